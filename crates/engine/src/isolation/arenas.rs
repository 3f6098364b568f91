use std::collections::BTreeMap;
use std::io;
use std::path::PathBuf;
use std::sync::{Arc, Weak};

use super::Arena;

/// The shared memory of an agent: one arena for what isolated modules read, which the host writes, and one for what
/// each of them writes. A module can spoil its own only.
#[derive(Debug, Default)]
pub struct Arenas {
    /// What is started to run a module; this program if it is nothing.
    pub program: Option<PathBuf>,
    host: Weak<Arena>,
    own: BTreeMap<String, Weak<Arena>>,
}

impl Arenas {
    /// None so far; modules run in processes of that program, or of this one.
    pub fn new(program: Option<PathBuf>) -> Self {
        Self { program, ..Self::default() }
    }

    /// What the host writes and isolated modules read.
    ///
    /// # Errors
    /// As [`Arena::new`].
    pub fn host(&mut self) -> io::Result<Arc<Arena>> {
        present(&mut self.host)
    }

    /// What that module writes.
    ///
    /// # Errors
    /// As [`Arena::new`].
    pub fn own(&mut self, module: &str) -> io::Result<Arc<Arena>> {
        if !self.own.contains_key(module) {
            self.own.insert(module.into(), Weak::new());
        }
        self.own.get_mut(module).map_or_else(Arena::new, present)
    }
}

/// The arena, made anew if nobody has had it any more.
fn present(arena: &mut Weak<Arena>) -> io::Result<Arc<Arena>> {
    if let Some(arena) = arena.upgrade() {
        return Ok(arena);
    }
    let made = Arena::new()?;
    *arena = Arc::downgrade(&made);
    Ok(made)
}
