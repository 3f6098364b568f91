//! Comparison of a second run with the recorded values, in a thread of its own.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

use slate_blackboard::{Access, Stamp};
use slate_runtime::Agent;

use super::difference::{self, Difference};
use super::expected::{Expected, ExpectedValue};
use super::run::Run;
use super::verdict::Verdict;
use slate_bag::Error;
use slate_record::capture::{Channel, Drain, Hub, Sink};

/// Progress shared between the run and its comparison.
#[derive(Default)]
pub(super) struct ComparisonProgress {
    /// Set when the run is over.
    pub is_over: AtomicBool,
    /// Set when no more of the run is needed.
    pub is_enough: AtomicBool,
}

/// Among the values, the end of a cycle.
const CYCLE_END: u32 = u32::MAX;

/// Polling period while there are no values.
const POLL_PERIOD: Duration = Duration::from_millis(1);

/// Marks the end of a cycle, with the changes after it, for the comparer.
pub(super) fn mark_cycle_end(hub: &Hub, cycle: u64, time: u64) {
    hub.push(CYCLE_END, 0, cycle, time, []);
}

/// Comparison of the second run's values.
pub(super) struct Comparer {
    expected: Expected,
    hub: Arc<Hub>,
    /// Set if the recording is complete.
    is_whole: bool,
    /// Set if the recording has messages to modules.
    has_messages: bool,
    values: u64,
    /// By channel of the hub, the place of its property among the expected ones.
    indices: Vec<Option<usize>>,
    /// The last cycle of which all values of its own thread came: its number and time.
    cycle: Option<(u64, u64)>,
    /// The times of the cycles until now, and the latest of a value.
    times: Vec<u64>,
    latest: u64,
    pub found: Option<Result<Verdict, Error>>,
    scratch: Vec<u8>,
}

impl Drop for Comparer {
    fn drop(&mut self) {
        // The run does not wait for its result.
        self.hub.stop();
    }
}

impl Comparer {
    pub fn new(expected: Expected, hub: Arc<Hub>, run: &Run) -> Self {
        Self {
            expected,
            hub,
            is_whole: run.cycles().is_some(),
            has_messages: run.has_messages(),
            values: 0,
            indices: Vec::new(),
            cycle: None,
            times: Vec::new(),
            latest: 0,
            found: None,
            scratch: Vec::new(),
        }
    }

    /// Compares values until the run is over or the comparison is decided.
    /// It is decided when a difference is found, or every recorded value has come.
    pub fn follow(mut self, course: &ComparisonProgress) -> Self {
        let hub = Arc::clone(&self.hub);
        let mut drain = Drain::default();
        loop {
            let is_over = course.is_over.load(Ordering::Acquire);
            // Values of other threads than the loop's are behind a mark of the turn before, at the latest.
            let cycle = self.cycle.take();
            let has_values = drain.take_values(&hub, &mut self);
            if let Some((_, time)) = cycle
                && self.found.is_none()
            {
                self.found = self.find_missed(time).transpose();
            }
            if self.found.is_some() || (!self.is_whole && self.expected.is_done()) {
                course.is_enough.store(true, Ordering::Release);
                hub.stop();
                return self;
            }
            if is_over && !has_values && cycle.is_none() {
                return self;
            }
            if !has_values {
                std::thread::park_timeout(POLL_PERIOD);
            }
        }
    }

    /// Returns the first value written before that time that did not come, if any.
    fn find_missed(&mut self, time: u64) -> Result<Option<Verdict>, Error> {
        self.expected.read_to(time)?;
        // A value of that very time may still come.
        Ok(self.expected.missed(time).map(missed))
    }

    /// Returns true if every recorded value has come.
    pub fn is_done(&self) -> bool {
        self.expected.is_done()
    }

    /// Returns the verdict at the end of the run.
    pub fn end(mut self, run: &Run, agent: &mut Agent) -> Result<Verdict, Error> {
        self.expected.read_to(u64::MAX)?;
        if let Some(wanted) = self.expected.missed(u64::MAX) {
            return Ok(missed(wanted));
        }
        let digest = agent.digest().map(|digest| format!("{digest:016x}")).unwrap_or_default();
        match run.end("digest") {
            Some(recorded) if recorded != digest => Ok(Verdict::Different(Difference {
                time: agent.now(),
                url: "the digest, which messages are part of too".into(),
                field: String::new(),
                recorded: recorded.into(),
                replayed: digest,
            })),
            _ => {
                // The agent may be beyond the end of a recording that was cut off.
                let until = self.times.partition_point(|time| *time < self.latest) as u64 + 1;
                let cycles = run.cycles().unwrap_or(until);
                Ok(Verdict::Identical { values: self.values, cycles, whole: self.is_whole })
            }
        }
    }

    fn compare_value(&mut self, channel: &Channel, id: u32, stamp: Stamp) -> Result<Option<Verdict>, Error> {
        let path = channel.path.as_str();
        let different = |field: String, recorded: String, replayed: String| {
            let url = format!("/{path}");
            Some(Verdict::Different(Difference { time: stamp.time, url, field, recorded, replayed }))
        };
        let own = || format!("value {} at {:.3} s", stamp.sequence, stamp.time as f64 * 1e-9);
        let index = id as usize;
        if index >= self.indices.len() {
            self.indices.resize(index + 1, None);
        }
        let index = &mut self.indices[index];
        let Some(wanted) = self.expected.next(path, index, stamp.time, stamp.sequence as u32)? else {
            // A recording that was cut off may lack anything at its end.
            let is_extra = self.is_whole;
            return Ok(if is_extra { different(String::new(), "no such value".into(), own()) } else { None });
        };
        if self.expected.hash(*index) != Some(channel.descriptor.hash) {
            let text = format!("the interface of /{path} is another one than that of the recording");
            return Ok(Some(Verdict::NotCovered(text)));
        }
        if wanted.sequence != stamp.sequence as u32 || wanted.time != stamp.time {
            let recorded = format!("value {} at {:.3} s", wanted.sequence, wanted.time as f64 * 1e-9);
            return Ok(different(String::new(), recorded, own()));
        }
        if wanted.message != self.scratch {
            let [field, recorded, replayed] =
                difference::field(channel.descriptor, &wanted.message, &self.scratch);
            return Ok(different(field, recorded, replayed));
        }
        self.values += 1;
        self.latest = self.latest.max(stamp.time);
        Ok(None)
    }
}

fn missed((path, wanted): (&str, &ExpectedValue)) -> Verdict {
    Verdict::Different(Difference {
        time: wanted.time,
        url: format!("/{path}"),
        field: String::new(),
        recorded: format!("value {}", wanted.sequence),
        replayed: "no such value".into(),
    })
}

impl Sink for Comparer {
    fn value(&mut self, channel: Option<&Channel>, id: u32, items: usize, stamp: Stamp, bytes: &[u8]) {
        if id == CYCLE_END {
            self.cycle = Some((stamp.sequence, stamp.time));
            if !self.is_whole && stamp.sequence > 0 {
                self.times.push(stamp.time);
            }
            return;
        }
        let Some(channel) = channel.filter(|channel| channel.repeats()) else { return };
        if self.found.is_some() || (channel.access == Access::Messages && !self.has_messages) {
            return;
        }
        self.scratch.clear();
        let found = match channel.encode(items, bytes, &mut self.scratch) {
            Ok(()) => self.compare_value(channel, id, stamp),
            Err(error) => Ok(Some(Verdict::NotCovered(error.to_string()))),
        };
        self.found = found.transpose();
    }
}
