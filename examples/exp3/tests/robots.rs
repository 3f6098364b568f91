//! EXP3's robots: one visits the corners, the other one follows it and never drives back where it knows nothing.
#![allow(clippy::unwrap_used, reason = "a test that fails panics")]

use slate::blackboard::interface::Value;
use slate::interfaces::{Pose2, Sighting, Sightings};
use slate::mapek::{self, PlanBlock, Planned, RobotModel};
use slate::module::testing::Fixture;
use slate::module::{Bool, Sequence, Text};
use slate::runtime::configuration::{self, Configuration};
use slate::runtime::{Agent, Options, Rate};
use slate::sim::robot::RobotDescription;
use slate_exp3::follow::FollowPlanner;
use slate_wheeled::knowledge::WheeledModel;
use slate_wheeled::locate_robot::Located;

fn agent(sets: &[&str]) -> Agent {
    let options = configuration::Options {
        sets: sets.iter().map(|set| (*set).to_owned()).collect(),
        extra_tables: ["world", "report", "controller"].map(Into::into).to_vec(),
        ..configuration::Options::default()
    };
    let configuration = Configuration::from_text("exp3.toml", slate_exp3::CONFIGURATION, &options).unwrap();
    let plugins = [slate::sim::plugin(), slate_wheeled::plugin(), slate_exp3::plugin()];
    let options = Options { rate: Rate::Max, armed: true, ..Options::default() };
    Agent::load(&configuration, &plugins, options).unwrap()
}

fn value(agent: &Agent, path: &str) -> Option<Value> {
    agent.board().read(path).unwrap().map(|(value, _)| value)
}

fn number(agent: &Agent, path: &str) -> f64 {
    value(agent, path).and_then(|value| value.as_f64()).unwrap()
}

#[test]
fn the_corners_are_reached_in_order_and_the_follower_stays_near() {
    let mut agent = agent(&["agent.seed=1"]);
    let mut goals = Vec::new();
    let state = loop {
        agent.step();
        let goal = (number(&agent, "r2/planner/goal/x"), number(&agent, "r2/planner/goal/y"));
        if goals.last() != Some(&goal) && goal != (0.0, 0.0) {
            goals.push(goal);
        }
        let state = value(&agent, "pursuit/verdict/state");
        match state.as_ref().and_then(Value::as_str) {
            None | Some("RUNNING") => {}
            Some(state) => break state.to_owned(),
        }
    };
    assert_eq!(goals[..4], [(2.0, 2.0), (2.0, -2.0), (-2.0, 2.0), (-2.0, -2.0)]);
    assert_eq!(state, "SUCCEEDED");
    assert!(number(&agent, "pursuit/metrics/gap_in_band") >= 0.95);
    assert_eq!(number(&agent, "pursuit/metrics/collisions_caused"), 0.0);
    assert_eq!(number(&agent, "referee/metrics/collisions_caused"), 0.0);
}

/// What the follower plans that stands there and sees its leader so far ahead, beside another robot; the wheels.
fn plans(pose: Pose2, range: f64, other: Sighting) -> Option<(f64, f64)> {
    let chassis = RobotDescription::named("summit_xl").unwrap().unwrap().chassis();
    let mut planner = Fixture::<PlanBlock<FollowPlanner>>::new();
    planner.set("robot", WheeledModel { robot: RobotModel { pose, ..RobotModel::default() }, chassis });
    planner.set("robots", Sightings { list: Sequence::new(&[other]) });
    let (x, y) = (pose.x + range, pose.y);
    planner.push("leader", Located { x, y, range, bearing: 0.0, seen: Bool::from(true), reserved: [0; 7] });
    planner.tick();
    let planned = planner.sent::<Planned>("plan");
    let action = &planned.last()?.action;
    assert_eq!(action.kind.as_str(), "SetWheelSpeed");
    Some((action.arguments[0], action.arguments[1]))
}

#[test]
fn it_goes_after_who_is_far_and_back_from_who_is_near_as_far_as_it_knows_the_room() {
    let nobody = Sighting { range: 3.0, bearing: 0.0, name: Text::new("r1") };
    let middle = Pose2::default();
    let (left, right) = plans(middle, 2.0, nobody).unwrap();
    assert!(left > 0.0 && left == right);
    assert!(plans(middle, 0.9, nobody).unwrap().0 < 0.0);
    let at_the_wall = Pose2 { x: -1.8, ..middle };
    assert_eq!(plans(at_the_wall, 0.9, nobody), Some((0.0, 0.0)));
    let behind = Sighting { range: 0.8, bearing: 3.0, name: Text::new("r1") };
    assert_eq!(plans(middle, 0.9, behind), Some((0.0, 0.0)));
}

#[test]
fn who_is_lost_is_not_followed() {
    let mut planner = Fixture::<PlanBlock<FollowPlanner>>::new();
    planner
        .set("situation", mapek::ExecuteStatus { route: mapek::Route::DELIBERATIVE, ..Default::default() });
    planner.push("leader", Located::default());
    planner.tick();
    let planned = planner.sent::<Planned>("plan");
    assert_eq!(planned.last().unwrap().step, mapek::PlanStep::CLEAR);
}
