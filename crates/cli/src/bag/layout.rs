//! Layouts of panels in the format of Foxglove, which Lichtblick reads, too.

use serde_json::{Map, Value, json};
use slate::bag::ChannelInfo;

/// Messages that the panel *3D* draws.
const DRAWN: [&str; 6] = [
    "sensor_msgs/msg/LaserScan",
    "sensor_msgs/msg/PointCloud2",
    "nav_msgs/msg/OccupancyGrid",
    "nav_msgs/msg/Path",
    "nav_msgs/msg/Odometry",
    "geometry_msgs/msg/PoseStamped",
];

/// Numbers that are worth a curve, by the message that has them.
const PLOTTED: [(&str, &[&str]); 3] = [
    ("geometry_msgs/msg/Twist", &["linear.x", "angular.z"]),
    ("geometry_msgs/msg/TwistStamped", &["twist.linear.x", "twist.angular.z"]),
    ("nav_msgs/msg/Odometry", &["twist.twist.linear.x", "twist.twist.angular.z"]),
];

/// Returns the layout of a recording with messages of ROS 2.
/// It has the map from above, curves, the pictures of a camera if there is one, and the values of a topic.
pub fn of(channels: &[ChannelInfo]) -> String {
    let mut panels = Map::new();
    panels.insert("3D!map".into(), scene(channels));
    panels.insert("Plot!velocities".into(), plot(channels));
    let shown = channels.iter().find(|channel| is_drawn(channel)).or(channels.first());
    panels.insert("RawMessages!topic".into(), json!({"topicPath": shown.map(|channel| &channel.topic)}));
    let mut below = json!({
        "first": "Plot!velocities", "second": "RawMessages!topic", "direction": "row", "splitPercentage": 60,
    });
    let image = channels.iter().find(|channel| channel.schema == "sensor_msgs/msg/Image");
    if let Some(image) = image {
        panels.insert("Image!camera".into(), json!({"imageMode": {"imageTopic": image.topic}}));
        below = json!({"first": "Image!camera", "second": below, "direction": "row", "splitPercentage": 30});
    }
    let layout = json!({
        "configById": panels,
        "globalVariables": {},
        "userNodes": {},
        "playbackConfig": {"speed": 1},
        "layout": {"first": "3D!map", "second": below, "direction": "column", "splitPercentage": 65},
    });
    format!("{layout:#}\n")
}

fn is_drawn(channel: &ChannelInfo) -> bool {
    DRAWN.contains(&channel.schema.as_str())
}

/// Returns the panel *3D*.
/// It draws all that it can, from above, in the frame of the map.
fn scene(channels: &[ChannelInfo]) -> Value {
    let drawn = channels.iter().filter(|channel| is_drawn(channel));
    let topics: Map<_, _> = drawn.map(|channel| (channel.topic.clone(), json!({"visible": true}))).collect();
    json!({
        "followTf": "map",
        "followMode": "follow-none",
        "cameraState": {
            "perspective": false, "distance": 15, "phi": 0, "thetaOffset": 0, "fovy": 45, "near": 0.5, "far": 5000,
            "target": [0, 0, 0], "targetOffset": [0, 0, 0], "targetOrientation": [0, 0, 0, 1],
        },
        "layers": {
            "grid": {"layerId": "foxglove.Grid", "instanceId": "grid", "visible": true, "size": 20, "divisions": 20},
        },
        "scene": {},
        "transforms": {},
        "topics": topics,
    })
}

/// Returns the panel *Plot*: velocities over time.
fn plot(channels: &[ChannelInfo]) -> Value {
    let curves = |channel: &ChannelInfo| {
        let fields =
            PLOTTED.iter().filter(|(message, _)| *message == channel.schema).flat_map(|(_, fields)| *fields);
        let topic = channel.topic.clone();
        fields.map(move |field| format!("{topic}.{field}")).collect::<Vec<_>>()
    };
    let path = |value: String| json!({"value": value, "enabled": true, "timestampMethod": "receiveTime"});
    let paths: Vec<_> = channels.iter().flat_map(curves).map(path).collect();
    json!({
        "paths": paths, "xAxisVal": "timestamp", "isSynced": true, "showLegend": true, "legendDisplay": "floating",
        "showPlotValuesInLegend": false, "showXAxisLabels": true, "showYAxisLabels": true,
    })
}
