//! Knowledge of a robot with several strategies: those of any wheeled robot, and their outcomes.

use slate_plugin::mapek::{StrategyModel, StrategyPorts};
use slate_plugin::prelude::*;

use crate::knowledge::{WheeledKnowledge, WheeledKnowledgeParams, WheeledModels};

/// The knowledge of a robot that has a role and plans to choose from. Its state is the strategies alone: what the robot
/// remembers from run to run when the configuration gives this module a memory.
pub struct StrategicKnowledge;

impl Knowledge for StrategicKnowledge {
    const NAME: &'static str = "strategic_knowledge";
    const DOC: &'static str =
        "Knows the robot's goal, its body, and which of its plans is the most promising.";
    type Models = (WheeledModels, StrategyPorts);
    type Params = WheeledKnowledgeParams;
    type State = StrategyModel;

    fn update(
        strategies: &mut StrategyModel,
        (models, ports): &Self::Models,
        params: &WheeledKnowledgeParams,
        now: &Tick,
    ) {
        WheeledKnowledge::update(&mut (), models, params, now);
        strategies.update(ports, now);
    }
}
