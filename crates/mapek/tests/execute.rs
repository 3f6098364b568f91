//! Execution of the actions that Execute receives.
#![allow(clippy::panic, reason = "a test")]

use crate::common;

use slate_interfaces::Twist2;
use slate_mapek::{
    ActionKind, ActionRequest, Ending, ExecuteBlock, ExecuteStatus, PlanStep, Planned, Route, WaitingAction,
    WaitingActions,
};
use slate_module::testing::Fixture;
use slate_module::{Outcome, Priority, Sequence, Text};

use common::{Actions, Drive, Stumble, Swerve, Tour, planned, reflex};

type Execute = Fixture<ExecuteBlock<Actions>>;

fn speed(execute: &Execute) -> Option<f64> {
    execute.output::<Twist2>("wheels").map(|twist| twist.linear)
}

/// Ticks, and gives the speed that was commanded.
fn step(execute: &mut Execute) -> Option<f64> {
    execute.advance(20_000_000);
    assert_eq!(execute.tick(), Outcome::Ok);
    speed(execute)
}

fn status(execute: &Execute) -> ExecuteStatus {
    let Some(status) = execute.output("status") else { panic!("the status did not change") };
    status
}

fn endings(status: &ExecuteStatus) -> Vec<(u64, Ending)> {
    status.ended.iter().map(|ended| (ended.ticket, ended.ending)).collect()
}

#[test]
fn nothing_to_do_sends_no_command() {
    let mut execute = Execute::new();
    assert_eq!(step(&mut execute), None);
    assert_eq!(status(&execute).route, Route::IDLE);
}

#[test]
fn the_status_is_written_when_it_changes_and_once_at_the_start() {
    let mut execute = Execute::new();
    step(&mut execute);
    assert!(execute.output::<ExecuteStatus>("status").is_some());
    step(&mut execute);
    assert!(execute.output::<ExecuteStatus>("status").is_none());
    execute.push("plan", planned(Drive::request((1.0, 3.0)), 1, 0));
    step(&mut execute);
    assert_eq!(status(&execute).running.as_str(), "Drive");
    step(&mut execute);
    assert!(execute.output::<ExecuteStatus>("status").is_none());
}

/// Kind, arguments, ticket, rank, route and age in seconds of the waiting actions.
type Waits = Vec<(String, Vec<f64>, u64, i32, Route, f64)>;

#[test]
fn changes_of_waiting_actions_are_published() {
    let mut execute = Execute::new();
    let waits = |execute: &Execute| -> Option<Waits> {
        execute.read("waiting", |waiting: &WaitingActions| {
            let line = |one: &WaitingAction| {
                let arguments = one.action.arguments.to_vec();
                (
                    one.action.kind.as_str().to_owned(),
                    arguments,
                    one.ticket,
                    one.rank,
                    one.route,
                    one.queued as f64 * 1e-9,
                )
            };
            waiting.actions.iter().map(line).collect()
        })
    };
    step(&mut execute);
    assert_eq!(waits(&execute), Some(Vec::new()), "nothing waits at the start");
    execute.push("plan", planned(Drive::request((1.0, 3.0)), 1, 0));
    step(&mut execute);
    assert_eq!(waits(&execute), None, "it runs at once");
    execute.push("plan", planned(Drive::request((2.0, 4.0)), 2, 0));
    step(&mut execute);
    let told = waits(&execute).unwrap();
    assert_eq!(told.len(), 1);
    let (kind, arguments, ticket, rank, route, queued) = &told[0];
    assert_eq!((kind.as_str(), arguments.as_slice(), *ticket, *rank), ("Drive", &[2.0, 4.0][..], 2, 0));
    assert!(*route == Route::DELIBERATIVE && (queued - 0.06).abs() < 1e-9, "{queued}");
    step(&mut execute);
    assert_eq!(waits(&execute), None, "nothing has changed");
    // The first reflex runs, the second waits, and the plan is cleared.
    execute.push("reflexes", reflex(Drive::request((0.7, 1.0)), 5));
    execute.push("reflexes", reflex(Drive::request((0.5, 1.0)), 3));
    step(&mut execute);
    let told = waits(&execute).unwrap();
    assert_eq!(told.len(), 1, "{told:?}");
    assert_eq!((told[0].0.as_str(), told[0].3, told[0].4), ("Drive", 3, Route::REACTIVE));
}

