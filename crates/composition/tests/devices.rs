//! Sensors, Actuators and the RobotModel of a robot: what is linked without being written, and what is refused.
#![allow(dead_code, reason = "ports are looked at and never read")]

use slate_composition::{Catalogue, LinkedConfiguration, unlinked_warnings};
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

/// A driver that has not said that its input moves the robot.
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

/// Threshold of a sensor.
#[interface]
pub struct Threshold {
    /// Meters.
    pub distance: f64,
    /// Name of the sensor.
    pub sensor: Text<28>,
}

#[params]
pub struct Rules {
    #[param(default = Sequence::new(&[Threshold { distance: 0.1, sensor: Text::new("warm") }]), doc = "rules")]
    rules: Sequence<Threshold, 4>,
}

#[ports]
pub struct BothSensors {
    near: Sensed<Near>,
    warmth: Sensed<Warm>,
}

pub struct Knows;

impl Knowledge for Knows {
    const NAME: &'static str = "knows";
    type Models = BothSensors;
    type Params = Rules;
    type State = ();

    fn update((): &mut (), _: &BothSensors, _: &Rules, _: &Tick) {}
}

const ROBOT: &str = "[robots.r2.modules]\ndriver = {}\ngauge = {}\nmotor = {}\nnear_monitor = {}\n\
                     knowledge.kind = \"knows\"\ndodge = {}\nexecute = {}\n\
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
fn linked(more: &str, sets: &[&str]) -> Result<Vec<String>, String> {
    let options = Options { sets: sets.iter().map(|set| (*set).into()).collect(), ..Options::default() };
    let configuration = Configuration::from_text("robot.toml", &format!("{ROBOT}{more}"), &options).unwrap();
    let catalogue = catalogue();
    let linked = LinkedConfiguration::new(&configuration, &catalogue, &|_| false);
    match linked.check(&catalogue) {
        Ok(_) => Ok(links(linked.configuration())),
        Err(report) => Err(report.to_string()),
    }
}

#[test]
fn sensors_read_the_driver_blocks_sensors_and_motors_the_gate() {
    let expected = [
        "r2/dodge/near <- /r2/gauge/value inferred",
        "r2/driver/moves <- /r2/motor/moves",
        "r2/execute/reflexes <- /r2/dodge/reflex inferred",
        "r2/gauge/source <- /r2/driver/near inferred",
        "r2/knowledge/near <- /r2/gauge/value inferred",
        "r2/motor/command <- /r2/wheels/command inferred",
        "r2/motor/gate <- /r2/wheels/gate inferred",
        "r2/near_monitor/near <- /r2/gauge/value inferred",
    ];
    assert_eq!(linked("", &[]).unwrap(), expected);
}

#[test]
fn a_monitor_that_reads_a_driver_is_refused() {
    let refusal = linked("\"r2/near_monitor/near\" = \"r2/driver/near\"\n", &[]).unwrap_err();
    for words in ["a Monitor reads Sensors and Knowledge", "r2/near_monitor/near", "/r2/driver/near"] {
        assert!(refusal.contains(words), "{words}: {refusal}");
    }
}

#[test]
fn an_actuator_takes_nothing_past_the_gate() {
    let robot = "\"r2/motor/command\" = \"r2/execute/wheels\"\n";
    assert!(linked(robot, &[]).is_err());
}

#[test]
fn a_robot_model_without_a_wanted_sensor_is_refused() {
    let warm = "[robots.r2.modules.warm_monitor]\n";
    let refusal = linked(warm, &[]).unwrap_err();
    for words in
        ["`r2/warm_monitor` needs a sensor of Warm", "RobotModel of `r2` lists `near` (Near of `gauge`)"]
    {
        assert!(refusal.contains(words), "{words}: {refusal}");
    }
    assert!(linked(warm, &["links.\"r2/warm_monitor/warm\"=false"]).is_ok());
    let has = linked(&format!("{warm}[robots.r2.modules.thermometer]\n"), &[]);
    assert!(has.is_ok(), "{has:?}");
}

#[test]
fn a_second_sensor_is_one_error_with_both_places() {
    let refusal = linked("[robots.r2.modules.other]\nkind = \"gauge\"\n", &[]).unwrap_err();
    assert_eq!(refusal.lines().count(), 1, "{refusal}");
    // The second one is in line 14.
    for words in [
        "robot.toml:14:",
        "a port without a written link has exactly one possible source; `r2/dodge/near`, `r2/knowledge/near`, `r2/near_monitor/near`",
        "could read `r2/gauge/value` (robot.toml:3) or `r2/other/value` (robot.toml:14)",
        "\"/r2/dodge/near\" = \"/r2/gauge/value\", \"/r2/knowledge/near\" = \"/r2/gauge/value\"",
    ] {
        assert!(refusal.contains(words), "{words}: {refusal}");
    }
    let written = ["near_monitor", "knowledge", "dodge"]
        .map(|block| format!("links.\"r2/{block}/near\"=r2/gauge/value"));
    let written = written.each_ref().map(String::as_str);
    assert!(linked("[robots.r2.modules.other]\nkind = \"gauge\"\n", &written).is_ok());
}

