//! EXP3's robots: one visits the corners, the other one follows it and never drives back where it knows nothing.
#![allow(clippy::unwrap_used, reason = "a test that fails panics")]

use slate::blackboard::interface::Value;
use slate::interfaces::{Orientation, Point2, Pose2, Position, Sighting, Sightings};
use slate::mapek::{self, PlanBlock, Planned, RobotModel};
use slate::module::testing::Fixture;
use slate::module::{Bool, Sequence, Text};
use slate::runtime::configuration::{self, Configuration};
use slate::runtime::{Agent, Options, Rate};
use slate::sim::robot::RobotDescription;
use slate_avoidance::Footprint;
use slate_exp3::follow::FollowPlanner;
use slate_exp3::outlook::{Moving, Outlook};
use slate_exp3::patrol::PatrolPlanner;
use slate_wheeled::knowledge::WheeledModel;
use slate_wheeled::locate_robot::Located;

fn agent(sets: &[&str]) -> Agent {
    let options = configuration::Options {
        sets: sets.iter().map(|set| (*set).to_owned()).collect(),
        extra_tables: ["world", "report", "controller", "pace"].map(Into::into).to_vec(),
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
        // Where it makes room is no corner.
        if goals.last() != Some(&goal) && goal.0.abs() == 2.0 {
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

/// A follower that stands there.
fn follower(pose: Pose2) -> Fixture<PlanBlock<FollowPlanner>> {
    let chassis = RobotDescription::named("summit_xl").unwrap().unwrap().chassis();
    let mut planner = Fixture::<PlanBlock<FollowPlanner>>::new();
    planner.set("robot", WheeledModel { robot: RobotModel { pose, ..RobotModel::default() }, chassis });
    planner
}

/// What it plans now: how fast its left and its right wheels turn.
fn wheels(planner: &Fixture<PlanBlock<FollowPlanner>>) -> Option<(f64, f64)> {
    let planned = planner.sent::<Planned>("plan");
    let action = &planned.last()?.action;
    assert_eq!(action.kind.as_str(), "SetWheelSpeed");
    Some((action.arguments[0], action.arguments[1]))
}

fn ahead(pose: Pose2, range: f64) -> Located {
    Located { x: pose.x + range, y: pose.y, range, bearing: 0.0, seen: Bool::from(true) }
}

/// What a follower plans that sees its leader so far ahead, beside another robot.
fn plans(pose: Pose2, range: f64, other: Sighting) -> Option<(f64, f64)> {
    let mut planner = follower(pose);
    planner.set("robots", Sightings { list: Sequence::new(&[other]) });
    planner.push("leader", ahead(pose, range));
    planner.tick();
    wheels(&planner)
}

#[test]
fn it_keeps_its_distance_to_the_leader_within_the_room() {
    let nobody = Sighting { range: 3.0, bearing: 2.0, name: Text::new("r1") };
    let middle = Pose2::default();
    let (left, right) = plans(middle, 2.0, nobody).unwrap();
    assert!(left > 0.0 && right > 0.0, "{left} {right}");
    let (left, right) = plans(middle, 0.9, nobody).unwrap();
    assert!(left < 0.0 && right < 0.0, "{left} {right}");
    let goes_back = |pose, other| plans(pose, 0.9, other).is_some_and(|(left, right)| left + right < -0.1);
    assert!(!goes_back(Pose2 { x: -2.0, ..middle }, nobody), "there is a wall");
    let behind = Sighting { range: 0.8, bearing: 3.0, name: Text::new("r1") };
    assert!(!goes_back(middle, behind));
}

#[test]
fn who_is_hidden_is_looked_for_for_a_while() {
    let mut planner = follower(Pose2::default());
    planner.push("leader", ahead(Pose2::default(), 1.2));
    planner.tick();
    let (left, right) = wheels(&planner).unwrap();
    assert!((left + right).abs() < 0.5, "it is where it wants to be: {left} {right}");
    planner.advance(2_000_000_000);
    planner.tick();
    let (left, right) = wheels(&planner).unwrap();
    assert!(left > 0.0 && right > 0.0, "it looks where the leader was: {left} {right}");
    planner.advance(60_000_000_000);
    planner.tick();
    assert_eq!(wheels(&planner), None, "it has given up");
}

#[test]
fn nobody_stands_well_in_the_way_of_a_leader_that_comes() {
    let chassis = RobotDescription::named("summit_xl").unwrap().unwrap().chassis();
    let corners: Vec<_> = chassis.outline.iter().map(|corner| [corner.x, corner.y]).collect();
    let footprint = Footprint::new(&corners).unwrap();
    let outlook = |velocity| Outlook {
        footprint: &footprint,
        leader: Moving { place: Point2::default(), velocity },
        hidden: false,
        others: [None; 8],
        distance: 1.2,
        room: 2.4,
        radius: 0.28,
        margin: 0.1,
        pace: 1.0,
    };
    let before = Pose2 { x: 1.2, y: 0.0, theta: std::f64::consts::PI };
    let beside = Pose2 { x: 0.0, y: 1.2, theta: -std::f64::consts::FRAC_PI_2 };
    let (comes, stands) = (outlook([0.4, 0.0]), outlook([0.0, 0.0]));
    assert!(comes.cost(before, 0.0) > comes.cost(beside, 0.0) + 0.5);
    assert!((stands.cost(before, 0.0) - stands.cost(beside, 0.0)).abs() < 1e-9);
    // Whoever stands before the leader makes the way to it longer.
    let mut others = [None; 8];
    others[0] = Some(Moving { place: Point2 { x: 0.4, y: 0.1 }, velocity: [0.0; 2] });
    let hindered = Outlook { others, ..outlook([0.0, 0.0]) };
    assert!(hindered.cost(before, 0.0) > stands.cost(before, 0.0) + 0.05);
    assert!(hindered.cost(beside, 0.0) < stands.cost(beside, 0.0) + 0.01);
}

#[test]
fn who_can_not_reach_a_corner_makes_room_and_tries_again() {
    let mut planner = Fixture::<PlanBlock<PatrolPlanner>>::new();
    let mut goes_to = |seconds: u64| {
        planner.advance(seconds * 1_000_000_000);
        planner.push("position", Position { x: 1.5, y: 1.5, z: 0.0 });
        planner.push("orientation", Orientation { theta: 0.0 });
        planner.tick();
        planner.output::<Point2>("goal").map(|goal| (goal.x, goal.y))
    };
    assert_eq!(goes_to(0), Some((2.0, 2.0)));
    assert_eq!(goes_to(9), Some((2.0, 2.0)), "it has patience");
    assert_eq!(goes_to(2), Some((0.8, 0.8)));
    assert_eq!(goes_to(5), Some((0.8, 0.8)));
    assert_eq!(goes_to(8), Some((2.0, 2.0)));
}

#[test]
fn another_corner_and_other_speeds_hold_on_the_way() {
    let mut planner = Fixture::<PlanBlock<PatrolPlanner>>::new();
    planner.push("position", Position::default());
    planner.push("orientation", Orientation::default());
    let sent = |planner: &mut Fixture<PlanBlock<PatrolPlanner>>| {
        planner.advance(200_000_000);
        planner.tick();
        let planned = planner.sent::<Planned>("plan");
        let arguments = &planned.last().unwrap().action.arguments;
        (arguments[0], arguments[1], arguments[2])
    };
    assert_eq!(sent(&mut planner), (2.0, 2.0, 0.4));
    planner
        .set("situation", mapek::ExecuteStatus { route: mapek::Route::DELIBERATIVE, ..Default::default() });
    planner.params().corner_x = 1.0;
    assert_eq!(sent(&mut planner), (1.0, 2.0, 0.4));
    planner.params().max_linear_velocity = 0.1;
    assert_eq!(sent(&mut planner), (1.0, 2.0, 0.1));
}

#[test]
fn who_is_lost_is_not_followed() {
    let mut planner = follower(Pose2::default());
    planner
        .set("situation", mapek::ExecuteStatus { route: mapek::Route::DELIBERATIVE, ..Default::default() });
    planner.push("leader", Located::default());
    planner.tick();
    let planned = planner.sent::<Planned>("plan");
    assert_eq!(planned.last().unwrap().step, mapek::PlanStep::CLEAR);
}
