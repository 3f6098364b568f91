//! Reports of monitors and the RobotModel about failed sensors and wheels.

use slate::blackboard::interface::Value;
use slate::prelude::*;
use slate::runtime::Agent;

use super::trouble::SILENT_SONAR;
use super::{agent, finish};

#[test]
fn a_monitor_and_the_robot_model_tell_of_a_stopped_sensor() {
    let kind = format!("modules.trouble.params.kind={SILENT_SONAR}");
    let mut agent = agent(&[&kind, "agent.seed=1"]);
    let text = |agent: &Agent, path: &str| {
        agent.board().read(path).unwrap().and_then(|(value, _)| value.as_str().map(str::to_owned)).unwrap()
    };
    let sonar = |agent: &Agent| {
        let (sensors, _) = agent.board().read("r2/knowledge/robot/robot/sensors").unwrap().unwrap();
        let Value::List(sensors) = sensors else { panic!("a list of sensors") };
        let of = |sensor: &Value, field: &str| sensor.get(field).and_then(Value::as_str).map(str::to_owned);
        let sonar = sensors.iter().find(|sensor| of(sensor, "name").as_deref() == Some("sonar"));
        of(sonar.unwrap(), "health").unwrap()
    };
    let condition = |agent: &Agent| text(agent, "r2/range_monitor/state/condition");
    for (until, expected) in [
        (1.9, ("FRESH", "WORKING")),
        (2.5, ("LATE", "WORKING")),
        (3.5, ("SILENT", "DEGRADED")),
        (4.5, ("FRESH", "WORKING")),
    ] {
        while agent.now() < (until * 1e9) as u64 {
            agent.step();
        }
        assert_eq!((&*sonar(&agent), &*condition(&agent)), expected, "at {until} s");
    }
}

/// Wheels of the simulator that fail for a time.
pub struct FailingWheels;

#[ports]
pub struct FailingPorts {
    #[safe(WheelSpeeds::ZERO)]
    wheels: Output<WheelSpeeds>,
}

#[params]
pub struct FailingParams {
    #[param(default = false, doc = "panics instead")]
    panics: Bool,
}

impl Actuator for FailingWheels {
    const NAME: &'static str = "failing_wheels";
    type Io = FailingPorts;
    type Params = FailingParams;
    type State = ();
    type Command = WheelSpeeds;
    const SAFE: WheelSpeeds = WheelSpeeds::ZERO;

    fn apply(
        (): &mut (),
        command: &WheelSpeeds,
        io: &FailingPorts,
        params: &FailingParams,
        now: &Tick,
    ) -> Outcome {
        let fails = (2.0..3.0).contains(&now.seconds());
        assert!(!(fails && params.panics.get()), "as the test wants");
        io.wheels.set(*command);
        if fails { Outcome::Degraded } else { Outcome::Ok }
    }
}

/// Steps to a time in seconds; what the RobotModel says of the wheels then.
fn health_of_wheels(agent: &mut Agent, until: f64) -> String {
    while agent.now() < (until * 1e9) as u64 {
        agent.step();
    }
    let (actuators, _) = agent.board().read("r2/knowledge/robot/robot/actuators").unwrap().unwrap();
    let Value::List(actuators) = actuators else { panic!("a list of actuators") };
    let [wheels] = &actuators[..] else { panic!("{actuators:?}") };
    assert_eq!(wheels.get("name").and_then(Value::as_str), Some("wheels"));
    wheels.get("health").and_then(Value::as_str).unwrap().to_owned()
}

#[test]
fn the_robot_model_tells_of_wheels_that_fail() {
    for panics in [false, true] {
        let kind = "robots.r2.modules.motors.kind=failing_wheels";
        let fails = format!("robots.r2.modules.motors.params.panics={panics}");
        let mut agent = agent(&[kind, &fails, "agent.seed=1"]);
        // A block that panics again and again is given up.
        let last = if panics { "FAILED" } else { "READY" };
        for (until, expected) in [(1.9, "READY"), (2.5, "FAILED"), (3.5, last)] {
            assert_eq!(health_of_wheels(&mut agent, until), expected, "{panics}, at {until} s");
        }
    }
}

#[test]
fn the_robot_model_tells_of_a_gate_that_stops() {
    let mut agent = agent(&["agent.seed=1"]);
    assert_eq!(health_of_wheels(&mut agent, 1.0), "READY");
    agent.stop_actuators("the test");
    assert_eq!(health_of_wheels(&mut agent, 1.2), "STOPPED");
    agent.reset();
    assert_eq!(health_of_wheels(&mut agent, 1.4), "DISARMED");
    assert!(agent.arm());
    assert_eq!(health_of_wheels(&mut agent, 1.6), "READY");
    finish(&mut agent);
}

#[test]
fn wheels_without_a_command_are_safe() {
    let mut agent = agent(&["robots.r2.modules.execute.enabled=false"]);
    assert_eq!(health_of_wheels(&mut agent, 1.0), "SAFE");
}
