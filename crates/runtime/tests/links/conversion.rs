//! Conversions of links between different interfaces, and their refusals.

use slate_blackboard::interface::Value;
use slate_module::Plugin;
use slate_module::prelude::*;
use slate_runtime::configuration::{Database, Options as Reading};
use slate_runtime::{Agent, NewLink, Options, Rate};

use crate::links::common::number;
use crate::links::support::{all, steps};

/// A point.
#[interface]
#[derive(PartialEq)]
pub struct Point {
    /// To the right.
    #[unit("m")]
    pub x: f64,
    /// Upwards.
    #[unit("m")]
    pub y: f64,
}

/// What a sensor says, in the widths that it has.
#[interface]
pub struct Raw {
    /// Where it is.
    pub place: Point,
    /// A distance.
    #[unit("m")]
    pub meters: u16,
    /// Turned by.
    #[unit("deg")]
    pub degrees: i16,
    /// Counts.
    pub count: u32,
    /// Whether it is well.
    pub good: Bool,
    /// A few distances.
    pub ranges: Sequence<u32, 4>,
}

/// The same for the computing module.
#[interface]
pub struct Refined {
    /// Where it is.
    pub place: Point,
    /// A distance.
    #[unit("mm")]
    pub meters: f64,
    /// Counts.
    pub count: u64,
    /// Turned by.
    #[unit("rad")]
    pub angle: f64,
}

/// As [`Refined`], without what does not convert.
#[interface]
pub struct Tame {
    /// A distance.
    #[unit("mm")]
    pub meters: u32,
    /// Counts.
    pub count: u32,
}

/// Ports of [`Sensor`].
#[ports]
pub struct SensorIo {
    raw: Output<Raw>,
}

/// Tells the number of its tick in all ways.
pub struct Sensor;

#[module(stage = SensorAcquire)]
impl Module for Sensor {
    type Io = SensorIo;
    type Params = ();
    type State = ();

    fn tick(_: &mut (), io: &SensorIo, _: &(), now: &Tick) -> Outcome {
        let n = now.number() as u32;
        // One more in each tick.
        let ranges = Sequence::new(&[0, 10, 20, 30][..n.min(4) as usize]);
        io.raw.set(Raw {
            place: Point { x: f64::from(n), y: -f64::from(n) },
            meters: n as u16,
            degrees: 90,
            count: n,
            good: Bool::from(n % 2 == 1),
            ranges,
        });
        Outcome::Ok
    }
}

/// Ports of [`Thinker`].
#[ports]
pub struct ThinkerIo {
    refined: Input<Refined>,
    tame: Input<Tame>,
    point: Input<Point>,
    seen: Output<Refined>,
    told: Output<Tame>,
    stale: Output<Tame>,
}

/// Parameters of [`Thinker`].
#[params]
pub struct ThinkerParams {
    #[param(default = 1.0, range = 0.0..=5.0, doc = "may be linked")]
    gain: f64,
    #[param(default = 2.0, unit = "m", doc = "as well")]
    width: f64,
}

/// Tells what it reads.
pub struct Thinker;

#[module(stage = Think)]
impl Module for Thinker {
    type Io = ThinkerIo;
    type Params = ThinkerParams;
    type State = ();

    fn tick(_: &mut (), io: &ThinkerIo, params: &ThinkerParams, _: &Tick) -> Outcome {
        io.seen.set(Refined {
            place: io.point.get().copied().unwrap_or_default(),
            meters: params.gain,
            count: io.refined.get().copied().unwrap_or_default().count,
            angle: params.width,
        });
        io.told.set(io.tame.get().copied().unwrap_or_default());
        io.stale.set(Tame { meters: u32::from(io.refined.is_stale()), count: u32::from(io.tame.is_stale()) });
        Outcome::Ok
    }
}

const TEXT: &str = r#"
time.source = "sensor"
[modules.sensor]
[modules.thinker]
inputs.refined = { angle = 0.5, count = 77 }
[modules.other]
kind = "thinker"
[modules.counter]
[modules.dice]
[links]
"#;

fn load(links: &str) -> Agent {
    try_load(links).unwrap_or_else(|error| panic!("{error}"))
}

fn try_load(links: &str) -> Result<Agent, String> {
    let database = Database::from_text("test.toml", &format!("{TEXT}{links}"), Reading::default()).unwrap();
    let own = [Plugin::linked::<Sensor>(), Plugin::linked::<Thinker>()];
    let plugins: Vec<_> = all().into_iter().chain(own).collect();
    let options = Options { rate: Rate::Max, ..Options::default() };
    Agent::load_with(&database, &plugins, options).map_err(|error| match error {
        slate_runtime::StartError::Configuration(report) => report.render(false),
        other => other.to_string(),
    })
}

