//! Who may read whom, by links of every kind.
#![allow(dead_code, reason = "ports are looked at and never read")]

use slate_composition::{Catalogue, RemotePath, RemoteProperty, Wired};
use slate_configuration::{Configuration, Options};
use slate_interfaces::Twist2;
use slate_mapek::prelude::*;
use slate_mapek::{actuator, analyze, execute, knowledge, monitor, plan, reactive, sensor};
use slate_module::prelude::*;
use slate_module::{ModuleKind, Plugin};

use crate::robot::{Actions, Avoid, Front, Near, WayIsFree, links};

/// A simulator.
#[ports]
pub struct WorldIo {
    near: Output<Near>,
    #[role("truth")]
    truth: Output<Near>,
    #[role("actuation")]
    wheels: Input<Twist2>,
}

pub struct World;

#[module(stage = PreLoop)]
impl Module for World {
    type Io = WorldIo;
    type Params = ();
    type State = ();

    fn tick(_: &mut (), _: &WorldIo, _: &(), _: &Tick) -> Outcome {
        Outcome::Ok
    }
}

#[ports]
pub struct JudgeIo {
    #[role("truth")]
    truth: Input<Near>,
}

pub struct Judge;

#[module(stage = PostLoop)]
impl Module for Judge {
    type Io = JudgeIo;
    type Params = ();
    type State = ();

    fn tick(_: &mut (), _: &JudgeIo, _: &(), _: &Tick) -> Outcome {
        Outcome::Ok
    }
}

#[params]
pub struct Tuning {
    #[param(default = 1.0, unit = "m", doc = "distance")]
    gain: f64,
}

/// A module that is no block.
#[ports]
pub struct PlainIo {
    input: Input<Near>,
    output: Output<Near>,
    twist: Output<Twist2>,
    say: Outbox<Near>,
    hear: Inbox<Near>,
    wheels: Command<Twist2>,
}

pub struct Plain;

#[module(stage = Act)]
impl Module for Plain {
    type Io = PlainIo;
    type Params = Tuning;
    type State = ();

    fn tick(_: &mut (), _: &PlainIo, _: &Tuning, _: &Tick) -> Outcome {
        Outcome::Ok
    }
}

#[ports]
pub struct Range {
    near: Input<Near>,
}

pub struct Distance;

impl Sensor for Distance {
    const NAME: &'static str = "distance";
    type Io = Range;
    type Params = ();
    type State = ();
    type Value = Near;

    fn get_data(_: &mut (), io: &Range, _: &(), _: &Tick) -> Option<Near> {
        io.near.updated().copied()
    }
}

#[ports]
pub struct Facts {
    fact: Known<Near>,
    learn: Input<Near>,
    rule: Output<Near>,
}

pub struct Atlas;

impl Knowledge for Atlas {
    const NAME: &'static str = "atlas";
    type Models = Facts;
    type Params = ();
    type State = ();

    fn update(_: &mut (), _: &Facts, _: &(), _: &Tick) {}
}

#[ports]
pub struct Noticing {
    range: Noticed<Near>,
    aim: Input<Near>,
    past: Queue<Near>,
    orders: Inbox<Near>,
    goal: Output<Near>,
    twist: Output<Twist2>,
    call: Outbox<Near>,
}

pub struct Rover;

impl Plan for Rover {
    const NAME: &'static str = "rover";
    type Noticed = Noticing;
    type Params = Tuning;
    type State = ();

    fn run((): &mut (), _: &Noticing, _: &Situation<'_>, _: &Tuning, _: &Tick, _: &mut Agenda<'_>) {}
}

#[ports]
pub struct Seeing {
    range: Observed<Near>,
    other: Input<Near>,
}

/// An Analyze with a plain input.
pub struct Compare;

impl Analyze for Compare {
    const NAME: &'static str = "compare";
    type Observed = Seeing;
    type Params = ();
    type State = ();
    type Value = Near;

    fn process((): &mut (), _: &Seeing, (): &(), _: &Tick) -> Option<Near> {
        None
    }
}

pub struct Motor;

impl Actuator for Motor {
    const NAME: &'static str = "motor";
    type Io = Drive;
    type Params = ();
    type State = ();
    type Command = Twist2;
    const SAFE: Twist2 = Twist2::ZERO;

    fn apply(_: &mut (), _: &Twist2, _: &Drive, _: &(), _: &Tick) -> Outcome {
        Outcome::Ok
    }
}

#[ports]
pub struct Drive {
    moved: Output<Twist2>,
}

