//! Names of IDL, and the types that they mean.

use slate_sorted::SortedMap;

use super::IdlKind;

/// Meaning of a name.
#[derive(Clone, Debug, PartialEq)]
pub enum IdlDefinition {
    Type(IdlKind),
    Constant(i64),
    /// Enumerator, which is a name of its own and no type.
    Enumerator,
}

/// Definitions by their names with modules, and the modules that are open.
#[derive(Default)]
pub struct Scope {
    pub definitions: SortedMap<String, IdlDefinition>,
    modules: Vec<String>,
}

impl Scope {
    pub fn open(&mut self, module: &str) {
        self.modules.push(module.into());
    }

    pub fn close(&mut self) {
        self.modules.pop();
    }

    /// Returns the number of open modules.
    pub fn depth(&self) -> usize {
        self.modules.len()
    }

    /// Returns a name with the open modules.
    pub fn whole(&self, name: &str) -> String {
        self.joined(self.modules.len(), name)
    }

    fn joined(&self, modules: usize, name: &str) -> String {
        let parts = self.modules[..modules].iter().map(String::as_str).chain([name]);
        parts.collect::<Vec<_>>().join("::")
    }

    /// Defines a name in the innermost module; whether it was free.
    pub fn define(&mut self, name: &str, definition: IdlDefinition) -> bool {
        self.definitions.insert(self.whole(name), definition).is_none()
    }

    /// Resolves a name, from the innermost module outwards.
    /// A name that begins with `::` is absolute.
    pub fn find(&self, name: &str) -> Option<&IdlDefinition> {
        if let Some(whole) = name.strip_prefix("::") {
            return self.definitions.get(whole);
        }
        (0..=self.modules.len()).rev().find_map(|count| self.definitions.get(&self.joined(count, name)))
    }
}