#[test]
fn an_interface_converts_field_by_field() {
    let mut agent = load("\"thinker/tame\" = \"sensor/raw\"");
    steps(&mut agent, 3);
    assert_eq!(number(&agent, "thinker/told/meters"), 3000.0);
    assert_eq!(number(&agent, "thinker/told/count"), 3.0);
    // Tools see what the module saw, with the time of its source.
    assert_eq!(number(&agent, "thinker/tame/meters"), 3000.0);
    let time = |path: &str| agent.board().read(path).unwrap().unwrap().1.time;
    assert_eq!(time("thinker/tame"), time("sensor/raw"));
    assert_eq!(number(&agent, "thinker/stale/count"), 0.0);
    // And can't set it.
    assert!(agent.board().write("thinker/tame/count", &Value::Integer(1), 0).is_err());
}

#[test]
fn several_links_fill_one_input_and_the_rest_keeps_its_value() {
    let links = "\"thinker/refined/meters\" = \"/sensor/raw/meters\"\n\"thinker/refined/place\" = \"sensor/raw/place\"\n\
                 \"thinker/point/x\" = \"slate://test/sensor/raw/place/y\"";
    let mut agent = load(links);
    steps(&mut agent, 4);
    let read = |field: &str| number(&agent, &format!("thinker/refined/{field}"));
    assert_eq!([read("meters"), read("place/x"), read("place/y")], [4000.0, 4.0, -4.0]);
    assert_eq!([read("count"), read("angle")], [77.0, 0.5]);
    assert_eq!(number(&agent, "thinker/seen/place/x"), -4.0);
    assert_eq!(number(&agent, "thinker/seen/place/y"), 0.0);
}

#[test]
fn items_of_a_sequence_are_followed_when_they_are_there() {
    let mut agent = load("\"thinker/tame/count\" = \"sensor/raw/ranges/2\"");
    steps(&mut agent, 2);
    assert_eq!(number(&agent, "thinker/stale/count"), 1.0, "it is not there yet");
    steps(&mut agent, 1);
    assert_eq!(number(&agent, "thinker/told/count"), 20.0);
    assert_eq!(number(&agent, "thinker/stale/count"), 0.0);
}

#[test]
fn chains_lead_to_their_end() {
    let links = "\"thinker/tame\" = \"sensor/raw\"\n\"other/tame\" = \"thinker/tame\"\n\
                 \"other/point/x\" = \"thinker/point/y\"\n\"thinker/point\" = \"sensor/raw/place\"";
    let mut agent = load(links);
    steps(&mut agent, 3);
    assert_eq!(number(&agent, "other/told/meters"), 3000.0);
    assert_eq!(number(&agent, "other/seen/place/x"), -3.0);
    // The end of a chain may change, also from a link to a value.
    agent.composer().link(&NewLink::new("thinker/point/x", "sensor/raw/place/y")).unwrap_err();
    agent.composer().unlink("thinker/point").unwrap();
    agent.composer().link(&NewLink::new("thinker/point/x", "sensor/raw/place/y")).unwrap();
    steps(&mut agent, 1);
    assert_eq!(number(&agent, "thinker/seen/place/x"), -4.0);
    assert_eq!(number(&agent, "other/seen/place/x"), 0.0);
}

