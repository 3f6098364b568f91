//! Changes at run time: proposals, what holds and where it comes from.

use super::*;

pub fn database(text: &str, sets: &[&str]) -> Database {
    Database::from_text("exp1.toml", text, options(sets)).unwrap()
}

/// Changes as `path: before -> after`.
pub fn shown(changes: &[Change]) -> Vec<String> {
    let show = |value: &Option<Value>| value.as_ref().map_or("-".into(), Value::to_string);
    changes.iter().map(|c| format!("{}: {} -> {}", c.path, show(&c.before), show(&c.after))).collect()
}

fn differences(database: &Database) -> Vec<String> {
    let show = |value: &Option<Value>| value.as_ref().map_or("-".into(), Value::to_string);
    let line = |d: Difference| {
        let origin = d.origin.map_or("nowhere".into(), |origin| origin.to_string());
        format!("{}: {} -> {} ({origin})", d.path, show(&d.file), show(&d.present))
    };
    database.diff().into_iter().map(line).collect()
}

const TEXT: &str = "[modules.follower]\nparams = { gain = 1.2, speed = 0.5 }\nevery = \"10ms\"\n\
                    [robots.r2.modules.planner]\nparams.speed = 1.0\n[robots.r2.links]\n\"planner/pose\" = \"a/pose\"\n";

#[test]
fn several_changes_are_made_at_once_or_not_at_all() {
    let database = database(TEXT, &[]);
    let changes = database
        .set(&[
            ("modules.follower.params.speed", "0.8"),
            ("robots.r2.modules.planner.params", "{ speed = 2.0, turn = \"left\" }"),
            ("loop.period", "10ms"),
        ])
        .unwrap();
    let expected = [
        "loop.period: \"20ms\" -> \"10ms\"",
        "modules.follower.params.speed: 0.5 -> 0.8",
        "modules.\"r2/planner\".params.speed: 1.0 -> 2.0",
        "modules.\"r2/planner\".params.turn: - -> \"left\"",
    ];
    assert_eq!(shown(&changes), expected);
    assert_eq!(database.current().period().value, 10_000_000);

    let before = database.current();
    let report = database
        .set(&[
            ("modules.follower.params.speed", "3.0"),
            ("modules.folower.params.speed", "3.0"),
            ("loop.hang", "soon"),
        ])
        .unwrap_err();
    assert_eq!(
        report.to_string(),
        "change:1:9: no module is called `folower` (did you mean `follower`?)\n\
         change:1:11: expected a duration such as \"200ms\", found \"soon\" (a duration is text with a unit of ns, us, ms, s or min, such as hang = \
         \"20ms\")"
    );
    assert!(
        report.render(false).contains("[change:1:11]\n 1 │ loop.hang=soon\n   ·           ──┬─"),
        "{report:?}"
    );
    assert!(Arc::ptr_eq(&before, &database.current()));
}

#[test]
fn a_path_is_never_cut_at_an_equals_sign_of_its_own() {
    let database = database("", &[]);
    let report = database.set(&[("world.a=1", "2")]).unwrap_err();
    assert!(report.to_string().starts_with("change:1:1: the path is not valid"), "{report}");
    database.set(&[("world.\"a=1\"", "x=y#z")]).unwrap();
    let [setting] = &database.get("world").unwrap()[..] else { panic!() };
    assert_eq!((setting.path.as_str(), setting.value.as_str()), ("world.\"a=1\"", Some("x=y#z")));
}

#[test]
fn a_change_can_be_parsed_as_the_command_line_does() {
    let parsed = |text: &str| parse_change(text).unwrap();
    assert_eq!(
        parsed("modules.follower.params.gain=2.5"),
        ("modules.follower.params.gain".into(), "2.5".into())
    );
    assert_eq!(parsed(" world.\"a=b\" = x = y "), ("world.\"a=b\"".into(), "x = y".into()));
    for (text, start) in [
        ("loop.period", "change:1:1: the setting has no `=`"),
        ("loop.period=", "change:1:13: the value is missing"),
        ("a..b=1", "change:1:1: the path is not valid"),
        ("a=[1,", "change:1:6: the value is not valid"),
    ] {
        let report = parse_change(text).unwrap_err();
        assert!(report.to_string().starts_with(start), "{report}");
    }
}

#[test]
fn every_value_tells_where_it_comes_from() {
    let database = database(TEXT, &["modules.follower.params.gain=1.5"]);
    database.set(&[("robots.r2.modules.planner.params.speed", "2.0")]).unwrap();
    let get = |path: &str| -> Vec<String> {
        let settings = database.get(path).unwrap();
        settings.iter().map(|s| format!("{}={} ({})", s.path, s.value, s.origin)).collect()
    };
    let follower = [
        "modules.follower.every=\"10ms\" (exp1.toml:3)",
        "modules.follower.params.gain=1.5 (--set modules.follower.params.gain=1.5)",
        "modules.follower.params.speed=0.5 (exp1.toml:2)",
    ];
    let planner =
        "modules.\"r2/planner\".params.speed=2.0 (change robots.r2.modules.planner.params.speed=2.0)";
    assert_eq!(get("modules.follower"), follower);
    assert_eq!(get("modules.follower.params.gain"), follower[1..2]);
    assert_eq!(get("robots.r2.modules.planner.params.speed"), [planner]);
    let robot = ["links.\"r2/planner/pose\"=\"/r2/a/pose\" (exp1.toml:7)", planner];
    assert_eq!(get("robots.r2"), robot);
    assert_eq!(get("robots.r2.modules"), [planner]);
    assert_eq!(
        get(""),
        [
            &["agent.seed=0 (built-in defaults)"],
            &robot[..1],
            &get("log")[..].iter().map(String::as_str).collect::<Vec<_>>(),
            &["loop.hang=\"2s\" (built-in defaults)", "loop.period=\"20ms\" (built-in defaults)"],
            &follower[..],
            &[planner]
        ]
        .concat()
    );
    assert!(get("modules.nobody").is_empty() && get("robots.r").is_empty());
    assert!(database.get("a..b").unwrap_err().to_string().starts_with("`a..b` is not a path"));
}

