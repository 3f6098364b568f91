use std::collections::BTreeSet;
use std::sync::Arc;

use slate_blackboard::channel::Budget;
use slate_blackboard::interface::Descriptor;
use slate_blackboard::{Access, Board, BoardError, Property, Store};

/// A property that is played.
#[derive(Clone, Debug)]
pub struct Played {
    /// Its path, without a leading slash.
    pub path: String,
    /// Its documentation.
    pub doc: String,
    /// Its interface.
    pub descriptor: &'static Descriptor,
    /// Room in the tail, for interfaces with one.
    pub capacity: usize,
    /// The module that wrote it, if one did; readers see its recorded condition.
    pub module: Option<String>,
    /// The modules whose stages come after that in which it was written: with `previous` they read what was there when the cycle
    /// began.
    pub early_for: BTreeSet<String>,
    /// Whether it is a mailbox instead: modules send to it, and the player takes the messages.
    pub is_mailbox: bool,
}

impl Played {
    /// Puts it on the board, where it is no mailbox.
    pub fn add(&self, board: &Board, depth: usize, budget: Budget) -> Result<Arc<Property>, BoardError> {
        let store = Store { capacity: self.capacity, depth, budget };
        // Only the player writes it, also if it was a setting.
        board.add_channel(&self.path, &self.doc, self.descriptor, store, Access::Output)
    }
}
