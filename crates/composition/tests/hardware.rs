//! The RobotModel of a robot must be that of its devices, and have what its blocks want.
#![allow(dead_code, reason = "ports are looked at and never read")]

use slate_composition::{Catalogue, LinkedConfiguration, check, described_limits, unlinked_warnings};
use slate_configuration::{Configuration, ErrorCode, Options};
use slate_interfaces::{DriverStatus, Twist2, WheelSpeeds};
use slate_mapek::prelude::*;
use slate_mapek::{ActuatorStatus, actuator, execute, knowledge, monitor, sensor};
use slate_module::prelude::*;
use slate_module::{Hardware, HardwareDevice, HardwareDrive, ModuleKind, Plugin};

use crate::devices::{Gauge, Motor, NearMonitor, Thermometer, Warm, WarmMonitor};
use crate::robot::{Actions, Near, links};

/// Hardware of a robot: `wide`, which has a thermometer, or `narrow`.
fn hardware(robot: &str, setting: &str) -> Result<Vec<Hardware>, Refusal> {
    let (track, count, x, thermometer) = match robot {
        "wide" => (0.8, 16, 0.0, true),
        "calibrated" => (0.81, 16, 0.0, true),
        "sparse" => (0.8, 3, 0.0, true),
        "shifted" => (0.8, 16, 0.2, true),
        "cold" => (0.8, 16, 0.0, false),
        "narrow" => (0.3, 16, 0.0, true),
        "walking" => (0.8, 16, 0.0, true),
        _ => return Err(Refusal(format!("params.robot: no robot `{robot}`; expected wide or narrow"))),
    };
    let near = HardwareDevice { count, mount: [x, 0.0, 0.0], ..HardwareDevice::new("near", "Near") };
    let warm = thermometer.then(|| HardwareDevice::new("warmth", "Warm"));
    let moves = if robot == "walking" { "Steps" } else { "Twist2" };
    Ok(vec![Hardware {
        robot: robot.into(),
        setting: setting.into(),
        drive: Some(HardwareDrive { wheel_radius: 0.1, track }),
        sensors: [near].into_iter().chain(warm).collect(),
        actuators: vec![HardwareDevice { limits: Some([-2.0, 2.0]), ..HardwareDevice::new("wheels", moves) }],
        ..Hardware::default()
    }])
}

#[params]
pub struct Described {
    #[param(default = "", follows = ["world.robots.{robot}.model", "world.model"], doc = "robot")]
    robot: Text<28>,
}

#[ports]
pub struct BothSensors {
    near: Sensed<Near>,
    warmth: Sensed<Warm>,
    #[role("actuator_status")]
    wheels: Input<ActuatorStatus>,
    #[role("actuator_status")]
    gripper: Input<ActuatorStatus>,
}

/// A user's own Knowledge.
pub struct Knows;

impl Knowledge for Knows {
    const NAME: &'static str = "knows";
    type Models = BothSensors;
    type Params = Described;
    type State = ();
    const DESCRIBES_HARDWARE: bool = true;

    fn hardware(_: &Setup<'_>, params: &Described) -> Result<Vec<Hardware>, Refusal> {
        hardware(params.robot.as_str(), "params.robot")
    }

    fn update((): &mut (), _: &BothSensors, _: &Described, _: &Tick) {}
}

#[ports]
pub struct DriverIo {
    near: Output<Near>,
    warm: Output<Warm>,
    #[role("actuation")]
    moves: Input<Twist2>,
    #[role("driver_status")]
    drive: Output<DriverStatus>,
}

#[params]
pub struct DriverParams {
    #[param(default = "wide", doc = "robot")]
    model: Text<28>,
}

/// A driver that knows its robot.
pub struct Driver;

#[module(stage = SensorAcquire)]
impl Module for Driver {
    type Io = DriverIo;
    type Params = DriverParams;
    type State = ();
    const DESCRIBES_HARDWARE: bool = true;

    fn hardware(_: &Setup<'_>, params: &DriverParams) -> Result<Vec<Hardware>, Refusal> {
        hardware(params.model.as_str(), "params.model")
    }

