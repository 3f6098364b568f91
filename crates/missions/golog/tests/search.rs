//! Search for plans.

use slate_golog::*;

use crate::common::{Robot, executor, theory};

/// A robot in a row of rooms; a door may be shut.
const ROOMS: &str = "
domain room = 0..4
condition shut
fluent at: room = 0
action left possible if at > 0 at becomes at - 1
action right possible if at < 4 and not (at == 2 and shut) at becomes at + 1
action jump possible if at == 0 at becomes 4
";

fn rooms(program: &str) -> GologExecutor {
    executor(&format!("{ROOMS} procedure main {{ {program} }}"))
}

#[test]
fn a_search_acts_only_when_a_plan_reaches_the_end() {
    let (mut executor, mut robot) = (rooms("search { left | right; right; test at == 2 }"), Robot::default());
    robot.set_condition("shut", false);
    assert_eq!(robot.ticks(&mut executor, 6), GologOutcome::Succeeded);
    assert_eq!(robot.log, ["start right", "end right", "start right", "end right"]);
    let (mut executor, mut robot) = (rooms("search { right; test at == 3 } | jump"), Robot::default());
    robot.set_condition("shut", false);
    robot.tick(&mut executor);
    assert_eq!(robot.log, ["start jump"], "a program without a plan is not begun");
}

#[test]
fn a_change_from_outside_makes_it_search_again() {
    let program = "search { repeat { right }; test at == 3 }";
    let (mut executor, mut robot) = (rooms(program), Robot::default());
    robot.set_condition("shut", false);
    robot.tick(&mut executor);
    robot.set_condition("shut", true);
    robot.ticks(&mut executor, 9);
    assert_eq!(robot.log, ["start right", "end right"], "no plan leads through the door");
    robot.set_condition("shut", false);
    assert_eq!(robot.ticks(&mut executor, 9), GologOutcome::Succeeded);
}

#[test]
fn a_search_ends_although_the_program_could_go_on_for_ever() {
    let (mut executor, mut robot) =
        (rooms("search { repeat { left | right }; test at == 4 }"), Robot::default());
    robot.set_condition("shut", false);
    assert_eq!(robot.ticks(&mut executor, 9), GologOutcome::Succeeded);
    assert_eq!(robot.log.len(), 8);
}

#[test]
fn a_long_search_spans_ticks_and_goes_on_as_if_alone() {
    let text = "domain d = 0..9 fluent n(d): d = 0 action up(i: d) possible if n(i) < 9 n(i) becomes n(i) + 1
        procedure main { search { repeat { pick i: d { up(i) } }; test n(0) == 9 and n(1) == 9 and n(2) == 3 } }";
    let theory = std::sync::Arc::new(theory(text));
    let limits = SearchLimits { transitions_per_tick: 100, most_transitions: 20_000 };
    let (mut executor, mut robot) = (GologExecutor::new(theory.clone(), limits), Robot::default());
    robot.ticks(&mut executor, 3);
    assert!(executor.is_searching());
    let state = executor.state();
    let mut resumed = GologExecutor::restore(theory, limits, &state).unwrap();
    assert!(resumed.is_searching());
    let mut other = robot.clone();
    for _ in 0..200 {
        if executor.tick(&mut robot).is_err() {
            assert!(resumed.tick(&mut other).is_err());
            return;
        }
        resumed.tick(&mut other).unwrap();
        assert_eq!((executor.state(), &robot.log), (resumed.state(), &other.log));
    }
}

#[test]
fn a_search_beyond_its_limit_is_refused_with_words() {
    let limits = SearchLimits { transitions_per_tick: 10, most_transitions: 25 };
    let text =
        format!("{ROOMS}procedure main {{ search {{ repeat {{ left | right }}; test at == 4 and shut }} }}");
    let mut executor = GologExecutor::new(theory(&text).into(), limits);
    let mut robot = Robot::default();
    let error = (0..9).find_map(|_| executor.tick(&mut robot).err());
    let said = error.map_or("it ended".into(), |error| error.to_string());
    assert!(said.contains("no plan within 25 transitions") || said == "it ended", "{said}");
}
