//! Activity of a mission: what changes while it runs.

use std::fmt::{Arguments, Write};

use slate_plugin::interfaces::MissionState;
use slate_plugin::prelude::*;

use super::drawing::NO_ELEMENT;
use crate::actions::MissionActions;
use crate::conditions::KnownConditions;

/// The most items: their values are small enough for the last seconds that an agent keeps.
pub const MOST_ITEMS: usize = 512;

/// Status of an item of a mission.
#[interface]
pub enum MissionItemStatus {
    /// A place has tokens.
    Marked,
    /// A machine is in the state.
    Current,
    /// A transition fires with the next step.
    Enabled,
    /// A transition, a state or a condition waits; the text has the reason.
    Waiting,
    /// It runs.
    Running,
    /// Something of higher priority runs; it waits for that.
    Suspended,
    /// It has succeeded.
    Succeeded,
    /// It has failed.
    Failed,
    /// It was passed over.
    Skipped,
    /// An action of the trace was done, or has begun.
    Performed,
    /// An exogenous action of the trace has occurred.
    Occurred,
    /// A row of the program that remains.
    Remaining,
    /// A condition holds.
    Holds,
    /// A condition does not hold.
    DoesNotHold,
    /// Nothing has reported the condition.
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
    /// Whether the mission makes no steps until it is resumed.
    pub is_paused: Bool,
    /// Whether items are missing, as the mission has more than fit.
    pub is_cut: Bool,
    /// Reason of a failure, or what the mission waits for.
    pub reason: Text<124>,
    /// Elements that are not at rest, rows of a trace and a program, and conditions.
    pub items: [MissionItem],
}

/// The robot as an activity sees it.
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
    /// Items; what was there before is not.
    pub items: &'a mut Vec<MissionItem>,
    /// What the mission waits for.
    pub reason: Text<124>,
    /// Whether there were more items than fit.
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

    /// Adds a condition that nothing has reported, once.
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
