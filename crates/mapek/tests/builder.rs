//! A robot as a program: the configuration that it prints, and what is refused.
#![allow(
    dead_code,
    clippy::unwrap_used,
    clippy::panic,
    reason = "a test that fails panics; ports are only described"
)]

use crate::common;

use slate_interfaces::Twist2;
use slate_mapek::prelude::*;
use slate_mapek::{Rank, RobotErrors, RobotProblem};
use slate_module::prelude::*;

use common::{Actions, AvoidNear, NearMonitor, Wanderer, WayIsFree};

/// A speed that users tune.
#[params]
pub struct CruiserParams {
    #[param(default = 0.5, range = 0.0..=2.0, unit = "m/s", doc = "speed")]
    speed: f64,
    #[param(default = "r1", doc = "robot that it follows")]
    leader: Text<16>,
}

/// A module beside the blocks.
pub struct Cruiser;

#[ports]
pub struct CruiserIo {
    pub goal: Input<Twist2>,
    #[safe(Twist2::ZERO)]
    pub wheels: Command<Twist2>,
}

#[module(stage = Act)]
impl Module for Cruiser {
    type Io = CruiserIo;
    type Params = CruiserParams;
    type State = ();

    fn tick(_: &mut (), _: &CruiserIo, _: &CruiserParams, _: &Tick) -> Outcome {
        Outcome::Ok
    }
}

/// The errors as text, without the place of this file.
fn errors<B>(robot: &Robot<B>) -> Vec<String> {
    let RobotErrors(errors) = robot.to_toml().unwrap_err();
    errors.iter().map(|error| error.problem.to_string()).collect()
}

fn gate() -> Gate {
    Gate::new(Twist2::ZERO).limit("linear", -0.5..=0.5).time_to_live("100ms")
}

fn robot() -> Robot<slate_mapek::ReactiveBlock<AvoidNear>> {
    Robot::new("r2")
        .monitor::<NearMonitor>("near_monitor")
        .link("range", "/simulator/r2/sonar")
        .attach::<WayIsFree>("way")
        .analyze::<WayIsFree>("way")
        .attach::<Wanderer>("planner")
        .plan::<Wanderer>("planner")
        .execute::<Actions>("execute")
        .gate("wheels", gate())
        .reactive::<AvoidNear>("avoid")
        .link("range", "/simulator/r2/sonar")
        .input("rank", Rank { rank: 5 })
        .disabled()
}

#[test]
fn a_robot_prints_what_a_person_would_write() {
    let expected = r#"[robots.r2.modules]
near_monitor = {}
way = { kind = "way_is_free" }
planner = { kind = "wanderer" }
execute = {}
avoid = { kind = "avoid_near", inputs = { rank = { rank = 5 } }, enabled = false }

[robots.r2.links]
"near_monitor/range" = "/simulator/r2/sonar"
"avoid/range" = "/simulator/r2/sonar"

[robots.r2.actuators.wheels]
command = "execute/wheels"
limits = { linear = [-0.5, 0.5] }
time_to_live = "100ms"
safe = { linear = 0.0, angular = 0.0 }
"#;
    assert_eq!(robot().to_toml().unwrap(), expected);
}

#[test]
fn attachments_that_types_leave_open_are_printed() {
    let robot = Robot::new("r2")
        .monitor::<NearMonitor>("left")
        .monitor::<NearMonitor>("right")
        .attach::<WayIsFree>("way")
        .analyze::<WayIsFree>("way");
    let text = robot.to_toml().unwrap();
    assert!(text.contains("\"way/near\" = \"right/percept\""), "{text}");
}

#[test]
fn parameters_with_their_default_are_not_printed() {
    let cruiser = |set: fn(&mut CruiserParams)| {
        let robot = Robot::new("r2").module::<Cruiser>("cruiser").params(set);
        robot.to_toml().unwrap().lines().nth(1).unwrap().to_owned()
    };
    assert_eq!(cruiser(|_| {}), "cruiser = {}");
    assert_eq!(cruiser(|params| params.speed = 1.0), "cruiser = { params = { speed = 1.0 } }");
    let both = cruiser(|params| (params.speed, params.leader) = (0.5, "r3".into()));
    assert_eq!(both, "cruiser = { params = { leader = \"r3\" } }");
}