    fn tick((): &mut (), _: &DriverIo, _: &DriverParams, _: &Tick) -> Outcome {
        Outcome::Ok
    }
}

const ROBOT: &str = "[modules.driver]\n[robots.r2.modules]\ngauge = {}\nthermometer = {}\nmotor = {}\n\
                     near_monitor = {}\nexecute = {}\n\
                     [robots.r2.actuators]\nwheels = { command = \"execute/wheels\" }\n\
                     [links]\n\"driver/moves\" = \"r2/motor/moves\"\n\"r2/gauge/source\" = \"driver/near\"\n\
                     \"r2/thermometer/source\" = \"driver/warm\"\n";

fn catalogue() -> Catalogue {
    let kinds = [
        ModuleKind::linked::<Driver>(),
        sensor::<Gauge>(),
        sensor::<Thermometer>(),
        actuator::<Motor>(),
        monitor::<NearMonitor>(),
        monitor::<WarmMonitor>(),
        knowledge::<Knows>(),
        execute::<Actions>(),
    ];
    let mut catalogue = Catalogue::default();
    kinds.into_iter().map(Plugin::from).for_each(|plugin| catalogue.add(plugin));
    catalogue
}

/// What is wrong: line, kind and words of each.
fn checked(more: &str) -> Vec<(Option<usize>, Option<ErrorCode>, String)> {
    let options = Options { extra_tables: vec!["world".into()], ..Options::default() };
    let configuration = Configuration::from_text("robot.toml", &format!("{ROBOT}{more}"), &options).unwrap();
    let catalogue = catalogue();
    let linked = LinkedConfiguration::new(&configuration, &catalogue, &|_| false);
    let report = linked.check(&catalogue).err();
    let found = report.iter().flat_map(|report| report.diagnostics());
    found.map(|one| (one.line(), one.error_code(), one.to_string())).collect()
}

/// The line of the robot's Knowledge.
const KNOWLEDGE: usize = 14;

fn knows(robot: &str) -> String {
    format!("[robots.r2.modules.knowledge]\nkind = \"knows\"\nparams.robot = \"{robot}\"\n")
}

/// The only error, which is of the RobotModel, in the line that names the robot.
#[track_caller]
fn refused(robot: &str, more: &str, words: &[&str]) {
    let found = checked(&format!("{}{more}", knows(robot)));
    let [(line, error_code, message)] = &found[..] else { panic!("{found:?}") };
    assert_eq!((*line, *error_code), (Some(KNOWLEDGE + 2), Some(ErrorCode::Hardware)), "{message}");
    for words in words {
        assert!(message.contains(words), "{words}: {message}");
    }
}

#[test]
fn a_robot_model_of_the_devices_is_accepted() {
    for robot in ["wide", "calibrated"] {
        assert_eq!(checked(&knows(robot)), [], "{robot}");
    }
}

#[test]
fn a_robot_model_of_another_robot_is_refused_in_its_line() {
    let both = ["the RobotModel of `r2` is that of a `narrow`", "`driver` has a `wide` there (robot.toml:1)"];
    refused("narrow", "", &[both[0], both[1], "a track of 0.8 m, not 0.3 m"]);
    // The driver's own setting is named where there is one.
    let driver = "[modules.driver.params]\nmodel = \"narrow\"\n";
    refused("wide", driver, &["a track of 0.3 m, not 0.8 m", "(robot.toml:18)"]);
    refused("sparse", "", &["`near` with 16 elements, not 3"]);
    refused("shifted", "", &["`near` mounted at 0.000 m, 0.000 m, not 0.200 m, 0.000 m"]);
    refused("walking", "", &["`wheels` for Twist2, not Steps"]);
}

#[test]
fn a_robot_model_that_lacks_what_a_monitor_wants_is_refused() {
    let monitor = "[robots.r2.modules.warm_monitor]\n";
    let words =
        "Monitor `r2/warm_monitor` needs a sensor of Warm for `warm`, and the RobotModel of `r2`, a `cold`";
    refused("cold", monitor, &[words, "has `near` (Near)"]);
    // Nothing of the robot wants it.
    assert_eq!(checked(&knows("cold")), []);
    let off = format!("{}[robots.r2.modules.warm_monitor]\nenabled = false\n", knows("cold"));
    assert_eq!(checked(&off), []);
}

