//! Missions that a plain module follows.

#[cfg(feature = "lua")]
use slate_behavior::{BehaviorEngine, BehaviorState, BehaviorStatus};
use slate_behavior_tree::{NodeStatus, TreeExecutor, TreeState};
use slate_golog::{GologExecutor, GologOutcome, GologState};
use slate_petri_net::ActionProgress;
use slate_plugin::prelude::*;

use super::ports::MissionManagerParams;
use crate::actions::MissionActions;
#[cfg(feature = "lua")]
use crate::behavior_plan::{BehaviorPlanParams, load_skills, run_skills};
use crate::behavior_tree_plan::{load_tree, run_tree};
use crate::golog_plan::{GologPlanParams, load_program, run_program};
use crate::mission::{MissionExecutor, PlanMission};
use crate::petri_net_plan::{PetriNetPlanParams, PetriNetRun, SavedPetriNetRun, load_net, run_net};

/// Settings by which a mission is loaded.
#[derive(Clone, Copy)]
pub struct MissionSettings<'a> {
    /// File of the mission.
    pub file: &'a str,
    /// Parameters of the module.
    pub params: &'a MissionManagerParams,
}

/// Mission that a plain module follows.
pub trait ManagedMission: MissionExecutor<Saved: Send> + Send + 'static {
    /// Kind of the module.
    const MANAGER: &'static str;
    /// Description of the module.
    const DOC: &'static str;

    /// Reads the mission, and restores a state into it.
    ///
    /// # Errors
    /// What is wrong in the file, or does not fit.
    fn load(settings: &MissionSettings<'_>, saved: &Self::Saved) -> Result<(Self, MissionActions), String>;

    /// Continues with a changed file.
    fn wake(&mut self) {}

    /// Executes the mission until it waits.
    ///
    /// # Errors
    /// What ends the mission.
    fn advance(mission: &mut PlanMission<Self>, now: &Tick) -> Result<(), String>;

    /// Returns why the mission has succeeded or failed; `None` while it runs.
    fn ending(&self) -> Option<Result<String, String>>;
}

impl ManagedMission for PetriNetRun {
    const MANAGER: &'static str = "petri_net_manager";
    const DOC: &'static str = "Follows a Petri Net Plan whose actions are outputs.";

    fn load(
        settings: &MissionSettings<'_>,
        saved: &SavedPetriNetRun,
    ) -> Result<(Self, MissionActions), String> {
        let params =
            PetriNetPlanParams { plan_filename: Text::new(settings.file), ..PetriNetPlanParams::default() };
        load_net(&params, saved, 0)
    }

    fn advance(mission: &mut PlanMission<Self>, now: &Tick) -> Result<(), String> {
        run_net(mission, None, 0.0, now)
    }

    fn ending(&self) -> Option<Result<String, String>> {
        match self.progress() {
            ActionProgress::Succeeded => Some(Ok("the plan has reached its goal".into())),
            ActionProgress::Failed => Some(Err("the plan has failed".into())),
            _ => None,
        }
    }
}

impl ManagedMission for TreeExecutor {
    const MANAGER: &'static str = "behavior_tree_manager";
    const DOC: &'static str = "Follows a behavior tree whose actions are outputs.";

    fn load(settings: &MissionSettings<'_>, saved: &TreeState) -> Result<(Self, MissionActions), String> {
        load_tree(settings.file, "", saved)
    }

    fn advance(mission: &mut PlanMission<Self>, now: &Tick) -> Result<(), String> {
        run_tree(mission, now).map_err(|error| error.to_string())
    }

    fn ending(&self) -> Option<Result<String, String>> {
        match self.outcome() {
            NodeStatus::Succeeded => Some(Ok("the tree has succeeded".into())),
            NodeStatus::Failed => Some(Err("the tree has failed".into())),
            _ => None,
        }
    }
}

impl ManagedMission for GologExecutor {
    const MANAGER: &'static str = "golog_manager";
    const DOC: &'static str = "Follows a Golog program whose actions are outputs.";

    fn load(settings: &MissionSettings<'_>, saved: &GologState) -> Result<(Self, MissionActions), String> {
        let params =
            GologPlanParams { program_filename: Text::new(settings.file), ..GologPlanParams::default() };
        load_program(&params, saved)
    }

    fn wake(&mut self) {
        Self::wake(self);
    }

    fn advance(mission: &mut PlanMission<Self>, now: &Tick) -> Result<(), String> {
        run_program(mission, now).map_err(|error| error.to_string())
    }

    fn ending(&self) -> Option<Result<String, String>> {
        match self.outcome() {
            GologOutcome::Succeeded => Some(Ok("the program has ended".into())),
            GologOutcome::Failed => Some(Err("no step of the program is possible".into())),
            GologOutcome::Running => None,
        }
    }
}

#[cfg(feature = "lua")]
impl ManagedMission for BehaviorEngine {
    const MANAGER: &'static str = "behavior_manager";
    const DOC: &'static str = "Runs skills in Lua whose actions are outputs.";

    fn load(settings: &MissionSettings<'_>, saved: &BehaviorState) -> Result<(Self, MissionActions), String> {
        let (skill_filename, skill) = (Text::new(settings.file), settings.params.skill);
        load_skills(&BehaviorPlanParams { skill_filename, skill, ..BehaviorPlanParams::default() }, saved)
    }

    fn advance(mission: &mut PlanMission<Self>, now: &Tick) -> Result<(), String> {
        run_skills(mission, now)
    }

    fn ending(&self) -> Option<Result<String, String>> {
        match self.status() {
            BehaviorStatus::Succeeded => Some(Ok("the skill has succeeded".into())),
            BehaviorStatus::Failed => Some(Err(self.reason())),
            BehaviorStatus::Running => None,
        }
    }
}