#[test]
fn several_robots_stand_behind_their_world() {
    let world = "[agent]\nname = \"demo\"\n\n# --- robots ---\n";
    let r3 = Robot::new("r3").monitor::<NearMonitor>("near");
    let text = robot().with(r3).world(world).to_toml().unwrap();
    assert!(text.starts_with(world), "{text}");
    let [first, second] = ["[robots.r2.modules]", "[robots.r3.modules]"].map(|it| text.find(it).unwrap());
    assert!(first < second);
    let same = robot().with(Robot::new("r3").monitor::<NearMonitor>("near")).world_of(&text);
    assert_eq!(same.to_toml().unwrap(), text, "its robots are left out");
    for include in ["include = \"r3.toml\"\n", "include = [\"r3.toml\"]\n", "include=[\n  \"r3.toml\",\n]\n"]
    {
        let same = robot().with(Robot::new("r3").monitor::<NearMonitor>("near"));
        assert_eq!(same.world_of(&format!("{include}{text}")).to_toml().unwrap(), text, "{include}");
    }
}

#[test]
fn kinds_come_once_and_not_those_of_other_plugins() {
    let robot = Robot::new("r2").monitor::<NearMonitor>("left").monitor::<NearMonitor>("right");
    let names = |others: &[slate_module::Plugin]| -> Vec<String> {
        let plugins = robot.plugins(others);
        plugins.iter().flat_map(|plugin| plugin.kinds()).map(|kind| kind.name().to_owned()).collect()
    };
    assert_eq!(names(&[]), ["near_monitor"]);
    let other = slate_module::Plugin::linked::<slate_mapek::MonitorBlock<NearMonitor>>();
    assert!(names(&[other]).is_empty());
}

#[test]
fn a_second_plan_is_refused_with_both_lines() {
    let first = line!() + 1;
    let robot = Robot::new("r2").execute::<Actions>("execute").plan::<Wanderer>("planner");
    let robot = robot.plan::<Wanderer>("another");
    let RobotErrors(errors) = robot.to_toml().unwrap_err();
    let [error] = &errors[..] else { panic!("{errors:?}") };
    let (file, line) = (file!(), first + 1);
    assert_eq!(
        error.to_string(),
        format!(
            "{file}:{line}: robot `r2`: a robot has one Plan, and `planner` in line {first} is it; remove `another`"
        )
    );
}

#[test]
fn a_second_execute_is_refused() {
    let robot = Robot::new("r2").execute::<Actions>("execute").execute::<Actions>("another");
    let RobotErrors(errors) = robot.check().unwrap_err();
    assert!(matches!(&errors[0].problem, RobotProblem::Second { part: "Execute", .. }), "{errors:?}");
}

#[test]
fn actions_without_an_execute_are_refused() {
    let robot = Robot::new("r2").reactive::<AvoidNear>("avoid");
    assert!(errors(&robot)[0].starts_with("it has no Execute, which `avoid` needs"));
}

#[test]
fn two_modules_of_one_name_are_refused() {
    let line = line!() + 1;
    let robot = Robot::new("r2").monitor::<NearMonitor>("near");
    let robot = robot.analyze::<WayIsFree>("near");
    assert_eq!(errors(&robot), [format!("the name `near` is taken by line {line}; choose another one")]);
}

#[test]
fn names_that_a_loop_gives_twice_are_refused() {
    let mut robot = Robot::new("r2");
    for name in ["left", "right", "left"] {
        robot = robot.monitor::<NearMonitor>(name).finish();
    }
    assert!(errors(&robot)[0].starts_with("the name `left` is taken by line "));
}

#[test]
fn two_robots_of_one_name_are_refused() {
    let robot = robot();
    let robot = robot.with(Robot::new("r2"));
    assert!(errors(&robot)[0].starts_with("the name `r2` is taken by line "));
}