const SCENE: &str = r#"
[modules]
simulator = { kind = "world" }
judge = {}
plain = {}
[robots.r2.modules]
sonar = { kind = "distance" }
front = {}
compare = {}
knowledge = { kind = "atlas" }
planner = { kind = "rover" }
avoid = {}
execute = { kind = "execute" }
motors = { kind = "motor" }
[robots.r3.modules]
front = {}
way = { kind = "way_is_free" }
[robots.r2.actuators]
wheels = { command = "execute/wheels" }
[robots.r2.links]
"sonar/near" = "/simulator/near"
"front/range" = "sonar/value"
"avoid/range" = "sonar/value"
"compare/other" = false
"planner/aim" = false
"planner/past" = false
"knowledge/learn" = false
[robots.r3.links]
"front/range" = "/r2/sonar/value"
"#;

fn catalogue() -> Catalogue {
    let mut catalogue = Catalogue { shares: true, ..Catalogue::default() };
    let blocks: [ModuleKind; 9] = [
        sensor::<Distance>(),
        monitor::<Front>(),
        analyze::<Compare>(),
        analyze::<WayIsFree>(),
        plan::<Rover>(),
        knowledge::<Atlas>(),
        reactive::<Avoid>(),
        execute::<Actions>(),
        actuator::<Motor>(),
    ];
    blocks.into_iter().map(Plugin::from).for_each(|plugin| catalogue.add(plugin));
    [Plugin::linked::<World>(), Plugin::linked::<Judge>(), Plugin::linked::<Plain>()]
        .into_iter()
        .for_each(|plugin| catalogue.add(plugin));
    catalogue
}

fn read(more: &[&str]) -> Configuration {
    let sets = more.iter().map(|set| (*set).to_owned()).collect();
    Configuration::from_text("scene.toml", SCENE, &Options { sets, ..Options::default() }).unwrap()
}

fn check(more: &[&str], catalogue: &Catalogue) -> Result<(), String> {
    let configuration = read(more);
    let wired = Wired::new(&configuration, catalogue, &|_| false);
    wired.check(catalogue).map(drop).map_err(|report| report.to_string())
}

/// The scene with a link; the complaint has all those parts.
#[track_caller]
fn refused(link: &str, parts: &[&str]) {
    let complaint = check(&[link], &catalogue()).err().unwrap_or_else(|| panic!("{link} should be refused"));
    for part in parts {
        assert!(complaint.contains(part), "no `{part}` for {link} in\n{complaint}");
    }
}

#[track_caller]
fn allowed(link: &str) {
    check(&[link], &catalogue()).unwrap_or_else(|complaint| panic!("{link}: {complaint}"));
}

const PLAN: &str = "a Plan reads Analyzes, Knowledge and Execute's status";

