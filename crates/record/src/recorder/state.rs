use std::sync::Arc;

use slate_blackboard::channel::{Budget, Writer};
use slate_blackboard::interface::{Interface, View};
use slate_blackboard::{Access, Board, Store};
use slate_module::{Bool, interface};
use slate_runtime::recording::RecordingEntry;

use super::target::Progress;

/// State of the recordings of a run, all counted together.
/// Written ten times a second at `/record/state`.
#[interface]
pub struct RecordState {
    /// Values that were handed over to files.
    pub values: u64,
    /// Values that are missing there, as the agent does not wait for a slow disk.
    pub dropped: u64,
    /// Bytes of the files.
    #[unit("B")]
    pub bytes: u64,
    /// Set while anything is recorded; not set if the file can't be written.
    pub is_on: Bool,
}

/// Output of the state.
pub(super) struct RecordStateOutput {
    writer: Writer,
}

impl RecordStateOutput {
    /// Creates the output of the state; `None` if the board has it already.
    pub fn new(board: &Arc<Board>) -> Option<Self> {
        let store = Store { capacity: 0, depth: 1, budget: Budget { latest: 8, queues: 0, window: 0 } };
        let doc = "State of the recording.";
        let property =
            board.add_channel(STATE_PATH, doc, RecordState::DESCRIPTOR, store, Access::Output).ok();
        // One that began earlier has left it.
        let property = property.or_else(|| board.get(STATE_PATH).map(|(property, _)| property))?;
        Some(Self { writer: property.channel()?.writer().ok()? })
    }

    /// Writes the sum of all recordings.
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

const STATE_PATH: &str = "record/state";
