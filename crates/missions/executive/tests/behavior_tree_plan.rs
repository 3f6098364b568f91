//! The Plan that follows a behavior tree.

use std::path::{Path, PathBuf};

use slate_executive::behavior_tree_plan::{BehaviorTreePlan, BehaviorTreePlanParams, TreeMissionStatus};
use slate_executive::conditions::ConditionValues;
use slate_plugin::interfaces::{MissionState, Verdict};
use slate_plugin::mapek::{Ending, ExecuteStatus, PlanBlock};
use slate_plugin::module::Text;
use slate_plugin::module::testing::Fixture;

use crate::common::{sent, status};

type TreePlanning = Fixture<PlanBlock<BehaviorTreePlan>>;

/// Writes a tree; returns its file.
fn file(name: &str, node: &str) -> PathBuf {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join("behavior-tree-plan");
    std::fs::create_dir_all(&folder).unwrap();
    let file = folder.join(format!("{name}.xml"));
    let text = format!(
        "<root BTCPP_format=\"4\"><BehaviorTree ID=\"{name}\">{node}</BehaviorTree>\
         <TreeNodesModel><Action ID=\"Go\"><input_port name=\"x\"/></Action><Action ID=\"Look\"/>\
         <Condition ID=\"person\"/></TreeNodesModel></root>"
    );
    std::fs::write(&file, text).unwrap();
    file
}

fn planning(file: &Path) -> TreePlanning {
    let tree_filename = Text::new(file.to_str().unwrap());
    TreePlanning::with(BehaviorTreePlanParams { tree_filename, ..BehaviorTreePlanParams::default() }).unwrap()
}

#[test]
fn actions_of_the_tree_are_sent_with_values_of_its_blackboard() {
    let node = "<Sequence><Script code=\"far := 1.5\"/><Go x=\"{far}\"/><Script code=\"far = -far\"/><Go x=\"{far}\"/>\
                </Sequence>";
    let mut plan = planning(&file("sequence", node));
    assert_eq!(sent(&mut plan), ["Go 1.5"]);
    let mission = plan.output::<TreeMissionStatus>("mission").unwrap();
    assert_eq!((mission.tree.as_str(), mission.running.as_str()), ("sequence", "Go"));
    plan.set("situation", status(0, 1, None));
    assert_eq!(sent(&mut plan), [""; 0]);
    assert!(!plan.wrote("mission"), "nothing has changed");
    plan.set("situation", status(1, 1, Some(Ending::COMPLETED)));
    assert_eq!(sent(&mut plan), ["Go -1.5"]);
    plan.set("situation", status(2, 2, Some(Ending::COMPLETED)));
    assert_eq!(sent(&mut plan), [""; 0]);
    assert_eq!(plan.output::<Verdict>("verdict").unwrap().state, MissionState::SUCCEEDED);
    assert_eq!(sent(&mut plan), [""; 0]);
    assert!(!plan.wrote("verdict"), "it ended once");
}

#[test]
fn arguments_are_in_the_order_of_the_model() {
    let models = "<TreeNodesModel><Action ID=\"GoToOrigin\"><input_port name=\"x\"/><input_port name=\"y\"/>\
                  <input_port name=\"speed\" default=\"0.4\"/><output_port name=\"end\"/>\
                  <input_port name=\"tolerance\" default=\"0.1\"/></Action></TreeNodesModel>";
    for (number, (ports, expected)) in [
        ("x=\"1\" y=\"2\" tolerance=\"0.2\"", "GoToOrigin 1 2 0.4 0.2"),
        ("tolerance=\"0.2\" end=\"{end}\" y=\"2\" x=\"1\"", "GoToOrigin 1 2 0.4 0.2"),
        ("y=\"2\" speed=\"0.3\" x=\"1\"", "GoToOrigin 1 2 0.3 0.1"),
    ]
    .into_iter()
    .enumerate()
    {
        let node = format!(
            "<Action ID=\"GoToOrigin\" {ports}/></BehaviorTree>{models}<BehaviorTree ID=\"other\"><Look/>"
        );
        let file = file(&format!("order{number}"), &node);
        let text = std::fs::read_to_string(&file).unwrap();
        let main = format!("<root main_tree_to_execute=\"order{number}\"");
        std::fs::write(&file, text.replace("<root", &main)).unwrap();
        assert_eq!(sent(&mut planning(&file)), [expected], "{ports}");
    }
    let mut plan = planning(&file("untold", "<Action ID=\"Turn\" b=\"1\" a=\"2\"/>"));
    assert_eq!(sent(&mut plan), ["Turn 1 2"], "without a model in the order of the file");
}

