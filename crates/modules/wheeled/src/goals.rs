//! Goals that a robot visits in turn, from Knowledge.

use slate_plugin::interfaces::Point2;
use slate_plugin::prelude::*;

/// Goals in the order of the visits.
#[interface]
#[derive(PartialEq)]
pub struct Goals {
    /// Their places.
    pub list: Sequence<Point2, 16>,
}

impl Goals {
    /// Returns a goal; after the last one the first follows. `None` without goals.
    pub fn get(&self, number: usize) -> Option<Point2> {
        let count = self.list.len();
        (count > 0).then(|| self.list[number % count])
    }
}
