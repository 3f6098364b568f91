//! Live values for tools: new values, their rate, and replacing one.

use std::sync::Arc;
use std::thread::sleep;
use std::time::{Duration, Instant};

use slate_blackboard::{BoardError, Property, Watching, interface};
use slate_sorted::SortedMap;

use super::properties::PropertyDirectory;
use super::refusal::{Done, KNOWN, reading, refusal, result};
use crate::entries::{RateMeasurement, Reading, Refusal, Spread, ValueUpdate, Watched};
use slate_runtime::{ErrorCode, Message};

/// Maximum duration of a call that looks for values.
/// It is less than tools wait for an answer.
pub const MAX_CALL_DURATION: Duration = Duration::from_secs(50);

/// Period at which new values are polled.
/// Writers do not notify tools, so no writer waits for one.
const POLL_PERIOD: Duration = Duration::from_millis(1);

/// Polling period while measuring.
/// Each missed value loses an interval.
const MEASURE_PERIOD: Duration = Duration::from_micros(250);

/// Polling period of another agent.
const REMOTE_POLL_PERIOD: Duration = Duration::from_millis(100);

/// Target of a watch.
enum WatchTarget<'u> {
    Local { property: Arc<Property>, path: String, _watching: Watching },
    Remote { agent: &'u str, path: &'u str },
}

/// Watches values of an agent's properties.
#[derive(Clone)]
pub(crate) struct ValueWatch {
    properties: PropertyDirectory,
}

impl ValueWatch {
    /// Creates the watch of an agent.
    pub fn new(properties: &PropertyDirectory) -> Self {
        Self { properties: properties.clone() }
    }

    fn target<'u>(&self, url: &'u str) -> Result<WatchTarget<'u>, Refusal> {
        if let Some((agent, path)) = self.properties.remote.of(url) {
            return Ok(WatchTarget::Remote { agent, path });
        }
        let path = self.properties.value_path(url)?;
        let (property, field) = self.properties.board().find(&path).map_err(unknown)?;
        if !field.is_empty() {
            let wrong = |error| unknown(BoardError::Access { url: format!("/{}", property.path()), error });
            interface::find(property.descriptor(), &field).map_err(wrong)?;
        }
        Ok(WatchTarget::Local { _watching: property.watch(), property, path })
    }

    /// Returns the values newer than those the client has.
    /// Waits for the first of them.
    #[allow(clippy::disallowed_methods, reason = "a tool waits on the wall clock")]
    pub fn watch(&self, of: &[Watched], within: Duration) -> Done {
        let targets = of.iter().map(|one| self.target(&one.url)).collect::<Result<Vec<_>, _>>()?;
        let until = Instant::now() + within.min(MAX_CALL_DURATION);
        let mut polled: Option<Instant> = None;
        loop {
            let polls_remote = polled.is_none_or(|polled| polled.elapsed() >= REMOTE_POLL_PERIOD);
            if polls_remote {
                polled = Some(Instant::now());
            }
            let mut updates = Vec::new();
            for (index, (target, Watched { after, .. })) in targets.iter().zip(of).enumerate() {
                let readings = match target {
                    WatchTarget::Local { property, path, .. } => self.newer(property, path, *after)?,
                    WatchTarget::Remote { agent, path } if polls_remote => {
                        let read = self.properties.remote.read(agent, path)?;
                        let read: Option<Reading> = serde_json::from_value(read).unwrap_or_default();
                        read.into_iter().filter(|read| Some(read.sequence) != *after).collect()
                    }
                    WatchTarget::Remote { .. } => Vec::new(),
                };
                let Some(first) = readings.first() else { continue };
                let missed = after.map_or(0, |after| first.sequence.saturating_sub(after + 1));
                updates.push(ValueUpdate { of: index, missed, readings });
            }
            if !updates.is_empty() || Instant::now() >= until {
                return result(updates);
            }
            sleep(POLL_PERIOD);
        }
    }

    /// Returns the newer values of a local property; without a number only the newest.
    fn newer(&self, property: &Property, path: &str, after: Option<u64>) -> Result<Vec<Reading>, Refusal> {
        let channel = property.channel();
        let published = channel.map_or(0, |channel| channel.published());
        if published == 0 || Some(published) == after {
            return Ok(Vec::new());
        }
        let board = self.properties.board();
        // After a restore from a snapshot, the count may be smaller than before.
        let after = after.filter(|after| *after < published);
        if let Some(after) = after.filter(|_| channel.is_some_and(|channel| channel.depth() > 1)) {
            let kept = board.history(path).map_err(unknown)?.into_iter();
            return Ok(kept.filter(|(_, stamp)| stamp.sequence > after).map(reading).collect());
        }
        Ok(board.read(path).map_err(unknown)?.map(reading).into_iter().collect())
    }

    /// Measures the rate of values for a while.
    #[allow(clippy::disallowed_methods, reason = "a tool waits on the wall clock")]
    pub fn measure(&self, urls: &[String], time: Duration) -> Done {
        let mut targets = Vec::new();
        for url in urls {
            match self.target(url)? {
                WatchTarget::Local { property, _watching, .. } => {
                    targets.push((url, ValueSeries::new(property), _watching));
                }
                WatchTarget::Remote { agent, .. } => {
                    return Err(refusal(
                        ErrorCode::OtherAgent.of(format!(
                            "{url} is of another agent, and values are measured where they are written"
                        )),
                        &format!("ask that agent itself: slate stat {url} --agent {agent}"),
                    ));
                }
            }
        }
        let lost = self.lost();
        let until = Instant::now() + time.min(MAX_CALL_DURATION);
        while Instant::now() < until {
            targets.iter_mut().for_each(|(_, series, _)| series.sample());
            sleep(MEASURE_PERIOD);
        }
        let (now, lost_since) = (self.properties.composer().now(), self.lost());
        let measured = targets.into_iter().map(|(url, series, _)| {
            let of = |lost: &SortedMap<String, u64>| lost.get(series.property.path()).copied().unwrap_or(0);
            let lost = of(&lost_since).saturating_sub(of(&lost));
            series.measured(url.clone(), now, lost)
        });
        result(measured.collect::<Vec<_>>())
    }

    /// Returns the losses of queue readers so far, by the path of the property.
    fn lost(&self) -> SortedMap<String, u64> {
        let mut lost = SortedMap::new();
        for link in self.properties.composer().links() {
            let (Some((_, count)), Ok((property, _))) =
                (link.queue, self.properties.board().find(link.from.trim_start_matches('/')))
            else {
                continue;
            };
            *lost.entry(property.path().to_owned()).or_default() += count;
        }
        lost
    }
}

