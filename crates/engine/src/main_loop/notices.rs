//! Log messages about a late loop, at most one of each kind per second.

use std::fmt::Write;
use std::sync::Arc;

use slate_module::Level;

use super::plan::PlannedStage;
use super::{RunnerCell, SharedLoop};
use crate::clock::monotonic;

/// Minimum interval of messages of a kind, ns.
const NOTICE_PERIOD: u64 = 1_000_000_000;
/// Maximum number of modules in a message.
const NAMED_MODULE_LIMIT: usize = 3;

/// Lets one notice a second through and counts the others.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct NoticeLimit {
    last: Option<u64>,
    suppressed: u64,
}

impl NoticeLimit {
    /// Returns the number of messages suppressed since the last one, if one is due.
    pub fn pass(&mut self, now: u64) -> Option<u64> {
        if self.last.is_some_and(|last| now.saturating_sub(last) < NOTICE_PERIOD) {
            self.suppressed += 1;
            return None;
        }
        self.last = Some(now);
        Some(std::mem::take(&mut self.suppressed))
    }
}

/// Describes the number of suppressed messages.
pub(super) fn suppression_note(suppressed: u64) -> String {
    match suppressed {
        0 => String::new(),
        times => format!(" ({times} more times since the last report)"),
    }
}

/// Messages of the loop's thread.
#[derive(Debug, Default)]
pub(super) struct Notices {
    overruns: NoticeLimit,
    time_up: NoticeLimit,
}

impl Notices {
    /// Reports a cycle that began late by `late` ns.
    /// The cycle before, which began at `began`, took too long.
    pub fn report_overrun(&mut self, shared: &SharedLoop, late: u64, began: u64, cells: &[Arc<RunnerCell>]) {
        let Some(suppressed) = self.overruns.pass(monotonic()) else { return };
        let mut durations: Vec<_> = cells
            .iter()
            .filter(|cell| began != 0 && cell.started() >= began)
            .map(|cell| (cell.is_given_up(), cell.duration(), &cell.name))
            .collect();
        durations.sort_by(|a, b| b.cmp(a));
        let mut text = format!(
            "the main loop took {} ms longer than its period of {} ms",
            milliseconds(late),
            milliseconds(shared.period)
        );
        for (index, (given_up, duration, name)) in durations.iter().take(NAMED_MODULE_LIMIT).enumerate() {
            let comma = if index == 0 { "; it took longest in " } else { ", " };
            // To write to a text does not fail.
            let _ = match given_up {
                true => write!(text, "{comma}{name}, which did not return in time"),
                false => write!(text, "{comma}{name} ({} ms)", milliseconds(*duration)),
            };
        }
        text.push_str(&suppression_note(suppressed));
        shared.logger.log(shared.clock.now(), Level::Warn, &text);
    }

    /// Reports modules that had no turn before the timeout of their stage.
    pub fn report_time_up<'s>(
        &mut self,
        shared: &SharedLoop,
        stage: &PlannedStage,
        missed: impl Iterator<Item = &'s Arc<RunnerCell>>,
    ) {
        let names: Vec<&str> = missed.map(|cell| &*cell.name).collect();
        if names.is_empty() {
            return;
        }
        let Some(suppressed) = self.time_up.pass(monotonic()) else { return };
        let more = names.len().saturating_sub(NAMED_MODULE_LIMIT);
        let text = format!(
            "the {} ms of stage {} were over before the turn of {}{}{}",
            milliseconds(stage.timeout),
            stage.gauge.name,
            names[..names.len() - more].join(", "),
            if more > 0 { format!(" and {more} more") } else { String::new() },
            suppression_note(suppressed)
        );
        shared.logger.log(shared.clock.now(), Level::Warn, &text);
    }
}

/// Formats nanoseconds as milliseconds, with the relevant decimals.
pub(super) fn milliseconds(nanoseconds: u64) -> String {
    let value = nanoseconds as f64 * 1e-6;
    if nanoseconds.is_multiple_of(1_000_000) || value >= 100.0 {
        format!("{value:.0}")
    } else {
        format!("{value:.1}")
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn one_notice_a_second_passes_and_the_others_are_counted() {
        let mut limit = NoticeLimit::default();
        let passed: Vec<_> = (0..25).map(|tenth| limit.pass(tenth * NOTICE_PERIOD / 10)).collect();
        let mut expected = vec![None; 25];
        (expected[0], expected[10], expected[20]) = (Some(0), Some(9), Some(9));
        assert_eq!(passed, expected);
    }

    #[test]
    fn milliseconds_are_short() {
        assert_eq!([5_000_000, 1_234_567, 312_400_000].map(milliseconds), ["5", "1.2", "312"]);
    }
}
