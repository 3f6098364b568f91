//! What a configuration promises: a whole model or a report that shows what to do.
#![allow(clippy::unwrap_used, reason = "what fails here fails the test")]

use std::fs;
use std::path::PathBuf;

use proptest::prelude::*;
use slate_blackboard::interface;
use slate_module::{Level, Stage, Trigger};
use slate_runtime::configuration::{Configuration, Options, Report, SourceKind, Value};

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
        let folder = std::env::temp_dir().join(format!("slate-configuration-{}-{test}", std::process::id()));
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
plugin = "pure_pursuit"
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
    assert_eq!(follower.plugin.value, "pure_pursuit");
    assert!(!follower.enabled.value && monitor.enabled.value);
    assert_eq!(follower.stage.unwrap().value, Stage::Act);
    assert_eq!(follower.trigger.as_ref().unwrap().value, Trigger::Every(10_000_000));
    assert_eq!(follower.deadline.unwrap().value, 5_000_000);
    assert_eq!(follower.params.get("gain").unwrap().as_f64(), Some(1.2));
    assert_eq!(interface::Value::from(&follower.inputs).to_string(), "{ goal = { x = 1, y = 2 } }");
    let on = Trigger::On { ports: vec!["scans".into(), "pose".into()], timeout: None };
    assert_eq!(mapper.trigger.as_ref().unwrap().value, on);
    assert_eq!(monitor.plugin.value, "range_monitor");
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
fn names_and_relative_urls_in_a_robot_get_its_name_and_absolute_ones_do_not() {
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

#[test]
fn settings_of_the_command_line_are_toml_or_bare_words() {
    let value = |set: &str| {
        let configuration = with_sets("", &[set]).unwrap();
        interface::Value::from(configuration.table("world").unwrap()).to_string()
    };
    assert_eq!(value("world.layout=authors"), r#"{ layout = "authors" }"#);
    assert_eq!(value("world.layout=\"authors\""), r#"{ layout = "authors" }"#);
    assert_eq!(value(" world . layout =  two words "), r#"{ layout = "two words" }"#);
    assert_eq!(value("world.size=3"), "{ size = 3 }");
    assert_eq!(value("world.size=-2.5"), "{ size = -2.5 }");
    assert_eq!(value("world.walls=false"), "{ walls = false }");
    assert_eq!(value("world.box={ x = 1, at = [1, 2] }"), "{ box = { at = [1, 2], x = 1 } }");
    assert_eq!(value("world.day=2026-01-01"), r#"{ day = "2026-01-01" }"#);
    assert_eq!(value("world.empty=\"\""), r#"{ empty = "" }"#);
}

#[test]
fn each_layer_overrides_the_earlier_ones_setting_by_setting() {
    let folder = Folder::new(
        "layers",
        &[
            ("common/base.toml", "[loop]\nperiod = \"1ms\"\nhang = \"1s\"\n[modules.a]\nplugin = \"base\"\n"),
            ("common/all.toml", "include = [\"base.toml\"]\n[modules.a]\nparams = { x = 1, y = 1, z = 1 }\n"),
            (
                "exp1.toml",
                "include = [\"common/all.toml\"]\n[loop]\nperiod = \"2ms\"\n[modules.a.params]\ny = 2\nz = 2\nw = 2\n",
            ),
            ("host.toml", "[modules.a]\nparams.z = 3\nparams.w = 3\n"),
        ],
    );
    let options = Options {
        sets: vec!["modules.a.params.w=4".into(), "modules.a.params.w=5".into()],
        host: Some(folder.path("host.toml")),
        ..Options::default()
    };
    let configuration = Configuration::load(folder.path("exp1.toml"), &options).unwrap();
    assert_eq!(configuration.agent_name(), "exp1");
    assert_eq!((configuration.period().value, configuration.hang().value), (2_000_000, 1_000_000_000));
    let params = interface::Value::from(&configuration.modules()[0].params).to_string();
    assert_eq!(params, "{ w = 5, x = 1, y = 2, z = 3 }");

    let origin = |path: &str| folder.plain(configuration.origin(path).unwrap());
    assert_eq!(origin("log.level"), "built-in defaults");
    assert_eq!(origin("loop.hang"), "common/base.toml:3");
    assert_eq!(origin("modules.a.params.x"), "common/all.toml:3");
    assert_eq!(origin("modules.a.params.y"), "exp1.toml:5");
    assert_eq!(origin("modules.a.params.z"), "host.toml:2");
    assert_eq!(origin("modules.a.params.w"), "--set modules.a.params.w=5");
    assert_eq!(configuration.origin("modules.a.params.v"), None);
    assert_eq!(configuration.origin("not a path"), None);
}

#[test]
fn a_setting_of_a_robot_can_be_named_either_way_in_any_layer() {
    let text = "[modules.\"r2/a\"]\nparams = { x = 1, y = 1 }\n[links]\n\"r2/a/pose\" = \"b/pose\"\n";
    let sets = [
        "robots.r2.modules.a.params.x=2",
        "modules.\"r2/a\".params.y=3",
        "robots.r2.links.\"a/pose\"=\"c/pose\"",
    ];
    let configuration = with_sets(text, &sets).unwrap();
    let [module] = configuration.modules() else { panic!() };
    assert_eq!(interface::Value::from(&module.params).to_string(), "{ x = 2, y = 3 }");
    assert_eq!(configuration.links()[0].from.to_string(), "/r2/c/pose");
    for path in ["robots.r2.modules.a.params.x", "modules.\"r2/a\".params.x"] {
        assert_eq!(configuration.value(path).unwrap().as_integer(), Some(2));
    }
    for path in ["robots.r2.links.\"a/pose\"", "links.\"r2/a/pose\"", "links.\"/r2/a/pose\""] {
        assert_eq!(configuration.origin(path).unwrap().kind, SourceKind::Set);
    }
}

#[test]
fn of_settings_that_exclude_each_other_the_later_layer_wins() {
    let text = "[modules.a]\nevery = \"1ms\"\ninputs.x = 1\ninputs.y = 1\n[links]\n\"a/z\" = \"b/z\"\n";
    let sets = ["modules.a.on=scans", "links.\"a/x\"=\"b/x\"", "modules.a.inputs.z=2"];
    let configuration = with_sets(text, &sets).unwrap();
    let [module] = configuration.modules() else { panic!() };
    assert_eq!(
        module.trigger.as_ref().unwrap().value,
        Trigger::On { ports: vec!["scans".into()], timeout: None }
    );
    assert_eq!(interface::Value::from(&module.inputs).to_string(), "{ y = 1, z = 2 }");
    let links: Vec<_> = configuration.links().iter().map(|link| link.to.as_str()).collect();
    assert_eq!(links, ["a/x"]);

    assert_eq!(
        error("[modules.a]\nevery = \"1ms\"\non = \"x\"\n"),
        "exp1.toml:3:1: `every` and `on` exclude each other (keep one of the two)"
    );
    assert_eq!(
        error("[modules.a]\ninputs.x = 1\n[links]\n\"a/x\" = \"b/x\"\n"),
        "exp1.toml:2:8: input `a/x` has both a link and a value \
         (remove the value or the link; the link is at exp1.toml:4)"
    );
}

#[test]
fn a_report_shows_file_line_caret_and_help() {
    let report = read("[agent]\nname = \"exp1\"\n\n[loop]\nperoid = \"20ms\"\n").unwrap_err();
    let expected = "
  × unknown key `peroid` in [loop]
   ╭─[exp1.toml:5:1]
 4 │ [loop]
 5 │ peroid = \"20ms\"
   · ───┬──
   ·    ╰── here
   ╰────
  help: did you mean `period`?
";
    assert_eq!(report.render(false).trim(), expected.trim());
    assert_eq!(format!("{report:?}"), report.render(false));
    let first = &report.diagnostics()[0];
    assert_eq!((first.source_name(), first.line()), (Some("exp1.toml"), Some(5)));
    assert_eq!(report.to_string(), "exp1.toml:5:1: unknown key `peroid` in [loop] (did you mean `period`?)");
    let shown = format!("{:?}", miette::Report::new(report));
    assert!(shown.contains("exp1.toml:5:1") && shown.contains("did you mean"), "{shown}");
}

#[test]
fn a_wrong_setting_of_the_command_line_gets_a_caret_in_that_setting() {
    let report = with_sets("", &["loop.period=10ms", "loop.hang=soon"]).unwrap_err();
    let expected = "
  × `soon` is no duration
   ╭─[--set:1:11]
 1 │ loop.hang=soon
   ·           ──┬─
   ·             ╰── here
   ╰────
  help: a duration is text with a unit of ns, us, ms, s or min, such as hang = \"20ms\"
";
    assert_eq!(report.render(false).trim(), expected.trim());
}

#[test]
fn all_errors_are_reported_together_in_the_order_of_the_text() {
    let text = "colour = 1\n[agent]\nseed = -1\n[modules.Bad]\n[modules.a]\nstage = \"Akt\"\nenabled = 1\nparams = 2\n\
                [links]\n\"a/x\" = \"http://b/c\"\n\"a/y\" = { form = \"b/c\" }\n[actuators.w]\nlimits.left = [2, 1]\n";
    let report = with_sets(text, &["loop.hang=0s"]).unwrap_err();
    let lines: Vec<_> = report.diagnostics().iter().map(|d| (d.line().unwrap(), d.message())).collect();
    assert_eq!(
        lines,
        [
            (1, "unknown key `colour` at the top"),
            (3, "`seed` takes a whole number from 0, found -1"),
            (4, "`Bad` can't name a module"),
            (6, "`stage` can't be `Akt`"),
            (7, "`enabled` takes true or false, found a whole number"),
            (8, "`params` takes a table, found a whole number"),
            (10, "`http://b/c` is not a property's URL: the scheme is slate://"),
            (11, "link `a/y` has no `from`"),
            (11, "unknown key `form` in link `a/y`"),
            (12, "nothing commands actuator `w`"),
            (13, "the lowest `left` is above the highest"),
            (1, "`hang` must be longer than nothing"),
        ]
    );
    assert!(report.diagnostics().iter().all(|diagnostic| diagnostic.help_text().is_some()));
}

#[test]
fn every_error_says_what_was_found_and_what_to_write() {
    for (text, expected) in [
        ("[lop]\n", "1:2: unknown key `lop` at the top (did you mean `lo"),
        ("[worl]\n", "1:2: unknown key `worl` at the top (did you mean `world`"),
        (
            "[loop]\nperiod = 20\n",
            "2:10: `period` takes a duration, found a whole number (a duration is text with a unit of ns, us, ms, s or \
             min, such as period = \"20ms\")",
        ),
        (
            "[loop]\nperiod = \"20 parsecs\"\n",
            "2:10: `20 parsecs` is no duration (a duration is text with a unit of ns, us, ms, s or min, such as period \
             = \"20ms\")",
        ),
        (
            "[loop]\nperiod = \"-1ms\"\n",
            "2:10: `-1ms` is no duration (a duration is text with a unit of ns, us, ms, s or min, such as period = \
             \"20ms\")",
        ),
        (
            "[agent]\nname = 5\n",
            "2:8: `name` takes text, found a whole number (put text in quotes, such as name = \"robot1\")",
        ),
        (
            "[log]\nlevel = \"inof\"\n",
            "2:9: `level` can't be `inof` (did you mean `info`? known are `error`, `warn`, `info`, `debug`, `trace`)",
        ),
        ("[log]\nlevel = info\n", "2:9: `info` is no value (put text in quotes: \"info\")"),
        ("[loop]\nperiod = 20ms\n", "2:10: `20ms` is no value (put text in quotes: \"20ms\")"),
        (
            "[agent]\nseed =\n",
            "2:7: the value is missing (write a number, true, false, \"text\", [list] or { table })",
        ),
        (
            "[modules.a]\n[modules.a]\n",
            "2:10: `a` is set twice (keep one of the two; to override a setting, use a file that includes this one, or \
             --set)",
        ),
        (
            "[modules.\"r2/a\"]\n[robots.r2.modules.a]\n",
            "2:20: `r2/a` is set twice in modules (keep one of the two)",
        ),
        ("[robots.r2.link]\n", "1:12: unknown key `link` in [robots.r2] (did you mean `links`?)"),
        (
            "[robots.\"R-2\"]\n",
            "1:9: `R-2` can't name a robot (a name is lowercase letters, digits and underscores, such as `r_2`)",
        ),
        (
            "[modules.\"a//b\"]\n",
            "1:10: `a//b` can't name a module (a name is lowercase letters, digits and underscores, with single slashes \
             between scopes, such as `a/b`)",
        ),
        (
            "[modules]\na = 1\n",
            "2:5: `modules.a` takes a table, found a whole number (write a section [modules.a] or modules.a = { ... })",
        ),
        (
            "[links]\na = \"b/c\"\n",
            "2:1: `a` names no property, only a module (a property is module/property, /module/property or \
             slate://agent/module/property)",
        ),
        (
            "[links]\n\"slate://x/a/b\" = \"b/c\"\n",
            "2:1: a link feeds an input of this agent (write the input as `/a/b`, in the configuration of its own agent)",
        ),
        (
            "[robots.r2.links]\n\"a/b\" = \"c\"\n",
            "2:9: `c` names no property, only a module (a property is module/property, /module/property or \
             slate://agent/module/property)",
        ),
        ("[modules.a]\nevry = \"1s\"\n", "2:1: unknown key `evry` in module `a` (did you mean `every`?)"),
        ("[modules.a]\non = []\n", "2:6: `on` names no port (name one or more, such as on = \"scans\")"),
        (
            "[actuators.w]\ncommand = \"a/b\"\nlimits.left = 3\n",
            "3:15: the limits of `left` are a list of two numbers, found a whole number (write the lowest and the \
             highest value: left = [-1.0, 1.0])",
        ),
        (
            "[actuators.w]\ncommand = \"a/b\"\nlimits.left = [-inf, 1]\n",
            "3:16: `left` must be finite (write a number such as 1.5)",
        ),
        (
            "[actuators.w]\ncommand = \"a/b\"\nlimits.left = [1, 2]\nsafe.left = 0\n",
            "4:13: the safe `left` is out of its limits (choose a value from 1 to 2)",
        ),
        (
            "[actuators.w]\ncommand = \"a/b\"\nrate_limits.left = 0\n",
            "3:20: the rate limit of `left` must be above zero (write how much it may change in a second: left = 30.0)",
        ),
        (
            "[mission]\noutcome = \"referee\"\n",
            "2:11: `referee` names no property, only a module (a property is module/property, /module/property or \
             slate://agent/module/property)",
        ),
        (
            "[world]\nday = 2026-01-01\n",
            "2:7: no setting is a date or a time of day (put it in quotes to make it text)",
        ),
    ] {
        let message = error(text);
        assert!(message.starts_with(&format!("exp1.toml:{expected}")), "{message}\nis not\n{expected}");
    }
}

#[test]
fn a_setting_of_an_unknown_path_names_the_nearest() {
    let text = "[modules.follower]\n[robots.r2.modules.planner]\n[actuators.wheels]\ncommand = \"a/b\"\n";
    for (set, expected) in [
        ("loop.peroid=1ms", "6: unknown key `peroid` in [loop] (did you mean `period`?)"),
        ("wrld.layout=1", "1: unknown key `wrld` at the top (did you mean `world`?)"),
        ("modules.folower.params.x=1", "9: no module is called `folower` (did you mean `follower`?)"),
        (
            "robots.r2.modules.plan.params.x=1",
            "19: no module is called `r2/plan` (did you mean `r2/planner`?)",
        ),
        (
            "modules.follower.parms.x=1",
            "18: unknown key `parms` in module `follower` (did you mean `params`?)",
        ),
        ("actuators.wheel.safe.x=1", "11: no actuator is called `wheel` (did you mean `wheels`?)"),
    ] {
        assert_eq!(set_error(text, set), format!("--set:1:{expected}"));
    }
    let added = with_sets(text, &["modules.logger.plugin=logger", "modules.logger.params.x=1"]).unwrap();
    assert!(added.modules().iter().any(|module| module.name.value == "logger"));
}

#[test]
fn a_setting_that_is_none_is_explained() {
    for (set, expected) in [
        ("loop.period", "1:1: the setting has no `=` ("),
        ("loop..period=1", "1:1: the path is not valid: "),
        ("=1", "1:1: the path is not valid: "),
        ("[loop]\nperiod=1", "1:1: the path is not valid: "),
        ("include=[\"a.toml\"]", "1:1: only a file includes others ("),
        ("loop.period=", "1:13: the value is missing ("),
        ("world.x=[1, 2", "1:14: the value is not valid: "),
        ("world.x=[a]", "1:10: the value is not valid: "),
        ("world.x=\"a\" # b", "1:12: the value is not valid: "),
    ] {
        let message = set_error("", set);
        assert!(message.starts_with(&format!("--set:{expected}")), "{set}: {message}");
    }
}

#[test]
fn files_that_cannot_be_read_are_named_where_they_are_included() {
    let folder = Folder::new(
        "files",
        &[
            ("missing.toml", "include = [\n  \"none.toml\",\n]\n"),
            ("circle.toml", "include = [\"sub/back.toml\"]\n"),
            ("sub/back.toml", "include = \"../circle.toml\"\n"),
            ("broken.toml", "include = [\"sub/typo.toml\", \"sub/worse.toml\"]\n[loop]\nperiod = 5\n"),
            ("sub/typo.toml", "[loop\n"),
            ("sub/worse.toml", "a = = 1\n"),
            ("folder.toml", "include = [\"sub\"]\n"),
        ],
    );
    fs::write(folder.path("latin.toml"), b"# first\nname = \"\xe9\"\n").unwrap();
    let message =
        |name: &str| folder.plain(Configuration::load(folder.path(name), &Options::default()).unwrap_err());
    assert_eq!(
        message("none.toml"),
        "can't read the configuration none.toml: No such file or directory (os error 2) (give the path of a TOML file)"
    );
    assert_eq!(
        message("missing.toml"),
        "missing.toml:2:3: can't read the configuration none.toml: No such file or directory (os error 2) (an included \
         file is found relative to the one that includes it)"
    );
    assert_eq!(
        message("circle.toml"),
        "sub/back.toml:1:11: can't read the configuration sub/../circle.toml: it includes itself (remove one `include` \
         of the circle)"
    );
    assert!(message("folder.toml").contains("it is no file"));
    assert!(message("latin.toml").contains("line 2 is not UTF-8"));
    let both = message("broken.toml");
    assert!(both.contains("sub/typo.toml:1:6: ") && both.contains("sub/worse.toml:1:"), "{both}");
    assert!(!both.contains("period"), "what follows from a broken file is not reported: {both}");
}

#[test]
fn a_file_that_two_others_include_counts_once() {
    let folder = Folder::new(
        "diamond",
        &[
            ("exp1.toml", "include = [\"a.toml\", \"b.toml\"]\n"),
            ("a.toml", "include = [\"base.toml\"]\n[agent]\nseed = 2\n"),
            ("b.toml", "include = [\"base.toml\"]\n"),
            ("base.toml", "[agent]\nseed = 1\n"),
        ],
    );
    let configuration = Configuration::load(folder.path("exp1.toml"), &Options::default()).unwrap();
    assert_eq!(configuration.seed().value, 2);
}

#[test]
fn errors_found_later_point_into_the_right_file() {
    let folder = Folder::new(
        "later",
        &[
            ("exp1.toml", "include = [\"links.toml\"]\n"),
            ("links.toml", "[links]\n\"a/pose\" = \"lokalizer/pose\"\n"),
        ],
    );
    let configuration = Configuration::load(folder.path("exp1.toml"), &Options::default()).unwrap();
    let link = &configuration.links()[0];
    let source =
        configuration.diagnostic(link.from.span, "no module `lokalizer`", Some("did you mean?".into()));
    let to = configuration.diagnostic(link.to.span, "no module `a`", None);
    let report = Report::from(vec![source, to]);
    assert_eq!(
        folder.plain(&report),
        "links.toml:2:12: no module `lokalizer` (did you mean?)\nlinks.toml:2:1: no module `a`"
    );
    assert!(report.render(false).contains("  ────────┬───────\n"), "{report:?}");
}

#[test]
fn applications_check_their_own_tables() {
    let configuration = with_sets("[world]\nlayout = \"paper\"\n", &["world.layuot=authors"]).unwrap();
    let world = configuration.table("world").unwrap();
    let unknown = configuration.unknown_keys(world, "in [world]", &["layout", "size"]);
    assert_eq!(
        Report::from(unknown).to_string(),
        "--set:1:7: unknown key `layuot` in [world] (did you mean `layout`?)"
    );
    let configuration = read("controller = \"rocs\"\n").unwrap();
    assert_eq!(configuration.value("controller").unwrap().value, Value::Text("rocs".into()));
    assert!(configuration.table("world").is_none());
}

#[test]
fn documents_are_kept_with_their_comments() {
    let text = "# about the agent\n[agent]\nseed = 3 # lucky\n";
    let configuration = read(text).unwrap();
    let main = configuration.sources().iter().find(|source| source.name() == "exp1.toml").unwrap();
    let mut document = main.document().unwrap().clone().into_mut();
    assert_eq!(document.to_string(), text);
    document["agent"]["name"] = toml_edit::value("scout");
    assert_eq!(document.to_string(), format!("{text}name = \"scout\"\n"));
}

#[test]
fn a_deep_or_long_text_is_refused_and_not_a_crash() {
    let deep = format!("{}a = 1", "a.".repeat(100_000));
    let nested = format!("world = {}", "[".repeat(100_000));
    for text in [deep, nested] {
        assert!(read(&text).is_err());
        assert!(with_sets("", &[&text]).is_err());
    }
}

#[test]
fn a_byte_order_mark_and_windows_line_ends_are_fine() {
    let configuration = read("\u{feff}[agent]\r\nseed = 3\r\n").unwrap();
    assert_eq!(configuration.origin("agent.seed").unwrap().to_string(), "exp1.toml:2");
}

/// Checks that what a report shows can be shown, whatever was read.
fn never_panics(text: &str, sets: &[&str]) {
    // A random text may not read files of this computer.
    if text.contains("include") {
        return;
    }
    match with_sets(text, sets) {
        Ok(configuration) => drop(configuration.clone()),
        Err(report) => assert!(!report.diagnostics().is_empty() && !report.render(false).is_empty()),
    }
}

proptest! {
    #[test]
    fn arbitrary_text_never_panics(text in any::<String>(), set in any::<String>()) {
        never_panics(&text, &[&set]);
    }

    #[test]
    fn text_of_toml_tokens_never_panics(
        tokens in prop::collection::vec(
            prop::sample::select(&[
                "[", "]", "{", "}", "=", ".", ",", "\"", "'", "#", "\n", "\r\n", " ", "\\", "/", "é", "\u{feff}", "1", "-",
                "1e9", "inf", "true", "\"20ms\"", "\"a/b\"", "\"slate://x/y/z\"", "\"\"\"", "agent", "name", "seed", "loop",
                "period", "modules", "r2", "links", "from", "previous", "stale", "actuators", "command", "limits", "safe",
                "robots", "world", "log", "levels", "level", "mission", "outcome", "every", "on", "params", "inputs",
            ][..]),
            0..40,
        ),
        equals in any::<bool>(),
    ) {
        let text = tokens.concat();
        never_panics(&text, &[]);
        let joined = tokens.join(if equals { "=" } else { "." });
        never_panics("", &[&joined, &text]);
    }

    #[test]
    fn a_changed_character_never_panics(at in 0..WHOLE.len(), with in "[\\[\\]{}=.\"'#\n a-z0-9é-]{0,3}", cut in 0..4usize) {
        let end = (at + cut).min(WHOLE.len());
        never_panics(&format!("{}{with}{}", &WHOLE[..at], &WHOLE[end..]), &[]);
    }

    #[test]
    fn any_text_given_as_a_quoted_setting_arrives_whole(text in "[ -~é\n]{0,40}") {
        let quoted = toml_edit::Value::from(text.as_str()).to_string();
        let configuration = with_sets("", &[&format!("world.text={quoted}")]).unwrap();
        prop_assert_eq!(configuration.value("world.text").unwrap().as_str(), Some(text.as_str()));
    }

    // Without words that may be true, false, inf or nan.
    #[test]
    fn any_word_given_as_a_bare_setting_arrives_whole(word in "[a-eg-hj-mo-su-z][a-z#=.:/ -]{0,20}[a-z#=]") {
        let configuration = with_sets("", &[&format!("world.text={word}")]).unwrap();
        prop_assert_eq!(configuration.value("world.text").unwrap().as_str(), Some(word.as_str()));
    }
}
