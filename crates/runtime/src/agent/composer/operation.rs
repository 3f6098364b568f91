//! Operation of a running agent: its actuators, its main loop, its past.

use std::sync::Arc;

use super::Composer;
use crate::agent::actuators::GateOperator;
use crate::agent::looping::{LoopControl, SystemClock};
use crate::agent::playing::PlaybackAccess;
use crate::agent::teleoperation::{ControlsError, ControlsHolder, ControlsRegistry, Teleoperation};
use crate::playback::PlaybackControl;
use crate::recording::{History, HistoryRequest, RecordingRefusal, TakeValue};
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

    /// Arms all actuators; false if one is still stopped.
    pub fn arm(&self) -> bool {
        GateOperator::new(&self.agent).arm()
    }

    /// Arms one actuator.
    /// False if it is still stopped, `None` if it is unknown.
    pub fn arm_one(&self, actuator: &str) -> Option<bool> {
        GateOperator::new(&self.agent).arm_one(actuator)
    }

    /// Returns the actuators, each with the reason of its stop, if stopped.
    pub fn actuators(&self) -> Vec<(String, Option<String>)> {
        GateOperator::new(&self.agent).actuators()
    }

    /// Takes the controls of an actuator.
    /// Commands pass while its gate is armed. `who` names the holder, for the log and for others who want the controls.
    ///
    /// # Errors
    /// When the actuator is unknown, or its controls are taken.
    pub fn take_controls(&self, actuator: &str, who: &str) -> Result<Teleoperation, ControlsError> {
        ControlsRegistry::new(&self.agent).take_controls(actuator, who)
    }

    /// The actuators, each with the holder of its controls.
    pub fn controls(&self) -> Vec<ControlsHolder> {
        ControlsRegistry::new(&self.agent).controls()
    }

    /// Sets the stages of the main loop, from its next cycle on.
    /// While a module has taken the loop with stages of its own, they take effect when it gives the loop back. Modules
    /// stay in the stages that they name.
    pub fn set_schedule(&self, schedule: Schedule) {
        LoopControl::new(&self.agent).set_schedule(schedule)
    }

    /// Sets the policy that chooses the next stage, from the next cycle on.
    /// `None` restores the order of the schedule. The policy is not called while a module has the loop. It is the
    /// application's code, as an observer is, and no watchdog checks whether it returns.
    pub fn set_policy(&self, policy: Option<Box<dyn LoopPolicy>>) {
        LoopControl::new(&self.agent).set_policy(policy)
    }

    /// Sets the time source, from the next cycle on.
    /// With `None` the time advances by the period.
    ///
    /// # Errors
    /// When the agent was not started with a time source.
    pub fn set_time_source(&self, source: Option<Box<dyn TimeSource>>) -> Result<(), SystemClock> {
        LoopControl::new(&self.agent).set_time_source(source)
    }

    /// Reads the earlier values of a property.
    /// They come from the recording that is played, else from the last seconds, if these are kept.
    ///
    /// # Errors
    /// The reason for which the values are not available.
    pub fn history(
        &self,
        request: &HistoryRequest,
        take: &mut TakeValue<'_>,
    ) -> Result<History, RecordingRefusal> {
        PlaybackAccess::new(&self.agent).history(request, take)
    }

    /// Sets the playback that tools control; the application makes its cycles.
    pub fn control_playback(&self, control: Arc<dyn PlaybackControl>) {
        PlaybackAccess::new(&self.agent).control(control)
    }

    /// Control of the playback; `None` if the agent plays no recording.
    pub fn playback(&self) -> Option<Arc<dyn PlaybackControl>> {
        PlaybackAccess::new(&self.agent).playback()
    }

    /// Returns the stages of the loop, each with its modules, in order.
    /// Modules with threads of their own are in no stage.
    pub fn order(&self) -> Vec<(String, Vec<String>)> {
        self.agent.shared.order()
    }

    /// Number of cycles that the main loop has begun.
    pub fn cycles(&self) -> u64 {
        self.agent.shared.cycles()
    }

    /// Returns the trace, as [`Agent::trace`](crate::Agent::trace).
    pub fn trace(&self) -> AgentTrace {
        AgentTrace::new(Arc::clone(&self.agent.shared))
    }
}
