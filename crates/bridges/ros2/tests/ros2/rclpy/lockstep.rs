//! Cycles that wait for nodes.
#![allow(clippy::disallowed_methods, reason = "nodes go by the machine's clock")]

use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::{Duration, Instant};

use serde_json::json;
use slate_control::ControlSurface;
use slate_interfaces::{Odometry, Pose2, Twist2};
use slate_module::prelude::*;
use slate_record::Recorder;
use slate_ros2::{RosBridge, RosSettings};
use slate_runtime::configuration::Record;
use slate_runtime::log::MemoryTarget;
use slate_runtime::{Agent, Control, End, Options, Rate};

use crate::ros2::rclpy::agent::{TestBridge, alone, assert_repeated, database, lockstep, plugins};
use crate::ros2::rclpy::peer::Peer;

#[ports]
pub struct CartIo {
    command: Input<Twist2>,
    odometry: Output<Odometry>,
}

/// Integrates the commanded twist, and publishes its odometry in every other cycle.
pub struct Cart;

#[module(stage = Act)]
impl Module for Cart {
    type Io = CartIo;
    type Params = ();
    type State = (u64, f64, f64);

    fn tick(state: &mut (u64, f64, f64), io: &CartIo, _: &(), _: &Tick) -> Outcome {
        state.0 += 1;
        let command = io.command.get().copied().unwrap_or(Twist2::ZERO);
        state.1 += 0.02 * command.linear;
        state.2 += 0.001 * command.angular * state.1;
        if state.0 % 2 == 1 {
            let pose = Pose2 { x: state.1, y: state.2, theta: 0.0 };
            io.odometry.set(Odometry { pose, twist: command });
        }
        Outcome::Ok
    }
}

/// How a run with a cart ended.
struct Ended {
    end: End,
    digest: u64,
    cycles: u64,
    lasted: Duration,
    log: Vec<String>,
    recording: PathBuf,
}

/// Runs a cart as fast as it can, for so many cycles of 10 ms.
fn run(name: &str, ros2: &str, cycles: u64) -> Ended {
    let text = format!("agent.name = \"house\"\nloop.period = \"10ms\"\n[modules.cart]\n[ros2]\n{ros2}\n");
    let recording = Path::new(env!("CARGO_TARGET_TMPDIR")).join(format!("ros2-lockstep-{name}.mcap"));
    let recorder = Recorder::new(&Record { enabled: true, ..Record::default() });
    let log = MemoryTarget::default();
    let options = Options {
        recording: Some(Arc::new(recorder.clone())),
        rate: Rate::Max,
        log: vec![Box::new(log.clone())],
        ..lockstep()
    };
    let database = database(&text);
    let mut agent = Agent::load_with(&database, &plugins(), options).unwrap();
    let surface = Arc::new(ControlSurface::new(&agent).unwrap());
    let mut bridge = RosBridge::opened(&surface, &database.current());
    recorder.begin(&agent, &recording);
    bridge.started();
    let began = Instant::now();
    let observer = move |cycle: &slate_runtime::Cycle<'_>| {
        if cycle.number < cycles { Control::Continue } else { Control::Stop }
    };
    let end = agent.run(Box::new(observer)).unwrap();
    let lasted = began.elapsed();
    drop(bridge);
    let (digest, cycles) = (agent.digest().unwrap(), agent.composer().cycles());
    recorder.end(&mut agent).unwrap();
    let log = log.lines().iter().map(ToString::to_string).collect();
    Ended { end, digest, cycles, lasted, log, recording }
}

fn steered(domain: u16, rest: &str) -> String {
    format!(
        "domain = {domain}\nwrite.\"/odom\" = \"cart/odometry\"\n\
         read.\"cart/command\" = {{ topic = \"/cmd_vel\", wait_per = \"/odom\"{rest} }}"
    )
}

fn steer(domain: u16, more: &serde_json::Value) -> Peer {
    let mut peer = Peer::start("steerer", domain);
    let mut request = json!({ "do": "steer", "source": "/odom", "to": "/cmd_vel" });
    request.as_object_mut().unwrap().extend(more.as_object().unwrap().clone());
    peer.request(request);
    peer
}

#[test]
fn a_run_with_a_slow_node_is_that_with_a_fast_one() {
    alone("ros2::rclpy::lockstep::a_run_with_a_slow_node_is_that_with_a_fast_one", |domain| {
        let run = |name: &str, pause: f64| {
            let _peer = steer(domain, &json!({ "pause": pause }));
            let ended = run(name, &steered(domain, ""), 201);
            assert_eq!((&ended.end, ended.cycles), (&End::Stopped, 201), "{:?}", ended.log);
            ended
        };
        let (fast, slow) = (run("fast", 0.0), run("slow", 0.02));
        assert!(slow.lasted > Duration::from_millis(700), "{:?}", slow.lasted);
        assert_eq!(fast.digest, slow.digest);
        // A hundred answers, and as many values of odometry.
        assert_repeated(&fast.recording, &plugins(), 200);
        assert_repeated(&slow.recording, &plugins(), 200);
    });
}

