//! The order of modules in a cycle, and the links that wait for the next one.
#![allow(dead_code, reason = "ports are looked at and never read")]

use slate_composition::{Catalogue, LinkEnd, check};
use slate_configuration::{Configuration, Options};
use slate_interfaces::Twist2;
use slate_module::Plugin;
use slate_module::prelude::*;

#[ports]
struct MixerIo {
    a: Input<Twist2>,
    b: Input<Twist2>,
    c: Input<Twist2>,
    d: Input<Twist2>,
    mixed: Output<Twist2>,
}

struct Mixer;

#[module(stage = Think)]
impl Module for Mixer {
    type Io = MixerIo;
    type Params = ();
    type State = ();

    fn tick((): &mut (), _: &MixerIo, (): &(), _: &Tick) -> Outcome {
        Outcome::Ok
    }
}

fn configuration(text: &str) -> Configuration {
    Configuration::from_text("mixers.toml", text, &Options::default()).unwrap()
}

fn catalogue() -> Catalogue {
    let mut catalogue = Catalogue::default();
    catalogue.add(Plugin::linked::<Mixer>());
    catalogue
}

#[test]
fn input_without_a_link_delays_no_reader() {
    let configuration = configuration(
        r#"
[modules]
early = { kind = "mixer", stage = "SensorAcquire" }
middle = { kind = "mixer" }
late = { kind = "mixer", stage = "Act" }
[links]
"early/b/linear" = "late/mixed/linear"
"middle/a" = { from = "early/a", previous = true }
"middle/b" = { from = "early/b", previous = true }
"middle/c" = { from = "early/mixed", previous = true }
"middle/d" = { from = "late/mixed", previous = true }
"#,
    );
    let survey = check(&configuration, &catalogue()).unwrap();
    let middle = survey.modules.iter().position(|module| module.module.name.value == "middle").unwrap();
    let delayed = survey.links.iter().filter(|link| link.port.0 == middle).map(|link| match link.port.1 {
        LinkEnd::Port(port) => (survey.modules[middle].description.ports[port].name.as_str(), link.delayed),
        end => panic!("{end:?}"),
    });
    // `early/a` is set between two cycles; the links of `early/b` write it at the step of `early`.
    let delayed: Vec<_> = delayed.collect();
    assert_eq!(delayed, [("a", false), ("b", true), ("c", true), ("d", false)]);
}

#[test]
fn circle_is_reported_at_a_link_that_is_part_of_it() {
    let text = r#"
[modules]
first = { kind = "mixer" }
second = { kind = "mixer" }
[links]
"first/a" = "second/d"
"first/b" = "second/mixed"
"second/a" = "first/d"
"second/b" = "first/mixed"
"#;
    let line = |wanted: &str| 1 + text.lines().position(|line| line == wanted).unwrap();
    let configuration = configuration(text);
    let report = check(&configuration, &catalogue()).err().unwrap().to_string();
    assert!(report.contains("cyclic dependency in stage Think"), "{report}");
    let place = format!("mixers.toml:{}:", line(r#""first/b" = "second/mixed""#));
    assert!(report.contains(&place), "expected {place}, found {report}");
    // Inputs that are set order no modules.
    let text = text.replace(r#""second/b" = "first/mixed""#, "");
    assert!(check(&self::configuration(&text), &catalogue()).is_ok());
}
