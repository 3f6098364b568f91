//! Record of the published views of a mission.

use serde::{Deserialize, Serialize};
use slate_plugin::interfaces::MissionState;
use slate_plugin::prelude::*;

use super::activity::{ActivityWriter, MissionActivity, MissionItem, MissionItemStatus, MissionSight};
use super::drawing::{MissionDrawing, MissionGraph, MissionNotation};
use crate::activity_hash::ActivityHash;

/// State of a view in snapshots.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(default)]
pub struct SavedView {
    /// Pause state: true while the mission makes no steps.
    pub is_paused: bool,
    /// Number of the graph that was published.
    pub graph: u32,
    /// Hash of the activity that was published.
    activity: u64,
}

/// Published view of a mission, and its pause state.
#[derive(Default)]
pub struct MissionView {
    /// State in snapshots.
    pub saved: SavedView,
    /// Drawing that was not published yet.
    drawing: Option<MissionDrawing>,
    /// Items, a buffer without allocations in a run.
    items: Vec<MissionItem>,
}

impl MissionView {
    /// Stores the drawing of a new file.
    pub fn draw(&mut self, drawing: MissionDrawing) {
        self.drawing = Some(drawing);
    }

    /// Publishes the drawing of a file, unless it was published before.
    pub fn publish_graph(&mut self, notation: MissionNotation, port: &Output<MissionGraph>) {
        if let Some(drawing) = self.drawing.take()
            && self.saved.graph != drawing.id()
        {
            drawing.write(notation, port);
            self.saved.graph = drawing.id();
        }
    }

    /// Returns true if an activity with that hash is new, and records it.
    pub fn takes(&mut self, mut hash: ActivityHash) -> bool {
        hash.number(self.saved.is_paused.into());
        hash.number(self.saved.graph.into());
        let hash = hash.finish();
        std::mem::replace(&mut self.saved.activity, hash) != hash
    }

    /// Publishes an activity, which `describe` writes.
    /// The known conditions follow.
    pub fn publish(
        &mut self,
        state: MissionState,
        seen: &MissionSight<'_>,
        port: &Output<MissionActivity>,
        describe: impl FnOnce(&mut ActivityWriter<'_>),
    ) {
        self.items.clear();
        let mut writer = ActivityWriter { items: &mut self.items, reason: Text::default(), is_cut: false };
        describe(&mut writer);
        for (name, holds) in seen.conditions.iter() {
            let status = if holds { MissionItemStatus::HOLDS } else { MissionItemStatus::DOES_NOT_HOLD };
            writer.row(status, 0, format_args!("{name}"));
        }
        let ActivityWriter { reason, is_cut, .. } = writer;
        let count = self.items.len().min(port.capacity());
        port.write(count, |activity| {
            activity.state = state;
            activity.graph = self.saved.graph;
            activity.is_paused = self.saved.is_paused.into();
            activity.is_cut = (is_cut || count < self.items.len()).into();
            activity.reason = reason;
            activity.items.copy_from_slice(&self.items[..count]);
        });
    }
}
