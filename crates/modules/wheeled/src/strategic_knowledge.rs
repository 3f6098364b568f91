//! Knowledge of a wheeled robot with strategies, and their outcomes.

use serde::{Deserialize, Serialize};
use slate_plugin::mapek::{StrategyModel, StrategyPorts};
use slate_plugin::module::Hardware;
use slate_plugin::prelude::*;

use crate::knowledge::{WheeledKnowledge, WheeledKnowledgeParams, WheeledKnowledgeState};

/// Knowledge of a robot with a role and several plans.
/// Its state is the strategies alone: the robot's memory from run to run when the configuration gives this module a
/// memory.
pub struct StrategicKnowledge;

/// State of [`StrategicKnowledge`].
#[derive(Default, Serialize, Deserialize)]
#[serde(transparent)]
pub struct StrategicKnowledgeState {
    strategies: StrategyModel,
    #[serde(skip)]
    wheeled: WheeledKnowledgeState,
}

impl Knowledge for StrategicKnowledge {
    const NAME: &'static str = "strategic_knowledge";
    const DOC: &'static str = "Knows the robot's goal, its body, and its most promising plan.";
    type Models = (<WheeledKnowledge as Knowledge>::Models, StrategyPorts);
    type Params = WheeledKnowledgeParams;
    type State = StrategicKnowledgeState;
    const DESCRIBES_HARDWARE: bool = true;

    fn hardware(setup: &Setup<'_>, params: &WheeledKnowledgeParams) -> Result<Vec<Hardware>, Refusal> {
        WheeledKnowledge::hardware(setup, params)
    }

    fn create(
        setup: &Setup<'_>,
        params: &WheeledKnowledgeParams,
    ) -> Result<StrategicKnowledgeState, Refusal> {
        let wheeled = WheeledKnowledge::create(setup, params)?;
        Ok(StrategicKnowledgeState { wheeled, ..StrategicKnowledgeState::default() })
    }

    fn update(
        state: &mut StrategicKnowledgeState,
        (models, ports): &Self::Models,
        params: &WheeledKnowledgeParams,
        now: &Tick,
    ) {
        WheeledKnowledge::update(&mut state.wheeled, models, params, now);
        state.strategies.update(ports, now);
    }
}
