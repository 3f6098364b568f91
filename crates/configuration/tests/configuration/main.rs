//! Guarantees of a configuration: a whole model or a report that shows what to do.
#![allow(clippy::unwrap_used, reason = "what fails here fails the test")]

mod agents;
mod changes;
mod choices;
mod division;
mod external;
mod files;
mod handlers;
mod layers;
mod reports;
mod save;
mod share;
mod watch;

use std::fs;
use std::path::PathBuf;
use std::sync::Arc;
use std::sync::atomic::{AtomicU32, Ordering};

use proptest::prelude::*;
use slate_blackboard::interface;
use slate_configuration::{
    Change, Configuration, Database, Difference, Options, Report, SaveTo, SourceKind, Subscription, Value,
    parse_change,
};
use slate_module::{Level, Stage, Trigger};

fn read(text: &str) -> Result<Configuration, Report> {
    Configuration::from_text("exp1.toml", text, &options(&[]))
}

fn options(sets: &[&str]) -> Options {
    Options {
        sets: sets.iter().map(|set| set.to_string()).collect(),
        extra_tables: vec!["world".into(), "controller".into()],
        ..Options::default()
    }
}

fn with_sets(text: &str, sets: &[&str]) -> Result<Configuration, Report> {
    Configuration::from_text("exp1.toml", text, &options(sets))
}

/// The one error of a text: `exp1.toml:3:1: message (help)`.
#[track_caller]
fn error(text: &str) -> String {
    let report = read(text).unwrap_err();
    assert_eq!(report.diagnostics().len(), 1, "{report:?}");
    report.to_string()
}

#[track_caller]
fn set_error(text: &str, set: &str) -> String {
    let report = with_sets(text, &[set]).unwrap_err();
    assert_eq!(report.diagnostics().len(), 1, "{report:?}");
    report.to_string()
}

/// A folder of its own for the files of one test, removed at the end.
struct Folder(PathBuf);

impl Folder {
    fn new(test: &str, files: &[(&str, &str)]) -> Self {
        // Tests run beside each other, and two of them may choose the same name.
        static COUNT: AtomicU32 = AtomicU32::new(0);
        let number = COUNT.fetch_add(1, Ordering::Relaxed);
        let name = format!("slate-configuration-{}-{number}-{test}", std::process::id());
        let folder = std::env::temp_dir().join(name);
        for (name, text) in files {
            let path = folder.join(name);
            fs::create_dir_all(path.parent().unwrap()).unwrap();
            fs::write(path, text).unwrap();
        }
        Self(folder)
    }

    fn path(&self, name: &str) -> PathBuf {
        self.0.join(name)
    }

    /// A text with the folder's path taken out.
    fn plain(&self, text: impl ToString) -> String {
        text.to_string().replace(&format!("{}/", self.0.display()), "")
    }
}

impl Drop for Folder {
    fn drop(&mut self) {
        let _ = fs::remove_dir_all(&self.0);
    }
}

const WHOLE: &str = r#"
[agent]
name = "scout"
seed = 7

[loop]
period = "10ms"
hang = "1.5s"

[time]
source = "simulator"

[mission]
outcome = "referee/verdict"

[log]
level = "warn"
levels."r2/planner" = "debug"

[modules.simulator]

[modules.follower]
kind = "pure_pursuit"
enabled = false
stage = "Act"
every = "10ms"
deadline = "5ms"
params.gain = 1.2
inputs.goal = { x = 1.0, y = 2.0 }

[modules.mapper]
on = ["scans", "pose"]

[links]
"follower/pose" = "localizer/pose"
"follower/target" = { from = "slate://base/mission/target", previous = true, stale = "200ms" }

[actuators.wheels]
command = "follower/wheels"
limits = { left = [-12.3, 12.3], right = [-12, 12] }
rate_limits = { left = 30.0 }
time_to_live = "50ms"
safe = { left = 0.0, right = 0.0 }

[robots.r2.modules.range_monitor]

[robots.r2.links]
"range_monitor/scans" = "sonar/scans"
"range_monitor/goal" = "/world/goal"
"/referee/r2" = "range_monitor/verdict"

[robots.r2.actuators.wheels]
commands = ["execute/wheels", "reflex/wheels"]

[world]
layout = "paper"
"#;

