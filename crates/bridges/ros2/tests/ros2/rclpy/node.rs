//! Publications of a node about itself, and frames from other nodes.
#![allow(clippy::disallowed_methods, reason = "ROS uses the system clock")]

use std::time::{Duration, Instant};

use serde_json::{Value as Json, json};

use crate::ros2::rclpy::agent::{Running, alone, eventually};
use crate::ros2::rclpy::peer::Peer;

#[test]
fn lines_of_the_log_are_heard_with_their_level_and_module() {
    alone("ros2::rclpy::node::lines_of_the_log_are_heard_with_their_level_and_module", |domain| {
        let text =
            format!("agent.name = \"house\"\n[modules.lamp]\n[ros2]\ndomain = {domain}\nclock = false\n");
        let agent = Running::of(&text);
        agent.composer.log(slate_module::Level::Error, "the lamp has burnt out");
        let mut peer = Peer::start("listener", domain);
        peer.subscribe("/rosout", "rcl_interfaces/msg/Log", json!({ "transient_local": true }));
        let mut heard: Vec<Json> = Vec::new();
        let mut line = |words: &str| {
            eventually(words, || {
                heard.extend(peer.take("/rosout"));
                heard.iter().any(|line| line["msg"].as_str().is_some_and(|text| text.contains(words)))
            });
            heard.iter().find(|line| line["msg"].as_str().is_some_and(|text| text.contains(words))).cloned()
        };
        // One from before the listener, and one from now.
        let early = line("the lamp has burnt out").unwrap();
        assert_eq!((&early["level"], &early["name"]), (&json!(40), &json!("house")));
        let now = std::time::SystemTime::now().duration_since(std::time::UNIX_EPOCH).unwrap().as_secs();
        let second = early["stamp"]["sec"].as_u64().unwrap();
        assert!(now.abs_diff(second) < 60, "{now} {second}");
        agent.composer.log(slate_module::Level::Warn, "a new lamp is needed");
        assert_eq!(line("a new lamp is needed").unwrap()["level"], 30);
    });
}

#[test]
fn nodes_go_by_the_time_of_the_agent() {
    alone("ros2::rclpy::node::nodes_go_by_the_time_of_the_agent", |domain| {
        let text =
            format!("agent.name = \"house\"\n[modules.lamp]\n[ros2]\ndomain = {domain}\nclock = true\n");
        let agent = Running::lockstep(&text);
        let mut peer = Peer::start("follower", domain);
        peer.request(json!({ "do": "follow_clock" }));
        let mut now = || peer.request(json!({ "do": "now" })).as_u64().unwrap();
        // Until it has heard of it, a node has no time.
        eventually("a time", || now() > 0);
        for _ in 0..5 {
            let before = agent.composer.now();
            std::thread::sleep(Duration::from_millis(200));
            let shown = now();
            let after = agent.composer.now();
            assert!(before <= shown && shown <= after, "{before} {shown} {after}");
        }
    });
}

#[test]
fn a_clock_needs_a_simulation() {
    let agent = Running::load_text("agent.name = \"house\"\n[modules.lamp]\n[ros2]\nclock = true\n");
    let settings = slate_ros2::RosSettings::of(&agent.configuration).unwrap().unwrap();
    let error = slate_ros2::check_topics(&agent.composer, &settings).unwrap_err();
    assert!(error.to_string().contains("the agent goes by the system's clock"), "{error}");
    assert!(error.help().contains("[time] source"), "{}", error.help());
}

