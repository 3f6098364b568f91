//! A robot with a role and several plans for it: which one it follows, and what it learns from how that goes.
#![allow(clippy::unwrap_used, reason = "a test that fails panics")]

use slate::interfaces::{Orientation, Pose2, Position, WheelSpeeds};
use slate::mapek::{
    ActionKind, ActionRequest, Ended, Ending, ExecuteBlock, ExecuteStatus, KnowledgeBlock, PlanBlock,
    PlanDescription, PlanLibrary, PlanOutcome, PlanStep, Planned, RobotModel, Role, Route, StrategyReport,
};
use slate::module::testing::Fixture;
use slate::module::{Sequence, Text};
use slate_wheeled::actions::{GoToOrigin, Leg};
use slate_wheeled::differential::DifferentialActions;
use slate_wheeled::knowledge::{WheeledKnowledgeParams, WheeledModel};
use slate_wheeled::strategic_knowledge::StrategicKnowledge;
use slate_wheeled::strategy_planner::StrategyPlanner;

fn way(x: f64) -> ActionRequest {
    GoToOrigin::request(Leg { x, y: 0.0, speed: 0.4, tolerance: 0.1 })
}

fn plan(role: &str, name: &str, ways: &[f64]) -> PlanDescription {
    let actions: Vec<_> = ways.iter().map(|x| way(*x)).collect();
    PlanDescription { name: Text::new(name), role: Text::new(role), actions: Sequence::new(&actions) }
}

fn library() -> PlanLibrary {
    let plans = [
        plan("messenger", "west", &[-1.0, -2.0]),
        plan("messenger", "east", &[1.0, 2.0]),
        plan("guard", "stay", &[0.0]),
    ];
    PlanLibrary { plans: Sequence::new(&plans) }
}

fn role(name: &str) -> Role {
    Role { name: Text::new(name) }
}

fn outcome(role: &str, name: &str, success: bool) -> PlanOutcome {
    PlanOutcome { seconds: 5.0, name: Text::new(name), role: Text::new(role), success: success.into() }
}

type Knowing = Fixture<KnowledgeBlock<StrategicKnowledge>>;

/// The name of the plan that Knowledge has told in this tick, if it told one.
fn told(knowledge: &mut Knowing) -> Option<String> {
    knowledge.tick();
    Some(knowledge.output::<PlanDescription>("strategy")?.name.as_str().to_owned())
}

fn new_knowledge() -> Knowing {
    let robot = Text::new("pioneer_p3dx");
    Knowing::with(WheeledKnowledgeParams { robot, ..WheeledKnowledgeParams::default() }).unwrap()
}

fn knowing() -> Knowing {
    let mut knowledge = new_knowledge();
    knowledge.set("role", role("messenger"));
    knowledge.set("library", library());
    knowledge
}

#[test]
fn the_role_and_past_outcomes_choose_the_plan() {
    let mut knowledge = knowing();
    assert_eq!(told(&mut knowledge).as_deref(), Some("west"), "of equal ones the first");
    assert_eq!(told(&mut knowledge), None, "nothing has happened");
    knowledge.set("role", role("messenger"));
    knowledge.set("library", library());
    assert_eq!(told(&mut knowledge), None, "it is told what it knows");
    knowledge.push("outcomes", outcome("messenger", "west", false));
    assert_eq!(told(&mut knowledge).as_deref(), Some("east"));
    knowledge.push("outcomes", outcome("messenger", "east", true));
    assert_eq!(told(&mut knowledge), None, "what has succeeded need not be done again");
    knowledge.set("role", role("guard"));
    assert_eq!(told(&mut knowledge).as_deref(), Some("stay"));
    knowledge.push("outcomes", outcome("messenger", "east", true));
    assert_eq!(told(&mut knowledge), None, "the outcome of a role that it had counts, too");
    let report = knowledge.output::<StrategyReport>("report").unwrap();
    let tries: Vec<_> = report.records.iter().map(|record| (record.tried, record.succeeded)).collect();
    assert_eq!(tries, [(1, 0), (2, 2), (0, 0)]);
    knowledge.set("role", role("cook"));
    assert_eq!(told(&mut knowledge).as_deref(), Some(""), "there is no plan for that");
}

#[test]
fn memory_has_only_learned_outcomes() {
    let mut knowledge = knowing();
    knowledge.push("outcomes", outcome("messenger", "west", false));
    assert_eq!(told(&mut knowledge).as_deref(), Some("east"));
    let state = knowledge.save().unwrap();
    let mut restarted = knowing();
    restarted.restore(&state).unwrap();
    assert_eq!(told(&mut restarted).as_deref(), Some("east"));
}

#[test]
fn removed_plans_stop_and_changed_plans_restart() {
    let mut knowledge = knowing();
    knowledge.push("outcomes", outcome("messenger", "west", false));
    knowledge.push("outcomes", outcome("messenger", "east", true));
    knowledge.tick();
    let state = knowledge.save().unwrap();
    let restarted = |plans: &[PlanDescription]| {
        let mut knowledge = new_knowledge();
        knowledge.set("role", role("messenger"));
        knowledge.set("library", PlanLibrary { plans: Sequence::new(plans) });
        knowledge.restore(&state).unwrap();
        let plan = told(&mut knowledge).unwrap();
        let report = knowledge.output::<StrategyReport>("report").unwrap();
        let tries = report.records.iter().map(|record| (record.tried, record.succeeded)).collect::<Vec<_>>();
        (plan, tries)
    };
    let (west, east) = (plan("messenger", "west", &[-1.0, -2.0]), plan("messenger", "east", &[1.0, 2.0]));
    let others = [(1, 0), (1, 1), (0, 0)];
    assert_eq!(restarted(&[west]), ("west".into(), others.to_vec()), "east is known, and not there");
    assert_eq!(restarted(&[west, east]).0, "east");
    assert_eq!(restarted(&[]).0, "", "without a library there is nothing to do");
    let mended = plan("messenger", "west", &[-1.0, -3.0]);
    assert_eq!(restarted(&[mended]), ("west".into(), vec![(0, 0), (1, 1), (0, 0)]));
}