fn unknown(error: BoardError) -> Refusal {
    refusal(Message::from(&error), KNOWN)
}

/// Consecutive values of a property.
struct ValueSeries {
    property: Arc<Property>,
    first: Option<(u64, u64)>,
    /// Sequence number and time of the last value.
    last: Option<(u64, u64)>,
    /// Intervals between consecutive values.
    intervals: Vec<u64>,
    seen: u64,
    bytes: u64,
}

impl ValueSeries {
    fn new(property: Arc<Property>) -> Self {
        Self { property, first: None, last: None, intervals: Vec::new(), seen: 0, bytes: 0 }
    }

    fn sample(&mut self) {
        let published = self.property.channel().map_or(0, |channel| channel.published());
        if published == 0 || self.last.is_some_and(|(sequence, _)| sequence == published) {
            return;
        }
        // A value without a free handle is sampled the next time.
        let Ok(Some((bytes, _, stamp))) = self.property.newest() else { return };
        match self.last {
            Some((sequence, time)) if stamp.sequence > sequence => {
                if stamp.sequence == sequence + 1 {
                    self.intervals.push(stamp.time.saturating_sub(time));
                }
            }
            Some((sequence, _)) if stamp.sequence == sequence => return,
            // The first value, also after a restore from a snapshot.
            _ => self.first = Some((stamp.sequence, stamp.time)),
        }
        self.last = Some((stamp.sequence, stamp.time));
        self.seen += 1;
        self.bytes += bytes.len() as u64;
    }

    fn measured(mut self, url: String, now: u64, lost: u64) -> RateMeasurement {
        let (first, last) = (self.first.unwrap_or_default(), self.last.unwrap_or_default());
        let count = last.0.saturating_sub(first.0);
        let time = last.1.saturating_sub(first.1);
        let rate = (count > 0 && time > 0).then(|| count as f64 * 1e9 / time as f64);
        let size = (self.seen > 0).then(|| self.bytes as f64 / self.seen as f64);
        self.intervals.sort_unstable();
        RateMeasurement {
            url,
            interface: self.property.descriptor().name.into(),
            count,
            rate,
            interval: spread(&self.intervals),
            unseen: (count + u64::from(self.first.is_some())).saturating_sub(self.seen),
            size,
            bandwidth: rate.zip(size).map(|(rate, size)| rate * size),
            age: self.last.map(|(_, time)| now.saturating_sub(time)),
            readers: self.property.readers(),
            has_writer: self.property.has_writer(),
            lost,
        }
    }
}

/// Returns the distribution of sorted durations.
fn spread(sorted: &[u64]) -> Option<Spread> {
    let (min, max) = (*sorted.first()?, *sorted.last()?);
    let count = sorted.len();
    let mean = sorted.iter().map(|one| *one as f64).sum::<f64>() / count as f64;
    let squares = sorted.iter().map(|one| (*one as f64 - mean) * (*one as f64 - mean)).sum::<f64>();
    let part = |hundredths: usize| sorted[(count * hundredths).div_ceil(100).saturating_sub(1)];
    let deviation = (squares / count as f64).sqrt();
    Some(Spread { min, mean, deviation, p50: part(50), p95: part(95), p99: part(99), max })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_spread_of_durations_has_the_greatest_of_each_part() {
        let sorted: Vec<u64> = (1..=100).collect();
        let spread = spread(&sorted).unwrap();
        assert_eq!((spread.min, spread.p50, spread.p95, spread.p99, spread.max), (1, 50, 95, 99, 100));
        assert!((spread.mean - 50.5).abs() < 1e-9 && (spread.deviation - 28.866).abs() < 1e-3);
    }
}
