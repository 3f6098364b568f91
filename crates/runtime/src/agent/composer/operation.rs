//! What people and tools do with an agent that runs: its actuators, its main loop, its past.

use std::sync::Arc;

use super::Composer;
use crate::agent::actuators::GateOperator;
use crate::agent::looping::{LoopControl, SystemClock};
use crate::agent::playing::PlaybackAccess;
use crate::agent::teleoperation::{ControlsError, ControlsHolder, ControlsKeeper, Teleoperation};
use crate::playback::PlaybackControl;
use crate::recording::{History, HistoryWish, RecordingRefusal, TakeValue};
use slate_engine::clock::TimeSource;
use slate_engine::main_loop::{AgentTrace, LoopPolicy, Schedule};

impl Composer {
    /// Stops all actuators, until they are reset and armed.
    pub fn stop_actuators(&self, reason: &str) {
        GateOperator::new(&self.agent).stop_actuators(reason)
    }

    /// Ends a stop.
    pub fn reset(&self) {
        GateOperator::new(&self.agent).reset()
    }

    /// Lets commands through to the actuators; false when one is still stopped.
    pub fn arm(&self) -> bool {
        GateOperator::new(&self.agent).arm()
    }

    /// Lets commands through to one actuator; false when it is still stopped, and nothing when there is none of that name.
    pub fn arm_one(&self, actuator: &str) -> Option<bool> {
        GateOperator::new(&self.agent).arm_one(actuator)
    }

    /// The actuators, each with why it is stopped, if it is.
    pub fn actuators(&self) -> Vec<(String, Option<String>)> {
        GateOperator::new(&self.agent).actuators()
    }

    /// Takes the controls of an actuator. Commands pass while its gate is armed. `who` says whose they are then, for the log
    /// and for others who want them.
    ///
    /// # Errors
    /// When there is no such actuator, or somebody has its controls.
    pub fn take_controls(&self, actuator: &str, who: &str) -> Result<Teleoperation, ControlsError> {
        ControlsKeeper::new(&self.agent).take_controls(actuator, who)
    }

    /// The actuators, each with the holder of its controls.
    pub fn controls(&self) -> Vec<ControlsHolder> {
        ControlsKeeper::new(&self.agent).controls()
    }

    /// Gives the main loop other stages, from its next cycle on; while a module has taken the loop with stages of its own,
    /// from when that ends. Modules stay in the stages that they name.
    pub fn set_schedule(&self, schedule: Schedule) {
        LoopControl::new(&self.agent).set_schedule(schedule)
    }

    /// Lets a policy say which stage comes next, from the next cycle on; none goes back to the order of the schedule.
    /// It is not asked while a module has the loop. It is the application's code, as an observer is, and nobody watches whether it returns.
    pub fn set_policy(&self, policy: Option<Box<dyn LoopPolicy>>) {
        LoopControl::new(&self.agent).set_policy(policy)
    }

    /// Lets a time source say what time it is, from the next cycle on; with none, time goes on by the period.
    ///
    /// # Errors
    /// When the agent was not started with a time source.
    pub fn set_time_source(&self, source: Option<Box<dyn TimeSource>>) -> Result<(), SystemClock> {
        LoopControl::new(&self.agent).set_time_source(source)
    }

    /// Tells the values that a property had: those of the recording that is played, if one is, and else those of the last seconds, if
    /// they are kept.
    ///
    /// # Errors
    /// Why there are none.
    pub fn history(&self, wish: &HistoryWish, take: &mut TakeValue<'_>) -> Result<History, RecordingRefusal> {
        PlaybackAccess::new(&self.agent).history(wish, take)
    }

    /// Lets tools control a playback, which the application makes the cycles of.
    pub fn control_playback(&self, control: Arc<dyn PlaybackControl>) {
        PlaybackAccess::new(&self.agent).control(control)
    }

    /// What the playback is controlled by, if the agent plays a recording.
    pub fn playback(&self) -> Option<Arc<dyn PlaybackControl>> {
        PlaybackAccess::new(&self.agent).playback()
    }

    /// The stages of the loop in their order, each with its modules in the order in which they run; those with threads of
    /// their own are in none.
    pub fn order(&self) -> Vec<(String, Vec<String>)> {
        self.agent.shared.order()
    }

    /// Cycles that the main loop has begun.
    pub fn cycles(&self) -> u64 {
        self.agent.shared.cycles()
    }

    /// What ran when; as [`Agent::trace`](crate::Agent::trace).
    pub fn trace(&self) -> AgentTrace {
        AgentTrace::new(Arc::clone(&self.agent.shared))
    }
}