#[test]
fn a_robot_model_without_the_commanded_actuator_is_refused() {
    // The devices tell nothing of themselves.
    let unknown = ROBOT.replace("\"driver/moves\" = \"r2/motor/moves\"\n", "");
    let configuration = format!(
        "{}{}",
        unknown
            .replace("\"r2/gauge/source\" = \"driver/near\"\n", "\"r2/gauge/source\" = false\n")
            .replace("\"r2/thermometer/source\" = \"driver/warm\"\n", "\"r2/thermometer/source\" = false\n"),
        knows("walking")
    );
    let configuration = Configuration::from_text("robot.toml", &configuration, &Options::default()).unwrap();
    let catalogue = catalogue();
    let linked = LinkedConfiguration::new(&configuration, &catalogue, &|_| false);
    let refusal = linked.check(&catalogue).err().unwrap().to_string();
    let words = "`/r2/execute/wheels` commands `r2/wheels` by Twist2, and the RobotModel of `r2`, a `walking`, \
                 has `wheels` for Steps";
    assert!(refusal.contains(words), "{refusal}");
}

#[test]
fn a_robot_that_is_not_named_or_not_known_is_refused() {
    let found = checked(&knows("tall"));
    assert!(found.len() == 1 && found[0].2.contains("no robot `tall`"), "{found:?}");
    assert_eq!(found[0].0, Some(KNOWLEDGE + 2));
    let found = checked("[robots.r2.modules.knowledge]\nkind = \"knows\"\n");
    assert!(found.len() == 1 && found[0].2.contains("r2/knowledge: params.robot: no robot ``"), "{found:?}");
    assert_eq!(found[0].0, Some(KNOWLEDGE));
}

#[test]
fn a_parameter_follows_the_first_of_its_settings() {
    let unnamed = "[robots.r2.modules.knowledge]\nkind = \"knows\"\n";
    assert_eq!(checked(&format!("{unnamed}[world]\nmodel = \"wide\"\n")), []);
    let own = format!("{unnamed}[world]\nmodel = \"narrow\"\nrobots.r2.model = \"wide\"\n");
    assert_eq!(checked(&own), []);
    let empty = format!("{unnamed}[world]\nmodel = \"wide\"\nrobots.r2.model = \"\"\n");
    assert_eq!(checked(&empty), []);
    // What the configuration says itself goes before.
    let found = checked(&format!("{}[world]\nmodel = \"wide\"\n", knows("narrow")));
    assert_eq!(found.len(), 1, "{found:?}");
    let found = checked(&format!("{unnamed}[world]\nmodel = 3\n"));
    assert!(found.len() == 1 && found[0].0 == Some(KNOWLEDGE + 3), "{found:?}");
}

/// The links with those words, of a robot with the blocks and links of `more`.
fn linked(more: &str, words: &str) -> Vec<String> {
    let text = format!("{ROBOT}{more}{}", knows("wide"));
    let configuration = Configuration::from_text("robot.toml", &text, &Options::default()).unwrap();
    let catalogue = catalogue();
    let linked = LinkedConfiguration::new(&configuration, &catalogue, &|_| false);
    linked.check(&catalogue).unwrap();
    links(linked.configuration()).into_iter().filter(|link| link.contains(words)).collect()
}

#[test]
fn an_actuator_reads_gate_and_driver_and_knowledge_its_status() {
    assert_eq!(linked("", "gate"), ["r2/motor/gate <- /r2/wheels/gate inferred"]);
    assert_eq!(linked("", "drive "), ["r2/motor/driver <- /driver/drive inferred"]);
    let status = ["r2/knowledge/wheels <- /r2/motor/status inferred"];
    assert_eq!(linked("", "status"), status);
    // A written link to the command says which gate it is.
    assert_eq!(linked("\"r2/motor/command\" = false\n", "gate"), [""; 0]);
    assert_eq!(linked("\"r2/motor/command\" = \"r2/wheels/command\"\n", "gate").len(), 1);
    assert_eq!(linked("\"r2/motor/driver\" = false\n", "driver <-"), [""; 0]);
}

