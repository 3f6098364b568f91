//! Knowledge of a robot that navigates.

use serde::{Deserialize, Serialize};
use slate_plugin::interfaces::OccupancyGrid;
use slate_plugin::module::Hardware;
use slate_plugin::prelude::*;
use slate_wheeled::knowledge::{WheeledKnowledge, WheeledKnowledgeState};

use crate::body::CostmapClear;
use crate::collision_stop::CollisionRules;
use crate::knowledge_params::NavigationKnowledgeParams;
use crate::mission::{
    MOST_GOALS, NavigationCommand, NavigationGoal, NavigationMission, NavigationRequest, SavedGoal,
};
use crate::obstacles::ObstaclePoints;
use crate::settings::ControllerSettings;

/// Ports of [`NavigationKnowledge`] beside those of any wheeled robot.
#[ports]
pub struct NavigationModels {
    /// Changes of the mission.
    navigate: Inbox<NavigationRequest>,
    /// Goals of the robot.
    mission: Output<NavigationMission>,
    /// Settings of the local planner.
    controller: Output<ControllerSettings>,
    /// Rules of the collision stop.
    #[role("rule")]
    collision_rules: Output<CollisionRules>,
    /// Obstacles around the robot.
    pub obstacles: Known<ObstaclePoints>,
    /// Costs of the map.
    pub costmap: Known<OccupancyGrid>,
    /// Request to forget the obstacles that are out of sight.
    pub clear: Known<CostmapClear>,
}

/// Knowledge of a navigating robot: that of any wheeled robot, and its mission.
pub struct NavigationKnowledge;

/// State of [`NavigationKnowledge`].
#[derive(Default, Serialize, Deserialize)]
pub struct NavigationKnowledgeState {
    wheeled: WheeledKnowledgeState,
    mission: SavedMission,
    /// True if the mission of the parameters was taken.
    has_begun: bool,
    /// True if the mission has changed since it was published.
    is_changed: bool,
    /// Published settings; published again after a restart.
    #[serde(skip)]
    settings: Option<NavigationKnowledgeParams>,
}

#[derive(Default, Serialize, Deserialize)]
struct SavedMission {
    number: u64,
    is_paused: bool,
    is_loop: bool,
    goals: Vec<SavedGoal>,
}

impl Knowledge for NavigationKnowledge {
    const NAME: &'static str = "navigation_knowledge";
    const DOC: &'static str = "Knows the robot's mission and model.";
    type Models = (<WheeledKnowledge as Knowledge>::Models, NavigationModels);
    type Params = NavigationKnowledgeParams;
    type State = NavigationKnowledgeState;
    const DESCRIBES_HARDWARE: bool = true;

    fn hardware(setup: &Setup<'_>, params: &NavigationKnowledgeParams) -> Result<Vec<Hardware>, Refusal> {
        WheeledKnowledge::hardware(setup, &params.wheeled())
    }

    fn create(
        setup: &Setup<'_>,
        params: &NavigationKnowledgeParams,
    ) -> Result<NavigationKnowledgeState, Refusal> {
        params.controller()?;
        let wheeled = WheeledKnowledge::create(setup, &params.wheeled())?;
        Ok(NavigationKnowledgeState { wheeled, ..NavigationKnowledgeState::default() })
    }

    fn update(
        state: &mut NavigationKnowledgeState,
        (wheeled, models): &Self::Models,
        params: &NavigationKnowledgeParams,
        now: &Tick,
    ) {
        WheeledKnowledge::update(&mut state.wheeled, wheeled, &params.wheeled(), now);
        if state.settings != Some(*params) {
            state.settings = Some(*params);
            // An unknown planner is refused before.
            if let Ok(controller) = params.controller() {
                models.controller.set(controller);
            }
            models.collision_rules.set(params.collision_rules());
        }
        if !std::mem::replace(&mut state.has_begun, true) {
            let goals = params.first_goals();
            if !goals.is_empty() {
                state.mission.begin(goals, params.is_loop.get());
                state.is_changed = true;
            }
        }
        for request in models.navigate.iter() {
            match state.mission.change(&request, now) {
                Ok(()) => state.is_changed = true,
                Err(reason) => request.refuse(reason),
            }
        }
        if std::mem::replace(&mut state.is_changed, false) {
            models.mission.set(state.mission.published());
        }
    }
}

impl SavedMission {
    fn begin(&mut self, goals: Vec<SavedGoal>, is_loop: bool) {
        *self = Self { number: self.number + 1, is_paused: false, is_loop, goals };
    }

    /// Changes the mission.
    ///
    /// # Errors
    /// The refusal of the request.
    fn change(&mut self, request: &NavigationRequest, now: &Tick) -> Result<(), u16> {
        let goal = &request.goal;
        let is_finite = [goal.x, goal.y, goal.theta].iter().all(|number| number.is_finite());
        match request.command {
            NavigationCommand::GO_TO | NavigationCommand::APPEND if !is_finite => {
                now.warn(format_args!("refused a goal with NaN: expected meters and radians"));
                Err(NavigationRequest::NOT_FINITE)
            }
            NavigationCommand::APPEND if self.goals.len() >= MOST_GOALS => Err(NavigationRequest::FULL),
            NavigationCommand::APPEND if !self.goals.is_empty() => {
                self.goals.push(goal.into());
                Ok(())
            }
            NavigationCommand::GO_TO | NavigationCommand::APPEND => {
                self.begin(vec![goal.into()], false);
                Ok(())
            }
            _ if self.goals.is_empty() => Err(NavigationRequest::NO_MISSION),
            NavigationCommand::CANCEL => {
                self.begin(Vec::new(), false);
                Ok(())
            }
            command => {
                self.is_paused = command == NavigationCommand::PAUSE;
                Ok(())
            }
        }
    }

    fn published(&self) -> NavigationMission {
        let mut goals = [NavigationGoal::default(); MOST_GOALS];
        for (place, goal) in goals.iter_mut().zip(&self.goals) {
            *place = goal.into();
        }
        NavigationMission {
            number: self.number,
            is_paused: self.is_paused.into(),
            is_loop: self.is_loop.into(),
            goals: Sequence::new(&goals[..self.goals.len().min(MOST_GOALS)]),
        }
    }
}
