//! Publications of missions, and orders of a developer.

use std::path::PathBuf;

use slate_executive::behavior_tree_plan::{BehaviorTreePlan, BehaviorTreePlanParams};
use slate_executive::conditions::ConditionValues;
use slate_executive::golog_plan::{GologPlan, GologPlanParams};
use slate_executive::petri_net_plan::{PetriNetPlan, PetriNetPlanParams};
use slate_executive::view::{
    ForcedOutcome, MissionActivity, MissionCommand, MissionElementKind, MissionGraph, MissionItemStatus,
    MissionOrder,
};
use slate_petri_net::{NetBuilder, write_pnml};
use slate_plugin::interfaces::{MissionState, Verdict};
use slate_plugin::mapek::{Ending, Plan, PlanBlock};
use slate_plugin::module::Text;
use slate_plugin::module::testing::Fixture;

use crate::common::{sent, status};

/// Writes a mission's file.
pub fn file(name: &str, text: &str) -> PathBuf {
    let folder = std::path::Path::new(env!("CARGO_TARGET_TMPDIR")).join("view");
    std::fs::create_dir_all(&folder).unwrap();
    let file = folder.join(name);
    std::fs::write(&file, text).unwrap();
    file
}

/// A graph as the test looks at it: its number, and kind and label of each element.
pub fn graph<P: Plan>(plan: &Fixture<PlanBlock<P>>) -> (u32, Vec<(MissionElementKind, String)>) {
    let look = |graph: &MissionGraph| {
        let elements = graph.elements.iter();
        (graph.id, elements.map(|own| (own.kind, own.label.as_str().to_owned())).collect())
    };
    plan.read("graph", look).unwrap()
}

/// The element with that label.
pub fn element(graph: &(u32, Vec<(MissionElementKind, String)>), label: &str) -> u32 {
    let found = graph.1.iter().position(|(_, own)| own == label);
    u32::try_from(found.unwrap()).unwrap()
}

/// Status and text of the item of an element, in the newest activity; `None` while it is at rest.
pub fn item<P: Plan>(plan: &Fixture<PlanBlock<P>>, element: u32) -> Option<(MissionItemStatus, u16, String)> {
    let look = |activity: &MissionActivity| {
        let found = activity.items.iter().find(|item| u32::from(item.element) == element);
        found.map(|item| (item.status, item.count, item.text.as_str().to_owned()))
    };
    plan.read("activity", look).unwrap()
}

/// Texts of the items of a status, with their count.
fn texts<P: Plan>(plan: &Fixture<PlanBlock<P>>, status: MissionItemStatus) -> Vec<(u16, String)> {
    let look = |activity: &MissionActivity| {
        let own = activity.items.iter().filter(|item| item.status == status);
        own.map(|item| (item.count, item.text.as_str().to_owned())).collect()
    };
    plan.read("activity", look).unwrap()
}

pub fn order(command: MissionCommand) -> MissionOrder {
    MissionOrder { command, outcome: ForcedOutcome::SUCCESS, element: 0, graph: 0 }
}

pub fn force(
    graph: &(u32, Vec<(MissionElementKind, String)>),
    label: &str,
    outcome: ForcedOutcome,
) -> MissionOrder {
    MissionOrder { command: MissionCommand::FORCE, outcome, element: element(graph, label), graph: graph.0 }
}

type Planning = Fixture<PlanBlock<PetriNetPlan>>;

/// A net that waits for `ready`, goes to a place, and is at its goal.
fn net_planning(name: &str) -> Planning {
    let mut net = NetBuilder::new(name);
    let (start, going) = (net.place("start", 1), net.place("Go_1.exec", 0));
    let (goal, fail) = (net.place("goal", 0), net.place("fail", 0));
    net.transition("*.start [and ready (not obstacle)]", &[(start, 1)], &[(going, 1)]);
    net.transition("*.end", &[(going, 1)], &[(goal, 1)]);
    net.transition("*.fail", &[(going, 1)], &[(fail, 1)]);
    let file = file(&format!("{name}.pnml"), &write_pnml(&net.finish().unwrap()));
    let plan_filename = Text::new(file.to_str().unwrap());
    Planning::with(PetriNetPlanParams { plan_filename, ..PetriNetPlanParams::default() }).unwrap()
}

const START: &str = "*.start [and ready (not obstacle)]";