#[test]
fn a_whole_configuration_is_read() {
    let configuration = read(WHOLE).unwrap();
    assert_eq!(configuration.agent_name(), "scout");
    assert_eq!(configuration.seed().value, 7);
    assert_eq!((configuration.period().value, configuration.hang().value), (10_000_000, 1_500_000_000));
    assert_eq!(configuration.time_source().unwrap().value, "simulator");
    assert_eq!(configuration.mission().unwrap().outcome.to_string(), "/referee/verdict");
    assert_eq!(configuration.log().level_of("r2/planner"), Level::Debug);
    assert_eq!(configuration.log().level_of("follower"), Level::Warn);

    let names: Vec<_> = configuration.modules().iter().map(|module| module.name.as_str()).collect();
    assert_eq!(names, ["follower", "mapper", "r2/range_monitor", "simulator"]);
    let [follower, mapper, monitor, _] = configuration.modules() else { panic!() };
    assert_eq!(follower.kind.value, "pure_pursuit");
    assert!(!follower.enabled.value && monitor.enabled.value);
    assert_eq!(follower.stage.unwrap().value, Stage::Act);
    assert_eq!(follower.trigger.as_ref().unwrap().value, Trigger::Every(10_000_000));
    assert_eq!(follower.deadline.unwrap().value, 5_000_000);
    assert_eq!(follower.params.get("gain").unwrap().as_f64(), Some(1.2));
    assert_eq!(interface::Value::from(&follower.inputs).to_string(), "{ goal = { x = 1, y = 2 } }");
    let on = Trigger::On { ports: vec!["scans".into(), "pose".into()], timeout: None };
    assert_eq!(mapper.trigger.as_ref().unwrap().value, on);
    assert_eq!(monitor.kind.value, "range_monitor");
    assert!(monitor.stage.is_none() && monitor.trigger.is_none() && monitor.deadline.is_none());

    let [local, _] = configuration.actuators() else { panic!() };
    assert_eq!(local.name.value, "r2/wheels");
    let commands: Vec<_> = local.commands.iter().map(|url| url.to_string()).collect();
    assert_eq!(commands, ["/r2/execute/wheels", "/r2/reflex/wheels"]);
    assert_eq!(local.time_to_live.value, 100_000_000);
    let wheels = &configuration.actuators()[1];
    assert_eq!(wheels.commands[0].to_string(), "/follower/wheels");
    assert_eq!(
        (wheels.limits[1].field.as_str(), wheels.limits[1].low, wheels.limits[1].high),
        ("right", -12.0, 12.0)
    );
    assert_eq!(wheels.rate_limits[0].per_second, 30.0);
    assert_eq!(wheels.time_to_live.value, 50_000_000);
    assert_eq!(wheels.safe.get("left").unwrap().as_f64(), Some(0.0));

    assert_eq!(configuration.table("world").unwrap().get("layout").unwrap().as_str(), Some("paper"));
}

#[test]
fn relative_names_in_a_robot_get_its_name_absolute_ones_do_not() {
    let configuration = read(WHOLE).unwrap();
    let links: Vec<_> = configuration
        .links()
        .iter()
        .map(|link| format!("{} <- {}", link.to.value, link.from.value))
        .collect();
    assert_eq!(
        links,
        [
            "follower/pose <- /localizer/pose",
            "follower/target <- slate://base/mission/target",
            "r2/range_monitor/goal <- /world/goal",
            "r2/range_monitor/scans <- /r2/sonar/scans",
            "referee/r2 <- /r2/range_monitor/verdict",
        ]
    );
    let target = &configuration.links()[1];
    assert!(target.previous);
    assert_eq!(target.stale.unwrap().value, 200_000_000);
}

#[test]
fn an_empty_text_is_an_agent_with_defaults() {
    let configuration = Configuration::from_text("robots/exp 1.toml", "", &Options::default()).unwrap();
    assert_eq!(configuration.agent_name(), "exp_1");
    assert_eq!(configuration.seed().value, 0);
    assert_eq!((configuration.period().value, configuration.hang().value), (20_000_000, 2_000_000_000));
    assert_eq!(configuration.log().level.value, Level::Info);
    assert!(configuration.modules().is_empty() && configuration.time_source().is_none());
    assert_eq!(configuration.origin("loop.period").unwrap().to_string(), "built-in defaults");
}

#[test]
fn the_own_agents_url_is_local() {
    let text = "[agent]\nname = \"base\"\n[links]\n\"a/b\" = \"slate://base/c/d\"\n";
    assert_eq!(read(text).unwrap().links()[0].from.to_string(), "/c/d");
}

#[test]
fn openrdk_configuration_values_cut_at_hash_and_equals() {
    let text = "[modules.radio.params]\nkey = 'a#b=c # d' # a comment\n[world]\nlayout = \"x=1#2\"\n";
    let configuration = read(text).unwrap();
    assert_eq!(configuration.value("modules.radio.params.key").unwrap().as_str(), Some("a#b=c # d"));
    assert_eq!(configuration.value("world.layout").unwrap().as_str(), Some("x=1#2"));
    for (set, expected) in [
        ("world.layout=a#b=c # d", "a#b=c # d"),
        ("world.layout=\"a#b=c # d\"", "a#b=c # d"),
        ("world.layout='#'", "#"),
        ("world.layout==", "="),
        ("world.layout=1#2", "1#2"),
        ("world.layout=true # no", "true # no"),
    ] {
        let configuration = with_sets(text, &[set]).unwrap();
        assert_eq!(configuration.value("world.layout").unwrap().as_str(), Some(expected), "{set}");
    }
    let configuration = with_sets(text, &["world.\"a=b#c\".'d=\"'=1"]).unwrap();
    assert_eq!(configuration.value("world.\"a=b#c\".'d=\"'").unwrap().as_integer(), Some(1));
}
