//! Knowledge of a robot with strategies that states its role to others.

use serde::{Deserialize, Serialize};
use slate_plugin::mapek::{FactTable, Statements, StrategyModel, StrategyPorts};
use slate_plugin::module::Hardware;
use slate_plugin::prelude::*;
use slate_wheeled::knowledge::{WheeledKnowledge, WheeledKnowledgeParams, WheeledKnowledgeState};

/// Statement of a robot about its role.
#[interface]
#[derive(PartialEq, Serialize, Deserialize)]
pub struct RoleClaim {
    /// Time at which it took its role, by its clock.
    #[unit("ns")]
    pub since: u64,
    /// 1 if it is the attacker, 0 if it is the defender.
    pub attacks: u32,
    /// 1 if it may become the attacker, else 0.
    pub ready: u32,
}

/// Claim of this robot, and its statements.
#[ports]
pub struct TeamPorts {
    /// Claim of this robot, from its Analyze.
    claim: Input<RoleClaim>,
    /// Statements of another robot about roles.
    /// From its Knowledge, or those of the team.
    pub others: Known<FactTable<RoleClaim>>,
    /// Statements of this robot about roles, by its name.
    #[capacity(8)]
    claims: Output<FactTable<RoleClaim>>,
}

/// Parameters of [`TeamKnowledge`].
#[params]
pub struct TeamKnowledgeParams {
    #[param(default = "r2", doc = "name of the robot in its statements")]
    name: Text<28>,
    #[param(default = "pioneer_p3dx", doc = "robot's description, as of `wheeled_knowledge`")]
    robot: Text<252>,
    #[param(
        default = "vrep",
        follows = ["world.robots.{robot}.profile", "world.profile"],
        doc = "profile of its sensors"
    )]
    profile: Text<28>,
}

impl TeamKnowledgeParams {
    fn wheeled(&self) -> WheeledKnowledgeParams {
        WheeledKnowledgeParams {
            robot: self.robot,
            profile: self.profile,
            ..WheeledKnowledgeParams::default()
        }
    }
}

/// State of [`TeamKnowledge`].
#[derive(Default, Serialize, Deserialize)]
pub struct TeamKnowledgeState {
    strategies: StrategyModel,
    statements: Statements<RoleClaim>,
    #[serde(skip)]
    wheeled: WheeledKnowledgeState,
}

/// Knowledge of the robot and its strategies; states its role.
pub struct TeamKnowledge;

impl Knowledge for TeamKnowledge {
    const NAME: &'static str = "team_knowledge";
    const DOC: &'static str = "Knows the robot and its strategies, and states its role to other robots.";
    type Models = ((<WheeledKnowledge as Knowledge>::Models, StrategyPorts), TeamPorts);
    type Params = TeamKnowledgeParams;
    type State = TeamKnowledgeState;
    const DESCRIBES_HARDWARE: bool = true;

    fn hardware(setup: &Setup<'_>, params: &TeamKnowledgeParams) -> Result<Vec<Hardware>, Refusal> {
        WheeledKnowledge::hardware(setup, &params.wheeled())
    }

    fn create(setup: &Setup<'_>, params: &TeamKnowledgeParams) -> Result<TeamKnowledgeState, Refusal> {
        let wheeled = WheeledKnowledge::create(setup, &params.wheeled())?;
        Ok(TeamKnowledgeState { wheeled, ..TeamKnowledgeState::default() })
    }

    fn update(
        state: &mut TeamKnowledgeState,
        ((models, strategy), team): &Self::Models,
        params: &TeamKnowledgeParams,
        now: &Tick,
    ) {
        WheeledKnowledge::update(&mut state.wheeled, models, &params.wheeled(), now);
        state.strategies.update(strategy, now);
        if let Some(claim) = team.claim.updated() {
            state.statements.state(now.now(), params.name.as_str(), 1.0, *claim);
        }
        state.statements.write(now.now(), &team.claims);
    }
}
