//! Inputs and outputs of modules that a recording lacks.

use slate_blackboard::is_within;
use slate_runtime::configuration::RecordSelection;
use slate_sorted::SortedSet;

use super::run::Run;
use super::timeline::Timeline;
use slate_record::capture::{selects, thins};

/// Check for missing parts of the recording of a run.
pub(super) struct GapCheck<'a> {
    run: &'a Run,
    timeline: &'a Timeline,
    /// Set if every written value is there.
    is_whole: bool,
    rules: Option<RecordSelection>,
}

impl<'a> GapCheck<'a> {
    pub fn new(run: &'a Run, timeline: &'a Timeline) -> Self {
        let is_whole = run.has_all_of(&timeline.coverage);
        Self { run, timeline, is_whole, rules: run.selection() }
    }

    /// Returns true if the configuration leaves values of a property out.
    /// This is also known where their numbers do not show it.
    pub fn is_ruled(&self, path: &str) -> bool {
        self.rules.as_ref().is_some_and(|rules| thins(rules, path))
    }

    /// Returns true if the recording observed the property.
    /// Only then did debug outputs have values.
    fn watched(&self, path: &str) -> bool {
        !self.run.is_flight() && self.rules.as_ref().is_none_or(|rules| selects(rules, path))
    }

    /// Lists the missing inputs of modules, in words.
    /// `watched` are written only while they are observed.
    pub fn missing_inputs(
        &self,
        reads: &SortedSet<String>,
        watched: &SortedSet<String>,
        inboxes: &SortedSet<String>,
    ) -> Vec<String> {
        let is_missed = |path: &str| watched.contains(path) && !self.watched(path);
        let mut gaps: Vec<String> = self.run.late_begin().into_iter().collect();
        for path in reads {
            let is_played = self.timeline.tracks.iter().any(|track| is_within(path, &track.path));
            match self.timeline.coverage.of(path) {
                None if self.is_whole || (self.run.is_unwritten(path) && !is_missed(path)) => {}
                None => gaps.push(format!("nothing of /{path} is recorded")),
                Some(_) if !is_played => gaps.push(format!("/{path} is left out")),
                Some(own) if own.has_gaps() => {
                    gaps.push(format!(
                        "only {} of {} values of /{path} are recorded",
                        own.count, own.written
                    ));
                }
                Some(_) if self.is_ruled(path) => {
                    gaps.push(format!("not every value of /{path} is recorded (`record.rules`)"));
                }
                Some(_) => {}
            }
        }
        let ruled = inboxes.iter().filter(|path| self.is_ruled(path));
        gaps.extend(ruled.map(|path| format!("not every message to /{path} is recorded (`record.rules`)")));
        gaps
    }

    /// Returns the properties of which not every written value is recorded.
    pub fn incomplete(&self) -> SortedSet<String> {
        let tracks = self.timeline.tracks.iter().map(|track| &track.path);
        let has_gaps = |path: &str| self.timeline.coverage.of(path).is_some_and(|own| own.has_gaps());
        tracks.filter(|path| has_gaps(path) || self.is_ruled(path)).cloned().collect()
    }
}