#[test]
fn parameters_follow_outputs_within_their_range() {
    let mut agent = load("\"thinker/params/gain\" = \"counter/number/value\"");
    steps(&mut agent, 3);
    assert_eq!(number(&agent, "thinker/seen/meters"), 3.0);
    assert_eq!(number(&agent, "thinker/params/gain"), 3.0);
    // Tools set the others, and not this one.
    agent.board().write("thinker/params/width", &Value::Float(7.0), 0).unwrap();
    let refused = agent.board().write("thinker/params/gain", &Value::Float(1.0), 0).unwrap_err().to_string();
    assert!(
        refused.contains("follows /counter/number/value") && refused.contains("slate unlink"),
        "{refused}"
    );
    let set =
        agent.database().unwrap().set(&[("modules.thinker.params.gain", "2.0")]).unwrap_err().to_string();
    assert!(set.contains("follows") && set.contains("slate unlink thinker/params/gain"), "{set}");
    steps(&mut agent, 4);
    assert_eq!(number(&agent, "thinker/seen/meters"), 5.0, "7 is out of range");
    assert_eq!(number(&agent, "thinker/seen/angle"), 7.0);
    agent.composer().unlink("thinker/params/gain").unwrap();
    assert_eq!(number(&agent, "thinker/params/gain"), 1.0, "the value that is set, as of inputs");
    agent.database().unwrap().set(&[("modules.thinker.params.gain", "0.5")]).unwrap();
    steps(&mut agent, 1);
    assert_eq!(number(&agent, "thinker/seen/meters"), 0.5);
    // A parameter is a source, too.
    agent.composer().link(&NewLink::new("other/params/gain", "thinker/params/gain")).unwrap();
    steps(&mut agent, 1);
    assert_eq!(number(&agent, "other/seen/meters"), 0.5);
    // But not of itself.
    let links = agent.composer().links();
    let link = NewLink::new("thinker/params/gain", "other/params/gain");
    let circle = agent.composer().link(&link).unwrap_err().to_string();
    assert!(circle.contains("cyclic dependency"), "{circle}");
    assert_eq!(agent.composer().links(), links);
    agent.composer().link(&NewLink::new("thinker/params/width", "other/params/width")).unwrap();
}

#[test]
fn the_loop_and_the_log_are_sources_too() {
    let mut agent = load("\"thinker/refined/count\" = \"loop/state/overruns\"");
    steps(&mut agent, 2);
    for (from, is_good) in [
        ("loop/state/cycles", true),
        ("log/counts/written", true),
        ("/loop/histogram/count", true),
        ("loop/stat/cycles", false),
        ("loop/state/cycle", false),
    ] {
        let linked = agent.composer().link(&NewLink::new("thinker/refined/count", from));
        assert_eq!(linked.is_ok(), is_good, "{from}: {linked:?}");
        let said = linked.err().map_or_else(String::new, |error| error.to_string());
        assert!(is_good || said.contains("did you mean"), "{said}");
        steps(&mut agent, 1);
    }
    agent.logger().log(0, slate_module::Level::Info, "a line");
    agent.composer().link(&NewLink::new("thinker/refined/count", "log/counts/written")).unwrap();
    let written = || {
        agent.logger().flush(std::time::Duration::from_secs(10));
        number(&agent, "log/counts/written")
    };
    assert!(written() > 0.0);
    steps(&mut agent, 1);
    assert!(number(&agent, "thinker/refined/count") > 0.0);
}

#[test]
fn a_truth_value_switches_a_module() {
    let mut agent = load("\"thinker/enabled\" = \"sensor/raw/good\"");
    steps(&mut agent, 5);
    assert_eq!(agent.counts("thinker").unwrap().0, 3);
    agent.composer().unlink("thinker/enabled").unwrap();
    steps(&mut agent, 5);
    assert_eq!(agent.counts("thinker").unwrap().0, 8);
}

#[test]
fn state_and_timing_are_sources() {
    let mut agent = load("\"thinker/refined/count\" = \"counter/timing/ticks\"");
    steps(&mut agent, 3);
    assert!(number(&agent, "thinker/seen/count") >= 1.0);
}

#[test]
fn links_of_parts_change_while_the_agent_runs() {
    let mut agent = load("");
    let composer = agent.composer();
    steps(&mut agent, 2);
    assert_eq!(number(&agent, "thinker/seen/count"), 77.0);
    composer.link(&NewLink::new("thinker/refined/count", "sensor/raw/count")).unwrap();
    steps(&mut agent, 1);
    assert_eq!(number(&agent, "thinker/seen/count"), 3.0);
    composer.link(&NewLink::new("thinker/refined/meters", "sensor/raw/meters")).unwrap();
    composer.link(&NewLink::new("thinker/tame", "sensor/raw")).unwrap();
    steps(&mut agent, 1);
    assert_eq!(number(&agent, "thinker/seen/count"), 4.0);
    assert_eq!(number(&agent, "thinker/refined/meters"), 4000.0);
    composer.unlink("thinker/refined/count").unwrap();
    steps(&mut agent, 1);
    assert_eq!(number(&agent, "thinker/seen/count"), 77.0);
    assert_eq!(number(&agent, "thinker/refined/meters"), 5000.0);
    assert_eq!(agent.counts("thinker").unwrap().0, 5);
}

