//! How what is wrong is shown.

use super::*;

#[test]
fn a_report_shows_file_line_caret_and_help() {
    let report = read("[agent]\nname = \"exp1\"\n\n[loop]\nperoid = \"20ms\"\n").unwrap_err();
    let expected = "
  × error[S002]: unknown key `peroid` in [loop]
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
fn a_wrong_command_line_setting_gets_a_caret() {
    let report = with_sets("", &["loop.period=10ms", "loop.hang=soon"]).unwrap_err();
    let expected = "
  × error[S015]: expected a duration such as \"200ms\", found \"soon\"
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
    let text = "color = 1\n[agent]\nseed = -1\n[modules.Bad]\n[modules.a]\nstage = \"Akt\"\nenabled = 1\nparams = 2\n\
                [links]\n\"a/x\" = \"http://b/c\"\n\"a/y\" = { form = \"b/c\" }\n[actuators.w]\nlimits.left = [2, 1]\n";
    let report = with_sets(text, &["loop.hang=0s"]).unwrap_err();
    let lines: Vec<_> = report.diagnostics().iter().map(|d| (d.line().unwrap(), d.message())).collect();
    assert_eq!(
        lines,
        [
            (1, "unknown key `color` at the top"),
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
            (1, "`hang` must be greater than zero"),
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
            "2:10: expected a duration such as \"200ms\", found \"20 parsecs\" (a duration is text with a unit of ns, us, ms, s or min, such as period \
             = \"20ms\")",
        ),
        (
            "[loop]\nperiod = \"-1ms\"\n",
            "2:10: expected a duration such as \"200ms\", found \"-1ms\" (a duration is text with a unit of ns, us, ms, s or min, such as period = \
             \"20ms\")",
        ),
        (
            "[agent]\nname = 5\n",
            "2:8: `name` takes text, found a whole number (put text in quotes, such as name = \"robot1\")",
        ),
        (
            "[log]\nlevel = \"inof\"\n",
            "2:9: `level` can't be `inof` (did you mean `info`? known: `error`, `warn`, `info`, `debug`, `trace`)",
        ),
        ("[log]\nlevel = info\n", "2:9: expected a value, found `info` (put text in quotes: \"info\")"),
        ("[loop]\nperiod = 20ms\n", "2:10: expected a value, found `20ms` (put text in quotes: \"20ms\")"),
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
            "[modules.a]\nplugin = \"follower\"\n",
            "2:1: module `a` has `plugin`, which is called `kind` in a module (write kind = \"follower\"; a plugin is a \
             library)",
        ),
        ("[links]\n\"a/b\" = [\"c/d\", 3]\n", "2:17: `a link` takes a list of texts, found a whole number"),
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
    let added = with_sets(text, &["modules.logger.kind=logger", "modules.logger.params.x=1"]).unwrap();
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
fn control_characters_in_names_are_escaped() {
    let name = "\u{1b}[31mred\n.toml";
    let folder = Folder::new("printable", &[(name, "[lop]\n")]);
    let report = Database::open(folder.path(name), options(&[])).unwrap_err();
    let missing = Database::open(folder.path("\u{7}.toml"), options(&[])).unwrap_err();
    for text in [report.to_string(), report.render(false), missing.to_string()] {
        assert!(!text.contains(['\u{1b}', '\u{7}']), "{text:?}");
    }
    assert!(report.to_string().contains("\\u{1b}[31mred\\n.toml:1:2: "), "{report}");
    assert!(missing.to_string().contains("\\u{7}.toml"), "{missing}");
}
