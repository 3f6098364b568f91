use slate_module::Text;

use crate::ActionKind;

/// Writer of the running action with its nested actions.
/// An example is `GoToOrigin > TurnToOrigin > TurnAngle`.
#[derive(Debug)]
pub struct ActionTree {
    bytes: [u8; 252],
    length: usize,
    /// Set if the next name is below another.
    below: bool,
}

impl Default for ActionTree {
    fn default() -> Self {
        Self { bytes: [0; 252], length: 0, below: false }
    }
}

impl ActionTree {
    /// Writes a name below the last one.
    pub fn name(&mut self, name: &str) {
        if self.below {
            self.push(" > ");
        }
        self.push(name);
        self.below = true;
    }

    /// Writes an action that runs inside the last one.
    pub fn child<A: ActionKind>(&mut self, action: &A) {
        action.describe(self);
    }

    /// Writes actions that run in parallel: `(A | B)`.
    pub fn parallel(&mut self, each: impl FnOnce(&mut ParallelWriter<'_>)) {
        if self.below {
            self.push(" > ");
        }
        self.push("(");
        each(&mut ParallelWriter { tree: self, first: true });
        self.push(")");
        self.below = true;
    }

    /// Returns the text, truncated to the capacity.
    pub fn text(&self) -> Text<252> {
        // Only whole strings were copied, cut at characters.
        Text::new(std::str::from_utf8(&self.bytes[..self.length]).unwrap_or_default())
    }

    fn push(&mut self, text: &str) {
        let mut end = text.len().min(self.bytes.len() - self.length);
        while !text.is_char_boundary(end) {
            end -= 1;
        }
        self.bytes[self.length..self.length + end].copy_from_slice(&text.as_bytes()[..end]);
        self.length += end;
    }
}

/// Writer of parallel actions; made by [`ActionTree::parallel`].
#[derive(Debug)]
pub struct ParallelWriter<'a> {
    tree: &'a mut ActionTree,
    first: bool,
}

impl ParallelWriter<'_> {
    /// Writes one of them.
    pub fn child<A: ActionKind>(&mut self, action: &A) {
        if !self.first {
            self.tree.push(" | ");
        }
        self.first = false;
        self.tree.below = false;
        action.describe(self.tree);
    }
}