#[test]
fn a_second_execute_or_knowledge_is_one_error_with_both_places() {
    for (kind, part, line) in [("execute", "execute", 8), ("knows", "knowledge", 6)] {
        let refusal = linked(&format!("[robots.r2.modules.second]\nkind = \"{kind}\"\n"), &[]).unwrap_err();
        assert_eq!(refusal.lines().count(), 1, "{refusal}");
        let words = format!(
            "robot.toml:14:20: a robot has one {part}, and `r2/{part}` (robot.toml:{line}) is it already"
        );
        assert!(refusal.contains(&words), "{refusal}");
    }
}

#[test]
fn a_reflex_reads_only_sensors_that_the_robot_model_lists() {
    // The Knowledge does not read it.
    let sets = ["links.\"r2/dodge/warm\"=r2/thermometer/value", "links.\"r2/knowledge/warmth\"=false"];
    let refusal = linked("[robots.r2.modules.thermometer]\n", &sets).unwrap_err();
    for words in
        ["`r2/dodge/warm` reads `/r2/thermometer/value`", "does not list", "`near` (Near of `gauge`)"]
    {
        assert!(refusal.contains(words), "{words}: {refusal}");
    }
}

#[test]
fn a_driver_whose_input_lacks_the_role_is_warned_of() {
    let configuration = Configuration::from_text("robot.toml", ROBOT, &Options::default()).unwrap();
    let catalogue = catalogue();
    let linked = LinkedConfiguration::new(&configuration, &catalogue, &|_| false);
    let survey = linked.check(&catalogue).unwrap();
    let found: Vec<_> = unlinked_warnings(linked.configuration(), &survey)
        .iter()
        .filter(|one| one.message().contains("actuation"))
        .map(|one| (one.line(), one.message().to_owned(), one.help_text().unwrap().to_owned()))
        .collect();
    let message = "`r2/driver/moves` is moved by `r2/motor` and lacks the role `actuation`: anything could be linked to it past the gate";
    let help = "write #[role(\"actuation\")] above `moves` in the ports of `driver`";
    assert_eq!(found, [(Some(2), message.to_owned(), help.to_owned())]);
}

#[test]
fn a_rule_for_a_sensor_that_is_not_there_is_refused_in_its_line() {
    let rules = |list: &str| format!("[robots.r2.modules.knowledge.params]\nrules = [\n{list}\n]\n");
    let near = "{ sensor = \"near\", distance = 0.2 },";
    assert!(linked(&rules(near), &[]).is_ok());
    // The first item of the list is in line 16.
    let refusal =
        linked(&rules(&format!("{near}\n{{ sensor = \"warmth\", distance = 1.0 }},")), &[]).unwrap_err();
    for words in [
        "robot.toml:17:",
        "`rules` of `r2/knowledge` has a rule for the sensor `warmth`",
        "the RobotModel of `r2` lists `near` (Near of `gauge`)",
        "add a Sensor of Warm to the robot, which `r2/knowledge/warmth` reads",
    ] {
        assert!(refusal.contains(words), "{words}: {refusal}");
    }
    let refusal = linked(&rules("{ sensor = \"gauge\", distance = 0.2 }"), &[]).unwrap_err();
    assert!(
        refusal.contains("robot.toml:16:") && refusal.contains("name a sensor of the RobotModel"),
        "{refusal}"
    );
    let both = rules(&format!("{near}\n{{ sensor = \"warmth\", distance = 1.0 }},"));
    assert!(linked(&format!("{both}[robots.r2.modules.thermometer]\n"), &[]).is_ok());
    // What was there goes away.
    let refusal = linked(&rules(near), &["links.\"r2/knowledge/near\"=false"]).unwrap_err();
    assert!(refusal.contains("a rule for the sensor `near`"), "{refusal}");
}

#[test]
fn a_robot_without_modules_is_warned_of_in_its_line() {
    for table in ["[robots.r3]\n", "[robots.r3.modules]\n", "[robots]\nr3 = {}\n"] {
        let text = format!("[modules.driver]\n{table}");
        let configuration = Configuration::from_text("robot.toml", &text, &Options::default()).unwrap();
        let catalogue = catalogue();
        let linked = LinkedConfiguration::new(&configuration, &catalogue, &|_| false);
        let survey = linked.check(&catalogue).unwrap();
        let found: Vec<_> = unlinked_warnings(linked.configuration(), &survey)
            .iter()
            .map(|one| (one.line(), one.message().to_owned(), one.help_text().unwrap().to_owned()))
            .collect();
        let line = 2 + usize::from(table.starts_with("[robots]"));
        let help = "add its blocks in [robots.r3.modules], or remove [robots.r3]";
        assert_eq!(found, [(Some(line), "robot `r3` has no modules".to_owned(), help.to_owned())], "{table}");
    }
}
