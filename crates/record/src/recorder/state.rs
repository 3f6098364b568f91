use std::sync::Arc;

use slate_blackboard::channel::{Budget, Writer};
use slate_blackboard::interface::{Interface, View};
use slate_blackboard::{Access, Board, Store};
use slate_module::{Bool, interface};

/// How the recording goes: `/record/state`, written ten times a second.
#[interface]
pub struct RecordState {
    /// Values that were handed over to the file.
    pub values: u64,
    /// Values that are missing there, as nobody may wait for a slow disk.
    pub dropped: u64,
    /// Bytes of the file.
    #[unit("B")]
    pub bytes: u64,
    /// Whether it goes on; it does not when the file can't be written.
    pub is_on: Bool,
    /// Not used.
    pub reserved: [u8; 7],
}

/// Shows it.
pub(super) struct Shown {
    writer: Writer,
}

impl Shown {
    /// Nothing when the board has it already.
    pub fn new(board: &Arc<Board>) -> Option<Self> {
        let store = Store { capacity: 0, depth: 1, budget: Budget { latest: 8, queues: 0, window: 0 } };
        let doc = "How the recording goes.";
        let property = board.add_channel(PATH, doc, RecordState::DESCRIPTOR, store, Access::Output).ok();
        // One that began earlier has left it.
        let property = property.or_else(|| board.get(PATH).map(|(property, _)| property))?;
        Some(Self { writer: property.channel()?.writer().ok()? })
    }

    pub fn write(&mut self, is_on: bool, values: u64, dropped: u64, bytes: u64, time: u64) {
        let state = RecordState { values, dropped, bytes, is_on: is_on.into(), reserved: [0; 7] };
        // Nobody holds it up.
        let _ = self.writer.write(View::of(&state).bytes(), 0, time);
    }
}

const PATH: &str = "record/state";
