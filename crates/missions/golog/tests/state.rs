//! Saved states and changed theories.

use std::sync::Arc;

use slate_golog::*;

use crate::common::{Robot, theory};

const MISSION: &str = "
domain place = desk, shelf, window
condition near
fluent met = false
fluent visited(place) = false
action go(p: place) visited(p) becomes true
action pause met becomes true
action forget performs nothing met becomes false
procedure tour { for p: place { go(p) } }
procedure main {
    interrupt near and not met { pause } >> interrupt met and not near { forget } >> {
        search { repeat { pick p: place { test not visited(p); go(p) } }; test visited(shelf) };
        tour
    }
}
";

fn restored(text: &str, state: &GologState) -> Result<GologExecutor, GologStateError> {
    GologExecutor::restore(Arc::new(theory(text)), SearchLimits::default(), state)
}

#[test]
fn a_restored_run_goes_on_as_if_it_had_not_stopped() {
    let mut executor = GologExecutor::new(Arc::new(theory(MISSION)), SearchLimits::default());
    let mut robot = Robot::default();
    for tick in 0..60 {
        let text = serde_json::to_string(&executor.state()).unwrap();
        let state: GologState = serde_json::from_str(&text).unwrap();
        executor = restored(MISSION, &state).unwrap();
        assert_eq!(executor.state(), state, "tick {tick}");
        robot.set_condition("near", tick % 11 < 4);
        robot.tick(&mut executor);
    }
    let mut whole = GologExecutor::new(Arc::new(theory(MISSION)), SearchLimits::default());
    let mut other = Robot::default();
    for tick in 0..60 {
        other.set_condition("near", tick % 11 < 4);
        other.tick(&mut whole);
    }
    assert_eq!(executor.outcome(), GologOutcome::Succeeded);
    assert_eq!((executor.state(), robot.log), (whole.state(), other.log));
}

#[test]
fn a_changed_theory_takes_over_where_the_program_is() {
    let text = "fluent n: 0..9 = 0 action a n becomes n + 1 action b procedure main { a; a; b }";
    let mut executor = GologExecutor::new(Arc::new(theory(text)), SearchLimits::default());
    let mut robot = Robot::default();
    robot.ticks(&mut executor, 3);
    let state = executor.state();
    let later = "fluent n: 0..9 = 5 action c action a n becomes n + 1 # more\nprocedure main { a; a; c; c }";
    let mut changed = restored(later, &state).unwrap();
    assert_eq!(changed.fluent("n").as_deref(), Some("1"));
    changed.wake();
    robot.ticks(&mut changed, 8);
    assert_eq!(robot.log[3..], ["end a", "start c", "end c", "start c", "end c"]);
    let earlier = "fluent n: 0..9 = 0 action a n becomes n + 1 action b procedure main { b; a; a; b }";
    let said = restored(earlier, &state).unwrap_err().to_string();
    assert!(
        said.contains("the program is at line 1, `a; b`") || said.contains("which does not exist"),
        "{said}"
    );
    let without = "action b procedure main { b }";
    let said = restored(without, &state).unwrap_err().to_string();
    assert!(said.contains("the action `a` does not exist"), "{said}");
}

#[test]
fn a_damaged_state_is_refused() {
    let mut executor = GologExecutor::new(Arc::new(theory(MISSION)), SearchLimits::default());
    Robot::default().ticks(&mut executor, 1);
    let text = serde_json::to_string(&executor.state()).unwrap();
    for (from, to) in [
        ("\"Performing\":0", "\"Performing\":7"),
        ("\"program\":", "\"program\":9"),
        ("\"Plan\":", "\"Plan\":8"),
    ] {
        assert!(text.contains(from), "{text}");
        let state: GologState = serde_json::from_str(&text.replace(from, to)).unwrap();
        assert!(restored(MISSION, &state).is_err(), "{from}");
    }
}

#[test]
fn a_long_run_keeps_its_memory() {
    let text = "condition c fluent n: 0..3 = 0
        action up performs nothing possible if n < 3 n becomes n + 1
        action zero performs nothing n becomes 0
        procedure main { while true { pick i: 0..3 { test i == n; if n < 3 { up } else { zero } } } }";
    let mut executor = GologExecutor::new(Arc::new(theory(text)), SearchLimits::default());
    let mut robot = Robot::default();
    robot.ticks(&mut executor, 300);
    assert!(executor.steps() > 10_000);
    let size = serde_json::to_string(&executor.state()).unwrap().len();
    assert!(size < 2000, "{size}");
}
