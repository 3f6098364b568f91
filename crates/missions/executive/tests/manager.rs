//! Missions that plain modules follow: actions are outputs, conditions and results are inputs.

use slate_behavior_tree::TreeExecutor;
use slate_executive::conditions::ConditionValues;
use slate_executive::manager::{
    ActivityName, ActivityResult, ManagedActivity, ManagedMission, ManagedMissionStatus, MissionManager,
    MissionManagerParams, SwitchCondition,
};
use slate_executive::petri_net_plan::PetriNetRun;
use slate_golog::GologExecutor;
use slate_plugin::interfaces::{MissionState, Pose2, Verdict};
use slate_plugin::module::testing::Fixture;
use slate_plugin::module::{Bool, Sequence, Text};

/// Search from 2 m, follow what was found, and stop.
const NET: (&str, &str) = (
    "mission.pnml",
    "<pnml><net>
<place id='s'><name><value>Search_2.exec</value></name><initialMarking><value>1</value></initialMarking></place>
<place id='f'><name><value>Follow.exec</value></name></place>
<place id='g'><name><value>goal</value></name></place>
<transition id='found'><name><value>Search_2.end Follow.start [found]</value></name></transition>
<transition id='end'><name><value>Follow.end</value></name></transition>
<arc source='s' target='found'/><arc source='found' target='f'/><arc source='f' target='end'/>
<arc source='end' target='g'/></net></pnml>",
);
fn managed<E: ManagedMission>((name, text): (&str, &str)) -> Fixture<MissionManager<E>> {
    let folder = std::path::Path::new(env!("CARGO_TARGET_TMPDIR")).join("manager");
    std::fs::create_dir_all(&folder).unwrap();
    let file = folder.join(name);
    // Tests run at once, and read it while others write the same.
    if std::fs::read_to_string(&file).is_ok_and(|known| known == text) {
        return manager(&file);
    }
    std::fs::write(&file, text).unwrap();
    manager(&file)
}

fn manager<E: ManagedMission>(file: &std::path::Path) -> Fixture<MissionManager<E>> {
    let params = MissionManagerParams {
        mission_filename: Text::new(file.to_str().unwrap()),
        actions: Sequence::new(&[ActivityName::new("Search"), ActivityName::new("Follow")]),
        conditions: Sequence::new(&[Text::new("found")]),
        ..MissionManagerParams::default()
    };
    Fixture::with(params).unwrap()
}

/// A tick after 20 ms.
fn tick<E: ManagedMission>(manager: &mut Fixture<MissionManager<E>>) {
    manager.advance(20_000_000);
    manager.tick();
}

fn activity<E: ManagedMission>(manager: &Fixture<MissionManager<E>>, port: &str) -> Option<(bool, u64, f64)> {
    let activity = manager.output::<ManagedActivity>(port)?;
    Some((activity.is_active.get(), activity.starts, activity.arguments[0]))
}

fn succeeded() -> ActivityResult {
    ActivityResult { has_succeeded: Bool::TRUE, has_failed: Bool::FALSE }
}

#[test]
fn actions_of_a_managed_mission_are_outputs() {
    let mut manager = managed::<PetriNetRun>(NET);
    tick(&mut manager);
    assert_eq!(activity(&manager, "action_1"), Some((true, 1, 2.0)));
    assert_eq!(activity(&manager, "action_2"), Some((false, 0, 0.0)));
    let running = |manager: &Fixture<_>| manager.output::<ManagedMissionStatus>("mission").unwrap();
    assert_eq!(running(&manager).active.as_str(), "Search 2");
    tick(&mut manager);
    assert!(!manager.wrote("action_1") && !manager.wrote("mission"), "nothing has changed");
    // A linked condition ends the first and starts the second.
    manager.set("condition_1", SwitchCondition { holds: Bool::TRUE });
    tick(&mut manager);
    assert_eq!(activity(&manager, "action_1"), Some((false, 1, 2.0)), "a target stays");
    assert_eq!(activity(&manager, "action_2"), Some((true, 1, 0.0)));
    assert_eq!(running(&manager).active.as_str(), "Follow");
    // A result in the settling time is that of the action before.
    manager.set("result_2", succeeded());
    tick(&mut manager);
    assert_eq!(activity(&manager, "action_2"), None);
    manager.advance(100_000_000);
    manager.set("result_2", succeeded());
    tick(&mut manager);
    assert_eq!(activity(&manager, "action_2"), Some((false, 1, 0.0)));
    assert_eq!(manager.output::<Verdict>("verdict").unwrap().state, MissionState::SUCCEEDED);
}