#[test]
fn a_timer_of_a_node_is_waited_for_each_period() {
    alone("ros2::rclpy::lockstep::a_timer_of_a_node_is_waited_for_each_period", |domain| {
        let table = format!(
            "domain = {domain}\nclock = true\n\
             read.\"cart/command\" = {{ topic = \"/cmd_vel\", wait_per = \"50ms\" }}"
        );
        let run = |name: &str| {
            let mut peer = Peer::start("timer", domain);
            peer.request(json!({ "do": "pace", "to": "/cmd_vel", "period": 0.05 }));
            let ended = run(name, &table, 101);
            assert_eq!(ended.end, End::Stopped, "{:?}", ended.log);
            ended.digest
        };
        assert_eq!(run("timer-1"), run("timer-2"));
    });
}

#[test]
fn a_run_ends_without_the_node_that_it_waits_for() {
    alone("ros2::rclpy::lockstep::a_run_ends_without_the_node_that_it_waits_for", |domain| {
        let reason = |ended: Ended| match ended.end {
            End::Unanswered { reason } => reason,
            end => panic!("{end:?}"),
        };
        let ended = run("nobody", &steered(domain, ", timeout = \"300ms\""), 100);
        assert_eq!(ended.cycles, 1);
        let text = reason(ended);
        let expected = "ros2: /cart/command waited 300ms for a message of /cmd_vel for each of /odom after the cycle at 0 s: \
                        /cmd_vel has no publisher";
        assert!(text.starts_with(expected), "{text}");
        // One that answers ten times.
        let _peer = steer(domain, &json!({ "limit": 10 }));
        let ended = run("late", &steered(domain, ", timeout = \"3s\""), 100);
        assert_eq!(ended.cycles, 21);
        let text = reason(ended);
        assert!(
            text.contains("after the cycle at 0.2 s: its publisher is there and has not published one"),
            "{text}"
        );
    });
}

#[test]
fn a_run_may_go_on_without_the_node() {
    alone("ros2::rclpy::lockstep::a_run_may_go_on_without_the_node", |domain| {
        let table = steered(domain, ", timeout = \"300ms\", late = \"continue\"");
        let ended = run("alone", &table, 100);
        assert_eq!((&ended.end, ended.cycles), (&End::Stopped, 100));
        let lines = ended.log.iter().filter(|line| line.contains("/cmd_vel has no publisher")).count();
        assert_eq!(lines, 1, "{:?}", ended.log);
        // It waits for no node that is not there.
        assert!(ended.lasted < Duration::from_secs(3), "{:?}", ended.lasted);
    });
}

#[test]
fn messages_beyond_one_for_each_end_the_run() {
    alone("ros2::rclpy::lockstep::messages_beyond_one_for_each_end_the_run", |domain| {
        let mut peer = steer(domain, &json!({}));
        peer.advertise("/cmd_vel", "geometry_msgs/msg/Twist", json!({}));
        let thread = std::thread::spawn(move || {
            while peer.matched("/cmd_vel") == 0 {}
            peer.request(json!({ "do": "burst", "topic": "/cmd_vel", "count": 100, "period": 0.001 }));
            peer
        });
        let ended = run("many", &steered(domain, ", depth = 3"), 100_000);
        let End::Unanswered { reason } = ended.end else { panic!("{:?}", ended.end) };
        assert!(reason.contains("/cart/command takes one message of /cmd_vel for each of /odom"), "{reason}");
        thread.join().unwrap();
    });
}

#[test]
fn a_wait_needs_a_simulation() {
    let database = database(
        "agent.name = \"house\"\n[modules.cart]\n[ros2]\nwrite.\"/odom\" = \"cart/odometry\"\nread.\"cart/command\" = { topic = \"/cmd_vel\", wait_per = \"/odom\" }\n",
    );
    let agent = Agent::load_with(&database, &plugins(), Options::default()).unwrap();
    let settings = RosSettings::of(&database.current()).unwrap().unwrap();
    let error = slate_ros2::check_topics(&agent.composer(), &settings).unwrap_err();
    assert!(error.to_string().contains("the agent goes by the system's clock"), "{error}");
    assert!(error.report(&database.current()).to_string().contains("test.toml:5"), "{error}");
    assert!(error.help().contains("[time] source"), "{}", error.help());
}
