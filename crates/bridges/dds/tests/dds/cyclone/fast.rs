//! Topics both ways with Fast DDS, below ROS 2.

use serde_json::json;

use crate::dds::agent::{eventually, start};
use crate::dds::cyclone::peer::{Peer, alone};

const TWIST: &str = "geometry_msgs/msg/Twist";

#[test]
fn topics_of_ros_2_go_both_ways_by_their_plain_names() {
    alone("dds::cyclone::fast::topics_of_ros_2_go_both_ways_by_their_plain_names", |domain| {
        let agent = start(&format!(
            "domain = {domain}\nread.\"planner/command\" = \"rt/cmd_vel\"\n\
             write.\"rt/wheels\" = {{ from = \"planner/wheels\", transient_local = true }}"
        ));
        let mut peer = Peer::fast(domain);
        peer.advertise("/cmd_vel", TWIST, json!({}));
        peer.subscribe("/wheels", TWIST, json!({ "transient_local": true }));
        eventually("the command", || {
            peer.publish("/cmd_vel", &json!({ "linear": { "x": 0.5 }, "angular": { "z": -0.25 } }));
            agent.number("planner/command/linear") == 0.5
        });
        eventually("the wheels", || {
            peer.take("/wheels").iter().any(|own| own["linear"]["x"] == 0.5 && own["angular"]["z"] == -0.25)
        });
    });
}

#[test]
fn structs_of_idl_go_both_ways_with_fast_dds() {
    alone("dds::cyclone::fast::structs_of_idl_go_both_ways_with_fast_dds", |domain| {
        let of = "type = \"geometry_msgs::msg::dds_::Point_\", idl = \"tests/dds/ros_point.idl\"";
        let agent = start(&format!(
            "domain = {domain}\nread.\"planner/point\" = {{ topic = \"rt/point\", {of} }}\n\
             write.\"rt/pointed\" = {{ from = \"planner/point\", {of} }}"
        ));
        let mut peer = Peer::fast(domain);
        peer.advertise("/point", "geometry_msgs/msg/Point", json!({}));
        peer.subscribe("/pointed", "geometry_msgs/msg/Point", json!({}));
        let point = json!({ "x": 1.5, "y": -2.0, "z": 7.0 });
        eventually("the point", || {
            peer.publish("/point", &point);
            agent.number("planner/point/x") == 1.5 && agent.number("planner/point/y") == -2.0
        });
        eventually("the point again", || {
            peer.publish("/point", &point);
            // The interface has no height.
            peer.take("/pointed").contains(&json!({ "x": 1.5, "y": -2.0, "z": 0.0 }))
        });
    });
}
