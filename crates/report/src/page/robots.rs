//! The robots of a recording whose configuration names none.

use slate_bag::ChannelTopic;
use slate_ros_messages::Followed;

/// Maximum number of followed robots by default: a picture of more is unreadable.
const MAX_ROBOTS: usize = 8;

/// Returns the robots whose poses are among the topics.
/// It prefers true poses, then poses by odometry, then any poses.
pub(super) fn followed_among(topics: &[ChannelTopic]) -> Vec<Followed> {
    let of = |types: &[&str], end: &str| {
        let fits =
            |topic: &&ChannelTopic| types.contains(&topic.schema.as_str()) && topic.topic.ends_with(end);
        topics.iter().filter(fits).map(|topic| topic.topic.clone()).collect::<Vec<_>>()
    };
    let planes = ["slate_msgs/msg/Pose2", "geometry_msgs/msg/Pose2D"];
    let odometry = ["slate_msgs/msg/Odometry", "nav_msgs/msg/Odometry"];
    let others = [
        "geometry_msgs/msg/Pose",
        "geometry_msgs/msg/PoseStamped",
        "geometry_msgs/msg/PoseWithCovariance",
        "geometry_msgs/msg/PoseWithCovarianceStamped",
    ];
    let mut poses = of(&planes, "/truth");
    for more in [of(&odometry, ""), of(&planes, ""), of(&others, "")] {
        if poses.is_empty() {
            poses = more;
        }
    }
    poses.sort();
    poses.truncate(MAX_ROBOTS);
    let owner = |topic: &str| topic.rsplit('/').nth(1).unwrap_or_default().to_owned();
    let follow = |pose: &String| {
        let name = owner(pose);
        let is_shared = name.is_empty() || poses.iter().filter(|other| owner(other) == name).count() > 1;
        let beside = |end: &str| {
            let own = |topic: &&ChannelTopic| topic.topic.ends_with(&format!("/{name}/{end}"));
            topics.iter().find(own).map(|topic| topic.topic.clone())
        };
        let status = |topic: &&ChannelTopic| {
            topic.schema == "slate_msgs/msg/ExecuteStatus" && topic.topic.split('/').any(|part| part == name)
        };
        Followed {
            status: topics.iter().find(status).filter(|_| !is_shared).map(|topic| topic.topic.clone()),
            clearance: beside("clearance").filter(|_| !is_shared),
            name: if is_shared { pose.clone() } else { name },
            pose: pose.clone(),
        }
    };
    poses.iter().map(follow).collect()
}
