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
    /// Gives the main loop other stages, from its next cycle on. Modules stay in the stages that they name.
    pub fn set_schedule(&self, schedule: Schedule) {
        // One change at a time.
        let _composition = self.composition();
        self.shared.set_schedule(schedule);
    }

    /// Lets a policy say which stage comes next, from the next cycle on; none goes back to the order of the schedule.
    /// It is the application's code, as an observer is, and nobody watches whether it returns.
    pub fn set_policy(&self, policy: Option<Box<dyn LoopPolicy>>) {
        let _composition = self.composition();
        self.shared.set_policy(policy, None);
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

#[cfg(test)]
#[allow(
    clippy::unwrap_used,
    clippy::disallowed_methods,
    reason = "a test that fails panics, and a hang takes time"
)]
mod tests {
    use std::sync::atomic::{AtomicU64, Ordering};
    use std::time::Duration;

    use slate_module::Plugin;
    use slate_module::prelude::*;

    use super::*;
    use crate::configuration::{self, Configuration};
    use crate::{Control, End, Options, Place};

    /// No ports.
    #[ports]
    pub struct NoIo {}

    /// Does nothing.
    pub struct Idle;

    #[module(stage = Think)]
    impl Module for Idle {
        type Io = NoIo;
        type Params = ();
        type State = ();

        fn tick(_: &mut (), _: &NoIo, _: &(), _: &Tick) -> Outcome {
            Outcome::Ok
        }
    }

    /// The default order, but that it does not return for a while in one cycle.
    struct Hangs(Arc<AtomicU64>);

    impl LoopPolicy for Hangs {
        fn next(&mut self, place: &Place<'_>) -> Option<usize> {
            self.0.store(place.cycle, Ordering::Relaxed);
            if place.cycle == 5 && place.after == Some(3) {
                std::thread::sleep(Duration::from_millis(200));
            }
            Some(place.after.map_or(0, |after| after + 1)).filter(|next| *next < place.stages.len())
        }
    }

    #[test]
    fn a_policy_of_a_module_that_does_not_return_is_removed_and_the_loop_goes_on() {
        let text = "loop.period = \"2ms\"\nloop.hang = \"20ms\"\n[modules.policy]\nplugin = \"idle\"\n\
                    [modules.other]\nplugin = \"idle\"\nstage = \"PostLoop\"\n";
        let configuration =
            Configuration::from_text("test.toml", text, &configuration::Options::default()).unwrap();
        let mut agent = Agent::load(&configuration, &[Plugin::linked::<Idle>()], Options::default()).unwrap();
        let seat = Arc::clone(&agent.composer.composition().present["policy"].seat);
        let asked = Arc::new(AtomicU64::new(0));
        agent.shared.set_policy(Some(Box::new(Hangs(Arc::clone(&asked)))), Some(seat));
        let composer = agent.composer();
        let end = agent.run(Box::new(move |cycle| {
            let back = composer.modules()[1].ticks > 10;
            if back && cycle.number > 60 || cycle.number > 10_000 { Control::Stop } else { Control::Continue }
        }));
        assert_eq!(end.unwrap(), End::Stopped);
        let (cycles, _) = agent.board().read("loop/state/cycles").unwrap().unwrap();
        assert_eq!(asked.load(Ordering::Relaxed), 5, "it is asked no more");
        agent.composer().set_schedule(Schedule::default());
        assert_eq!(Arc::strong_count(&asked), 1, "once it has returned, a change drops it");
        assert_eq!(
            agent.counts("other").unwrap().0 as f64,
            cycles.as_f64().unwrap(),
            "and no cycle is missed"
        );
    }
}