#[test]
fn net_shows_its_tokens_and_why_transitions_wait() {
    use MissionItemStatus as Status;
    let mut plan = net_planning("shown");
    sent(&mut plan);
    let graph = graph(&plan);
    let kinds: Vec<u32> = graph.1.iter().map(|(kind, _)| u32::from(kind.0)).collect();
    let count = |kind: MissionElementKind| kinds.iter().filter(|own| **own == u32::from(kind.0)).count();
    assert_eq!(
        [MissionElementKind::GROUP, MissionElementKind::PLACE, MissionElementKind::TRANSITION].map(count),
        [1, 4, 3]
    );
    assert_eq!(count(MissionElementKind::EDGE), 6);
    let [start, go, began, ended] =
        ["start", "Go_1.exec", START, "*.end"].map(|label| element(&graph, label));
    assert_eq!(item(&plan, start), Some((Status::MARKED, 1, String::new())));
    assert_eq!(
        item(&plan, began),
        Some((Status::WAITING, 0, "`ready` is unknown, `obstacle` is unknown".into()))
    );
    assert_eq!(item(&plan, ended), Some((Status::WAITING, 0, "no token in `Go_1.exec`".into())));
    assert_eq!(texts(&plan, Status::UNKNOWN), [(0, "ready".into()), (0, "obstacle".into())]);
    sent(&mut plan);
    assert!(!plan.wrote("activity") && !plan.wrote("graph"), "nothing has changed");
    plan.push("conditions", ConditionValues::new(&[("ready", true), ("obstacle", true)]));
    sent(&mut plan);
    assert_eq!(item(&plan, began), Some((Status::WAITING, 0, "`ready` is true, `obstacle` is true".into())));
    assert_eq!(texts(&plan, Status::HOLDS), [(0, "obstacle".into()), (0, "ready".into())]);
    plan.push("conditions", ConditionValues::new(&[("obstacle", false)]));
    assert_eq!(sent(&mut plan), ["Go 1"]);
    assert_eq!(item(&plan, start), None);
    assert_eq!(item(&plan, go), Some((Status::MARKED, 1, "the action runs".into())));
    assert_eq!(item(&plan, ended), Some((Status::WAITING, 0, "`Go_1` has not succeeded yet".into())));
    assert!(!plan.wrote("graph"));
}

#[test]
fn paused_net_makes_single_steps_and_forced_ones() {
    let mut plan = net_planning("paused");
    sent(&mut plan);
    let graph = graph(&plan);
    // Not before it is paused.
    plan.push("orders", order(MissionCommand::STEP));
    plan.push("orders", order(MissionCommand::PAUSE));
    plan.push("conditions", ConditionValues::new(&[("ready", true), ("obstacle", false)]));
    assert_eq!(sent(&mut plan), [""; 0]);
    assert!(plan.read("activity", |activity: &MissionActivity| activity.is_paused.get()).unwrap());
    assert_eq!(
        item(&plan, element(&graph, START)),
        Some((MissionItemStatus::ENABLED, 0, "fires with the next step".into()))
    );
    plan.push("orders", order(MissionCommand::STEP));
    assert_eq!(sent(&mut plan), ["Go 1"]);
    plan.set("situation", status(0, 1, None));
    // A transition without its token, and one of another graph, stay.
    plan.push("orders", force(&graph, START, ForcedOutcome::SUCCESS));
    plan.push("orders", MissionOrder { graph: 1, ..force(&graph, "*.end", ForcedOutcome::SUCCESS) });
    assert_eq!(sent(&mut plan), [""; 0]);
    assert!(!plan.wrote("activity"));
    // The action is forced to fail, which Execute hears; the net sees it with its next step.
    plan.push("orders", force(&graph, "Go_1.exec", ForcedOutcome::FAILURE));
    assert_eq!(sent(&mut plan), ["clear"]);
    plan.push("orders", order(MissionCommand::RESUME));
    sent(&mut plan);
    assert_eq!(plan.output::<Verdict>("verdict").unwrap().state, MissionState::FAILED);
}

#[test]
fn forced_transition_moves_tokens_whatever_its_guard_says() {
    let mut plan = net_planning("forced");
    sent(&mut plan);
    let graph = graph(&plan);
    plan.push("orders", force(&graph, START, ForcedOutcome::SUCCESS));
    assert_eq!(sent(&mut plan), ["Go 1"]);
    plan.set("situation", status(0, 1, None));
    plan.push("orders", force(&graph, "*.end", ForcedOutcome::SUCCESS));
    assert_eq!(sent(&mut plan), ["clear"]);
    assert_eq!(plan.output::<Verdict>("verdict").unwrap().state, MissionState::SUCCEEDED);
    let state = plan.read("activity", |activity: &MissionActivity| activity.state).unwrap();
    assert_eq!(state, MissionState::SUCCEEDED);
}

#[test]
fn resumed_mission_is_paused_and_publishes_nothing_again() {
    let mut plan = net_planning("resumed");
    plan.push("orders", order(MissionCommand::PAUSE));
    sent(&mut plan);
    plan.push("orders", order(MissionCommand::PAUSE));
    sent(&mut plan);
    let mut other = net_planning("resumed");
    other.restore(&plan.save().unwrap()).unwrap();
    other.advance(40_000_000);
    for plan in [&mut plan, &mut other] {
        plan.push("conditions", ConditionValues::new(&[("ready", true), ("obstacle", false)]));
        assert_eq!(sent(plan), [""; 0]);
        assert!(!plan.wrote("graph") && plan.wrote("activity"));
        assert_eq!(sent(plan), [""; 0]);
        assert!(!plan.wrote("activity"));
        plan.push("orders", order(MissionCommand::RESUME));
        assert_eq!(sent(plan), ["Go 1"]);
    }
    assert_eq!(other.save().unwrap(), plan.save().unwrap());
}

