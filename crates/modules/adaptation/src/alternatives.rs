//! Alternatives: the configuration as written, and variants of its settings.

use slate_plugin::module::Sequence;
use slate_plugin::prelude::*;

/// Alternative configuration.
#[interface]
pub struct Alternative {
    /// Maximum speed; 0 for standstill, which needs no sensor.
    #[unit("m/s")]
    pub speed: f64,
    /// Name.
    pub name: Text<28>,
    /// Changes of the configuration, each `path=value` as for `slate config set`.
    pub changes: Sequence<Text<124>, 8>,
}

/// Alternatives, the best first.
#[interface]
pub struct Alternatives {
    /// Alternatives by health: first sensor healthy, only the second, none.
    pub list: Sequence<Alternative, 3>,
}

impl Alternatives {
    /// Returns the name of an alternative.
    pub fn name(&self, number: usize) -> &str {
        self.list.get(number).map_or("none", |alternative| alternative.name.as_str())
    }

    /// Returns the changes to request for an alternative, `path` or `path=value`.
    /// Of the settings that alternatives name, all are reset, then its own are set.
    pub fn changes(&self, number: usize) -> impl Iterator<Item = &str> {
        let all = self.list.iter().flat_map(|alternative| alternative.changes.iter());
        let paths = all.filter_map(|change| change.as_str().split_once('=').map(|(path, _)| path));
        let own = self.list.get(number).into_iter().flat_map(|alternative| alternative.changes.iter());
        paths.chain(own.map(|change| change.as_str()))
    }
}
