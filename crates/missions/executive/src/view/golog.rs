//! View of a Golog program: its trace, running actions and remaining program.

use slate_golog::{ActionTheory, GologExecutor, MOST_ACTIONS, TracedEvent, outline};

use super::activity::{ActivityWriter, MissionItemStatus};
use super::drawing::{MissionDrawing, MissionElementKind, MissionMark};
use crate::activity_hash::ActivityHash;

/// Draws the robot's action slots, exogenous actions, and the program's outline.
pub fn draw(theory: &ActionTheory) -> MissionDrawing {
    let mut drawing = MissionDrawing::new(theory.name());
    let plain = MissionMark::PLAIN;
    for slot in 1..=MOST_ACTIONS {
        drawing.node(MissionElementKind::ACTION, plain, usize::MAX, &format!("action {slot}"));
    }
    for event in theory.exogenous_actions() {
        drawing.node(MissionElementKind::EVENT, plain, usize::MAX, &event);
    }
    let first = MOST_ACTIONS + theory.exogenous_actions().len();
    for row in outline(theory) {
        let kind = if row.is_leaf { MissionElementKind::STEP } else { MissionElementKind::CONTROL };
        let parent = row.parent.map_or(usize::MAX, |parent| first + parent);
        drawing.node(kind, plain, parent, &row.text);
    }
    drawing
}

/// Hashes the situation, the actions, and the number of steps.
pub fn hash(executor: &GologExecutor, hash: &mut ActivityHash) {
    let flags = [executor.is_blocked(), executor.is_searching()];
    flags.into_iter().for_each(|flag| hash.number(u64::from(flag)));
    [executor.steps(), executor.traced(), executor.situation_hash()]
        .into_iter()
        .for_each(|number| hash.number(number));
    executor.phases().for_each(|phase| hash.number(phase));
}

/// Describes the trace, the actions that run, and the program that remains.
pub fn describe(executor: &GologExecutor, activity: &mut ActivityWriter<'_>) {
    for (text, event) in executor.trace() {
        let status = match event {
            TracedEvent::Done | TracedEvent::Started => MissionItemStatus::PERFORMED,
            TracedEvent::Succeeded => MissionItemStatus::SUCCEEDED,
            TracedEvent::Failed => MissionItemStatus::FAILED,
            TracedEvent::Occurred => MissionItemStatus::OCCURRED,
        };
        activity.row(status, usize::from(event == TracedEvent::Started), format_args!("{text}"));
    }
    for (slot, text, is_suspended) in executor.running() {
        let status = if is_suspended { MissionItemStatus::SUSPENDED } else { MissionItemStatus::RUNNING };
        activity.element(slot, status, 0, format_args!("{text}"));
    }
    for row in executor.remaining() {
        activity.row(MissionItemStatus::REMAINING, row.level, format_args!("{}", row.text));
    }
    executor.unknown_conditions().for_each(|name| activity.unknown(name));
}