#[test]
fn plan_reads_analyzes_knowledge_and_execute_alone() {
    for link in [
        r#"links."/r2/planner/aim"="/r2/compare/change""#,
        r#"links."/r2/planner/aim"="/r3/way/change""#,
        r#"links."/r2/planner/aim"="/r2/knowledge/rule""#,
        r#"links."/r2/planner/aim"="/r2/knowledge/fact""#,
        r#"links."/r2/planner/past"="/r2/knowledge/rule""#,
        r#"links."/r2/planner/aim/distance"="/r2/compare/change/distance""#,
        r#"links."/r2/planner/params/gain"="/r2/knowledge/rule/distance""#,
        r#"robots.r2.modules.planner.inputs.aim.distance=1.0"#,
    ] {
        allowed(link);
    }
    let wants = [PLAN, "give it a Sensor, a Monitor and an Analyze", "`/simulator/near`"];
    for link in [
        r#"links."/r2/planner/aim"="/simulator/near""#,
        r#"links."/r2/planner/aim"={from="/simulator/near",previous=true}"#,
        r#"links."/r2/planner/aim"={from="/simulator/near",every=2}"#,
        r#"links."/r2/planner/past"="/simulator/near""#,
        r#"links."/r2/planner/past"={from="/simulator/near",when="distance > 1"}"#,
    ] {
        refused(link, &wants);
    }
    refused(
        r#"links."/r2/planner/aim/distance"="/simulator/near/distance""#,
        &[PLAN, "`/r2/planner/aim/distance`"],
    );
    refused(r#"links."/r2/planner/params/gain"="/simulator/near/distance""#, &[PLAN]);
    refused(
        r#"links."/r2/planner/aim"="/r2/sonar/value""#,
        &[PLAN, "of a Sensor", "a Monitor and an Analyze"],
    );
    refused(r#"links."/r2/planner/aim"="/r2/front/percept""#, &[PLAN, "of a Monitor", "give it an Analyze"]);
    refused(r#"links."/r2/planner/orders"="/plain/say""#, &[PLAN, "`/plain/say`"]);
}

#[test]
fn inputs_of_others_hide_nothing_from_the_rules() {
    // Another module's input leads to its source, and a part of one to what fills it.
    let hop = |to: &str| [r#"links."/plain/input"="/simulator/near""#.to_owned(), to.to_owned()];
    let by = |links: &[String]| {
        let links: Vec<_> = links.iter().map(String::as_str).collect();
        check(&links, &catalogue())
    };
    assert!(by(&hop(r#"links."/r2/planner/aim"="/plain/input""#)).unwrap_err().contains(PLAN));
    let part = [
        r#"links."/plain/input/distance"="/simulator/near/distance""#.to_owned(),
        r#"links."/r2/planner/aim"="/plain/input""#.to_owned(),
    ];
    assert!(by(&part).unwrap_err().contains(PLAN));
    let parameter = [
        r#"links."/plain/params/gain"="/simulator/near/distance""#.to_owned(),
        r#"links."/r2/planner/aim/distance"="/plain/params/gain""#.to_owned(),
    ];
    assert!(by(&parameter).unwrap_err().contains(PLAN));
    // What a person sets there is no bypass.
    by(&[r#"links."/r2/planner/aim"="/plain/input""#.to_owned()]).unwrap();
    by(&[r#"links."/r2/planner/aim/distance"="/plain/params/gain""#.to_owned()]).unwrap();
}

#[test]
fn monitor_reads_sensors_and_knowledge() {
    allowed(r#"links."/r2/front/range"="/r2/knowledge/rule""#);
    for from in ["/r2/compare/change", "/r3/front/percept", "/r2/planner/goal"] {
        refused(
            &format!(r#"links."/r2/front/range"="{from}""#),
            &["a Monitor reads Sensors and Knowledge: `/r2/front/range`", "let Knowledge have it"],
        );
    }
}

#[test]
fn analyze_reads_monitors_and_another_one_by_a_fact() {
    allowed(r#"links."/r2/compare/other"="/r3/front/percept""#);
    allowed(r#"links."/r2/compare/other"="/r2/knowledge/rule""#);
    let rule = "an Analyze reads Monitors and Knowledge";
    refused(r#"links."/r2/compare/other"="/r3/way/change""#, &[rule, "make it a fact of Knowledge"]);
    refused(r#"links."/r2/compare/other"="/r2/sonar/value""#, &[rule, "give it a Monitor"]);
    refused(r#"links."/r2/compare/other"="/simulator/near""#, &[rule, "give it a Sensor and a Monitor"]);
    refused(r#"links."/r2/compare/range"="/simulator/near""#, &["an Analyze reads Monitors"]);
    let fact = [
        r#"links."/r2/knowledge/fact"="/r3/way/change""#,
        r#"links."/r2/compare/other"="/r2/knowledge/fact""#,
    ];
    let (configuration, catalogue) = (read(&fact), catalogue());
    let wired = Wired::new(&configuration, &catalogue, &|_| false);
    let survey = wired.check(&catalogue).unwrap();
    // It reads the origin itself, in the cycle in which that is written.
    let path = |joint: &slate_composition::ResolvedLink<'_>| survey.path(wired.configuration(), joint.target);
    let read =
        survey.joints.iter().find(|joint| survey.wire_path(joint.port.0, joint.port.1) == "r2/compare/other");
    assert_eq!(path(read.unwrap()), "r3/way/change");
    let place = |name: &str| {
        let levels = survey.order.iter().flatten();
        levels
            .enumerate()
            .find(|(_, level)| level.iter().any(|module| survey.modules[*module].module.name.value == name))
    };
    assert!(place("r3/way").unwrap().0 < place("r2/compare").unwrap().0);
}

#[test]
fn fact_with_a_bad_origin_is_refused_at_knowledge() {
    refused(r#"links."/r2/knowledge/fact"="/simulator/truth""#, &["only ports of referees"]);
    for from in ["/r2/compare/change", "/r2/front/percept", "/r2/sonar/value", "/r2/planner/goal"] {
        allowed(&format!(r#"links."/r2/knowledge/learn"="{from}""#));
    }
}

#[test]
fn reflex_reads_sensors_and_knowledge() {
    allowed(r#"links."/r2/avoid/range"="/r2/knowledge/rule""#);
    for from in ["/r2/planner/goal", "/r2/compare/change", "/r2/front/percept"] {
        let rule = "a ReactiveModel reads Sensors and Knowledge: `/r2/avoid/range`";
        refused(&format!(r#"links."/r2/avoid/range"="{from}""#), &[rule, "a reflex maps measurements"]);
    }
}

#[test]
fn truth_is_for_referees() {
    allowed(r#"links."/judge/truth"="/simulator/truth""#);
    for to in ["/plain/input", "/r2/sonar/near", "/r2/front/range", "/r2/planner/aim", "/r2/avoid/range"] {
        let parts = ["only ports of referees read ground truth", "`/simulator/truth`", "Sensors"];
        refused(&format!(r#"links."{to}"="/simulator/truth""#), &parts);
        refused(&format!(r#"links."{to}/distance"="/simulator/truth/distance""#), &parts);
    }
    // Also through the port of a referee.
    let both = [r#"links."/judge/truth"="/simulator/truth""#, r#"links."/plain/input"="/judge/truth""#];
    assert!(check(&both, &catalogue()).unwrap_err().contains("only ports of referees"));
}

#[test]
fn execute_alone_reaches_actuators() {
    allowed(r#"links."/simulator/wheels"="/r2/wheels/command""#);
    allowed(r#"links."/simulator/wheels"="/r2/motors/moved""#);
    // A robot of plain modules stays legal.
    allowed(r#"links."/simulator/wheels"="/plain/twist""#);
    let only = "only Execute reaches actuators";
    refused(r#"links."/simulator/wheels"="/r2/planner/twist""#, &[only, "to a gate"]);
    let commands = r#"robots.r2.actuators.wheels.command="/plain/wheels""#;
    refused(commands, &["Execute alone commands", "`/plain/wheels`", "`r2/wheels`"]);
    refused(
        r#"links."/plain/hear"="/r2/planner/call""#,
        &["only Execute sends to other agents and to modules"],
    );
    refused(
        r#"links."slate://other/x/hear"="/r2/planner/call""#,
        &["only Execute sends to other agents", "let an action send it"],
    );
    refused(
        r#"links."/r2/motors/command"="/r2/planner/twist""#,
        &["an Actuator reads the command that passed the gate", "link it to a gate"],
    );
    let inferred = links(Wired::new(&read(&[]), &catalogue(), &|_| false).configuration());
    assert!(
        inferred.contains(&"r2/motors/command <- /r2/wheels/command inferred".to_owned()),
        "{inferred:?}"
    );
}

#[test]
fn nothing_against_the_rules_is_inferred() {
    let free = [
        r#"links."/r2/knowledge/fact"="/r3/way/change""#,
        "robots.r2.links.\"compare/other\"=\"knowledge/fact\"",
    ];
    let configuration = read(&free);
    let found = links(Wired::new(&configuration, &catalogue(), &|_| false).configuration());
    let inferred: Vec<_> =
        found.iter().filter(|line| line.ends_with(" inferred")).map(String::as_str).collect();
    let expected = [
        "r2/compare/range <- /r2/front/percept inferred",
        "r2/execute/plan <- /r2/planner/plan inferred",
        "r2/execute/reflexes <- /r2/avoid/reflex inferred",
        "r2/motors/command <- /r2/wheels/command inferred",
        "r2/planner/range <- /r2/compare/change inferred",
        "r2/planner/situation <- /r2/execute/status inferred",
        "r3/way/range <- /r3/front/percept inferred",
    ];
    assert_eq!(inferred, expected);
}

/// A link to another agent, whose property is written by such a part.
fn from_other(to: &str, part: &str) -> Option<String> {
    let link = format!(r#"links."{to}"="slate://other/x/value""#);
    let mut catalogue = catalogue();
    let found = RemoteProperty {
        path: "x/value".into(),
        descriptor: <Near as Interface>::DESCRIPTOR,
        part: part.into(),
        epoch: 1,
    };
    catalogue.remote.insert(RemotePath { agent: "other".into(), path: "x/value".into() }, found);
    let configuration = read(&[&link]);
    let wired = Wired::new(&configuration, &catalogue, &|_| false);
    let survey = wired.check(&catalogue).unwrap();
    survey.misfits.values().next().map(|misfit| format!("{} ({})", misfit.message, misfit.help))
}

#[test]
fn links_to_other_agents_wait_when_they_are_against_the_rules() {
    for to in ["/r2/planner/aim", "/r2/planner/past"] {
        assert_eq!(from_other(to, "analyze"), None);
        assert_eq!(from_other(to, "knowledge"), None);
        for part in ["", "sensor", "monitor", "truth"] {
            let misfit = from_other(to, part).unwrap_or_else(|| panic!("{to} should not read {part}"));
            let rule = if part == "truth" { "only ports of referees" } else { PLAN };
            assert!(misfit.contains(rule) && misfit.contains("slate://other/x/value"), "{misfit}");
        }
    }
    assert_eq!(from_other("/judge/truth", "truth"), None);
    assert!(from_other("/plain/input", "truth").unwrap().contains("only ports of referees"));
    assert_eq!(from_other("/plain/input", "monitor"), None);
}
