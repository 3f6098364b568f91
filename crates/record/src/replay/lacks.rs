//! Inputs and outputs of modules that a recording lacks.

use std::collections::BTreeSet;

use slate_blackboard::is_within;
use slate_runtime::configuration::RecordSelection;

use super::run::Run;
use super::timeline::Timeline;
use crate::recorder::{selects, thins};

/// Finds out what is missing in the recording of a run.
pub(super) struct Lacks<'a> {
    run: &'a Run,
    timeline: &'a Timeline,
    /// Whether all is there that was written.
    is_whole: bool,
    rules: Option<RecordSelection>,
}

impl<'a> Lacks<'a> {
    pub fn new(run: &'a Run, timeline: &'a Timeline) -> Self {
        let is_whole = run.has_all_of(&timeline.coverage);
        Self { run, timeline, is_whole, rules: run.selection() }
    }

    /// Whether the configuration leaves values of a property out, also where their numbers don't show it.
    pub fn is_ruled(&self, path: &str) -> bool {
        self.rules.as_ref().is_some_and(|rules| thins(rules, path))
    }

    /// Whether the recording watched the property, so that debug outputs had values.
    fn watched(&self, path: &str) -> bool {
        !self.run.is_flight() && self.rules.as_ref().is_none_or(|rules| selects(rules, path))
    }

    /// The inputs of modules that are missing, in words; `watched` are written only while they are watched.
    pub fn told(
        &self,
        reads: &BTreeSet<String>,
        watched: &BTreeSet<String>,
        inboxes: &BTreeSet<String>,
    ) -> Vec<String> {
        let is_missed = |path: &str| watched.contains(path) && !self.watched(path);
        let mut told: Vec<String> = self.run.late_begin().into_iter().collect();
        for path in reads {
            let is_played = self.timeline.tracks.iter().any(|track| is_within(path, &track.path));
            match self.timeline.coverage.of(path) {
                None if self.is_whole || (self.run.is_unwritten(path) && !is_missed(path)) => {}
                None => told.push(format!("nothing of /{path} is recorded")),
                Some(_) if !is_played => told.push(format!("/{path} is left out")),
                Some(own) if own.has_gaps() => {
                    told.push(format!(
                        "only {} of {} values of /{path} are recorded",
                        own.count, own.written
                    ));
                }
                Some(_) if self.is_ruled(path) => {
                    told.push(format!("not every value of /{path} is recorded (`record.rules`)"));
                }
                Some(_) => {}
            }
        }
        let ruled = inboxes.iter().filter(|path| self.is_ruled(path));
        told.extend(ruled.map(|path| format!("not every message to /{path} is recorded (`record.rules`)")));
        told
    }

    /// The properties of which not every value that was written is there.
    pub fn thin(&self) -> BTreeSet<String> {
        let tracks = self.timeline.tracks.iter().map(|track| &track.path);
        let has_gaps = |path: &str| self.timeline.coverage.of(path).is_some_and(|own| own.has_gaps());
        tracks.filter(|path| has_gaps(path) || self.is_ruled(path)).cloned().collect()
    }
}