#[test]
fn a_condition_halts_what_a_reactive_node_runs() {
    let node = "<ReactiveFallback><Sequence><person/><Look/></Sequence><Go x=\"1\"/></ReactiveFallback>";
    let mut plan = planning(&file("react", node));
    assert_eq!(sent(&mut plan), [""; 0], "nobody knows yet whether there is a person");
    plan.push("conditions", ConditionValues::new(&[("person", false)]));
    assert_eq!(sent(&mut plan), ["Go 1"]);
    plan.set("situation", status(0, 1, None));
    plan.push("conditions", ConditionValues::new(&[("person", true)]));
    assert_eq!(sent(&mut plan), ["clear", "Look"]);
}

#[test]
fn conditions_without_value_are_named() {
    let node = "<Parallel><Go x=\"1\"/><person/><Condition ID=\"localised\"/></Parallel>";
    let mut plan = planning(&file("untold_conditions", node));
    sent(&mut plan);
    let running = |plan: &TreePlanning| plan.output::<TreeMissionStatus>("mission").unwrap().running;
    assert_eq!(running(&plan).as_str(), "Go, waits for `person`, `localised`");
    plan.push("conditions", ConditionValues::new(&[("person", true)]));
    sent(&mut plan);
    assert_eq!(running(&plan).as_str(), "Go, waits for `localised`");
}

#[test]
fn an_action_of_a_tree_that_a_reflex_cancels_is_sent_again() {
    let mut plan = planning(&file("reflex", "<Go x=\"1\"/>"));
    sent(&mut plan);
    plan.set("situation", status(0, 1, None));
    sent(&mut plan);
    let cancelled = status(1, 1, Some(Ending::CANCELLED));
    plan.set("situation", ExecuteStatus { epoch: 1, replan: true.into(), ..cancelled });
    assert_eq!(sent(&mut plan), ["Go 1"]);
}

#[test]
fn retries_and_time_outs_of_a_tree_follow_the_clock() {
    let node = "<RetryUntilSuccessful num_attempts=\"2\"><Timeout msec=\"1000\"><Go x=\"1\"/></Timeout>\
                </RetryUntilSuccessful>";
    let mut plan = planning(&file("times", node));
    assert_eq!(sent(&mut plan), ["Go 1"]);
    plan.set("situation", status(0, 1, None));
    plan.advance(900_000_000);
    assert_eq!(sent(&mut plan), [""; 0]);
    plan.advance(100_000_000);
    assert_eq!(sent(&mut plan), ["clear", "Go 1"]);
    plan.set("situation", status(1, 3, Some(Ending::FAILED)));
    sent(&mut plan);
    assert_eq!(plan.output::<Verdict>("verdict").unwrap().state, MissionState::FAILED);
}

#[test]
fn a_restored_tree_goes_on_as_the_saved_one() {
    let node = "<Sequence><Script code=\"far := 3\"/><Go x=\"{far}\" _onSuccess=\"far = 4\"/><Delay delay_msec=\"500\">\
                <Go x=\"{far}\"/></Delay></Sequence>";
    let file = file("saved", node);
    let mut plan = planning(&file);
    sent(&mut plan);
    let mut other = planning(&file);
    other.restore(&plan.save().unwrap()).unwrap();
    assert_eq!(
        other.save().unwrap(),
        plan.save().unwrap(),
        "a state that waits for its tree is saved as it is"
    );
    other.advance(20_000_000);
    for plan in [&mut plan, &mut other] {
        plan.set("situation", status(0, 1, None));
        sent(plan);
        let cancelled = status(1, 1, Some(Ending::CANCELLED));
        plan.set("situation", ExecuteStatus { epoch: 1, replan: true.into(), ..cancelled });
        assert_eq!(sent(plan), ["Go 3"], "what a reflex has cleared is sent with the arguments of its start");
        plan.set("situation", ExecuteStatus { epoch: 1, ..status(2, 2, Some(Ending::COMPLETED)) });
        assert_eq!(sent(plan), [""; 0]);
        plan.advance(500_000_000);
        assert_eq!(sent(plan), ["Go 4"]);
    }
    assert_eq!(other.save().unwrap(), plan.save().unwrap());
}

