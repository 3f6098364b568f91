//! Knowledge of a robot on wheels that follows a plan with others.

use slate_plugin::mapek::FactTable;
use slate_plugin::module::Hardware;
use slate_plugin::prelude::*;
use slate_wheeled::knowledge::{WheeledKnowledge, WheeledKnowledgeParams, WheeledKnowledgeState};

use crate::team::MissionStatement;

/// Statements about the plan.
#[ports]
pub struct MissionPorts {
    /// Statements of this robot's Plan, for other robots.
    pub claims: Known<FactTable<MissionStatement>>,
    /// Statements of the other robots, for this robot's Plan.
    pub partners: Known<FactTable<MissionStatement>>,
}

/// Knowledge of the robot, and of the statements of a plan's robots.
pub struct MissionKnowledge;

impl Knowledge for MissionKnowledge {
    const NAME: &'static str = "mission_knowledge";
    const DOC: &'static str = "Knows the wheeled robot, and the statements of a plan's robots.";
    type Models = (<WheeledKnowledge as Knowledge>::Models, MissionPorts);
    type Params = WheeledKnowledgeParams;
    type State = WheeledKnowledgeState;
    const DESCRIBES_HARDWARE: bool = true;

    fn hardware(setup: &Setup<'_>, params: &WheeledKnowledgeParams) -> Result<Vec<Hardware>, Refusal> {
        WheeledKnowledge::hardware(setup, params)
    }

    fn create(setup: &Setup<'_>, params: &WheeledKnowledgeParams) -> Result<WheeledKnowledgeState, Refusal> {
        WheeledKnowledge::create(setup, params)
    }

    fn update(
        state: &mut WheeledKnowledgeState,
        (models, _): &Self::Models,
        params: &WheeledKnowledgeParams,
        now: &Tick,
    ) {
        WheeledKnowledge::update(state, models, params, now);
    }
}