#[test]
fn only_knowledge_and_monitors_read_how_a_gate_stands() {
    let wrong = |link: &str| {
        let found = checked(&format!("{link}{}", knows("wide")));
        found.into_iter().map(|(_, _, message)| message).collect::<Vec<_>>().join("; ")
    };
    let refusal = wrong("\"r2/motor/gate\" = \"driver/drive\"\n");
    assert!(!refusal.is_empty(), "a driver is not a gate");
    let refusal = wrong("\"r2/motor/driver\" = \"r2/wheels/gate\"\n");
    assert!(!refusal.is_empty(), "a gate is no driver");
}

/// The limits of the gate that are not written, and warnings of those that are.
fn limits(gate: &str, knowledge: &str) -> (Vec<(String, f64, f64)>, Vec<String>) {
    let text = format!("{}{knowledge}", ROBOT.replace("command = \"execute/wheels\"", gate));
    let configuration = Configuration::from_text("robot.toml", &text, &Options::default()).unwrap();
    let catalogue = catalogue();
    let linked = LinkedConfiguration::new(&configuration, &catalogue, &|_| false);
    let survey = linked.check(&catalogue).unwrap();
    let described = described_limits(&survey, &linked.configuration().actuators()[0]);
    let described = described.into_iter().flat_map(|described| described.limits);
    let described = described.map(|limit| (limit.field.value, limit.low, limit.high)).collect();
    let warnings = unlinked_warnings(linked.configuration(), &survey).into_iter().map(|one| one.to_string());
    (described, warnings.filter(|warning| warning.contains("wider")).collect())
}

#[ports]
pub struct PairIo {
    wheels: Command<WheelSpeeds>,
}

/// Commands two wheels.
pub struct Pair;

#[module(stage = Act)]
impl Module for Pair {
    type Io = PairIo;
    type Params = ();
    type State = ();

    fn tick((): &mut (), _: &PairIo, (): &(), _: &Tick) -> Outcome {
        Outcome::Ok
    }
}

#[test]
fn numbers_without_limits_beside_limited_ones_are_warned_of() {
    let warnings = |limits: &str| {
        let text = format!("[modules.pair]\n[actuators.wheels]\ncommand = \"pair/wheels\"\n{limits}");
        let configuration = Configuration::from_text("robot.toml", &text, &Options::default()).unwrap();
        let mut catalogue = Catalogue::default();
        catalogue.add(Plugin::linked::<Pair>());
        let survey = check(&configuration, &catalogue).unwrap();
        let warnings = unlinked_warnings(&configuration, &survey).into_iter().map(|one| one.to_string());
        warnings.filter(|warning| warning.contains("no limit")).collect::<Vec<_>>()
    };
    let found = warnings("limits = { right = [-1.0, 1.0] }");
    assert!(found.len() == 1 && found[0].contains("`left` of the gate `wheels` has no limit"), "{found:?}");
    assert_eq!(warnings("limits = { right = [-1.0, 1.0], left = [-1.0, 1.0] }"), [""; 0]);
    assert_eq!(warnings(""), [""; 0]);
}

#[test]
fn a_gate_without_limits_has_those_of_the_robot_model() {
    let command = "command = \"execute/wheels\"";
    let linear = ("linear".to_owned(), -2.0, 2.0);
    assert_eq!(limits(command, &knows("wide")), (vec![linear], vec![]), "2 m/s is no limit of rad/s");
    let narrow = format!("{command}, limits = {{ linear = [-1.0, 1.0] }}");
    assert_eq!(limits(&narrow, &knows("wide")), (vec![], vec![]));
    assert_eq!(limits(command, ""), (vec![], vec![]), "a robot without a RobotModel");
    let (described, warnings) =
        limits(&format!("{command}, limits = {{ linear = [-3.0, 2.0] }}"), &knows("wide"));
    assert_eq!(described, []);
    let words = "the limits of `linear` at the gate `r2/wheels`, -3 to 2, are wider than those of the RobotModel, a `wide`: -2 to 2";
    assert!(warnings.len() == 1 && warnings[0].contains(words), "{warnings:?}");
}