#[test]
fn a_changed_tree_takes_over_or_is_refused_in_a_running_mission() {
    let place = file("reload", "<Sequence><Go x=\"1\"/><Go x=\"2\"/></Sequence>");
    let mut plan = planning(&place);
    sent(&mut plan);
    plan.set("situation", status(0, 1, None));
    file("reload", "<Sequence><Go x=\"1\"/><Look/></Sequence>");
    plan.params().revision = 1;
    assert_eq!(sent(&mut plan), [""; 0]);
    // A tree that lacks the node that runs: the mission continues with the old one.
    file("reload", "<Look/>");
    plan.params().revision = 2;
    assert_eq!(sent(&mut plan), [""; 0]);
    std::fs::write(&place, "<root>").unwrap();
    plan.params().revision = 3;
    sent(&mut plan);
    plan.set("situation", status(1, 1, Some(Ending::COMPLETED)));
    assert_eq!(sent(&mut plan), ["Look"]);
}

#[test]
fn an_action_without_arguments_goes_on_in_a_changed_tree() {
    let node = |first: &str| format!("<Sequence>{first}<Look/></Sequence>");
    let mut plan = planning(&file("other", &node("<Go name=\"first\" x=\"-1\"/>")));
    sent(&mut plan);
    plan.set("situation", status(1, 1, Some(Ending::COMPLETED)));
    assert_eq!(sent(&mut plan), ["Look"]);
    // A `wait` of -1 s would be refused.
    file("other", &node("<Action ID=\"wait\" name=\"first\" seconds=\"1\"/>"));
    plan.params().revision = 1;
    assert_eq!(sent(&mut plan), [""; 0]);
    assert_eq!(plan.output::<TreeMissionStatus>("mission").unwrap().running.as_str(), "Look");
    plan.set("situation", status(2, 2, Some(Ending::COMPLETED)));
    sent(&mut plan);
    assert_eq!(plan.output::<Verdict>("verdict").unwrap().state, MissionState::SUCCEEDED);
}

#[test]
fn a_tree_that_can_not_run_fails_with_the_reason() {
    let reason = |file: &Path| {
        let mut plan = planning(file);
        assert_eq!(sent(&mut plan), [""; 0]);
        let verdict = plan.output::<Verdict>("verdict").unwrap();
        assert_eq!(verdict.state, MissionState::FAILED);
        verdict.reason.as_str().to_owned()
    };
    assert_eq!(reason(Path::new("")), "a mission needs a file with its tree");
    assert!(reason(Path::new("none.xml")).starts_with("none.xml: can't be read"));
    reason(&file("words", "<Go x=\"there\"/>"));
    let script = reason(&file("script", "<Script code=\"x := missing\"/>"));
    assert!(script.starts_with("node `script/0 Script` (line 1): "), "{script}");
}

#[test]
fn names_of_numbers_are_a_parameter_of_the_plan() {
    let file = file("enumerations", "<Sequence><Script code=\"x := RED\"/><Go x=\"{x}\"/></Sequence>");
    let mut plan = planning(&file);
    plan.params().enumerations = Text::new("GREEN = -1, RED=3,");
    assert_eq!(sent(&mut plan), ["Go 3"]);
    let mut plan = planning(&file);
    plan.params().enumerations = Text::new("RED");
    sent(&mut plan);
    assert_eq!(plan.output::<Verdict>("verdict").unwrap().state, MissionState::FAILED);
}
