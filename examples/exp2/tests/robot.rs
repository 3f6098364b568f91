//! EXP2's robot: it reaches its place on four wheels, stays there, and gives way.
#![allow(clippy::unwrap_used, reason = "a test that fails panics")]

use slate::blackboard::interface::Value;
use slate::interfaces::{
    Echo, FourWheelSpeeds, Odometry, Pose2, Sighting, Sightings, SonarPlacement, SonarScan, Twist2,
};
use slate::mapek::{self, ActionKind, ExecuteBlock, Planned, ReactiveBlock};
use slate::module::testing::Fixture;
use slate::module::{Sequence, Text};
use slate::runtime::configuration::{self, Configuration};
use slate::runtime::{Agent, Options, Rate};
use slate_wheeled::actions::{GoToOrigin, Leg};
use slate_wheeled::give_way::GiveWayModel;
use slate_wheeled::knowledge::{WheeledKnowledgeParams, WheeledModel};
use slate_wheeled::skid_steer::SkidSteerActions;

fn agent(sets: &[&str]) -> Agent {
    let options = configuration::Options {
        sets: sets.iter().map(|set| (*set).to_owned()).collect(),
        extra_tables: ["world", "report"].map(Into::into).to_vec(),
        embedded: slate_exp2::EMBEDDED,
        ..configuration::Options::default()
    };
    let configuration = Configuration::from_text("exp2.toml", slate_exp2::CONFIGURATION, &options).unwrap();
    let plugins = [slate::sim::plugin(), slate_wheeled::plugin()];
    let options = Options { rate: Rate::Max, armed: true, ..Options::default() };
    Agent::load(&configuration, &plugins, options).unwrap()
}

fn value(agent: &Agent, path: &str) -> Option<Value> {
    agent.board().read(path).unwrap().map(|(value, _)| value)
}

fn number(agent: &Agent, path: &str) -> f64 {
    value(agent, path).and_then(|value| value.as_f64()).unwrap()
}

/// Runs until the referee has decided; what it said.
fn verdict(agent: &mut Agent) -> String {
    loop {
        agent.step();
        let state = value(agent, "referee/verdict/state");
        match state.as_ref().and_then(Value::as_str) {
            None | Some("RUNNING") => {}
            Some(state) => return state.into(),
        }
    }
}

fn model() -> WheeledModel {
    WheeledModel::load("summit_xl", "vrep").unwrap()
}

#[test]
fn ten_seeds_reach_the_place_hold_it_and_cause_no_contact() {
    for seed in 1..=10 {
        let mut agent = agent(&[&format!("agent.seed={seed}")]);
        assert_eq!(verdict(&mut agent), "SUCCEEDED", "seed {seed}");
        assert_eq!(number(&agent, "referee/metrics/collisions_caused"), 0.0, "seed {seed}");
        assert!(number(&agent, "referee/stay/held") >= 0.9, "seed {seed}");
    }
}

#[test]
fn it_holds_its_place_from_where_the_authors_let_it_begin() {
    assert_eq!(verdict(&mut agent(&["world.layout=authors"])), "SUCCEEDED");
}

#[test]
fn robot_leaving_the_place_has_not_held_it() {
    // Its plan goes elsewhere than the referee looks.
    let mut agent = agent(&["robots.r3.modules.knowledge.params.goal_x=0.6", "world.layout=authors"]);
    assert_eq!(verdict(&mut agent), "FAILED");
}

#[test]
fn the_actions_of_two_wheels_turn_four() {
    let mut execute = Fixture::<ExecuteBlock<SkidSteerActions>>::new();
    let mut robot = model();
    robot.robot.pose = Pose2 { x: 1.0, y: 0.0, theta: 0.0 };
    execute.set("robot", robot);
    let action = GoToOrigin::request(Leg { x: 0.0, y: 0.0, speed: 0.4, tolerance: 0.05 });
    execute.push("plan", Planned { ticket: 1, action, ..Planned::default() });
    execute.tick();
    let status = execute.output::<mapek::ExecuteStatus>("status").unwrap();
    assert_eq!(status.tree.as_str(), "GoToOrigin > TurnToOrigin > TurnAngle");
    let wheels = execute.output::<FourWheelSpeeds>("wheels").unwrap();
    assert!(wheels.front_left != 0.0 && wheels.front_left == -wheels.front_right, "{wheels:?}");
    assert_eq!((wheels.front_left, wheels.front_right), (wheels.back_left, wheels.back_right));
}

fn seen(range: f64, bearing: f64) -> Sighting {
    Sighting { range, bearing, name: Text::new("r1") }
}

/// What the model does about a robot that is seen in that direction, at that distance, while this one drives at a velocity: the speed of
/// its wheels, if any.
fn gives_way(range: f64, bearing: f64, velocity: f64) -> Option<f64> {
    gives_way_to(&[seen(range, bearing)], 1.0, velocity)
}

/// The same with several robots, nearest first, and the range of a sonar ahead.
fn gives_way_to(robots: &[Sighting], range: f64, velocity: f64) -> Option<f64> {
    let mut model_of = Fixture::<ReactiveBlock<GiveWayModel>>::new();
    let twist = Twist2 { linear: velocity, angular: 0.0 };
    model_of.set("odometry", Odometry { twist, ..Odometry::default() });
    model_of.set("robot", model());
    model_of.set("rules", WheeledKnowledgeParams::default().rules());
    model_of.set("robots", Sightings { list: Sequence::new(robots) });
    let echo = Echo { range, heard: (range < 1.0).into() };
    model_of.set(
        "sonar",
        SonarScan {
            echoes: Sequence::new(&[echo]),
            placements: Sequence::new(&[SonarPlacement::default()]),
            range_max: 1.0,
            ..SonarScan::default()
        },
    );
    model_of.tick();
    model_of.sent::<mapek::Reflex>("reflex").first().map(|reflex| reflex.action.arguments[1])
}

#[test]
fn gives_way_only_to_near_robots_while_standing() {
    assert!(gives_way(0.6, 0.1, 0.0).unwrap() < 0.0, "back from who comes ahead");
    assert!(gives_way(0.6, 3.0, 0.0).unwrap() > 0.0, "ahead of who comes behind");
    assert_eq!(gives_way(1.5, 0.1, 0.0), None, "who is far away does not matter");
    assert_eq!(gives_way(0.6, 1.57, 0.0), None, "nobody can go sideways");
    assert_eq!(gives_way(0.6, 0.1, 0.2), None, "it drives on");
    assert!(gives_way(0.6, 0.1, -0.2).unwrap() < 0.0, "it backs off already");
}

#[test]
fn giving_way_considers_all_robots_and_sonars() {
    let lost = seen(0.5, f64::NAN);
    let both = [lost, seen(0.6, 0.1)];
    assert!(gives_way_to(&both, 1.0, 0.0).unwrap() < 0.0, "of the nearest nothing is known");
    let beside = [seen(0.5, 1.57), seen(0.6, 3.0)];
    assert!(gives_way_to(&beside, 1.0, 0.0).unwrap() > 0.0, "the nearest is beside");
    assert_eq!(gives_way_to(&[seen(0.6, 3.0), seen(0.65, 0.1)], 1.0, 0.0), None, "it is between two");
    assert_eq!(gives_way_to(&[seen(0.6, 3.0)], 0.1, 0.0), None, "something is ahead");
    assert!(gives_way_to(&[seen(0.6, 0.1)], 0.1, 0.0).unwrap() < 0.0, "what is ahead is not behind");
}