#[test]
fn of_two_plans_of_one_name_and_role_the_first_is_kept() {
    let mut knowledge = new_knowledge();
    knowledge.set("role", role("messenger"));
    let twice = [plan("messenger", "west", &[-1.0]), plan("messenger", "west", &[-2.0])];
    knowledge.set("library", PlanLibrary { plans: Sequence::new(&twice) });
    knowledge.tick();
    assert_eq!(knowledge.output::<PlanDescription>("strategy"), Some(twice[0]));
}

#[test]
fn no_robot_drives_backwards_to_a_place() {
    for (speed, goes) in [(0.4, true), (-0.4, false), (f64::NAN, false)] {
        let mut execute = Fixture::<ExecuteBlock<DifferentialActions>>::new();
        let pose = Pose2 { x: 1.0, y: 0.0, theta: std::f64::consts::PI };
        let robot = RobotModel { pose, ..RobotModel::default() };
        execute.set("robot", WheeledModel { robot, ..WheeledModel::default() });
        let action = GoToOrigin::request(Leg { x: 0.0, y: 0.0, speed, tolerance: 0.1 });
        execute.push("plan", Planned { ticket: 1, action, ..Planned::default() });
        execute.tick();
        assert_eq!(execute.output::<WheelSpeeds>("wheels").is_some(), goes, "{speed}");
        let status = execute.output::<ExecuteStatus>("status").unwrap();
        assert_eq!(status.failed + status.refused, u64::from(!goes), "{speed}");
    }
}

type Planning = Fixture<PlanBlock<StrategyPlanner>>;

/// A planner that knows where its robot is.
fn planning() -> Planning {
    let mut planner = Planning::new();
    planner.push("position", Position::default());
    planner.push("orientation", Orientation::default());
    planner
}

/// What Execute says when the action of that ticket has ended so.
fn ended(number: u64, ticket: u64, ending: Ending) -> ExecuteStatus {
    let ended = Ended { number, ticket, ending, route: Route::DELIBERATIVE, ..Ended::default() };
    ExecuteStatus { ticket, ended: Sequence::new(&[ended]), ..ExecuteStatus::default() }
}

/// What the planner sends in this tick: the kind of step, and where to.
fn sent(planner: &mut Planning) -> Vec<(PlanStep, Option<f64>, u64)> {
    planner.tick();
    let sent = planner.sent::<Planned>("plan");
    sent.iter().map(|plan| (plan.step, plan.action.arguments.first().copied(), plan.ticket)).collect()
}

#[test]
fn plan_runs_action_by_action_and_reports_success() {
    let mut planner = planning();
    assert_eq!(sent(&mut planner), [], "there is no plan");
    planner.set("strategy", plan("messenger", "west", &[-1.0, -2.0]));
    assert_eq!(sent(&mut planner), [(PlanStep::REPLACE, Some(-1.0), 1)]);
    // A reflex comes between.
    planner.set("situation", ExecuteStatus { replan: true.into(), ..ended(1, 1, Ending::CANCELLED) });
    assert_eq!(sent(&mut planner), [(PlanStep::REPLACE, Some(-1.0), 2)]);
    planner.set("situation", ended(2, 2, Ending::COMPLETED));
    assert_eq!(sent(&mut planner), [(PlanStep::REPLACE, Some(-2.0), 3)]);
    assert_eq!(planner.output::<PlanOutcome>("outcome"), None);
    planner.advance(1_500_000_000);
    planner.set("situation", ended(3, 3, Ending::COMPLETED));
    sent(&mut planner);
    let outcome = planner.output::<PlanOutcome>("outcome").unwrap();
    assert!(outcome.success.get() && outcome.name.as_str() == "west" && outcome.role.as_str() == "messenger");
    assert!(outcome.seconds >= 1.5);
    planner.set("situation", ended(3, 4, Ending::COMPLETED));
    assert_eq!(sent(&mut planner), [], "it has done what it should");
}

#[test]
fn a_failed_or_late_plan_waits_for_the_next_of_knowledge() {
    for fails_by_time in [false, true] {
        let mut planner = planning();
        planner.set("strategy", plan("messenger", "west", &[-1.0]));
        sent(&mut planner);
        match fails_by_time {
            true => planner.advance(61_000_000_000),
            false => planner.set("situation", ended(1, 1, Ending::FAILED)),
        }
        assert_eq!(sent(&mut planner), [(PlanStep::CLEAR, None, 2)], "what is under way ends");
        let outcome = planner.output::<PlanOutcome>("outcome").unwrap();
        assert!(!outcome.success.get() && outcome.name.as_str() == "west", "{outcome:?}");
        planner.set("situation", ended(2, 2, Ending::CANCELLED));
        assert_eq!(sent(&mut planner), [], "Knowledge has not yet learned of it");
        planner.set("strategy", plan("messenger", "east", &[1.0]));
        assert_eq!(sent(&mut planner), [(PlanStep::REPLACE, Some(1.0), 3)]);
        // Another role in the middle of that: it is not a failure.
        planner.set("strategy", plan("guard", "stay", &[0.0]));
        let steps = sent(&mut planner);
        assert_eq!(steps.first(), Some(&(PlanStep::CLEAR, None, 4)));
        assert_eq!(planner.output::<PlanOutcome>("outcome"), None);
    }
}
