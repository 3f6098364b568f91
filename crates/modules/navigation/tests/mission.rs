//! Missions in Knowledge.
#![allow(clippy::unwrap_used, reason = "a test that fails panics")]

use slate_navigation::{
    NavigationCommand, NavigationGoal, NavigationKnowledge, NavigationKnowledgeParams, NavigationMission,
    NavigationRequest, PlaceName,
};
use slate_plugin::mapek::KnowledgeBlock;
use slate_plugin::module::testing::Fixture;
use slate_plugin::module::{Sequence, Text};

type Block = Fixture<KnowledgeBlock<NavigationKnowledge>>;

fn block(places: &[&str]) -> Block {
    let goals: Vec<_> = places.iter().map(|place| PlaceName { place: Text::new(place) }).collect();
    let params = NavigationKnowledgeParams {
        robot: Text::new("pioneer_p3dx"),
        places: Sequence::new(&goals),
        ..NavigationKnowledgeParams::default()
    };
    Fixture::with(params).unwrap()
}

fn send(block: &mut Block, command: NavigationCommand, x: f64) -> NavigationMission {
    let goal = NavigationGoal { x, ..NavigationGoal::default() };
    block.push("navigate", NavigationRequest { command, goal });
    block.advance(50_000_000);
    block.tick();
    block.output("mission").unwrap_or_default()
}

#[test]
fn a_mission_of_the_configuration_holds_until_another_one_comes() {
    let mut block = block(&["kitchen", "office"]);
    block.tick();
    let mission: NavigationMission = block.output("mission").unwrap();
    assert_eq!((mission.number, mission.goals.len()), (1, 2));
    assert_eq!(mission.goals[1].place.as_str(), "office");
    let mission = send(&mut block, NavigationCommand::GO_TO, 3.0);
    assert_eq!((mission.number, mission.goals.len(), mission.goals[0].x), (2, 1, 3.0));
    let mission = send(&mut block, NavigationCommand::APPEND, 4.0);
    assert_eq!((mission.number, mission.goals.len(), mission.goals[1].x), (2, 2, 4.0));
    let mission = send(&mut block, NavigationCommand::CANCEL, 0.0);
    assert_eq!((mission.number, mission.goals.len()), (3, 0));
}

#[test]
fn a_pause_holds_until_it_is_resumed() {
    let mut block = block(&["kitchen"]);
    assert!(send(&mut block, NavigationCommand::PAUSE, 0.0).is_paused.get());
    assert!(!send(&mut block, NavigationCommand::RESUME, 0.0).is_paused.get());
}

#[test]
fn a_goal_that_is_no_number_changes_nothing() {
    let mut block = block(&["kitchen"]);
    block.tick();
    send(&mut block, NavigationCommand::GO_TO, f64::NAN);
    assert!(!block.wrote("mission"));
}

#[test]
fn an_unknown_local_planner_is_refused() {
    let params = NavigationKnowledgeParams {
        robot: Text::new("pioneer_p3dx"),
        local_planner: Text::new("teb"),
        ..NavigationKnowledgeParams::default()
    };
    let refusal = Fixture::<KnowledgeBlock<NavigationKnowledge>>::with(params).err().unwrap();
    assert!(refusal.to_string().contains("expected mppi or dwa"), "{refusal}");
}
