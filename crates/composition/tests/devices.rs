//! Sensors, Actuators and the RobotModel of a robot: what is linked without being written, and what is refused.
#![allow(dead_code, reason = "ports are looked at and never read")]

use slate_composition::{Catalogue, Wired};
use slate_configuration::{Configuration, Options};
use slate_interfaces::Twist2;
use slate_mapek::prelude::*;
use slate_mapek::{actuator, driver_actuator, driver_sensors, execute, knowledge, monitor, reactive, sensor};
use slate_module::prelude::*;
use slate_module::{ModuleKind, Plugin};

use crate::robot::{Actions, Near, links};

/// Another measurement.
#[interface]
pub struct Warm {
    /// Degrees.
    pub celsius: f64,
}

driver_sensors! {
    Gauge("gauge", "Measures distances."): Near,
    Thermometer("thermometer", "Measures temperatures."): Warm,
}
driver_actuator!(Motor("motor", "Moves."), MotorPorts { moves: Twist2 });

#[ports]
pub struct DriverIo {
    near: Output<Near>,
    warm: Output<Warm>,
    moves: Input<Twist2>,
}

pub struct Driver;

#[module(stage = SensorAcquire)]
impl Module for Driver {
    type Io = DriverIo;
    type Params = ();
    type State = ();

    fn tick((): &mut (), _: &DriverIo, (): &(), _: &Tick) -> Outcome {
        Outcome::Ok
    }
}

#[ports]
pub struct NearSensor {
    near: Sensed<Near>,
}

#[ports]
pub struct WarmSensor {
    warm: Sensed<Warm>,
}

macro_rules! monitors {
    ($($name:ident: $kind:literal, $ports:ty, $value:ty),+) => {$(
        pub struct $name;

        impl Monitor for $name {
            const NAME: &'static str = $kind;
            type Sensors = $ports;
            type Params = ();
            type State = ();
            type Value = $value;

            fn interpret((): &mut (), _: &$ports, (): &(), _: &Tick) -> Option<$value> {
                None
            }
        }
    )+};
}
monitors!(NearMonitor: "near_monitor", NearSensor, Near, WarmMonitor: "warm_monitor", WarmSensor, Warm);

#[ports]
pub struct AnySensor {
    near: Input<Near>,
    warm: Input<Warm>,
}

pub struct Dodge;

impl ReactiveModel for Dodge {
    const NAME: &'static str = "dodge";
    type Sensors = AnySensor;
    type Params = ();
    type State = ();

    fn run((): &mut (), _: &AnySensor, (): &(), _: &Tick) -> Option<ActionRequest> {
        None
    }
}

pub struct Knows;

impl Knowledge for Knows {
    const NAME: &'static str = "knows";
    type Models = NearSensor;
    type Params = ();
    type State = ();

    fn update((): &mut (), _: &NearSensor, (): &(), _: &Tick) {}
}

const ROBOT: &str = "[robots.r2.modules]\ndriver = {}\ngauge = {}\nmotor = {}\nnear_monitor = {}\n\
                     knowledge = { kind = \"knows\" }\ndodge = {}\nexecute = {}\n\
                     [robots.r2.actuators]\nwheels = { command = \"execute/wheels\" }\n\
                     [links]\n\"r2/driver/moves\" = \"r2/motor/moves\"\n\"r2/dodge/warm\" = false\n";

fn catalogue() -> Catalogue {
    let kinds = [
        ModuleKind::linked::<Driver>(),
        sensor::<Gauge>(),
        sensor::<Thermometer>(),
        actuator::<Motor>(),
        monitor::<NearMonitor>(),
        monitor::<WarmMonitor>(),
        knowledge::<Knows>(),
        reactive::<Dodge>(),
        execute::<Actions>(),
    ];
    let mut catalogue = Catalogue::default();
    kinds.into_iter().map(Plugin::from).for_each(|plugin| catalogue.add(plugin));
    catalogue
}

/// The links of the robot with more settings, or what is wrong with it.
fn wired(more: &str, sets: &[&str]) -> Result<Vec<String>, String> {
    let options = Options { sets: sets.iter().map(|set| (*set).into()).collect(), ..Options::default() };
    let configuration = Configuration::from_text("robot.toml", &format!("{ROBOT}{more}"), &options).unwrap();
    let catalogue = catalogue();
    let wired = Wired::new(&configuration, &catalogue, &|_| false);
    match wired.check(&catalogue) {
        Ok(_) => Ok(links(wired.configuration())),
        Err(report) => Err(report.to_string()),
    }
}

#[test]
fn sensors_read_the_driver_blocks_the_sensors_and_motors_the_gate() {
    let expected = [
        "r2/dodge/near <- /r2/gauge/value inferred",
        "r2/driver/moves <- /r2/motor/moves",
        "r2/execute/reflexes <- /r2/dodge/reflex inferred",
        "r2/gauge/source <- /r2/driver/near inferred",
        "r2/knowledge/near <- /r2/gauge/value inferred",
        "r2/motor/command <- /r2/wheels/command inferred",
        "r2/near_monitor/near <- /r2/gauge/value inferred",
    ];
    assert_eq!(wired("", &[]).unwrap(), expected);
}

#[test]
fn a_monitor_that_reads_a_driver_is_refused() {
    let refusal = wired("\"r2/near_monitor/near\" = \"r2/driver/near\"\n", &[]).unwrap_err();
    for words in ["a Monitor reads Sensors and Knowledge", "r2/near_monitor/near", "/r2/driver/near"] {
        assert!(refusal.contains(words), "{words}: {refusal}");
    }
}

#[test]
fn an_actuator_takes_nothing_past_the_gate() {
    let robot = "\"r2/motor/command\" = \"r2/execute/wheels\"\n";
    assert!(wired(robot, &[]).is_err());
}

#[test]
fn a_robot_model_without_a_wanted_sensor_is_refused() {
    let warm = "[robots.r2.modules.warm_monitor]\n";
    let refusal = wired(warm, &[]).unwrap_err();
    for words in ["`r2/warm_monitor` wants a sensor of Warm", "RobotModel of `r2` lists `gauge` (Near)"] {
        assert!(refusal.contains(words), "{words}: {refusal}");
    }
    assert!(wired(warm, &["links.\"r2/warm_monitor/warm\"=false"]).is_ok());
    let has = wired(&format!("{warm}[robots.r2.modules.thermometer]\n"), &[]);
    assert!(has.is_ok(), "{has:?}");
}

#[test]
fn a_reflex_reads_only_sensors_that_the_robot_model_lists() {
    // The Knowledge has no input for temperatures.
    let sets = ["links.\"r2/dodge/warm\"=r2/thermometer/value"];
    let refusal = wired("[robots.r2.modules.thermometer]\n", &sets).unwrap_err();
    for words in ["`r2/dodge/warm` reads `/r2/thermometer/value`", "does not list", "`gauge` (Near)"] {
        assert!(refusal.contains(words), "{words}: {refusal}");
    }
}
