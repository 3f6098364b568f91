//! Files that are edited while the agent runs.

use std::sync::mpsc::{self, Receiver};
use std::time::Duration;

use super::changes::shown;
use super::*;

type Told = Receiver<Result<Vec<Change>, Report>>;

fn watched(folder: &Folder) -> (Database, slate_runtime::configuration::Watch, Told) {
    let database = Database::open(folder.path("exp1.toml"), options(&["log.level=warn"])).unwrap();
    let (sender, told) = mpsc::channel();
    let watch = database.watch(move |result| drop(sender.send(result))).unwrap();
    (database, watch, told)
}

/// What was told next; it comes within a second or so, and a slow computer gets a minute.
#[track_caller]
fn next(told: &Told) -> Result<Vec<String>, Report> {
    told.recv_timeout(Duration::from_secs(60)).unwrap().map(|changes| shown(&changes))
}

fn folder(test: &str) -> Folder {
    let files = [
        ("exp1.toml", "include = \"robot.toml\"\n[loop]\nperiod = \"20ms\"\n"),
        ("robot.toml", "[modules.a]\nparams.x = 1\n"),
    ];
    Folder::new(test, &files)
}

#[test]
fn an_edited_file_is_taken_over_however_it_is_replaced() {
    let folder = folder("edited");
    let (database, watch, told) = watched(&folder);
    database.set(&[("modules.a.params.y", "5")]).unwrap();

    fs::write(folder.path("exp1.toml"), "include = \"robot.toml\"\n[loop]\nperiod = \"10ms\"\n").unwrap();
    assert_eq!(next(&told).unwrap(), ["loop.period: \"20ms\" -> \"10ms\""]);
    assert_eq!(database.current().period().value, 10_000_000);

    // As an editor does it, and in an included file.
    fs::write(folder.path("robot.toml~"), "[modules.a]\nparams = { x = 2, y = 2 }\n").unwrap();
    fs::rename(folder.path("robot.toml~"), folder.path("robot.toml")).unwrap();
    assert_eq!(next(&told).unwrap(), ["modules.a.params.x: 1 -> 2"]);
    let origins: Vec<_> =
        database.get("modules.a").unwrap().iter().map(|setting| folder.plain(&setting.origin)).collect();
    assert_eq!(origins, ["robot.toml:2", "change modules.a.params.y=5"], "the session stays on top");

    // A file that is included from now on is watched too.
    fs::write(folder.path("more.toml"), "[modules.b]\nparams.x = 1\n").unwrap();
    let text = "include = [\"robot.toml\", \"more.toml\"]\n[loop]\nperiod = \"10ms\"\n";
    fs::write(folder.path("exp1.toml"), text).unwrap();
    assert_eq!(next(&told).unwrap(), ["modules.b.params.x: - -> 1"]);
    fs::write(folder.path("more.toml"), "[modules.b]\nparams.x = 2\n").unwrap();
    assert_eq!(next(&told).unwrap(), ["modules.b.params.x: 1 -> 2"]);

    drop(watch);
    fs::write(folder.path("more.toml"), "[modules.b]\nparams.x = 3\n").unwrap();
    assert!(told.recv().is_err(), "the thread is gone");
    assert_eq!(database.current().value("modules.b.params.x").unwrap().as_integer(), Some(2));
}

#[test]
fn an_invalid_edit_is_refused_whole_with_file_line_and_caret() {
    let folder = folder("invalid");
    let (database, _watch, told) = watched(&folder);
    let before = database.current();
    let text = "include = \"robot.toml\"\n[loop]\nperiod = \"10ms\"\nhang = \"soon\"\n";
    fs::write(folder.path("exp1.toml"), text).unwrap();
    let report = next(&told).unwrap_err();
    assert!(folder.plain(&report).starts_with("exp1.toml:4:8: `soon` is no duration"), "{report}");
    assert!(report.render(false).contains("hang = \"soon\"\n   ·        ───┬──"), "{report:?}");
    assert!(Arc::ptr_eq(&before, &database.current()));

    // It's told once, and changes at run time go on from what holds.
    database.set(&[("modules.a.params.x", "2")]).unwrap();
    assert_eq!(database.current().period().value, 20_000_000);

    // What is missing for an edit to be right is waited for.
    fs::write(folder.path("exp1.toml"), "include = [\"robot.toml\", \"more.toml\"]\n").unwrap();
    let report = next(&told).unwrap_err();
    assert!(folder.plain(&report).contains("can't read the configuration more.toml"), "{report}");
    fs::write(folder.path("more.toml"), "[loop]\nperiod = \"5ms\"\n").unwrap();
    assert_eq!(next(&told).unwrap(), ["loop.period: \"20ms\" -> \"5ms\""]);

    // A validator has a say too, and the session must still fit.
    database.validate_with(Box::new(|configuration, _| match configuration.period().value {
        0..1_000_000 => Err(configuration.diagnostic(configuration.period().span, "too short", None).into()),
        _ => Ok(()),
    }));
    fs::write(folder.path("more.toml"), "[loop]\nperiod = \"5us\"\n").unwrap();
    assert_eq!(folder.plain(next(&told).unwrap_err()), "more.toml:2:10: too short");
    fs::write(folder.path("more.toml"), "[loop]\nperiod = \"6ms\"\n").unwrap();
    next(&told).unwrap();
    fs::write(folder.path("robot.toml"), "").unwrap();
    assert_eq!(next(&told).unwrap_err().to_string(), "change:1:9: no module is called `a` (there is none)");
    database.revert("modules").unwrap().commit().unwrap();
    fs::write(folder.path("robot.toml"), "# none\n").unwrap();
    assert_eq!(next(&told).unwrap(), ["modules.a.params.x: 1 -> -"]);
}

#[test]
fn a_file_that_goes_is_reported_and_what_holds_stays() {
    let folder = folder("gone");
    let (database, _watch, told) = watched(&folder);
    fs::remove_file(folder.path("robot.toml")).unwrap();
    let report = next(&told).unwrap_err();
    assert!(
        folder.plain(&report).starts_with("exp1.toml:1:11: can't read the configuration robot.toml"),
        "{report}"
    );
    database.set(&[("modules.a.params.x", "2")]).unwrap();
    assert_eq!(database.current().modules().len(), 1);
    fs::write(folder.path("robot.toml"), "[modules.a]\n[modules.b]\n").unwrap();
    assert_eq!(next(&told).unwrap(), ["modules.b: - -> {}"]);
}

#[test]
fn what_is_told_may_panic_and_what_is_saved_is_no_edit() {
    let folder = folder("told");
    let database = Database::open(folder.path("exp1.toml"), options(&[])).unwrap();
    let (sender, told) = mpsc::channel();
    let _watch = database
        .watch(move |result| {
            sender.send(result).unwrap();
            panic!("whoever is told fails");
        })
        .unwrap();
    for period in ["10ms", "20ms"] {
        database.set(&[("modules.a.params.x", period)]).unwrap();
        database.save(SaveTo::Origin).unwrap();
        fs::write(
            folder.path("exp1.toml"),
            format!("include = \"robot.toml\"\n[loop]\nperiod = \"{period}\"\nhang = \"1s\"\n"),
        )
        .unwrap();
        let changes = next(&told).unwrap();
        assert!(changes.iter().all(|change| change.starts_with("loop")), "{changes:?}");
    }
}
