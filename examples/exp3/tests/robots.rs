//! EXP3's robots: one visits the corners, the other one follows it; and how they are judged.
#![allow(clippy::panic, clippy::unwrap_used, reason = "a test that fails panics")]

use slate::blackboard::interface::Value;
use slate::interfaces::{Orientation, Point2, Position};
use slate::mapek::{self, PlanBlock, Planned};
use slate::module::testing::Fixture;
use slate::module::{Bool, Sequence, math};
use slate::runtime::configuration::{self, Configuration};
use slate::runtime::{Agent, Options, Rate};
use slate_exp3::follow::FollowPlanner;
use slate_exp3::patrol::PatrolPlanner;
use slate_wheeled::goals::Goals;
use slate_wheeled::knowledge::WheeledModel;
use slate_wheeled::locate_robot::Located;

fn agent(sets: &[&str]) -> Agent {
    let options = configuration::Options {
        sets: sets.iter().map(|set| (*set).to_owned()).collect(),
        extra_tables: ["world", "report"].map(Into::into).to_vec(),
        embedded: slate_exp3::EMBEDDED,
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

/// Runs until the last referee has decided; returns its verdict.
fn verdict(agent: &mut Agent) -> [String; 3] {
    loop {
        agent.step();
        let text = |field: &str| {
            let value = value(agent, &format!("pursuit/verdict/{field}"));
            value.as_ref().and_then(Value::as_str).unwrap_or_default().to_owned()
        };
        if !matches!(text("state").as_str(), "" | "RUNNING") {
            return ["state", "outcome", "reason"].map(text);
        }
    }
}

#[test]
fn corners_repeat_in_order_and_the_follower_stays_near() {
    let sets = [
        "controller=rocs-fixed",
        "agent.seed=6",
        "robots.r2.modules.planner.params.max_linear_velocity=0.4",
        "robots.r2.modules.planner.params.careful_linear_velocity=0.3",
        "robots.r3.modules.planner.params.max_linear_velocity=0.9",
        "modules.referee.params.time_limit=120.0",
    ];
    let mut agent = agent(&sets);
    let mut goals = Vec::new();
    while goals.len() < 5 {
        agent.step();
        let goal = (number(&agent, "r2/planner/goal/x"), number(&agent, "r2/planner/goal/y"));
        if goals.last() != Some(&goal) {
            goals.push(goal);
        }
    }
    assert_eq!(goals, [(2.0, 2.0), (2.0, -2.0), (-2.0, 2.0), (-2.0, -2.0), (2.0, 2.0)]);
    assert_eq!(verdict(&mut agent), ["SUCCEEDED", "GAP_KEPT", "gap kept"]);
    assert!(number(&agent, "referee/metrics/goals_reached") >= 5.0);
    assert!(number(&agent, "referee/metrics/shortest_path") > 15.0);
    assert!(number(&agent, "pursuit/metrics/gap_in_band") >= 0.95);
    assert!((1.0..1.6).contains(&number(&agent, "pursuit/metrics/median_gap")));
}

/// A mission of two seconds in which no robot moves: R2 in the middle, R3 east of it by the gap.
fn standing(gap: f64, more: &[&str]) -> [String; 3] {
    let r3 = format!("world.layouts.authors.robots.r3={{ x = {gap}, y = 0.0, theta = 0.0 }}");
    let sets = [
        "world.layout=authors",
        "world.layouts.authors.robots.r1={ x = 0.0, y = 2.0, theta = 0.0 }",
        "world.layouts.authors.robots.r2={ x = 0.0, y = 0.0, theta = 0.0 }",
        &r3,
        "world.robots.r1.script={ wheel_speed = 0.0 }",
        "world.goals.r2=[[0.0, 0.0]]",
        "modules.referee.params.time_limit=2.0",
        "robots.r3.modules.planner.enabled=false",
        "robots.r2.modules.planner.enabled=false",
        // A robot that stands beside a wall stands still.
        "robots.r2.modules.avoid_obstacle.enabled=false",
        "robots.r3.modules.avoid_obstacle.enabled=false",
    ];
    verdict(&mut agent(&[&sets, more].concat()))
}

#[test]
fn pursuit_ends_with_the_patrol_and_is_judged_by_the_gap() {
    assert_eq!(standing(1.2, &[]), ["SUCCEEDED", "GAP_KEPT", "gap kept"]);
    assert_eq!(standing(2.1, &[])[..2], ["FAILED", "GAP_LEFT"]);
    let nowhere = "world.goals.r2=[[1.5, 1.5]]";
    assert_eq!(standing(1.2, &[nowhere]), ["FAILED", "TIMED_OUT", "leader: time is up"]);
}

#[test]
fn caused_collision_fails_a_kept_gap_and_ends_no_run() {
    // R2 drives into R1, which stands still, and pushes on.
    let drives = [
        "robots.r2.modules.planner.enabled=true",
        "robots.r2.modules.knowledge.params.goals=[{ x = 0.0, y = 2.0 }]",
        "robots.r2.modules.avoid_obstacle.enabled=false",
        "modules.pursuit.params.max_gap=10.0",
        "modules.referee.params.time_limit=6.0",
        "world.layouts.authors.robots.r1={ x = 0.0, y = 0.8, theta = 0.0 }",
    ];
    let [state, outcome, reason] = standing(1.2, &drives);
    assert_eq!([state, outcome], ["FAILED", "COLLIDED"]);
    assert!(reason.starts_with("leader: patrol completed, with ") && reason.ends_with(" caused"), "{reason}");
}

/// A follower that stands there.
fn follower() -> Fixture<PlanBlock<FollowPlanner>> {
    let mut planner = Fixture::<PlanBlock<FollowPlanner>>::new();
    planner.set("robot", WheeledModel::load("summit_xl", "vrep").unwrap());
    planner
}

/// What a follower plans whose leader is so far away in that direction: how fast its left and its right wheels turn.
fn plans(range: f64, bearing: f64) -> (f64, f64) {
    let mut planner = follower();
    let leader = Located { range, bearing, seen: Bool::from(true), ..Located::default() };
    planner.push("leader", leader);
    planner.tick();
    let planned = planner.sent::<Planned>("plan");
    let action = &planned.last().unwrap().action;
    assert_eq!(action.kind.as_str(), "SetWheelSpeed");
    (action.arguments[0], action.arguments[1])
}

#[test]
fn follower_keeps_its_distance_and_faces_the_leader() {
    let (left, right) = plans(2.0, 0.0);
    assert!(left > 0.0 && left == right, "{left} {right}");
    let (left, right) = plans(0.8, 0.0);
    assert!(left < 0.0 && left == right, "{left} {right}");
    let (left, right) = plans(2.0, 0.4);
    assert!(right > left && left + right > 0.0, "an arc to the left: {left} {right}");
    let (left, right) = plans(2.0, -1.5);
    assert!(left > 0.0 && left == -right, "on the spot to the right: {left} {right}");
}

/// How the left and the right wheels of a follower turn, at the origin facing east, when its leader has come to each of these
/// places, a second after the one before.
fn follows(places: &[(f64, f64)]) -> Vec<(f64, f64)> {
    let mut planner = follower();
    let plan = |(x, y): &(f64, f64)| {
        let leader = Located {
            x: *x,
            y: *y,
            range: math::hypot(*x, *y),
            bearing: math::atan2(*y, *x),
            seen: true.into(),
        };
        planner.push("leader", leader);
        planner.advance(1_000_000_000);
        planner.tick();
        let planned = planner.sent::<Planned>("plan");
        let arguments = planned.last().unwrap().action.arguments;
        (arguments[0], arguments[1])
    };
    places.iter().map(plan).collect()
}

#[test]
fn follower_makes_way_for_a_leader_that_comes_towards_it() {
    // The course of the leader is to its left or to its right.
    let (left, right) = follows(&[(1.5, 0.2), (1.3, 0.2)])[1];
    assert!(left > 0.0 && left == -right, "it turns to the right: {left} {right}");
    let (left, right) = follows(&[(1.5, -0.2), (1.3, -0.2)])[1];
    assert!(left < 0.0 && left == -right, "it turns to the left: {left} {right}");
    let (left, right) = follows(&[(1.3, 0.8), (1.2, 0.8)])[1];
    assert!(left + right == 0.0 && right > left, "the leader passes, it faces it: {left} {right}");
    let (left, right) = follows(&[(1.5, 0.0), (1.8, 0.0)])[1];
    assert!(left > 0.0 && left == right, "the leader leaves, it follows: {left} {right}");
}

#[test]
fn follower_that_comes_no_nearer_drives_round_what_is_between() {
    let stuck = follows(&[(2.5, 0.0); 12]);
    assert!(stuck[..3].iter().all(|(left, right)| left == right && *left > 0.0), "{stuck:?}");
    let turns = |sign: f64| stuck.iter().any(|(left, right)| (right - left) * sign > 1.0);
    assert!(turns(1.0) && turns(-1.0), "to one side, then to the other: {stuck:?}");
    let nearer: Vec<_> = (0..8).map(|step| (2.5 - 0.1 * f64::from(step), 0.0)).collect();
    assert!(follows(&nearer).iter().all(|(left, right)| left == right), "it comes nearer");
}

#[test]
fn lost_leader_is_looked_for_where_it_was() {
    let mut planner = follower();
    planner.push("leader", Located { x: 1.0, y: -2.0, range: 2.2, bearing: -1.1, seen: false.into() });
    planner.tick();
    let planned = planner.sent::<Planned>("plan");
    let action = &planned.last().unwrap().action;
    assert_eq!((action.kind.as_str(), &action.arguments[..2]), ("GoToOrigin", &[1.0, -2.0][..]));
}

#[test]
fn follower_looks_around_for_a_leader_that_it_does_not_detect() {
    let turns = |leader: Option<Located>| {
        let mut planner = follower();
        if let Some(leader) = leader {
            planner.push("leader", leader);
        }
        planner.tick();
        let planned = planner.sent::<Planned>("plan");
        let action = planned.last().unwrap().action;
        assert_eq!(action.kind.as_str(), "SetWheelSpeed");
        assert_eq!(action.arguments[0], -action.arguments[1], "on the spot");
        action.arguments[1]
    };
    assert!(turns(None) > 0.0, "one that was never there");
    let lost = |bearing| Located {
        x: math::cos(bearing),
        y: math::sin(bearing),
        range: 1.0,
        bearing,
        seen: false.into(),
    };
    assert!(turns(Some(lost(2.5))) > 0.0 && turns(Some(lost(-2.5))) < 0.0, "to the side where it was last");
}

#[test]
fn plan_does_not_interrupt_a_reflex() {
    let mut planner = follower();
    planner.set("situation", mapek::ExecuteStatus { route: mapek::Route::REACTIVE, ..Default::default() });
    planner.push("leader", Located { range: 2.0, seen: true.into(), ..Located::default() });
    planner.tick();
    assert!(planner.sent::<Planned>("plan").is_empty());
}

/// Goals at the corners of a room.
fn corners(x: f64, y: f64) -> Goals {
    let corners = [(x, y), (x, -y), (-x, y), (-x, -y)];
    Goals { list: Sequence::new(&corners.map(|(x, y)| Point2 { x, y })) }
}

#[test]
fn goals_are_in_knowledge_and_the_plan_reads_them_there() {
    let mut agent = agent(&[]);
    agent.step();
    agent.step();
    let newest = |path: &str| agent.board().read(path).unwrap().map(|(value, _)| value);
    let goal =
        |value: &Value| [value.get("x"), value.get("y")].map(|number| number.unwrap().as_f64().unwrap());
    let Some(Value::List(known)) = newest("r2/knowledge/goals/list") else { panic!("a list of goals") };
    let known: Vec<_> = known.iter().map(goal).collect();
    assert_eq!(known, [[2.0, 2.0], [2.0, -2.0], [-2.0, 2.0], [-2.0, -2.0]]);
    assert_eq!(newest("r2/planner/goal").as_ref().map(goal), Some(known[0]));
    for none in ["r2/knowledge/goal", "r3/knowledge/goal", "r3/knowledge/goals"] {
        assert!(newest(none).is_none(), "{none} says where nobody goes");
    }
}

#[test]
fn corner_without_progress_is_left_for_the_next_lap() {
    let mut planner = Fixture::<PlanBlock<PatrolPlanner>>::new();
    planner.set("goals", corners(2.0, 2.0));
    let mut goes_to = |seconds: u64| {
        planner.advance(seconds * 1_000_000_000);
        planner.push("position", Position { x: 1.5, y: 1.5, z: 0.0 });
        planner.push("orientation", Orientation { theta: 0.0 });
        planner.tick();
        planner.output::<Point2>("goal").map(|goal| (goal.x, goal.y))
    };
    assert_eq!(goes_to(0), Some((2.0, 2.0)));
    assert_eq!(goes_to(19), Some((2.0, 2.0)), "it may still come");
    assert_eq!(goes_to(2), Some((2.0, -2.0)));
}

#[test]
fn another_corner_and_other_speeds_hold_on_the_way() {
    let mut planner = Fixture::<PlanBlock<PatrolPlanner>>::new();
    planner.set("goals", corners(2.0, 2.0));
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
    planner.set("goals", corners(1.0, 2.0));
    assert_eq!(sent(&mut planner), (1.0, 2.0, 0.4));
    planner.params().max_linear_velocity = 0.1;
    assert_eq!(sent(&mut planner), (1.0, 2.0, 0.1));
}
