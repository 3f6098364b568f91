use std::sync::Arc;
use std::sync::atomic::Ordering;

use slate_blackboard::channel::Writer;
use slate_blackboard::interface::View;
use slate_composition::own::{ModuleCondition, ModuleState, PortName};

use super::{Health, RunnerSnapshot};

/// Number of panics in a row after which a module stays off.
/// A further start would not help.
pub(super) const PANIC_LIMIT: u32 = 5;
/// Number of ticks after which a panic begins a new row.
pub(super) const PANIC_ROW_LENGTH: u64 = 100;

/// Condition of a module, with its publication.
#[repr(C)]
pub struct RunnerStatus {
    /// Condition; `None` before it was first published.
    condition: Option<ModuleCondition>,
    /// Health of the module, for others.
    health: Arc<Health>,
    /// Data that is needed when the condition changes.
    report: Box<StatusReport>,
}

struct StatusReport {
    /// Writes `/module/state`.
    writer: Writer,
    /// Input for which the module waits while its condition is `Waiting`.
    waiting_for: PortName,
    panics: PanicCounts,
}

#[derive(Clone, Copy, Default)]
struct PanicCounts {
    total: u32,
    /// Number of panics without many ticks between them.
    in_a_row: u32,
    /// Tick of the last panic.
    last: u64,
}

impl RunnerStatus {
    /// Returns the status of a module that begins; `writer` is of `/module/state`.
    pub fn new(health: Arc<Health>, writer: Writer) -> Self {
        let (waiting_for, panics) = (PortName::default(), PanicCounts::default());
        Self { condition: None, health, report: Box::new(StatusReport { writer, waiting_for, panics }) }
    }

    /// Returns the health of the module, for others.
    #[inline]
    pub fn health(&self) -> &Arc<Health> {
        &self.health
    }

    /// Returns the condition.
    #[inline]
    pub fn condition(&self) -> ModuleCondition {
        self.condition.unwrap_or(ModuleCondition::WORKING)
    }

    /// Returns true if that condition was published.
    #[inline]
    pub fn is_published(&self, condition: ModuleCondition) -> bool {
        self.condition == Some(condition)
    }

    /// Changes the condition, and publishes it with the number of ticks.
    pub fn change(&mut self, condition: ModuleCondition, ticks: u64, now: u64) {
        self.condition = Some(condition);
        self.health.set(condition);
        let StatusReport { writer, waiting_for, panics } = &mut *self.report;
        let is_waiting = condition == ModuleCondition::WAITING;
        let mut state = ModuleState {
            ticks,
            panics: panics.total.into(),
            condition,
            waiting_for: if is_waiting { *waiting_for } else { PortName::default() },
        };
        // Only a recorder in lockstep may hold a writer up; the condition is then recorded with its next change.
        let _ = writer.write(View::of(&mut state).bytes(), 0, now);
    }

    /// Sets the input for which the module waits.
    /// Its condition is published anew if that is another port.
    pub fn wait_for(&mut self, port: PortName) {
        if port != self.report.waiting_for {
            self.report.waiting_for = port;
            self.condition = self.condition.filter(|condition| *condition != ModuleCondition::WAITING);
        }
    }

    /// Counts a panic in that tick.
    pub fn count_panic(&mut self, tick: u64) {
        let panics = &mut self.report.panics;
        panics.total += 1;
        self.health.panics.store(panics.total.into(), Ordering::Relaxed);
        if tick.saturating_sub(panics.last) > PANIC_ROW_LENGTH {
            panics.in_a_row = 0;
        }
        panics.in_a_row += 1;
        panics.last = tick;
    }

    /// Returns true if the module has panicked so often in a row that it stays off.
    pub fn panics_too_often(&self) -> bool {
        self.report.panics.in_a_row >= PANIC_LIMIT
    }

    /// Forgets that the code before panicked.
    pub fn forget_panics(&mut self) {
        self.report.panics.in_a_row = 0;
    }

    /// Writes the status to a snapshot.
    pub(super) fn snapshot(&self, saved: &mut RunnerSnapshot) {
        let PanicCounts { total, in_a_row, last } = self.report.panics;
        saved.condition = self.condition.map(|condition| condition.0);
        (saved.panics, saved.panics_in_a_row, saved.last_panic) = (total, in_a_row, last);
        saved.misses = self.health.misses.load(Ordering::Relaxed);
    }

    /// Resumes from a snapshot.
    pub(super) fn restore(&mut self, saved: &RunnerSnapshot) {
        self.condition = saved.condition.map(ModuleCondition);
        self.health.set(self.condition());
        let RunnerSnapshot { panics, panics_in_a_row, last_panic, .. } = *saved;
        self.report.panics = PanicCounts { total: panics, in_a_row: panics_in_a_row, last: last_panic };
        self.health.panics.store(panics.into(), Ordering::Relaxed);
        self.health.misses.store(saved.misses, Ordering::Relaxed);
    }

    /// Returns the writer of `/module/state`.
    pub(super) fn writer(&mut self) -> &mut Writer {
        &mut self.report.writer
    }
}
