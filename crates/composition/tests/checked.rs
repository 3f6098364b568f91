//! Checked compositions: what an agent would have, without one.
#![allow(dead_code, reason = "ports are looked at and never read")]

use std::sync::atomic::{AtomicUsize, Ordering};

use serde::{Deserialize, Serialize};
use slate_blackboard::Access;
use slate_composition::{
    Catalogue, CheckedComposition, ExternalPorts, LinkedConfiguration, PropertyFacts, PropertyIndex,
    RestoredStates, check_facts,
};
use slate_configuration::{Configuration, Options};
use slate_interfaces::Twist2;
use slate_module::Plugin;
use slate_module::prelude::*;
use slate_sorted::SortedMap;

#[ports]
struct DriverIo {
    target: Input<Twist2>,
    queue: Queue<Twist2>,
    orders: Inbox<Twist2>,
    speed: Output<Twist2>,
    motor: Command<Twist2>,
    report: Outbox<Twist2>,
}

#[params]
struct DriverParams {
    #[param(default = 1.0, unit = "m", doc = "distance; below zero it refuses")]
    distance: f64,
}

#[derive(Clone, Debug, Default, Serialize, Deserialize)]
struct Odometer {
    meters: u32,
}

/// Instances of negative distance that were wanted.
static REFUSED: AtomicUsize = AtomicUsize::new(0);

/// Distance of a test that looks whether an instance is made.
const WATCHED: f64 = -2.0;

struct Driver;

#[module(stage = Act)]
impl Module for Driver {
    type Io = DriverIo;
    type Params = DriverParams;
    type State = Odometer;

    fn create(_: &Setup<'_>, params: &DriverParams) -> Result<Odometer, Refusal> {
        if params.distance < 0.0 {
            REFUSED.fetch_add(usize::from(params.distance == WATCHED), Ordering::Relaxed);
            return Err("distance is negative; choose one above zero".into());
        }
        Ok(Odometer::default())
    }

    fn tick(_: &mut Odometer, _: &DriverIo, _: &DriverParams, _: &Tick) -> Outcome {
        Outcome::Ok
    }
}

const PAIR: &str = r#"
[modules]
first = { kind = "driver" }
second = { kind = "driver" }
[actuators]
wheels = { command = "first/motor" }
[links]
"second/target" = "first/speed"
"second/orders" = ["first/report"]
"#;

fn catalogue() -> Catalogue {
    let mut catalogue = Catalogue::default();
    catalogue.add(Plugin::linked::<Driver>());
    catalogue
}