#[test]
fn two_sources_of_one_port_are_refused() {
    let robot = Robot::new("r2")
        .monitor::<NearMonitor>("left")
        .attach::<WayIsFree>("way")
        .monitor::<NearMonitor>("right")
        .attach::<WayIsFree>("way")
        .analyze::<WayIsFree>("way");
    let found = errors(&robot);
    assert!(found[0].starts_with("`way/near` reads `left/percept` by line "), "{found:?}");
    assert!(found[0].ends_with("and can't read `right/percept` too"), "{found:?}");
}

#[test]
fn parameters_out_of_range_are_refused() {
    for speed in [2.5, f64::NAN] {
        let robot = Robot::new("r2").module::<Cruiser>("cruiser").params(|params| params.speed = speed);
        let found = errors(&robot);
        assert_eq!(
            found,
            [format!("the parameter `speed` of `cruiser` must be from 0.0 to 2.0, found {speed:?}")]
        );
    }
}

#[test]
fn names_that_are_not_there_are_refused_with_similar_ones() {
    let attached = Robot::new("r2").monitor::<NearMonitor>("near").attach::<WayIsFree>("wey");
    let found = errors(&attached.analyze::<WayIsFree>("way"));
    assert_eq!(found, ["it has no module `wey`; did you mean `way`?"]);
    let robot = Robot::new("r2").monitor::<NearMonitor>("near").link("rnage", "/simulator/r2/sonar");
    assert_eq!(errors(&robot), ["`near` has no port `rnage`; did you mean `range`?"]);
    let robot = Robot::new("r2").monitor::<NearMonitor>("near").link("range", "sonar/value");
    assert_eq!(errors(&robot), ["it has no module `sonar`; did you mean `near`?"]);
    let robot = Robot::new("r2").monitor::<NearMonitor>("near").attach::<WayIsFree>("near");
    assert_eq!(errors(&robot), ["`near` has the kind `near_monitor`, expected `way_is_free`"]);
    let robot = Robot::new("my robot");
    assert!(errors(&robot)[0].starts_with("`my robot` is not a name"));
}

#[test]
fn gates_without_a_commander_or_with_bad_limits_are_refused() {
    let of = |gate: Gate| Robot::new("r2").module::<Cruiser>("cruiser").gate("wheels", gate);
    assert!(of(gate()).check().is_ok());
    let unknown = of(Gate::new(Twist2::ZERO).limit("linaer", -1.0..=1.0));
    assert_eq!(
        errors(&unknown),
        ["the command Twist2 of the gate `wheels` has no field `linaer`; did you mean `linear`?"]
    );
    let outside = of(Gate::new(Twist2::ZERO).limit("linear", 0.5..=1.0));
    assert!(errors(&outside)[0].contains("must contain the safe value 0.0"));
    let still = of(Gate::new(Twist2::ZERO).rate_limit("linear", 0.0));
    assert!(errors(&still)[0].contains("must be above zero"));
    let slow = of(Gate::new(Twist2::ZERO).time_to_live("fast"));
    assert_eq!(errors(&slow), ["expected a duration such as \"200ms\", found \"fast\""]);
    let monitor = Robot::new("r2").monitor::<NearMonitor>("near").gate("wheels", gate());
    assert_eq!(errors(&monitor), ["`near` has 0 ports that command Twist2, and the gate `wheels` needs one"]);
}

#[test]
fn inputs_of_another_interface_are_refused() {
    let robot = Robot::new("r2").module::<Cruiser>("cruiser").input("goal", Rank { rank: 1 });
    assert_eq!(errors(&robot), ["the input `cruiser/goal` expects Twist2, found Rank"]);
}

/// A kind with the name of another one.
pub struct OtherMonitor;

impl Monitor for OtherMonitor {
    const NAME: &'static str = "near_monitor";
    type Sensors = common::Sonar;
    type Params = ();
    type State = ();
    type Value = common::Near;

    fn interpret((): &mut (), _: &common::Sonar, (): &(), _: &Tick) -> Option<common::Near> {
        None
    }
}

#[test]
fn two_kinds_of_one_name_are_refused() {
    let robot = Robot::new("r2").monitor::<NearMonitor>("near").monitor::<OtherMonitor>("other");
    assert!(errors(&robot)[0].contains("have different code and the same kind `near_monitor`"));
}
