//! Activity of a mission: what changes while it runs.

use std::fmt::{Arguments, Write};

use slate_plugin::interfaces::MissionState;
use slate_plugin::prelude::*;

use super::drawing::NO_ELEMENT;
use crate::actions::MissionActions;
use crate::conditions::KnownConditions;

/// Maximum number of items.
/// Their values are small enough for the last seconds that an agent keeps.
pub const MOST_ITEMS: usize = 512;

/// Status of an item of a mission.
#[interface]
pub enum MissionItemStatus {
    /// Place with tokens.
    Marked,
    /// Current state of a machine.
    Current,
    /// Transition that fires with the next step.
    Enabled,
    /// Waiting transition, state or condition; the text has the reason.
    Waiting,
    /// It runs.
    Running,
    /// Suspended: it waits for an action of higher priority.
    Suspended,
    /// It has succeeded.
    Succeeded,
    /// It has failed.
    Failed,
    /// Passed over.
    Skipped,
    /// Action of the trace that was done, or has begun.
    Performed,
    /// Exogenous action of the trace.
    Occurred,
    /// Row of the program that remains.
    Remaining,
    /// Condition that holds.
    Holds,
    /// Condition that does not hold.
    DoesNotHold,
    /// Unknown: the condition has no report yet.
    Unknown,
}

/// Item of a mission's activity.
#[interface]
#[derive(PartialEq)]
pub struct MissionItem {
    /// Status.
    pub status: MissionItemStatus,
    /// Number of the element in the graph; 65535 for none.
    pub element: u16,
    /// Tokens of a place, or level of a row of a program.
    pub count: u16,
    /// Reason, name of a condition, or text of an action or a row.
    pub text: Text<100>,
}

/// Activity of a mission.
#[interface]
pub struct MissionActivity {
    /// State of the mission.
    pub state: MissionState,
    /// Number of the graph whose elements the items name.
    pub graph: u32,
    /// Pause state: true while the mission makes no steps.
    pub is_paused: Bool,
    /// True if items are missing, as the mission has more than fit.
    pub is_cut: Bool,
    /// Reason of a failure, or for which the mission waits.
    pub reason: Text<124>,
    /// Elements that are not at rest, rows of a trace and a program, and conditions.
    pub items: [MissionItem],
}

/// View of the robot for an activity.
#[derive(Clone, Copy)]
pub struct MissionSight<'a> {
    /// Actions of the mission.
    pub actions: &'a MissionActions,
    /// Conditions that are known.
    pub conditions: &'a KnownConditions,
    /// Time, ns.
    pub now: u64,
}

/// Writer of an activity.
pub struct ActivityWriter<'a> {
    /// Items; earlier content was removed.
    pub items: &'a mut Vec<MissionItem>,
    /// Reason for which the mission waits.
    pub reason: Text<124>,
    /// True if the mission had more items than fit.
    pub is_cut: bool,
}

impl ActivityWriter<'_> {
    /// Adds an item of an element.
    pub fn element(&mut self, element: usize, status: MissionItemStatus, count: u32, text: Arguments<'_>) {
        self.add(u16::try_from(element).unwrap_or(NO_ELEMENT), status, count, text);
    }

    /// Adds an item that belongs to no element.
    pub fn row(&mut self, status: MissionItemStatus, level: usize, text: Arguments<'_>) {
        self.add(NO_ELEMENT, status, u32::try_from(level).unwrap_or(u32::MAX), text);
    }

    /// Adds an unknown condition, once.
    pub fn unknown(&mut self, name: &str) {
        let is_there =
            |item: &MissionItem| item.status == MissionItemStatus::UNKNOWN && item.text.as_str() == name;
        if !self.items.iter().any(is_there) {
            self.row(MissionItemStatus::UNKNOWN, 0, format_args!("{name}"));
        }
    }

    fn add(&mut self, element: u16, status: MissionItemStatus, count: u32, text: Arguments<'_>) {
        if self.items.len() == MOST_ITEMS {
            self.is_cut = true;
            return;
        }
        let mut written = Text::default();
        // A text takes what fits.
        let _ = written.write_fmt(text);
        let count = u16::try_from(count).unwrap_or(u16::MAX);
        self.items.push(MissionItem { status, element, count, text: written });
    }
}
