//! Requests of modules to their agent, with the answers.

use std::collections::VecDeque;

use slate_sorted::{SortedMap, SortedSet};

use super::difference::Difference;
use super::recomputed::Recomputed;
use slate_record::CHANGE_TOPIC;

/// A request that is recorded.
struct RecordedRequest {
    time: u64,
    lines: String,
    answer: Result<String, String>,
}

/// Recorded answers to requests of the modules that run.
#[derive(Default)]
pub(super) struct Requests {
    /// Pending requests, by module.
    open: SortedMap<String, VecDeque<RecordedRequest>>,
    /// Modules that have made a request, then or now.
    pub askers: SortedSet<String>,
    /// Set if requests of one time belong together.
    has_times: bool,
    /// Requests that are not recorded: time and text.
    extra: Vec<(u64, String)>,
    found: Recomputed,
    first: Option<Difference>,
}

impl Requests {
    pub fn new(has_times: bool) -> Self {
        let found = Recomputed { url: CHANGE_TOPIC.name.into(), ..Recomputed::default() };
        Self { has_times, found, ..Self::default() }
    }

    /// Adds a recorded request; they come in their order.
    pub fn add(&mut self, time: u64, module: String, lines: String, answer: Result<String, String>) {
        self.askers.insert(module.clone());
        self.open.entry(module).or_default().push_back(RecordedRequest { time, lines, answer });
    }

    /// Returns the recorded answer to a request; `None` if it was another request.
    pub fn answer(&mut self, module: &str, lines: &str, now: u64) -> Option<Result<String, String>> {
        self.askers.insert(module.into());
        let has_times = self.has_times;
        let open = self.open.entry(module.into()).or_default();
        let mut missed = Vec::new();
        while let Some(request) = open.pop_front_if(|request| has_times && request.time < now) {
            missed.push(request);
        }
        let request = open.pop_front_if(|request| !has_times || request.time == now);
        missed.into_iter().for_each(|request| self.miss(&request));
        match request {
            Some(request) if request.lines == lines => {
                self.found.same += 1;
                return Some(request.answer);
            }
            Some(request) => {
                self.found.different += 1;
                self.differs(now, request.lines, lines.into());
            }
            None => self.extra.push((now, lines.into())),
        }
        None
    }

    /// Returns the comparison of the requests until `end`, and the first difference.
    /// `None` if there were none.
    pub fn outcome(&mut self, end: u64) -> Option<(Recomputed, Option<Difference>)> {
        let left = std::mem::take(&mut self.open).into_values().flatten();
        left.filter(|request| request.time <= end).for_each(|request| self.miss(&request));
        // Requests of the last cycle may have no answer.
        for (time, lines) in std::mem::take(&mut self.extra) {
            if time < end {
                self.found.only_recomputed += 1;
                self.differs(time, NONE.into(), lines);
            }
        }
        let is_there = !self.askers.is_empty();
        is_there.then(|| (self.found.clone(), self.first.clone()))
    }

    fn miss(&mut self, request: &RecordedRequest) {
        self.found.only_recorded += 1;
        self.differs(request.time, request.lines.clone(), NONE.into());
    }

    fn differs(&mut self, time: u64, recorded: String, replayed: String) {
        if self.first.as_ref().is_none_or(|first| time < first.time) {
            let url = CHANGE_TOPIC.name.into();
            self.first = Some(Difference { time, url, field: String::new(), recorded, replayed });
        }
    }
}

const NONE: &str = "no such request";
