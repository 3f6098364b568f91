//! Handlers of changes: their order, time and permissions.

use std::sync::{Mutex, mpsc};

use super::changes::{database, shown};
use super::*;

const TEXT: &str =
    "[modules.a]\nparams = { x = 1, y = 1 }\n[modules.ab]\nparams.x = 1\n[modules.\"r2/b\"]\nparams.x = 1\n";

#[derive(Clone, Default)]
struct Calls(Arc<Mutex<Vec<String>>>);

impl Calls {
    fn add(&self, call: String) {
        self.0.lock().unwrap().push(call);
    }

    fn take(&self) -> Vec<String> {
        std::mem::take(&mut self.0.lock().unwrap())
    }

    fn subscribe(&self, database: &Database, name: &'static str, path: &str) -> Subscription {
        let calls = self.clone();
        let handler = move |_: &Database, changes: &[Change]| {
            calls.add(format!("{name} {}", shown(changes).join(", ")));
        };
        database.subscribe(path, handler).unwrap()
    }
}

#[test]
fn handlers_get_the_changes_below_their_prefix_in_order() {
    let (database, calls) = (database(TEXT, &[]), Calls::default());
    let _b = calls.subscribe(&database, "b", "modules.a.params");
    let all = calls.subscribe(&database, "all", "");
    let _x = calls.subscribe(&database, "x", "modules.a.params.x");
    let _r2 = calls.subscribe(&database, "r2", "robots.r2");
    let _nobody = calls.subscribe(&database, "nobody", "modules.a.par");
    let changes = [("modules.a.params.y", "2"), ("modules.ab.params.x", "2"), ("modules.a.params.x", "2")];
    database.set(&changes).unwrap();
    let (x, y) = ("modules.a.params.x: 1 -> 2", "modules.a.params.y: 1 -> 2");
    assert_eq!(
        calls.take(),
        [format!("b {x}, {y}"), format!("all {x}, {y}, modules.ab.params.x: 1 -> 2"), format!("x {x}")]
    );
    database.set(&changes).unwrap();
    assert!(calls.take().is_empty(), "nothing has changed");
    drop(all);
    database.set(&[("robots.r2.modules.b.params.x", "5")]).unwrap();
    assert_eq!(calls.take(), ["r2 modules.\"r2/b\".params.x: 1 -> 5"]);
    assert!(database.subscribe("a..b", |_, _| ()).is_err());
}

#[test]
fn panicking_handler_stops_no_other_handler() {
    let (database, calls) = (database(TEXT, &[]), Calls::default());
    let bad = database.subscribe("", |_, _| panic!("a handler that fails")).unwrap();
    let _good = calls.subscribe(&database, "good", "");
    for value in ["2", "3"] {
        database.set(&[("modules.a.params.x", value)]).unwrap();
    }
    assert_eq!(bad.panics(), 2);
    assert_eq!(calls.take().len(), 2);
}

#[test]
fn a_handler_may_read_change_and_subscribe() {
    let (database, calls) = (database(TEXT, &[]), Calls::default());
    let seen = calls.clone();
    let mut late = Vec::new();
    let _follows = database
        .subscribe("modules.a.params.x", move |database, changes| {
            let after = changes[0].after.as_ref().unwrap().to_string();
            assert_eq!(database.get("modules.a.params.x").unwrap()[0].value.to_string(), after);
            database.set(&[("modules.a.params.y", after.as_str())]).unwrap();
            seen.add("followed".into());
            late.push(seen.subscribe(database, "late", "modules.a.params.y"));
        })
        .unwrap();
    let _all = calls.subscribe(&database, "all", "");
    database.set(&[("modules.a.params.x", "7")]).unwrap();
    // All see the changes in one order, also the ones made by a handler.
    let (x, y) = ("modules.a.params.x: 1 -> 7", "modules.a.params.y: 1 -> 7");
    assert_eq!(
        calls.take(),
        ["followed".into(), format!("all {x}"), format!("all {y}"), format!("late {y}")]
    );
}

#[test]
fn a_handler_may_end_any_subscription() {
    let (database, calls) = (database(TEXT, &[]), Calls::default());
    let (sender, receiver) = mpsc::channel::<Subscription>();
    let ender = database.subscribe("", move |_, _| receiver.try_iter().for_each(drop)).unwrap();
    sender.send(calls.subscribe(&database, "ended", "")).unwrap();
    sender.send(ender).unwrap();
    let _last = calls.subscribe(&database, "last", "");
    for value in ["2", "3"] {
        database.set(&[("modules.ab.params.x", value)]).unwrap();
    }
    let lines = ["last modules.ab.params.x: 1 -> 2", "last modules.ab.params.x: 2 -> 3"];
    assert_eq!(calls.take(), lines);
}

#[test]
fn concurrent_changes_are_made_and_reported_in_one_order() {
    let (database, calls) = (database(TEXT, &[]), Calls::default());
    let _x = calls.subscribe(&database, "x", "modules.a.params.x");
    std::thread::scope(|scope| {
        for thread in 0..4 {
            let database = &database;
            scope.spawn(move || {
                for i in 0..25 {
                    let value = (thread * 100 + i + 2).to_string();
                    database.set(&[("modules.a.params.x", value.as_str())]).unwrap();
                }
            });
        }
    });
    let calls = calls.take();
    assert_eq!(calls.len(), 100);
    // Each change starts from what the one before ended with.
    let mut value = "1".to_owned();
    for call in calls {
        let (before, after) =
            call.strip_prefix("x modules.a.params.x: ").unwrap().split_once(" -> ").unwrap();
        assert_eq!(before, value);
        value = after.into();
    }
    assert_eq!(database.get("modules.a.params.x").unwrap()[0].value.to_string(), value);
}
