//! Alternatives: the configuration as written, and variants with some other settings.

use slate_plugin::module::Sequence;
use slate_plugin::prelude::*;

/// An alternative configuration.
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

/// The alternatives, the best first.
#[interface]
pub struct Alternatives {
    /// The first one is for when the first sensor is healthy, the second for when only the second one is, and the third for
    /// when none is.
    pub list: Sequence<Alternative, 3>,
}

impl Alternatives {
    /// The name of one.
    pub fn name(&self, number: usize) -> &str {
        self.list.get(number).map_or("none", |alternative| alternative.name.as_str())
    }

    /// What is to be asked for, so that of the settings that alternatives name those of one hold: all are taken back, and
    /// its own are set.
    pub fn changes(&self, number: usize) -> impl Iterator<Item = &str> {
        let all = self.list.iter().flat_map(|alternative| alternative.changes.iter());
        let paths = all.filter_map(|change| change.as_str().split_once('=').map(|(path, _)| path));
        let own = self.list.get(number).into_iter().flat_map(|alternative| alternative.changes.iter());
        paths.chain(own.map(|change| change.as_str()))
    }
}
