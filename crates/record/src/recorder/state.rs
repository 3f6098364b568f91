use std::sync::Arc;

use slate_blackboard::channel::{Budget, Writer};
use slate_blackboard::interface::{Interface, View};
use slate_blackboard::{Access, Board, Store};
use slate_module::{Bool, interface};
use slate_runtime::recording::RecordingEntry;

use super::target::Progress;

/// How recordings go: `/record/state`, written ten times a second. All of the run are counted together.
#[interface]
pub struct RecordState {
    /// Values that were handed over to files.
    pub values: u64,
    /// Values that are missing there, as the agent does not wait for a slow disk.
    pub dropped: u64,
    /// Bytes of the files.
    #[unit("B")]
    pub bytes: u64,
    /// Whether anything is recorded; nothing is when the file can't be written.
    pub is_on: Bool,
}

/// Shows it.
pub(super) struct RecordStateOutput {
    writer: Writer,
}

impl RecordStateOutput {
    /// Nothing when the board has it already.
    pub fn new(board: &Arc<Board>) -> Option<Self> {
        let store = Store { capacity: 0, depth: 1, budget: Budget { latest: 8, queues: 0, window: 0 } };
        let doc = "How the recording goes.";
        let property = board.add_channel(PATH, doc, RecordState::DESCRIPTOR, store, Access::Output).ok();
        // One that began earlier has left it.
        let property = property.or_else(|| board.get(PATH).map(|(property, _)| property))?;
        Some(Self { writer: property.channel()?.writer().ok()? })
    }

    /// All recordings together.
    pub fn write(&mut self, is_on: bool, recordings: &[Arc<Progress>], time: u64) {
        let entries = recordings.iter().map(|progress| progress.entry());
        let sum = |sums: [u64; 3], entry: RecordingEntry| {
            [sums[0] + entry.values, sums[1] + entry.dropped, sums[2] + entry.bytes]
        };
        let [values, dropped, bytes] = entries.fold([0; 3], sum);
        let mut state = RecordState { values, dropped, bytes, is_on: is_on.into() };
        // No reader blocks it.
        let _ = self.writer.write(View::of(&mut state).bytes(), 0, time);
    }
}

const PATH: &str = "record/state";