#[test]
fn differences_from_files_are_listed() {
    let database = database(TEXT, &["modules.follower.params.gain=1.5"]);
    let of_set = "modules.follower.params.gain: 1.2 -> 1.5 (--set modules.follower.params.gain=1.5)";
    assert_eq!(differences(&database), [of_set]);
    database.set(&[("modules.follower.on", "scans"), ("world.layout", "paper")]).unwrap();
    let expected = [
        "modules.follower.every: \"10ms\" -> - (nowhere)",
        "modules.follower.on: - -> \"scans\" (change modules.follower.on=scans)",
        of_set,
        "world.layout: - -> \"paper\" (change world.layout=paper)",
    ];
    assert_eq!(differences(&database), expected);
    database.set(&[("modules.follower.every", "10ms"), ("modules.follower.params.gain", "1.2")]).unwrap();
    let world = "world.layout: - -> \"paper\" (change world.layout=\"paper\")";
    assert_eq!(differences(&database), [world]);
    database.revert("world").unwrap().commit().unwrap();
    assert!(differences(&database).is_empty());
    database.revert("").unwrap().commit().unwrap();
    assert_eq!(differences(&database), [of_set]);
}

#[test]
fn a_proposal_changes_nothing_until_it_is_committed() {
    let database = database(TEXT, &[]);
    let slow = database.propose(&[("modules.follower.params.speed", "0.1")]).unwrap();
    let fast = database.propose(&[("modules.follower.params.speed", "0.9")]).unwrap();
    let speed = |c: &Configuration| c.value("modules.follower.params.speed").and_then(|value| value.as_f64());
    assert_eq!((speed(slow.configuration()), speed(&database.current())), (Some(0.1), Some(0.5)));
    assert_eq!(shown(slow.changes()), ["modules.follower.params.speed: 0.5 -> 0.1"]);
    slow.commit().unwrap();
    assert_eq!(
        fast.commit().unwrap_err().to_string(),
        "the configuration has changed since the proposal was made (propose again; nothing was changed by this one)"
    );
    assert_eq!(speed(&database.current()), Some(0.1));
}

#[test]
fn a_later_change_overrides_an_earlier_one() {
    let database = database("[world]\nbox = 1\n", &[]);
    let world = || interface::Value::from(database.current().table("world").unwrap()).to_string();
    for (path, value, expected) in [
        ("world.box", "{ x = 1, y = 1 }", "{ box = { x = 1, y = 1 } }"),
        ("world.box.x", "2", "{ box = { x = 2, y = 1 } }"),
        ("world.box", "{ y = 3 }", "{ box = { x = 2, y = 3 } }"),
        ("world.box", "[1, 2]", "{ box = [1, 2] }"),
        ("world.box.z", "4", "{ box = { z = 4 } }"),
        ("world.box", "{}", "{ box = { z = 4 } }"),
        ("world.empty", "{}", "{ box = { z = 4 }, empty = { } }"),
        ("world.text", "a\\\"b\nc", "{ box = { z = 4 }, empty = { }, text = \"a\\\\\\\"b\\nc\" }"),
    ] {
        database.set(&[(path, value)]).unwrap();
        assert_eq!(world(), expected);
    }
}

#[test]
fn proposals_are_checked_by_the_agent_too() {
    let database = database(TEXT, &[]);
    database.validate_with(Box::new(|configuration, changes| {
        assert!(!changes.is_empty());
        let speed = configuration.value("modules.follower.params.speed").unwrap();
        match speed.as_f64() {
            Some(value) if value > 2.0 => {
                Err(configuration.diagnostic(speed.span, "too fast", Some("at most 2".into())).into())
            }
            _ => Ok(()),
        }
    }));
    database.validate_with(Box::new(|_, changes| {
        assert!(changes.iter().all(|change| !change.path.starts_with("world")), "no worlds");
        Ok(())
    }));
    database.set(&[("modules.follower.params.speed", "1.5")]).unwrap();
    let report = database.set(&[("modules.follower.params.speed", "2.5")]).unwrap_err();
    assert_eq!(report.to_string(), "change:1:31: too fast (at most 2)");
    let report = database.set(&[("world.x", "1"), ("modules.follower.params.speed", "2.5")]).unwrap_err();
    let messages: Vec<_> = report.diagnostics().iter().map(|d| d.message()).collect();
    assert_eq!(messages, ["too fast", "a check of the configuration panicked"]);
    assert_eq!(database.diff().len(), 1);
}