#[test]
fn the_running_action_renews_its_command_in_each_cycle() {
    let mut execute = Execute::new();
    execute.push("plan", planned(Drive::request((1.5, 3.0)), 1, 0));
    for _ in 0..3 {
        assert_eq!(step(&mut execute), Some(1.5));
        assert_eq!(execute.priority("wheels"), Some(Priority::Plan as u32));
    }
    assert_eq!(step(&mut execute), None);
    assert_eq!(endings(&status(&execute)), [(1, Ending::COMPLETED)]);
}

#[test]
fn when_an_action_is_done_the_next_begins_in_the_same_cycle() {
    let mut execute = Execute::new();
    for (ticket, speed) in [(1, 1.0), (2, 2.0), (3, 3.0)] {
        execute.push("plan", planned(Drive::request((speed, 1.0)), ticket, 0));
    }
    assert_eq!(
        [step(&mut execute), step(&mut execute), step(&mut execute)],
        [Some(1.0), Some(2.0), Some(3.0)]
    );
}

#[test]
fn a_macro_action_is_decomposed_without_losing_a_cycle() {
    let mut execute = Execute::new();
    execute.push("plan", planned(Tour::request(()), 1, 0));
    assert_eq!(step(&mut execute), Some(1.0));
    assert_eq!(status(&execute).tree.as_str(), "Tour > Drive");
    assert_eq!(step(&mut execute), Some(2.0));
    assert_eq!(status(&execute).tree.as_str(), "Tour > Swerve");
    assert_eq!([step(&mut execute), step(&mut execute)], [Some(3.0), Some(3.0)]);
    assert_eq!(step(&mut execute), None);
    assert_eq!(status(&execute).completed, 1);
}

#[test]
fn a_reflex_takes_over_in_the_cycle_in_which_it_comes() {
    let mut execute = Execute::new();
    execute.push("plan", planned(Drive::request((1.0, 9.0)), 1, 0));
    execute.push("plan", planned(Drive::request((2.0, 9.0)), 2, 0));
    step(&mut execute);
    execute.push("reflexes", reflex(Swerve::request((-1.0, 2.0)), 0));
    assert_eq!(step(&mut execute), Some(-1.0));
    assert_eq!(execute.priority("wheels"), Some(Priority::Reflex as u32));
    let status = status(&execute);
    assert_eq!((status.route, status.epoch, status.replan.get()), (Route::REACTIVE, 1, true));
    assert_eq!((status.cancelled, status.reflexes, status.route_switches), (2, 1, 1));
    assert_eq!(endings(&status), [(2, Ending::CANCELLED), (1, Ending::CANCELLED)]);
}

#[test]
fn a_plan_from_before_a_reflex_is_dropped_in_any_cycle() {
    let mut execute = Execute::new();
    execute.push("plan", planned(Drive::request((1.0, 9.0)), 1, 0));
    execute.push("reflexes", reflex(Swerve::request((-1.0, 1.0)), 0));
    assert_eq!(step(&mut execute), Some(-1.0));
    assert_eq!(status(&execute).dropped, 1);
    assert_eq!(step(&mut execute), None);
    // A plan of the new epoch is taken.
    execute.push("plan", planned(Drive::request((2.0, 9.0)), 2, 1));
    assert_eq!(step(&mut execute), Some(2.0));
    let status = status(&execute);
    assert_eq!((status.route, status.replan.get(), status.route_switches), (Route::DELIBERATIVE, false, 1));
}