#[test]
fn tree_shows_the_status_of_its_nodes_and_forced_leaves() {
    let text = "<root BTCPP_format=\"4\"><BehaviorTree ID=\"tree\"><Sequence><Condition ID=\"person\"/><Go x=\"2\"/>\
                <AlwaysSuccess/></Sequence></BehaviorTree><TreeNodesModel><Action ID=\"Go\"><input_port \
                name=\"x\"/></Action><Condition ID=\"person\"/></TreeNodesModel></root>";
    let tree_filename = Text::new(file("tree.xml", text).to_str().unwrap());
    let params = BehaviorTreePlanParams { tree_filename, ..BehaviorTreePlanParams::default() };
    let mut plan = Fixture::<PlanBlock<BehaviorTreePlan>>::with(params).unwrap();
    assert_eq!(sent(&mut plan), [""; 0]);
    let graph = graph(&plan);
    let labels: Vec<&str> = graph.1.iter().map(|(_, label)| label.as_str()).collect();
    assert_eq!(labels, ["Sequence", "person", "Go", "AlwaysSuccess"]);
    assert_eq!(item(&plan, 0).unwrap().0, MissionItemStatus::RUNNING);
    assert_eq!(item(&plan, 1), Some((MissionItemStatus::WAITING, 0, "`person` is unknown".into())));
    // What is above a leaf follows from it.
    plan.push("orders", force(&graph, "Sequence", ForcedOutcome::SUCCESS));
    plan.push("orders", force(&graph, "Go", ForcedOutcome::SUCCESS));
    assert_eq!(sent(&mut plan), [""; 0]);
    plan.push("orders", force(&graph, "person", ForcedOutcome::SUCCESS));
    assert_eq!(sent(&mut plan), ["Go 2"]);
    assert_eq!(item(&plan, 2), Some((MissionItemStatus::RUNNING, 0, "Go(2)".into())));
    plan.set("situation", status(0, 1, None));
    plan.push("orders", force(&graph, "Go", ForcedOutcome::SUCCESS));
    assert_eq!(sent(&mut plan), ["clear"]);
    assert_eq!(plan.output::<Verdict>("verdict").unwrap().state, MissionState::SUCCEEDED);
}

#[test]
fn program_shows_its_trace_and_what_remains() {
    use MissionItemStatus as Status;
    let text = "domain place = desk, shelf\ntable x(place) = desk: 1.5, shelf: -2\nfluent met = false\n\
                exogenous bell met becomes true\naction go(p: place) performs Go(x(p))\naction rest performs nothing met becomes false\n\
                procedure main { for p: place { go(p) }; rest; test met }";
    let program_filename = Text::new(file("tour.golog", text).to_str().unwrap());
    let params = GologPlanParams { program_filename, ..GologPlanParams::default() };
    let mut plan = Fixture::<PlanBlock<GologPlan>>::with(params).unwrap();
    assert_eq!(sent(&mut plan), ["Go 1.5"]);
    let graph = graph(&plan);
    assert_eq!(texts(&plan, Status::PERFORMED), [(1, "go(desk)".into())]);
    assert_eq!(item(&plan, 0), Some((Status::RUNNING, 0, "go(desk)".into())));
    let rest: Vec<String> = texts(&plan, Status::REMAINING).into_iter().map(|(_, text)| text).collect();
    assert_eq!(rest[0], "go(desk)");
    assert!(rest.contains(&"rest".into()) && rest.contains(&"test met".into()), "{rest:?}");
    plan.set("situation", status(0, 1, None));
    plan.push("orders", order(MissionCommand::PAUSE));
    plan.push("orders", force(&graph, "action 1", ForcedOutcome::SUCCESS));
    assert_eq!(sent(&mut plan), ["clear"]);
    // One transition after the other.
    plan.push("orders", order(MissionCommand::STEP));
    assert_eq!(sent(&mut plan), ["Go -2"]);
    assert_eq!(texts(&plan, Status::SUCCEEDED), [(0, "go(desk)".into())]);
    plan.set("situation", status(1, 3, Some(Ending::COMPLETED)));
    plan.push("orders", order(MissionCommand::RESUME));
    sent(&mut plan);
    assert_eq!(texts(&plan, Status::PERFORMED).last(), Some(&(0, "rest".into())));
    assert_eq!(texts(&plan, Status::REMAINING), [(0, "test met".into())]);
    plan.push("orders", force(&graph, "bell", ForcedOutcome::SUCCESS));
    sent(&mut plan);
    assert_eq!(plan.output::<Verdict>("verdict").unwrap().state, MissionState::SUCCEEDED);
    assert_eq!(texts(&plan, Status::OCCURRED), [(0, "bell".into())]);
}
