//! The actions that the Plan of EXP1 sends to Execute.
#![allow(clippy::unwrap_used, reason = "a test that fails panics")]

use slate::interfaces::{Orientation, Point2, Position};
use slate::mapek::{ExecuteStatus, PlanBlock, PlanStep, Planned};
use slate::module::testing::Fixture;
use slate::prelude::*;
use slate_wheeled::actions::GoToOrigin;
use slate_wheeled::analyzes::Surroundings;
use slate_wheeled::go_to_origin::GoToOriginPlanner;

/// A planner that was told where the robot is.
fn planner(x: f64, y: f64) -> Fixture<PlanBlock<GoToOriginPlanner>> {
    let mut planner = Fixture::new();
    planner.set("goal", Point2 { x: 0.0, y: 0.0 });
    planner.set("situation", ExecuteStatus::default());
    planner.push("position", Position { x, y, z: 0.0 });
    planner.push("orientation", Orientation { theta: 0.0 });
    planner
}

#[test]
fn the_plan_is_the_same_whatever_stands_around() {
    for nearest in [0.05, 0.3, 0.7, 1.0, f64::NAN] {
        for crowded in [false, true] {
            let mut planner = planner(1.0, 2.0);
            planner.push("range", Surroundings { nearest, crowded: crowded.into() });
            planner.tick();
            let [planned]: [Planned; 1] = planner.sent("plan").try_into().unwrap();
            assert_eq!(planned.action.kind.as_str(), GoToOrigin::KIND);
            // Only the speed may differ.
            assert_eq!(planned.action.arguments[..2], [0.0, 0.0]);
            assert!(planned.action.arguments[2] > 0.0);
        }
    }
}

#[test]
fn a_plan_that_a_reflex_cleared_is_made_anew_in_the_new_epoch() {
    let mut planner = planner(1.0, 2.0);
    planner.tick();
    let [first]: [Planned; 1] = planner.sent("plan").try_into().unwrap();
    assert_eq!((first.epoch, first.step), (0, PlanStep::REPLACE));
    let driving = ExecuteStatus { ticket: first.ticket, route: Route::DELIBERATIVE, ..Default::default() };
    planner.set("situation", driving);
    planner.advance(20_000_000);
    planner.tick();
    assert_eq!(
        planner.sent::<Planned>("plan").len(),
        0,
        "while the plan is carried out there is nothing to do"
    );
    // A reflex took the robot elsewhere.
    planner.push("position", Position { x: 1.5, y: 1.5, z: 0.0 });
    let cleared = ExecuteStatus { epoch: 1, ticket: first.ticket, replan: true.into(), ..Default::default() };
    planner.set("situation", cleared);
    planner.advance(20_000_000);
    planner.tick();
    let [second]: [Planned; 1] = planner.sent("plan").try_into().unwrap();
    assert_eq!((second.epoch, second.ticket), (1, first.ticket + 1));
    assert_eq!(second.action, first.action, "to the same goal");
}