#[test]
fn a_repeated_reflex_renews_the_running_one() {
    let mut execute = Execute::new();
    for speed in [-1.0, -2.0, -3.0] {
        execute.push("reflexes", reflex(Swerve::request((speed, 2.0)), 0));
        assert_eq!(step(&mut execute), Some(speed));
    }
    let status = status(&execute);
    assert_eq!((status.reflexes, status.high, status.completed, status.cancelled), (3, 0, 0, 0));
}

#[test]
fn when_a_planned_action_fails_the_plan_is_given_up() {
    let mut execute = Execute::new();
    execute.push("plan", planned(Stumble::request((1.0, 1.0)), 1, 0));
    execute.push("plan", planned(Drive::request((2.0, 9.0)), 2, 0));
    assert_eq!(step(&mut execute), Some(1.0));
    assert_eq!(step(&mut execute), None);
    let status = status(&execute);
    assert_eq!((status.epoch, status.failed, status.cancelled, status.replan.get()), (1, 1, 1, true));
    assert_eq!(endings(&status), [(1, Ending::FAILED), (2, Ending::CANCELLED)]);
}

#[test]
fn replacing_a_plan_first_cancels_the_running_action() {
    let mut execute = Execute::new();
    execute.push("plan", planned(Drive::request((1.0, 9.0)), 1, 0));
    step(&mut execute);
    let replace = Planned { step: PlanStep::REPLACE, ..planned(Drive::request((2.0, 9.0)), 2, 0) };
    execute.push("plan", replace);
    assert_eq!(step(&mut execute), Some(2.0));
    execute.push("plan", Planned { step: PlanStep::CLEAR, ..planned(ActionRequest::default(), 3, 0) });
    // What is left is the command of the action's own cancelling.
    assert_eq!(step(&mut execute), Some(-1000.0));
    assert_eq!(step(&mut execute), None);
}

#[test]
fn unknown_or_unreadable_request_is_refused() {
    let mut execute = Execute::new();
    let request = |kind: &str, arguments: &[f64]| ActionRequest {
        kind: Text::new(kind),
        arguments: Sequence::new(arguments),
    };
    execute.push("plan", planned(request("Fly", &[]), 1, 0));
    execute.push("plan", planned(request("Drive", &[1.0]), 2, 0));
    execute.push("plan", planned(request("Drive", &[f64::NAN, 1.0]), 3, 0));
    execute.push("reflexes", reflex(request("Fly", &[]), 0));
    execute.push("plan", planned(Drive::request((1.0, 1.0)), 4, 0));
    assert_eq!(step(&mut execute), Some(1.0));
    let status = status(&execute);
    // Refused reflexes change nothing: the plan of epoch 0 continues.
    assert_eq!((status.refused, status.reflexes, status.epoch, status.ticket), (4, 0, 0, 4));
}

#[test]
fn an_unknown_action_is_answered_with_the_known_ones() {
    use slate_mapek::Repertoire;
    let request = ActionRequest { kind: Text::new("Fly"), ..ActionRequest::default() };
    let error = Actions::start(&request).err().expect("it is unknown");
    assert_eq!(error.to_string(), "unknown action; known: Drive, Stumble, Swerve, Tour");
}

#[test]
fn a_saved_execute_goes_on_where_it_was() {
    let mut execute = Execute::new();
    execute.push("plan", planned(Tour::request(()), 1, 0));
    execute.push("plan", planned(Drive::request((5.0, 1.0)), 2, 0));
    step(&mut execute);
    step(&mut execute);
    let mut resumed = Execute::new();
    resumed.restore(&execute.save().unwrap()).unwrap();
    for _ in 0..5 {
        assert_eq!(step(&mut resumed), step(&mut execute));
        assert_eq!(
            resumed.output::<ExecuteStatus>("status").map(|status| endings(&status)),
            execute.output::<ExecuteStatus>("status").map(|status| endings(&status)),
        );
    }
    assert_eq!(resumed.save().unwrap(), execute.save().unwrap());
}