#[test]
fn conditions_come_as_values_facts_and_messages() {
    let found = ConditionValues::new(&[("found", true)]);
    for port in ["conditions", "messages", "facts"] {
        let mut manager = managed::<PetriNetRun>(NET);
        tick(&mut manager);
        match port {
            "facts" => manager.set(port, found),
            _ => manager.push(port, found),
        }
        tick(&mut manager);
        assert_eq!(activity(&manager, "action_2"), Some((true, 1, 0.0)), "{port}");
    }
}

#[test]
fn a_restored_manager_goes_on_as_the_saved_one() {
    let mut manager = managed::<PetriNetRun>(NET);
    tick(&mut manager);
    tick(&mut manager);
    let mut other = managed::<PetriNetRun>(NET);
    other.restore(&manager.save().unwrap()).unwrap();
    other.advance(40_000_000);
    for manager in [&mut manager, &mut other] {
        tick(manager);
        assert_eq!((activity(manager, "action_1"), manager.wrote("mission")), (None, false));
        manager.set("condition_1", SwitchCondition { holds: Bool::TRUE });
        tick(manager);
        assert_eq!(activity(manager, "action_2"), Some((true, 1, 0.0)));
    }
    assert_eq!(other.save().unwrap(), manager.save().unwrap());
}

#[test]
fn trees_and_programs_are_managed_as_well() {
    let tree = "<root BTCPP_format='4'><BehaviorTree ID='main'><Action ID='Search'/></BehaviorTree></root>";
    ends_with_its_action(managed::<TreeExecutor>(("search.xml", tree)), 0.0);
    let program = "mission lookout\naction look\n    performs Search(3)\nprocedure main {\n    look\n}\n";
    ends_with_its_action(managed::<GologExecutor>(("search.golog", program)), 3.0);
}

fn ends_with_its_action<E: ManagedMission>(mut manager: Fixture<MissionManager<E>>, argument: f64) {
    tick(&mut manager);
    let verdict = manager.output::<Verdict>("verdict").map(|verdict| verdict.reason);
    assert_eq!(activity(&manager, "action_1"), Some((true, 1, argument)), "{verdict:?}");
    manager.advance(200_000_000);
    manager.set("result_1", succeeded());
    let verdicts = (0..3).filter_map(|_| {
        tick(&mut manager);
        manager.output::<Verdict>("verdict")
    });
    assert_eq!(verdicts.last().map(|verdict| verdict.state), Some(MissionState::SUCCEEDED));
}

#[test]
fn an_action_without_an_output_is_refused_with_its_name() {
    let text = NET.1.replace("Follow", "Dance");
    let mut manager = managed::<PetriNetRun>(("dance.pnml", &text));
    tick(&mut manager);
    let verdict = manager.output::<Verdict>("verdict").unwrap();
    assert_eq!(verdict.state, MissionState::FAILED);
    assert!(verdict.reason.as_str().starts_with("dance.pnml: expected the action `Dance`"), "{verdict:?}");
}

#[test]
fn more_conditions_than_a_mission_may_know_end_it() {
    let mut manager = managed::<PetriNetRun>(NET);
    tick(&mut manager);
    for number in 0..300 {
        manager.push("conditions", ConditionValues::new(&[(format!("c{number}").as_str(), true)]));
        tick(&mut manager);
    }
    manager.params().revision = 0;
    let saved = String::from_utf8_lossy(&manager.save().unwrap()).into_owned();
    assert!(saved.contains("expected at most 256 conditions, found `c256`"), "{saved}");
}

#[test]
fn a_target_comes_by_a_link_or_by_arguments() {
    let net = "<pnml><net>
<place id='s'><name><value>Search.exec</value></name><initialMarking><value>1</value></initialMarking></place>
<place id='f'><name><value>Follow_3_-4.exec</value></name></place>
<transition id='t'><name><value>Search.end Follow_3_-4.start [found]</value></name></transition>
<arc source='s' target='t'/><arc source='t' target='f'/></net></pnml>";
    let mut manager = managed::<PetriNetRun>(("targets.pnml", net));
    let target = |manager: &Fixture<_>| manager.output::<Pose2>("target").map(|pose| [pose.x, pose.y]);
    tick(&mut manager);
    assert_eq!(target(&manager), None, "nothing leads anywhere yet");
    manager.set("target_1", Pose2 { x: 1.0, y: 2.0, theta: 0.0 });
    tick(&mut manager);
    assert_eq!(target(&manager), Some([1.0, 2.0]));
    manager.set("target_1", Pose2 { x: 1.5, y: 2.0, theta: 0.0 });
    tick(&mut manager);
    assert_eq!(target(&manager), Some([1.5, 2.0]), "it is followed while the action runs");
    manager.set("condition_1", SwitchCondition { holds: Bool::TRUE });
    tick(&mut manager);
    assert_eq!(target(&manager), Some([3.0, -4.0]));
    assert_eq!(manager.output::<ManagedActivity>("action_2").map(|action| action.target.y), Some(-4.0));
}
