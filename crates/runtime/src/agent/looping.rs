//! Control of the main loop by the application.
//! It covers stages, their order, the time source and the waits.

use super::handle::AgentHandle;
use slate_engine::clock::TimeSource;
use slate_engine::main_loop::{LoopPolicy, Schedule};

/// The agent's time can't be set.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error("the agent runs on the system clock, whose time can't be set: start it with a time source")]
pub struct SystemClock;

/// Control of the main loop.
pub(super) struct LoopControl<'c> {
    agent: &'c AgentHandle,
}

impl<'c> LoopControl<'c> {
    pub fn new(agent: &'c AgentHandle) -> Self {
        Self { agent }
    }

    /// Sets the stages of the main loop, from its next cycle on.
    pub fn set_schedule(&self, schedule: Schedule) {
        // One change at a time.
        let _composition = self.agent.composition();
        self.agent.shared.set_schedule(schedule);
    }

    /// Sets the policy that chooses the next stage, from the next cycle on.
    /// `None` restores the order of the schedule.
    pub fn set_policy(&self, policy: Option<Box<dyn LoopPolicy>>) {
        let _composition = self.agent.composition();
        self.agent.shared.set_policy(policy);
    }

    /// Sets the time source, from the next cycle on.
    /// With `None` the time advances by the period.
    pub fn set_time_source(&self, source: Option<Box<dyn TimeSource>>) -> Result<(), SystemClock> {
        if !self.agent.shared.clock.is_driven() {
            return Err(SystemClock);
        }
        let _composition = self.agent.composition();
        self.agent.shared.set_time_source(source, None);
        Ok(())
    }
}
