use slate_blackboard::interface::Value;
use slate_module::Level;
use slate_runtime::configuration::Database;
use slate_runtime::{Agent, Options};

use crate::snapshot::common::{number, plugins};
use crate::snapshot::support::{ROBOT, options, resumed, robot, seen, steps};

#[test]
fn an_agent_of_another_process_goes_on_from_any_moment() {
    let mut straight = robot(ROBOT);
    steps(&mut straight, 60);
    let expected = seen(&mut straight);
    for moment in 0..60 {
        let mut first = robot(ROBOT);
        steps(&mut first, moment);
        let snapshot = first.composer().snapshot().unwrap();
        let before = seen(&mut first);
        drop(first);
        let workers = moment % 2;
        let mut second = resumed(&snapshot, Options { workers, always_help: true, ..options() });
        assert_eq!(seen(&mut second), before, "after {moment} cycles");
        steps(&mut second, 60 - moment);
        assert_eq!(seen(&mut second), expected, "after {moment} cycles");
    }
}

#[test]
fn an_agent_goes_back_in_its_own_process_as_often_as_one_likes() {
    let mut agent = robot(ROBOT);
    steps(&mut agent, 30);
    let snapshot = agent.composer().snapshot().unwrap();
    assert!(snapshot.messages() > 0, "the test is about messages that wait");
    steps(&mut agent, 27);
    let expected = seen(&mut agent);
    for wander in [0, 1, 40] {
        steps(&mut agent, wander);
        agent.restore(&snapshot).unwrap();
        steps(&mut agent, 27);
        assert_eq!(seen(&mut agent), expected, "after {wander} cycles more");
    }
}

#[test]
fn it_takes_no_part_in_the_run() {
    let (mut quiet, mut saved) = (robot(ROBOT), robot(ROBOT));
    for _ in 0..50 {
        steps(&mut quiet, 1);
        steps(&mut saved, 1);
        saved.composer().snapshot().unwrap();
    }
    assert_eq!(seen(&mut saved), seen(&mut quiet));
}

#[test]
fn run_time_changes_are_part_of_snapshot() {
    let mut agent = robot(ROBOT);
    steps(&mut agent, 5);
    agent
        .database()
        .unwrap()
        .set(&[("modules.counter.params.nan_at", "22"), ("modules.dice.enabled", "false")])
        .unwrap();
    // On the blackboard alone, so in no configuration.
    agent.board().write("counter/params/hang_ms", &Value::Integer(7), agent.now()).unwrap();
    agent.logger().set_level(Some("relay"), Level::Trace);
    // Not yet seen by the module.
    let snapshot = agent.composer().snapshot().unwrap();
    let mut second = resumed(&snapshot, options());
    assert_eq!(number(&second, "counter/params/hang_ms"), 7.0);
    assert_eq!(second.logger().level("relay"), Level::Trace);
    let set = second.database().unwrap().get("modules.counter.params.nan_at").unwrap();
    assert_eq!(set[0].value.as_integer(), Some(22));
    steps(&mut agent, 30);
    steps(&mut second, 30);
    assert_eq!(seen(&mut second), seen(&mut agent));
    assert_eq!(agent.counts("dice").unwrap().0, 5, "it was switched off");
}

/// Links that were changed at run time: another source, one with a condition, a parameter and a switch that follow.
#[test]
fn links_that_were_changed_at_run_time_come_along() {
    let mut agent = robot(ROBOT);
    steps(&mut agent, 5);
    let before = agent.composer().snapshot().unwrap();
    let changes = [
        ("links.\"driver/input\"", "\"relay/output\""),
        ("links.\"relay/input\"", "{ from = \"counter/number\", every = 3 }"),
    ];
    agent.database().unwrap().set(&changes).unwrap();
    steps(&mut agent, 4);
    for moment in 0..8 {
        steps(&mut agent, 1);
        let snapshot = agent.composer().snapshot().unwrap();
        let mut second = resumed(&snapshot, options());
        let mut third = resumed(&snapshot, options());
        assert_eq!(seen(&mut second), seen(&mut agent), "cycle {moment}");
        steps(&mut second, 30);
        steps(&mut third, 30);
        assert_eq!(seen(&mut second), seen(&mut third));
    }
    let snapshot = agent.composer().snapshot().unwrap();
    let mut second = resumed(&snapshot, options());
    // In its own process it gets the links back that it had before, and then these again.
    agent.restore(&before).unwrap();
    let mut straight = robot(ROBOT);
    steps(&mut straight, 25);
    steps(&mut agent, 20);
    assert_eq!(seen(&mut agent), seen(&mut straight));
    agent.restore(&snapshot).unwrap();
    steps(&mut agent, 20);
    steps(&mut second, 20);
    assert_eq!(seen(&mut agent), seen(&mut second));
}