#[test]
fn previous_is_last_cycles_value_also_of_an_earlier_stage() {
    let links = "\"thinker/tame\" = { from = \"sensor/raw\", previous = true }\n\
                 \"thinker/point\" = { from = \"sensor/raw/place\", previous = true }";
    let mut agent = load(links);
    for cycle in 1..6 {
        steps(&mut agent, 1);
        assert_eq!(number(&agent, "thinker/told/count"), f64::from(cycle - 1));
        assert_eq!(number(&agent, "thinker/seen/place/x"), f64::from(cycle - 1));
    }
}

#[test]
fn filters_let_some_values_through() {
    let links = "\"thinker/tame\" = { from = \"sensor/raw\", every = 3 }\n\
                 \"thinker/point\" = { from = \"sensor/raw/place\", when = \"place/x >= 4\" }";
    let mut agent = load(links);
    let mut seen = Vec::new();
    for _ in 0..7 {
        steps(&mut agent, 1);
        seen.push((number(&agent, "thinker/told/count"), number(&agent, "thinker/seen/place/x")));
    }
    assert_eq!(seen, [(0.0, 0.0), (0.0, 0.0), (3.0, 0.0), (3.0, 4.0), (3.0, 5.0), (6.0, 6.0), (6.0, 7.0)]);
}

#[test]
fn inexact_conversion_is_refused_with_both_ends() {
    let refused = |links: &str, words: &[&str]| {
        let text = try_load(links).err().unwrap_or_else(|| panic!("`{links}` should be refused"));
        let flat = text.replace(['\n', '│', '┃', '·'], " ").split_whitespace().collect::<Vec<_>>().join(" ");
        words.iter().for_each(|word| assert!(flat.contains(word), "{word}: {flat}"));
        assert!(flat.contains("here") && flat.contains("test.toml"), "{flat}");
    };
    refused(
        "\"thinker/refined/angle\" = \"sensor/raw/degrees\"",
        &["deg", "rad", "`thinker/refined/angle`", "exact"],
    );
    refused("\"thinker/tame/meters\" = \"sensor/raw/place/x\"", &["f64 in m", "u32 in mm"]);
    refused("\"thinker/tame/count\" = \"thinker/refined/count\"", &["u32 does not hold every u64"]);
    refused("\"other/refined\" = \"sensor/raw\"", &["Raw has no field `angle`"]);
    refused(
        "\"thinker/refined/angel\" = \"sensor/raw/degrees\"",
        &["no field `angel`", "did you mean angle?"],
    );
    refused("\"thinker/refined/count\" = \"sensor/raw/cuont\"", &["no field `cuont`", "did you mean count?"]);
    refused("\"thinker/refined/count\" = \"sensor/raw/ranges/9\"", &["unknown item `9`", "at most 4"]);
    refused("\"thinker/params/gani\" = \"counter/number/value\"", &["no field `gani`", "gain"]);
    refused("\"thinker/params\" = \"counter/number\"", &["all parameters", "gain"]);
    refused("\"thinker/params/width\" = \"counter/number/value\"", &["no unit", "m"]);
    refused(
        "\"thinker/point\" = \"sensor/raw/place\"\n\"thinker/point/x\" = \"counter/number/value\"",
        &["linked already"],
    );
    refused(
        "\"thinker/point\" = \"other/point\"\n\"other/point\" = \"thinker/point\"",
        &["other/point -> thinker/point -> other/point", "cyclic dependency"],
    );
    refused(
        "\"thinker/params/gain\" = \"other/params/gain\"\n\"other/params/gain\" = \"thinker/params/gain\"",
        &["other/params/gain -> thinker/params/gain -> other/params/gain", "cyclic dependency"],
    );
    refused("\"thinker/params/gain\" = \"thinker/params/gain\"", &["cyclic dependency"]);
    refused("\"thinker/tame\" = { from = \"sensor/raw\", when = \"good\" }", &["`good` is not a condition"]);
    for (when, holds) in [("good > true", "never holds"), ("good >= false", "always holds")] {
        let link = format!("\"thinker/tame\" = {{ from = \"sensor/raw\", when = \"{when}\" }}");
        refused(&link, &[when, holds]);
    }
    refused(
        "\"thinker/tame\" = { from = \"sensor/raw\", when = \"goood == true\" }",
        &["no field `goood`", "good"],
    );
    refused(
        "\"thinker/tame\" = { from = \"sensor/raw\", carrier = \"tcp\" }",
        &["`carrier` has no meaning here"],
    );
    refused("\"thinker/tame\" = { from = \"sensor/raw\", policy = \"skip\" }", &["not a queue input"]);
}
