//! What an application does with the main loop: other stages, another order, another time, and what it waits for.

use super::handle::AgentHandle;
use slate_engine::clock::TimeSource;
use slate_engine::main_loop::{LoopPolicy, Schedule};

/// The agent's time can't be set.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error(
    "the agent runs on the system's clock, which goes by itself: start it with a time source to set its time"
)]
pub struct SystemClock;

/// Changes what the main loop does.
pub(super) struct LoopControl<'c> {
    agent: &'c AgentHandle,
}

impl<'c> LoopControl<'c> {
    pub fn new(agent: &'c AgentHandle) -> Self {
        Self { agent }
    }

    /// Gives the main loop other stages, from its next cycle on.
    pub fn set_schedule(&self, schedule: Schedule) {
        // One change at a time.
        let _composition = self.agent.composition();
        self.agent.shared.set_schedule(schedule);
    }

    /// Lets a policy say which stage comes next, from the next cycle on; none goes back to the order of the schedule.
    pub fn set_policy(&self, policy: Option<Box<dyn LoopPolicy>>) {
        let _composition = self.agent.composition();
        self.agent.shared.set_policy(policy);
    }

    /// Lets a time source say what time it is, from the next cycle on; with none, time goes on by the period.
    pub fn set_time_source(&self, source: Option<Box<dyn TimeSource>>) -> Result<(), SystemClock> {
        if !self.agent.shared.clock.is_driven() {
            return Err(SystemClock);
        }
        let _composition = self.agent.composition();
        self.agent.shared.set_time_source(source, None);
        Ok(())
    }
}
