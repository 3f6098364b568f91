//! Shared knowledge of a robot.

use super::*;

fn knowledge(says: &str) -> Result<slate_configuration::SharedKnowledge, String> {
    let read = read(&format!("agent.name = \"robot\"\n[share.knowledge]\n{says}\n"));
    let read = read.map_err(|report| report.to_string())?;
    Ok(read.share().unwrap().knowledge.clone().unwrap())
}

#[test]
fn a_robot_states_what_its_own_blocks_write() {
    for property in ["scout/found", "/scout/found", "slate://robot/scout/found"] {
        let own = knowledge(&format!("facts.victims = \"{property}\"")).unwrap();
        assert_eq!(own.facts["victims"].value, "scout/found");
    }
    for agent in ["other", "team"] {
        let refused = knowledge(&format!("facts.victims = \"slate://{agent}/scout/found\"")).unwrap_err();
        let says = format!("3:17: `slate://{agent}/scout/found` is not of agent `robot`");
        assert!(refused.contains(&says), "{refused}");
    }
}

#[test]
fn a_period_that_is_too_short_is_refused() {
    assert_eq!(knowledge("period = \"10ms\"").unwrap().period, 10_000_000);
    let refused = knowledge("period = \"1ms\"").unwrap_err();
    assert!(refused.contains("3:10: `period` is too short"), "{refused}");
}

#[test]
fn agent_without_settings_is_found_by_name() {
    let configuration = read("[share.agents.arm]\n[share.agents.leg]\nat = \"tls:10.0.0.4:7447\"\n").unwrap();
    let agents = &configuration.share().unwrap().agents;
    assert_eq!(agents["arm"].value, "local:arm");
    assert_eq!(agents["leg"].value, "tls:10.0.0.4:7447");
}