/// Looks at the composition of the pair, changed by settings.
fn with<R>(sets: &[&str], look: impl FnOnce(&CheckedComposition<'_>) -> R) -> Result<R, String> {
    let sets = sets.iter().map(|set| (*set).to_owned()).collect();
    let options = Options { sets, ..Options::default() };
    let configuration = Configuration::from_text("pair.toml", PAIR, &options).unwrap();
    let linked = LinkedConfiguration::new(&configuration, &catalogue(), &|_| false);
    let checked = linked.composition(&catalogue());
    checked.map(|checked| look(&checked)).map_err(|report| report.to_string())
}

fn tried(sets: &[&str], states: &SortedMap<String, Vec<u8>>) -> Result<RestoredStates, String> {
    with(sets, |checked| checked.try_modules(&catalogue(), states).map_err(|report| report.to_string()))?
}

#[test]
fn paths_lead_to_properties_without_an_agent() {
    with(&[], |checked| {
        let kind = |path: &str| {
            let (property, field) = checked.find(path).unwrap();
            (property.path().to_owned(), field, property.access())
        };
        let of = |path: &str, field: &str, access| (path.to_owned(), field.to_owned(), access);
        assert_eq!(kind("second/target/linear"), of("first/speed", "linear", Access::Output));
        assert_eq!(kind("first/target"), of("first/target", "", Access::Setting));
        assert_eq!(kind("second/orders"), of("second/orders", "", Access::Messages));
        assert_eq!(kind("first/params/distance"), of("first/params", "distance", Access::Setting));
        assert_eq!(kind("wheels/command"), of("wheels/command", "", Access::Output));
        for path in ["wheels/gate", "first/state", "first/timing", "first/histogram", "first/enabled"] {
            assert_eq!(checked.find(path).unwrap().0.path(), path);
        }
        for path in ["loop/state", "loop/Act/histogram", "log/tail", "log/counts"] {
            assert_eq!(checked.find(path).unwrap().0.path(), path);
        }
        let error = checked.find("first/spedo").unwrap_err().to_string();
        assert!(error.contains("no property at /first/spedo; nearest: first/speed"), "{error}");
        assert!(checked.find("first/process").is_err(), "it is not isolated");
    })
    .unwrap();
    with(&["modules.first.isolated=true"], |checked| assert!(checked.find("first/process").is_ok())).unwrap();
}

#[test]
fn programs_outside_fill_what_no_link_fills() {
    with(&[], |checked| {
        assert!(checked.external_input("first/target").is_ok());
        let error = checked.external_input("second/target").unwrap_err();
        assert_eq!(error.reason, "it is linked, from /first/speed");
        let error = checked.external_input("first/queue/linear").unwrap_err();
        assert!(error.reason.contains("a queue takes whole values"), "{error}");
        let error = checked.external_input("first/params").unwrap_err();
        assert_eq!(error.reason, "it is not an input with values");
        assert_eq!(checked.external_inbox("first/target").unwrap_err().reason, "it takes no messages");
        assert!(checked.external_inbox("first/orders").is_ok());
        assert!(checked.output_refusal("first/motor").is_some());
        assert!(checked.output_refusal("first/speed").is_none());
        assert!(!checked.is_lockstep());
    })
    .unwrap();
}

#[test]
fn gates_and_paths_that_do_not_fit_are_refused() {
    for (set, wanted) in [
        ("actuators.wheels.command=\"first/speed\"", "`/first/speed` is not a command"),
        ("actuators.wheels.modules=[\"second\"]", "`second` has no aspect Actuators"),
        ("actuators.wheels.limits.linaer=[0,1]", "linaer"),
        ("actuators.first={command=\"second/motor\"}", ""),
        ("actuators.\"second/state\"={command=\"second/motor\"}", ""),
    ] {
        let found = with(&[set], |_| ());
        match wanted {
            "" => assert!(found.is_ok(), "{set}: {found:?}"),
            wanted => assert!(found.as_ref().unwrap_err().contains(wanted), "{set}: {found:?}"),
        }
    }
    let taken = with(&["modules.\"wheels/command\"={kind=\"driver\"}"], |_| ());
    assert!(taken.is_ok(), "a module is below that path: {taken:?}");
}

#[test]
fn a_module_that_can_not_be_set_up_is_told_of_at_its_place() {
    let none = SortedMap::new();
    assert_eq!(tried(&[], &none), Ok(RestoredStates::new()));
    let refused = tried(&["modules.second.params.distance=-1.0"], &none).unwrap_err();
    assert!(refused.contains("`second` can't be set up: distance is negative"), "{refused}");
    let too_little = ["modules.second.isolated=true", "modules.second.isolation.memory=\"1kB\""];
    let refused = tried(&too_little, &none).unwrap_err();
    assert!(refused.contains("`second` may allocate 1000 bytes"), "{refused}");
}

#[test]
fn modules_on_trial_take_the_states_they_are_given() {
    let state = |bytes: Vec<u8>| SortedMap::from([("first".to_owned(), bytes)]);
    let setup = Setup { name: "first", seed: 0, period: 1, section: None, params: None };
    let catalogue = catalogue();
    let kind = catalogue.kind("driver").unwrap();
    assert!(kind.try_out(&setup, &1.0_f64.to_ne_bytes(), None).unwrap().is_ok());
    let restored = tried(&[], &state(vec![0xff])).unwrap();
    assert!(restored["first"].is_err() && restored.len() == 1, "{restored:?}");
}

#[test]
fn a_composition_makes_no_instance() {
    let set = format!("modules.first.params.distance={WATCHED:?}");
    assert_eq!(with(&[&set], |checked| checked.survey().modules.len()), Ok(2));
    assert_eq!(REFUSED.load(Ordering::Relaxed), 0);
    assert!(tried(&[&set], &SortedMap::new()).is_err());
    assert_eq!(REFUSED.load(Ordering::Relaxed), 1);
}

#[test]
fn stated_facts_need_a_property() {
    let facts = |path: &str| {
        let set = format!("share.knowledge.facts={{here=\"{path}\"}}");
        let checked = with(&[&set], |checked| {
            check_facts(checked.configuration(), checked, |_| true).map_err(|e| e.to_string())
        });
        checked.unwrap()
    };
    assert_eq!(facts("first/speed"), Ok(()));
    let error = facts("first/spede").unwrap_err();
    assert!(error.contains("what this robot states about `here`: no property at /first/spede"), "{error}");
}
