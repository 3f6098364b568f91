//! Seventeen modules in a row, each of which adds one to the value before it.
//!
//! Copper makes one program of all its tasks when it is compiled; Slate's modules are put together when the agent starts.

#[allow(missing_docs, reason = "what the macro makes has none")]
mod copper_off;
#[allow(missing_docs, reason = "what the macro makes has none")]
pub(super) mod copper_on;
mod tasks;

use std::path::Path;
use std::time::{Duration, Instant};

use slate_record::Recorder;
use slate_runtime::Agent;
use slate_runtime::configuration::Record;

use super::agents;
use crate::machine::pin;
use crate::measure::{Contest, Effort, Samples};
use crate::table::{Role, Table};

const WORK: &str = "caterpillar";

pub(super) const MODULES: usize = 17;

/// Steps back to back, and steps that leave the recorder time.
pub(super) const PACES: [(&str, Duration); 2] =
    [("one cycle after the other", Duration::ZERO), ("a cycle each 100 us", Duration::from_micros(100))];

/// An agent with its recorder.
pub(super) struct Recorded {
    pub agent: Agent,
    recorder: Recorder,
}

impl Recorded {
    /// Seventeen modules, and everything recorded below that folder.
    pub fn start(folder: &Path) -> Self {
        let mut settings = Record { enabled: true, ..Record::default() };
        settings.flight.enabled = false;
        let recorder = Recorder::on_demand(&settings);
        let agent = agents::lockstep(&agents::row(MODULES), Some(&recorder));
        recorder.attach(&agent, folder);
        Self { agent, recorder }
    }

    /// Ends the recording, of which nothing was left out.
    pub fn end(mut self) {
        let recorded =
            self.recorder.finish(&mut self.agent).expect("it recorded").expect("the disk is not full");
        assert_eq!(recorded.dropped, 0, "everything is recorded");
    }
}

/// Measures all lines.
pub fn run(effort: Effort, table: &mut Table) {
    pin(0);
    for (pace, pause) in PACES {
        let folder = super::folder();
        let mut contest = Contest::new(WORK, format!("{MODULES} modules, nothing recorded, {pace}"));
        let mut agent = agents::lockstep(&agents::row(MODULES), None);
        contest.with("Slate", Role::Slate, move |samples| {
            steps(effort, pause, samples, || assert!(agent.step()));
        });
        match copper_off::start(folder.path()) {
            Ok(mut step) => contest
                .with("Copper (cu29)", Role::Peer, move |samples| steps(effort, pause, samples, &mut step)),
            Err(error) => table.absent(WORK, "Copper (cu29)", format!("{error:?}")),
        }
        contest.run(effort, table);

        let mut recorded = Recorded::start(&folder.path().join("slate"));
        let mut contest = Contest::new(WORK, format!("{MODULES} modules, everything recorded, {pace}"));
        let agent = &mut recorded.agent;
        contest.with("Slate", Role::Slate, |samples| steps(effort, pause, samples, || assert!(agent.step())));
        match copper_on::start(folder.path()) {
            Ok(mut step) => contest
                .with("Copper (cu29)", Role::Peer, move |samples| steps(effort, pause, samples, &mut step)),
            Err(error) => table.absent(WORK, "Copper (cu29)", format!("{error:?}")),
        }
        contest.run(effort, table);
        recorded.end();
    }
}

/// Times steps, between which that time passes.
pub(super) fn steps(effort: Effort, pause: Duration, samples: &mut Samples, mut step: impl FnMut()) {
    for _ in 0..effort.count(5000) {
        let start = Instant::now();
        samples.time(&mut step);
        while start.elapsed() < pause {
            std::hint::spin_loop();
        }
    }
}
