//! Properties and other names of them, by path.

use std::collections::BTreeMap;

use super::BoardError;
use crate::nearest::nearest_paths;

/// Aliases that are followed at most.
/// An alias leads to a property, not to another alias, but an application may chain them by mistake.
const MAX_ALIASES: usize = 8;

/// Properties by path, and other names of them.
/// A [`Board`](crate::Board) has one of properties with memory, a description of an agent one without.
#[derive(Clone, Debug)]
pub struct AddressSpace<P> {
    entries: BTreeMap<String, AddressEntry<P>>,
}

/// Entry of an [`AddressSpace`].
#[derive(Clone, Debug)]
pub enum AddressEntry<P> {
    /// Property.
    Property(P),
    /// Linked input: the path of the property that it reads, which may name a field.
    Alias(String),
}

impl<P> Default for AddressSpace<P> {
    fn default() -> Self {
        Self { entries: BTreeMap::new() }
    }
}

impl<P> AddressSpace<P> {
    /// Adds an entry at a path.
    ///
    /// # Errors
    /// When the path is taken.
    pub fn add(&mut self, path: &str, entry: AddressEntry<P>) -> Result<(), BoardError> {
        if self.entries.contains_key(path) {
            return Err(BoardError::Exists { url: format!("/{path}") });
        }
        self.entries.insert(path.into(), entry);
        Ok(())
    }

    /// Puts an entry at a path, in the place of the present one.
    pub fn place(&mut self, path: String, entry: AddressEntry<P>) {
        self.entries.insert(path, entry);
    }

    /// Removes and returns the entry at exactly that path.
    ///
    /// # Errors
    /// When nothing is there.
    pub fn remove(&mut self, path: &str) -> Result<AddressEntry<P>, BoardError> {
        self.entries.remove(path).ok_or_else(|| self.unknown(path))
    }

    /// Redirects the alias at a path, and returns its former target.
    ///
    /// # Errors
    /// When nothing is there, or a property.
    pub fn replace_alias(&mut self, path: &str, target: &str) -> Result<String, BoardError> {
        match self.entries.get_mut(path) {
            Some(AddressEntry::Alias(old)) => Ok(std::mem::replace(old, target.into())),
            Some(AddressEntry::Property(_)) => Err(BoardError::Exists { url: format!("/{path}") }),
            None => Err(self.unknown(path)),
        }
    }

    /// Returns the entry at exactly that path.
    pub fn entry(&self, path: &str) -> Option<&AddressEntry<P>> {
        self.entries.get(path)
    }

    /// Returns the property at a path, and the field that the rest of the path names.
    /// The field is empty for the whole value.
    ///
    /// # Errors
    /// [`BoardError::Unknown`] with the nearest names.
    pub fn find(&self, path: &str) -> Result<(&P, String), BoardError> {
        self.look_up(path).map_err(|path| self.unknown(&path))
    }

    /// Returns a property as [`find`](Self::find); `None` if it is missing.
    /// It does not search for similar names.
    pub fn get(&self, path: &str) -> Option<(&P, String)> {
        self.look_up(path).ok()
    }

    /// Returns all properties in the order of their paths.
    pub fn properties(&self) -> impl Iterator<Item = &P> {
        self.entries.values().filter_map(|entry| match entry {
            AddressEntry::Property(property) => Some(property),
            AddressEntry::Alias(_) => None,
        })
    }

    /// Returns all linked inputs with the paths that they read.
    pub fn aliases(&self) -> impl Iterator<Item = (&str, &str)> {
        self.entries.iter().filter_map(|(path, entry)| match entry {
            AddressEntry::Alias(target) => Some((path.as_str(), target.as_str())),
            AddressEntry::Property(_) => None,
        })
    }

    /// Returns the property at a path and the rest of the path.
    /// If it is missing, returns the path to which aliases lead.
    fn look_up(&self, path: &str) -> Result<(&P, String), String> {
        let mut path = path.to_owned();
        for _ in 0..MAX_ALIASES {
            let mut end = path.len();
            loop {
                match self.entries.get(&path[..end]) {
                    Some(AddressEntry::Property(property)) => {
                        return Ok((property, path[end..].trim_start_matches('/').to_owned()));
                    }
                    Some(AddressEntry::Alias(target)) => {
                        path = format!("{target}{}", &path[end..]);
                        break;
                    }
                    None => match path[..end].rfind('/') {
                        Some(slash) => end = slash,
                        None => return Err(path),
                    },
                }
            }
        }
        Err(path)
    }

    fn unknown(&self, path: &str) -> BoardError {
        BoardError::Unknown {
            url: format!("/{path}"),
            near: nearest_paths(path, '/', self.entries.keys().map(String::as_str)),
        }
    }
}