#[test]
fn frames_come_from_two_static_writers_and_a_moving_one() {
    alone("ros2::rclpy::node::frames_come_from_two_static_writers_and_a_moving_one", |domain| {
        let text = format!(
            "agent.name = \"house\"\nloop.period = \"10ms\"\n[modules.laser]\nkind = \"external_frame\"\n[modules.camera]\nkind = \"external_frame\"\n\
             [modules.base]\nkind = \"external_frame\"\n[modules.mast]\n[ros2]\ndomain = {domain}\ntf = true\n\
             frames.\"laser/transform\" = \"laser\"\nframes.\"camera/transform\" = \"camera\"\n\
             frames.\"base/transform\" = \"base_link\"\n"
        );
        // Both static ones have said what they say once, before the agent is there.
        let (mut first, mut second) = (Peer::frames(domain), Peer::frames(domain));
        first.request(json!({ "do": "publish", "name": "/tf_static", "transforms": [["base_link", "laser", 0.25, 0.0]] }));
        second.request(json!({ "do": "publish", "name": "/tf_static", "transforms": [["base_link", "camera", 0.5, -0.125]] }));
        let agent = Running::of(&text);
        eventually("the laser", || agent.number("laser/frame/translation/x") == 0.25);
        eventually("the camera", || agent.number("camera/frame/translation/y") == -0.125);
        assert_eq!(agent.number("laser/frame/rotation/w"), 0.8);
        let read = |path: &str| agent.composer.board().read(path).unwrap().unwrap().0;
        assert_eq!(read("laser/frame/parent").as_str(), Some("base_link"));
        assert_eq!(read("laser/frame/fixed").as_bool(), Some(true));
        eventually("the base", || {
            first.request(
                json!({ "do": "publish", "name": "/tf", "transforms": [["odom", "base_link", 1.5, 2.0]] }),
            );
            agent.number("base/frame/translation/x") == 1.5
        });
        assert_eq!(read("base/frame/fixed").as_bool(), Some(false));
        // The stamp is the agent's time.
        let age = agent.composer.now() as f64 - agent.number("base/frame/time");
        assert!((0.0..5e9).contains(&age), "{age}");
        // A module's own fixed frame goes out, and those that came from ROS do not go back.
        second.request(json!({ "do": "subscribe", "name": "/tf_static" }));
        let mut heard = Vec::new();
        eventually("the mast", || {
            let taken = second.request(json!({ "do": "take", "name": "/tf_static" }));
            let messages = taken.as_array().unwrap().iter();
            heard.extend(messages.flat_map(|own| own["transforms"].as_array().unwrap().clone()));
            heard.iter().any(|own: &Json| own["child_frame_id"] == "mast")
        });
        std::thread::sleep(Duration::from_millis(300));
        let mast = heard.iter().find(|own| own["child_frame_id"] == "mast").unwrap();
        assert_eq!(mast["header"]["frame_id"], "base_link");
        assert_eq!(mast["transform"]["translation"]["z"], 1.25);
        let laser = heard.iter().filter(|own| own["child_frame_id"] == "laser").count();
        assert!(laser <= 1, "{heard:?}");
    });
}

#[test]
fn thirteen_participants_that_join_at_once_see_the_agent() {
    alone("ros2::rclpy::node::thirteen_participants_that_join_at_once_see_the_agent", |domain| {
        let table = format!(
            "domain = {domain}\nread.\"driver/command\" = \"/cmd_vel\"\nwrite.\"/odom\" = \"sensor/odometry\""
        );
        let host = Running::start("host", &table);
        let mut peer = Peer::start("members", domain);
        let mut assert_joined = |agent: &Running, name: &str, agents: u64| {
            let began = Instant::now();
            if agents == 1 {
                peer.request(json!({ "do": "join", "count": 13 }));
            }
            let seen = json!({ "do": "members_that_see", "name": name, "agents": agents });
            eventually("all members", || {
                agent.bridge().topics().iter().all(|topic| topic.others == Some(13))
                    && peer.request(seen.clone()) == 13
            });
            assert!(began.elapsed() < Duration::from_secs(15), "{:?}", began.elapsed());
        };
        assert_joined(&host, "host", 1);
        // One that comes when they are there, with a higher number than they have.
        let late = Running::start("late", &table);
        assert_joined(&late, "late", 2);
    });
}