#[test]
fn a_running_agent_gets_the_settings_of_its_snapshot_back() {
    let mut agent = robot(ROBOT);
    let database = agent.database().unwrap().clone();
    let value = || database.get("modules.counter.params.nan_at").unwrap()[0].value.as_integer();
    database.set(&[("modules.counter.params.nan_at", "40")]).unwrap();
    steps(&mut agent, 3);
    let snapshot = agent.composer().snapshot().unwrap();
    database.set(&[("modules.counter.params.nan_at", "4")]).unwrap();
    steps(&mut agent, 3);
    agent.restore(&snapshot).unwrap();
    assert_eq!((value(), number(&agent, "counter/params/nan_at")), (Some(40), 40.0));
    let mut straight = resumed(&snapshot, options());
    steps(&mut agent, 50);
    steps(&mut straight, 50);
    assert_eq!(seen(&mut agent), seen(&mut straight));
}

#[test]
fn settings_outside_of_snapshot_return_to_files() {
    let mut agent = robot(ROBOT);
    let database = agent.database().unwrap().clone();
    steps(&mut agent, 3);
    let snapshot = agent.composer().snapshot().unwrap();
    let changes = [
        ("modules.counter.params.nan_at", "40"),
        ("modules.counter.params.panic_at", "41"),
        ("modules.dice.enabled", "false"),
        ("links.\"relay/input\"", "{ from = \"counter/number\", every = 3 }"),
    ];
    database.set(&changes).unwrap();
    steps(&mut agent, 3);
    agent.restore(&snapshot).unwrap();
    let diff: Vec<_> = database.diff().into_iter().map(|difference| difference.path).collect();
    assert!(diff.is_empty(), "{diff:?}");
    assert_eq!(number(&agent, "counter/params/nan_at"), 0.0);
    assert!(!agent.composer().snapshot().unwrap().configuration_text().contains("nan_at"));
    let mut straight = resumed(&snapshot, options());
    steps(&mut agent, 20);
    steps(&mut straight, 20);
    assert_eq!(seen(&mut agent), seen(&mut straight));
}

#[test]
fn settings_of_files_alone_hold_no_more() {
    let mut agent = robot(ROBOT);
    steps(&mut agent, 5);
    let snapshot = agent.composer().snapshot().unwrap();
    let other = ROBOT.replace("panic_at = 13", "panic_at = 13\nparams.nan_at = 17");
    let mut second = robot(&other);
    second.restore(&snapshot).unwrap();
    let said = second.database().unwrap().get("modules.counter.params.nan_at").unwrap();
    let says = (number(&second, "counter/params/nan_at"), said[0].value.as_integer());
    assert_eq!(says, (0.0, Some(0)), "the configuration says what the robot has");
    steps(&mut agent, 30);
    steps(&mut second, 30);
    assert_eq!(seen(&mut agent), seen(&mut second));
}

#[test]
fn an_agent_may_go_on_with_parameters_of_its_own() {
    let mut agent = robot(ROBOT);
    steps(&mut agent, 5);
    let snapshot = agent.composer().snapshot().unwrap();
    let other = ROBOT.replace("panic_at = 13", "panic_at = 8");
    let database = Database::from_text("robot.toml", &other, Default::default()).unwrap();
    let mut second = Agent::load_with(&database, &plugins(), options()).unwrap();
    second.restore_under_own_settings(&snapshot).unwrap();
    assert_eq!(number(&second, "counter/params/panic_at"), 8.0);
    assert_eq!(number(&second, "counter/number/value"), 5.0);
    steps(&mut second, 3);
    assert_eq!(second.counts("counter").unwrap().2, 1);
}

#[test]
fn real_actuators_wait_for_a_person() {
    let mut agent = robot(ROBOT);
    steps(&mut agent, 5);
    let snapshot = agent.composer().snapshot().unwrap();
    let mut second = resumed(&snapshot, Options { armed: false, ..options() });
    steps(&mut second, 3);
    assert_eq!(number(&second, "wheel/command/value"), 0.0);
    assert!(second.arm());
    steps(&mut second, 3);
    assert_ne!(number(&second, "wheel/command/value"), 0.0);
    // A stop comes along, also where actuators arm themselves.
    agent.stop_actuators("smoke");
    let mut stopped = resumed(&agent.composer().snapshot().unwrap(), options());
    steps(&mut stopped, 3);
    assert_eq!(number(&stopped, "wheel/command/value"), 0.0);
    assert_eq!(stopped.composer().actuators(), [("wheel".to_owned(), Some("smoke".to_owned()))]);
}
