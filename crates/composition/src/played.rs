use std::sync::Arc;

use slate_blackboard::channel::Budget;
use slate_blackboard::interface::Descriptor;
use slate_blackboard::{Access, Board, BoardError, Property, Store};
use slate_sorted::SortedSet;

/// Property that is played from a recording.
#[derive(Clone, Debug)]
pub struct Played {
    /// Path without a leading slash.
    pub path: String,
    /// Documentation of the property.
    pub doc: String,
    /// Interface of the property.
    pub descriptor: &'static Descriptor,
    /// Room in the tail, for interfaces with one.
    pub capacity: usize,
    /// The module that wrote it, if one did; readers see its recorded condition.
    pub module: Option<String>,
    /// Modules whose stages run after the stage that wrote the property.
    /// With `previous` they read the value from the beginning of the cycle.
    pub later_modules: SortedSet<String>,
    /// Flag of a mailbox: modules send to it, and the player takes the messages.
    pub is_mailbox: bool,
}

impl Played {
    /// Adds the property to the board, unless it is a mailbox.
    pub fn add(&self, board: &Board, depth: usize, budget: Budget) -> Result<Arc<Property>, BoardError> {
        let store = Store { capacity: self.capacity, depth, budget };
        // Only the player writes it, also if it was a setting.
        board.add_channel(&self.path, &self.doc, self.descriptor, store, Access::Output)
    }
}
