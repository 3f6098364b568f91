//! Files that are edited while the agent runs.

use std::sync::mpsc::{self, Receiver};
use std::time::Duration;

use super::changes::shown;
use slate_configuration::Edit;

use super::*;

type Told = Receiver<Result<Edit, Report>>;

fn watched(folder: &Folder) -> (Database, slate_configuration::Watch, Told) {
    let database = Database::open(folder.path("exp1.toml"), options(&["log.level=warn"])).unwrap();
    let (sender, told) = mpsc::channel();
    let watch = database.watch(move |result| drop(sender.send(result))).unwrap();
    (database, watch, told)
}

/// What was told next; it comes within a second or so, and a slow computer gets a minute.
#[track_caller]
fn next(told: &Told) -> Result<Vec<String>, Report> {
    told.recv_timeout(Duration::from_secs(60)).unwrap().map(|edit| shown(&edit.changes))
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
    assert!(
        folder
            .plain(&report)
            .starts_with("exp1.toml:4:8: expected a duration such as \"200ms\", found \"soon\""),
        "{report}"
    );
    assert!(report.render(false).contains("hang = \"soon\"\n   ·        ───┬──"), "{report:?}");
    assert!(Arc::ptr_eq(&before, &database.current()));

    // It's told once, and changes at run time continue from what holds.
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
    assert_eq!(
        next(&told).unwrap_err().to_string(),
        "change:1:9: no module is called `a` (it was there when this was changed: put it back, or revert the change with `slate config revert modules.a`)"
    );
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
fn handlers_may_panic_and_own_save_is_no_edit() {
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

#[test]
fn an_edit_of_a_run_time_setting_is_reported_and_kept() {
    let folder = folder("covered");
    let (database, _watch, told) = watched(&folder);
    database.set(&[("modules.a.params.x", "5"), ("modules.a.params.y", "6")]).unwrap();
    fs::write(folder.path("robot.toml"), "[modules.a]\nparams.x = 2\n").unwrap();
    let edit = told.recv_timeout(Duration::from_secs(60)).unwrap().unwrap();
    assert!(edit.changes.is_empty(), "{:?}", edit.changes);
    assert_eq!(shown(&edit.covered), ["modules.a.params.x: 5 -> 2"]);
    let refused = database.save(SaveTo::Origin).unwrap_err().to_string();
    assert!(
        refused.contains("`modules.a.params.x` was set to 5 at run time, and a file was then edited to 2"),
        "{refused}"
    );
    assert_eq!(fs::read_to_string(folder.path("robot.toml")).unwrap(), "[modules.a]\nparams.x = 2\n");
    // Set again, it is meant.
    database.set(&[("modules.a.params.x", "7")]).unwrap();
    assert!(database.covered().is_empty());
    database.save(SaveTo::Origin).unwrap();
    assert!(fs::read_to_string(folder.path("robot.toml")).unwrap().contains("params.x = 7"));
    // Taken back, what the file says holds.
    database.set(&[("modules.a.params.x", "8")]).unwrap();
    fs::write(folder.path("robot.toml"), "[modules.a]\nparams.x = 3\nparams.y = 6\n").unwrap();
    let edit = told.recv_timeout(Duration::from_secs(60)).unwrap().unwrap();
    assert_eq!(shown(&edit.covered), ["modules.a.params.x: 8 -> 3"]);
    assert_eq!(shown(&database.take_back("modules.a.params").unwrap()), ["modules.a.params.x: 8 -> 3"]);
    assert!(database.covered().is_empty());
}

#[test]
fn corrected_file_is_reported() {
    let folder = folder("mended");
    let (_database, _watch, told) = watched(&folder);
    let good = fs::read_to_string(folder.path("exp1.toml")).unwrap();
    fs::write(folder.path("exp1.toml"), "nonsense").unwrap();
    assert!(told.recv_timeout(Duration::from_secs(60)).unwrap().is_err());
    fs::write(folder.path("exp1.toml"), good).unwrap();
    assert!(told.recv_timeout(Duration::from_secs(60)).unwrap().unwrap().changes.is_empty());
}

#[test]
fn a_pending_value_survives_changes_of_its_setting() {
    let folder = folder("waits");
    let database = Database::open(folder.path("exp1.toml"), options(&[])).unwrap();
    database.wait_with(|_, changes| {
        let waits = |change: &Change| {
            change.path.starts_with("loop") || matches!(change.names(), [_, module, ..] if module != "a")
        };
        (0..changes.len()).filter(|place| waits(&changes[*place])).collect()
    });
    let edit = |main: &str, robot: &str| {
        fs::write(folder.path("exp1.toml"), format!("include = \"robot.toml\"\n{main}")).unwrap();
        fs::write(folder.path("robot.toml"), robot).unwrap();
        shown(&database.reload().unwrap().commit().unwrap())
    };
    let waiting = || shown(&database.waiting());
    // The period is another one, the timeout is new, and so is a whole module.
    let changed = edit(
        "loop.period = \"7ms\"\nloop.hang = \"1s\"",
        "[modules.a]\nparams.x = 2\n[modules.b.params]\ny = [1, 2]\n",
    );
    assert_eq!(changed, ["modules.a.params.x: 1 -> 2"]);
    let all = waiting();
    assert!(all.contains(&"modules.b.params.y: - -> [1, 2]".to_owned()), "{all:?}");
    assert!(all.contains(&"loop.period: \"20ms\" -> \"7ms\"".to_owned()), "{all:?}");
    let now = database.current();
    assert_eq!((now.period().value, now.modules().len()), (20_000_000, 1));
    assert_eq!(database.get("loop.period").unwrap()[0].origin.to_string(), "until the next start");
    assert!(database.get("modules.b").unwrap().is_empty());
    // What is set meanwhile changes nothing of it, also when it is saved.
    database.set(&[("modules.a.params.x", "3")]).unwrap();
    database.save(SaveTo::Origin).unwrap();
    assert_eq!(waiting(), all);
    assert_eq!(database.current().period().value, 20_000_000);
    let start = Database::open(folder.path("exp1.toml"), options(&[])).unwrap();
    assert_eq!(start.current().modules().len(), 2);
    assert_eq!(start.get("modules.a.params.x").unwrap()[0].value.as_f64(), Some(3.0));
    // As it was before, nothing waits.
    assert!(edit("[loop]\nperiod = \"20ms\"\n", "[modules.a]\nparams.x = 3\n").is_empty());
    assert!(waiting().is_empty() && database.diff().is_empty());
    // An edit with an error changes nothing of what waits either.
    edit("loop.period = \"5ms\"", "[modules.a]\nparams.x = 3\n");
    fs::write(folder.path("exp1.toml"), "include = \"robot.toml\"\nloop.period = 5\n").unwrap();
    assert!(database.reload().is_err());
    assert_eq!(waiting(), ["loop.period: \"20ms\" -> \"5ms\""]);
}
