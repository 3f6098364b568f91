//! The Plan that sends a robot to its goal, when what it goes by changes under way.
#![allow(clippy::unwrap_used, reason = "a test that fails panics")]

use slate::interfaces::{Orientation, Point2, Position};
use slate::mapek::{Ended, Ending, ExecuteStatus, PlanBlock, Planned, Route};
use slate::module::testing::Fixture;
use slate::module::{Bool, Sequence, Text};
use slate_wheeled::go_to_origin::GoToOriginPlanner;
use slate_wheeled::locate_robot::Located;

/// A robot at the origin that was sent somewhere.
fn on_its_way(goal: Point2) -> Fixture<PlanBlock<GoToOriginPlanner>> {
    let mut planner = Fixture::<PlanBlock<GoToOriginPlanner>>::new();
    planner.set("goal", goal);
    planner.push("position", Position { x: 0.0, y: 0.0, z: 0.0 });
    planner.push("orientation", Orientation { theta: 0.0 });
    planner.tick();
    assert_eq!(sent(&planner), Some((goal.x, goal.y, 0.4)));
    planner.set("situation", ExecuteStatus { route: Route::DELIBERATIVE, ..Default::default() });
    planner.advance(200_000_000);
    planner.tick();
    assert_eq!(sent(&planner), None, "nothing has changed");
    planner
}

/// Where it is sent now, and how fast.
fn sent(planner: &Fixture<PlanBlock<GoToOriginPlanner>>) -> Option<(f64, f64, f64)> {
    let planned = planner.sent::<Planned>("plan");
    let arguments = &planned.last()?.action.arguments;
    Some((arguments[0], arguments[1], arguments[2]))
}

fn arrived(number: u64) -> ExecuteStatus {
    let ended =
        Ended { number, kind: Text::new("GoToOrigin"), ending: Ending::COMPLETED, ..Default::default() };
    ExecuteStatus { ended: Sequence::new(&[ended]), ..Default::default() }
}

const EAST: Point2 = Point2 { x: 2.0, y: 0.0 };
const NORTH: Point2 = Point2 { x: 0.0, y: 2.0 };

#[test]
fn a_new_goal_holds_at_once() {
    let mut planner = on_its_way(EAST);
    planner.set("goal", NORTH);
    planner.tick();
    assert_eq!(sent(&planner), Some((0.0, 2.0, 0.4)));
}

#[test]
fn robot_continues_to_moved_goal() {
    let mut planner = on_its_way(EAST);
    planner.set("goal", NORTH);
    planner.set("situation", arrived(1));
    planner.tick();
    assert_eq!(sent(&planner), Some((0.0, 2.0, 0.4)));
    planner.set("situation", arrived(2));
    planner.advance(200_000_000);
    planner.tick();
    assert_eq!(sent(&planner), None, "it is there");
    planner.set("goal", EAST);
    planner.set("situation", ExecuteStatus::default());
    planner.advance(200_000_000);
    planner.tick();
    assert_eq!(sent(&planner), Some((2.0, 0.0, 0.4)), "who stands goes on, too");
}

#[test]
fn another_robot_that_is_near_makes_it_careful() {
    let mut planner = on_its_way(EAST);
    let mut meets = |range, seen: bool| {
        planner.push("other", Located { range, seen: Bool::from(seen), ..Located::default() });
        planner.advance(20_000_000);
        planner.tick();
        sent(&planner).map(|(.., speed)| speed)
    };
    assert_eq!(meets(1.1, true), None);
    assert_eq!(meets(0.9, true), Some(0.3));
    assert_eq!(meets(1.2, true), None, "it has not left");
    assert_eq!(meets(1.2, false), Some(0.4));
}
