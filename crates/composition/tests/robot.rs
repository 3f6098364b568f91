//! Blocks of a small robot, each in a plugin of its own.
#![allow(dead_code, reason = "ports are looked at and never read")]

use serde::{Deserialize, Serialize};
use slate_composition::{Catalogue, LinkedConfiguration};
use slate_configuration::{Configuration, Link, Options};
use slate_interfaces::Twist2;
use slate_mapek::prelude::*;
use slate_mapek::{analyze, execute, monitor, plan, reactive};
use slate_module::Plugin;
use slate_module::prelude::*;

/// A distance.
#[interface]
pub struct Near {
    /// Meters.
    #[unit("m")]
    pub distance: f64,
}

#[ports]
pub struct Sonar {
    range: Input<Near>,
}

macro_rules! monitors {
    ($($name:ident: $kind:literal),+) => {
        $(
            pub struct $name;

            impl Monitor for $name {
                const NAME: &'static str = $kind;
                type Sensors = Sonar;
                type Params = ();
                type State = ();
                type Value = Near;

                fn interpret((): &mut (), sensors: &Sonar, (): &(), _: &Tick) -> Option<Near> {
                    sensors.range.fresh().copied()
                }
            }
        )+
    };
}
monitors!(Front: "front", Back: "back");

#[ports]
pub struct ObservedRange {
    range: Observed<Near>,
}

pub struct WayIsFree;

impl Analyze for WayIsFree {
    const NAME: &'static str = "way_is_free";
    type Observed = ObservedRange;
    type Params = ();
    type State = ();
    type Value = Near;

    fn process((): &mut (), observed: &ObservedRange, (): &(), _: &Tick) -> Option<Near> {
        observed.range.updated().copied()
    }
}

#[ports]
pub struct NoticedRange {
    pub range: Noticed<Near>,
}

pub struct Wanderer;

impl Plan for Wanderer {
    const NAME: &'static str = "wanderer";
    type Noticed = NoticedRange;
    type Params = ();
    type State = ();

    fn run((): &mut (), _: &NoticedRange, _: &Situation<'_>, (): &(), _: &Tick, _: &mut Agenda<'_>) {}
}

macro_rules! reflexes {
    ($($name:ident: $kind:literal),+) => {
        $(
            pub struct $name;

            impl ReactiveModel for $name {
                const NAME: &'static str = $kind;
                type Sensors = Sonar;
                type Params = ();
                type State = ();

                fn run((): &mut (), _: &Sonar, (): &(), _: &Tick) -> Option<ActionRequest> {
                    None
                }
            }
        )+
    };
}
reflexes!(Avoid: "avoid", Retreat: "retreat");

#[ports]
pub struct Body {
    pub wheels: Command<Twist2>,
}

#[derive(Serialize, Deserialize)]
pub struct Halt;

impl ActionKind for Halt {
    const KIND: &'static str = "Halt";
    type Arguments = ();

    fn start((): ()) -> Self {
        Self
    }
}

impl Action<Body> for Halt {
    fn act(&mut self, _: &Acting<'_, Body>) -> Step {
        Step::Done
    }
}

repertoire! {
    pub enum Actions for Body { Halt }
}

/// The robot with both reflexes and the first Monitor.
pub const ROBOT: &str = "[robots.r2.modules]\nfront = {}\nway = { kind = \"way_is_free\" }\n\
                         wanderer = {}\nexecute = {}\navoid = {}\nretreat = {}\n\
                         [robots.r2.actuators]\nwheels = { command = \"execute/wheels\" }\n";

/// All kinds; those of plugins that are `dormant` are known and not loaded.
pub fn catalogue(dormant: &[&str]) -> Catalogue {
    let kinds = [
        monitor::<Front>(),
        monitor::<Back>(),
        analyze::<WayIsFree>(),
        plan::<Wanderer>(),
        execute::<Actions>(),
        reactive::<Avoid>(),
        reactive::<Retreat>(),
    ];
    let mut catalogue = Catalogue::default();
    kinds.into_iter().map(Plugin::from).for_each(|plugin| catalogue.add(plugin));
    dormant.iter().for_each(|name| catalogue.remove(name));
    catalogue
}

/// The robot with more of it in another layer, and settings over both.
pub fn read(more: &str, sets: &[&str]) -> Configuration {
    let options = Options { sets: sets.iter().map(|set| (*set).into()).collect(), ..Options::default() };
    Configuration::from_text("robot.toml", &format!("{ROBOT}{more}"), &options).unwrap()
}

/// The links of a configuration, and which of them are inferred.
pub fn links(configuration: &Configuration) -> Vec<String> {
    let line = |link: &Link| {
        let how = if link.is_inferred() { " inferred" } else { "" };
        format!("{} <- {}{how}", link.to.value, link.from.value)
    };
    let mut links: Vec<_> = configuration.links().iter().map(line).collect();
    links.sort();
    links
}

/// The links of a robot that begins with all its modules.
pub fn linked(more: &str, sets: &[&str]) -> Vec<String> {
    let (configuration, catalogue) = (read(more, sets), catalogue(&[]));
    let linked = LinkedConfiguration::new(&configuration, &catalogue, &|_| false);
    linked.check(&catalogue).map(|_| ()).unwrap();
    links(linked.configuration())
}
