//! What an application does with the main loop: other stages, another order, another time, and what it waits for.

use std::sync::Arc;
use std::time::SystemTime;

use super::{Agent, Composer};
use crate::clock::TimeSource;
use crate::main_loop::{AgentTrace, LoopPolicy, Schedule};
use crate::synchronization::Synchronization;

/// The agent's time can't be set.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error(
    "the agent runs on the system's clock, which goes by itself: start it with a time source to set its time"
)]
pub struct SystemClock;

impl Composer {
    /// Gives the main loop other stages, from its next cycle on; while a module has taken the loop with stages of its own,
    /// from when that ends. Modules stay in the stages that they name.
    pub fn set_schedule(&self, schedule: Schedule) {
        // One change at a time.
        let _composition = self.composition();
        self.shared.set_schedule(schedule);
    }

    /// Lets a policy say which stage comes next, from the next cycle on; none goes back to the order of the schedule.
    /// It is not asked while a module has the loop. It is the application's code, as an observer is, and nobody watches whether it returns.
    pub fn set_policy(&self, policy: Option<Box<dyn LoopPolicy>>) {
        let _composition = self.composition();
        self.shared.set_policy(policy);
    }

    /// Lets a time source say what time it is, from the next cycle on; with none, time goes on by the period.
    ///
    /// # Errors
    /// When the agent was not started with a time source.
    pub fn set_time_source(&self, source: Option<Box<dyn TimeSource>>) -> Result<(), SystemClock> {
        if !self.shared.clock.is_driven() {
            return Err(SystemClock);
        }
        let _composition = self.composition();
        self.shared.set_time_source(source, None);
        Ok(())
    }
}

impl Composer {
    /// The stages of the loop in their order, each with its modules in the order in which they run; those with threads of
    /// their own are in none.
    pub fn order(&self) -> Vec<(String, Vec<String>)> {
        self.shared.order()
    }

    /// Cycles that the main loop has begun.
    pub fn cycles(&self) -> u64 {
        self.shared.cycles()
    }

    /// What ran when; as [`Agent::trace`].
    pub fn trace(&self) -> AgentTrace {
        AgentTrace::new(Arc::clone(&self.shared))
    }
}

impl Agent {
    /// The points at which threads outside the main loop fall in with it: `/cycle/start` and `/cycle/end`, and for each
    /// stage such as `Act`, `/stage/Act/start` and `/stage/Act/end`. The loop emits a point from when somebody has asked
    /// for it.
    pub fn synchronization(&self) -> &Arc<Synchronization> {
        &self.shared.synchronization
    }

    /// What ran when.
    pub fn trace(&self) -> AgentTrace {
        AgentTrace::new(Arc::clone(&self.shared))
    }

    /// Shows what was measured until now in the properties `/loop/state`, `/loop/histogram`, `/loop/STAGE/histogram` and
    /// `/MODULE/histogram`. A run does it ten times a second; it is for who makes single steps.
    pub fn publish_timing(&self) {
        self.shared.publish_timing();
    }

    /// The date (UTC) of an agent's time, for people who read it. It may jump when the machine's clock is set, and
    /// nothing in an agent depends on it.
    pub fn date_of(&self, time: u64) -> SystemTime {
        self.shared.clock.date_of(time)
    }
}
