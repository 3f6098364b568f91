//! A scene of two robots with blocks, a simulator and a referee.
#![allow(dead_code, reason = "ports are looked at and never read")]

use slate_composition::{Catalogue, LinkedConfiguration};
use slate_configuration::{Configuration, Options};
use slate_interfaces::Twist2;
use slate_mapek::prelude::*;
use slate_mapek::{actuator, analyze, execute, knowledge, monitor, plan, reactive, sensor};
use slate_module::prelude::*;
use slate_module::{ModuleKind, Plugin};

use crate::robot::{Actions, Avoid, Front, Near, WayIsFree};

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
    other: Input<Near>,
    opinion: Output<Near>,
    tell: Outbox<Near>,
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
    #[param(default = 0.0, unit = "m/s", doc = "speed")]
    speed: f64,
}

/// A module that is not a block.
#[ports]
pub struct PlainIo {
    input: Input<Near>,
    output: Output<Near>,
    twist: Output<Twist2>,
    say: Outbox<Near>,
    hear: Inbox<Near>,
    wheels: Command<Twist2>,
    speed: Input<Twist2>,
}

/// Messages for an Execute, without a role.
#[ports]
pub struct Calls {
    reflex: Outbox<Reflex>,
    planned: Outbox<Planned>,
}

/// A module that sends actions and is not a block.
pub struct PlainCaller;

#[module(stage = Act)]
impl Module for PlainCaller {
    type Io = Calls;
    type Params = ();
    type State = ();

    fn tick(_: &mut (), _: &Calls, _: &(), _: &Tick) -> Outcome {
        Outcome::Ok
    }
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
    more: Inbox<Near>,
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
    heard: Inbox<Near>,
    #[role("rule")]
    rule: Output<Near>,
    advice: Output<Twist2>,
    goal: Output<Near>,
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
pub struct RoverPorts {
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
    type Noticed = RoverPorts;
    type Params = Tuning;
    type State = ();

    fn run((): &mut (), _: &RoverPorts, _: &Situation<'_>, _: &Tuning, _: &Tick, _: &mut Agenda<'_>) {}
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

/// A Monitor of a Sensor alone.
#[ports]
pub struct Listening {
    near: Sensed<Near>,
}

pub struct Listen;

impl Monitor for Listen {
    const NAME: &'static str = "listen";
    type Sensors = Listening;
    type Params = ();
    type State = ();
    type Value = Near;

    fn interpret((): &mut (), _: &Listening, (): &(), _: &Tick) -> Option<Near> {
        None
    }
}

/// A Monitor that hands on what a Sensor measures.
#[ports]
pub struct Passing {
    percept: HandedOn<Near>,
}

pub struct Pass;

impl Monitor for Pass {
    const NAME: &'static str = "pass";
    type Sensors = Passing;
    type Params = ();
    type State = ();
    type Value = InPlace<Near>;

    fn interpret((): &mut (), near: &Passing, (): &(), _: &Tick) -> Option<InPlace<Near>> {
        Some(near.percept.as_it_is())
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
    felt: Output<Near>,
}

const SCENE: &str = r#"
[modules]
simulator = { kind = "world" }
judge = {}
plain = {}
[robots.r2.modules]
sonar = { kind = "distance" }
front = {}
listen = {}
compare = {}
way = { kind = "way_is_free" }
knowledge = { kind = "atlas" }
planner = { kind = "rover" }
avoid = {}
execute = { kind = "execute" }
motors = { kind = "motor" }
[robots.r3.modules]
sonar = { kind = "distance" }
front = {}
way = { kind = "way_is_free" }
compare = {}
knowledge = { kind = "atlas" }
avoid = {}
execute = { kind = "execute" }
[robots.r2.actuators]
wheels = { command = "execute/wheels" }
[robots.r2.links]
"sonar/near" = "/simulator/near"
"front/range" = "sonar/value"
"avoid/range" = "sonar/value"
"compare/range" = "front/percept"
"compare/other" = false
"way/range" = "front/percept"
"planner/range" = "compare/change"
"planner/aim" = false
"planner/past" = false
"knowledge/learn" = false
"listen/near" = "sonar/value"
[robots.r3.links]
"sonar/near" = "/r2/sonar/value"
"front/range" = "sonar/value"
"compare/other" = false
"knowledge/learn" = false
"avoid/range" = "sonar/value"
"#;

pub fn catalogue() -> Catalogue {
    let mut catalogue = Catalogue { shares: true, ..Catalogue::default() };
    let blocks: [ModuleKind; 11] = [
        sensor::<Distance>(),
        monitor::<Front>(),
        monitor::<Listen>(),
        monitor::<Pass>(),
        analyze::<Compare>(),
        analyze::<WayIsFree>(),
        plan::<Rover>(),
        knowledge::<Atlas>(),
        reactive::<Avoid>(),
        execute::<Actions>(),
        actuator::<Motor>(),
    ];
    blocks.into_iter().map(Plugin::from).for_each(|plugin| catalogue.add(plugin));
    [
        Plugin::linked::<World>(),
        Plugin::linked::<Judge>(),
        Plugin::linked::<Plain>(),
        Plugin::linked::<PlainCaller>(),
    ]
    .into_iter()
    .for_each(|plugin| catalogue.add(plugin));
    catalogue
}

pub fn read(more: &[&str]) -> Configuration {
    let sets = more.iter().map(|set| (*set).to_owned()).collect();
    Configuration::from_text("scene.toml", SCENE, &Options { sets, ..Options::default() }).unwrap()
}

pub fn check(more: &[&str], catalogue: &Catalogue) -> Result<(), String> {
    let configuration = read(more);
    let linked = LinkedConfiguration::new(&configuration, catalogue, &|_| false);
    linked.check(catalogue).map(drop).map_err(|report| report.to_string())
}

/// The scene with a link; the complaint has all those parts.
#[track_caller]
pub fn refused(link: &str, parts: &[&str]) {
    let complaint = check(&[link], &catalogue()).err().unwrap_or_else(|| panic!("{link} should be refused"));
    for part in parts {
        assert!(complaint.contains(part), "no `{part}` for {link} in\n{complaint}");
    }
}

#[track_caller]
pub fn allowed(link: &str) {
    check(&[link], &catalogue()).unwrap_or_else(|complaint| panic!("{link}: {complaint}"));
}
