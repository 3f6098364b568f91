//! Blackboards of trees and sub-trees, whose entries are found when a tree is read.

use slate_sorted::SortedMap;

use crate::value::BoardValue;

/// Blackboard of a tree.
#[derive(Default)]
pub(super) struct TreeBoard {
    pub parent: Option<usize>,
    /// Path of the sub-tree; empty for the main tree.
    pub path: String,
    /// Entries that are others of the parent.
    pub remapped: SortedMap<String, String>,
    /// Entries whose value the file has.
    pub own: SortedMap<String, BoardValue>,
    /// True if entries are those of the parent with the same name.
    pub is_open: bool,
}

/// Blackboards, and their entries by numbers.
#[derive(Default)]
pub(super) struct Boards {
    boards: Vec<TreeBoard>,
    slots: SortedMap<(usize, String), usize>,
    pub entries: Vec<String>,
    /// Position of each entry's name in its text.
    pub names: Vec<usize>,
    pub initial: Vec<Option<BoardValue>>,
}

impl Boards {
    pub fn add(&mut self, board: TreeBoard) -> usize {
        self.boards.push(board);
        self.boards.len() - 1
    }

    /// Returns the number of the entry that a name leads to.
    ///
    /// A name with `@` in front is one of the main tree. A name with `_` in front is never that of the parent.
    pub fn entry(&mut self, board: usize, name: &str) -> usize {
        let (mut board, mut name) = match name.strip_prefix('@') {
            Some(rest) => (0, rest),
            None => (board, name),
        };
        let key = loop {
            let own = &self.boards[board];
            let Some(parent) = own.parent.filter(|_| !own.own.contains_key(name)) else {
                break (board, name);
            };
            match own.remapped.get(name) {
                Some(outer) => (board, name) = (parent, outer),
                None if own.is_open && !name.starts_with('_') => board = parent,
                None => break (board, name),
            }
            if let Some(rest) = name.strip_prefix('@') {
                break (0, rest);
            }
        };
        let key = (key.0, key.1.to_owned());
        if let Some(slot) = self.slots.get(&key) {
            return *slot;
        }
        let own = &self.boards[key.0];
        self.names.push(if own.path.is_empty() { 0 } else { own.path.len() + 1 });
        self.entries.push(match own.path.as_str() {
            "" => key.1.clone(),
            path => format!("{path}/{}", key.1),
        });
        self.initial.push(own.own.get(&key.1).cloned());
        self.slots.insert(key, self.entries.len() - 1);
        self.entries.len() - 1
    }

    /// Adds an entry that only the node at a path uses.
    pub fn own_entry(&mut self, path: &str, name: &str) -> usize {
        self.names.push(path.len() + 1);
        self.entries.push(format!("{path}/{name}"));
        self.initial.push(None);
        self.entries.len() - 1
    }
}
