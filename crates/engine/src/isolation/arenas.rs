use std::io;
use std::path::PathBuf;
use std::sync::{Arc, Weak};

use slate_sorted::SortedMap;

use super::Arena;

/// Shared memory of an agent: the host's arena, and one for each isolated module.
/// The host writes its arena and isolated modules read it; each module writes its own, and can corrupt no other.
#[derive(Debug, Default)]
pub struct Arenas {
    /// Program that runs an isolated module; this program if `None`.
    pub program: Option<PathBuf>,
    host: Weak<Arena>,
    own: SortedMap<String, Weak<Arena>>,
}

impl Arenas {
    /// Returns arenas without memory yet.
    /// Modules run in processes of `program`, or of this one.
    pub fn new(program: Option<PathBuf>) -> Self {
        Self { program, ..Self::default() }
    }

    /// Returns the arena that the host writes and isolated modules read.
    ///
    /// # Errors
    /// As [`Arena::new`].
    pub fn host(&mut self) -> io::Result<Arc<Arena>> {
        present(&mut self.host)
    }

    /// Returns the arena that this module writes.
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

/// Returns the arena, or a new one if no user is left.
fn present(arena: &mut Weak<Arena>) -> io::Result<Arc<Arena>> {
    if let Some(arena) = arena.upgrade() {
        return Ok(arena);
    }
    let made = Arena::new()?;
    *arena = Arc::downgrade(&made);
    Ok(made)
}
