//! Sorted maps and sets that compile quickly.
//! They are used as those of the standard library: [`SortedMap`] and [`SortedSet`]. But a range that ends before it starts has no
//! entries, and `extract_if` takes entries out at once.
//!
//! Own code, as the time to compile is what it is for. Each pair of types in a [`BTreeMap`] is some six thousand lines
//! for LLVM, and one that is collected is sorted by another two thousand: together a third of the code of the crates with
//! the most maps. A [`SortedMap`] is a list of short sorted lists, which is a tenth of that code, and inserts in about
//! the same time up to millions of entries. Maps of libraries either sort, too, or keep one list, where insertion
//! takes time in proportion to its length.
//!
//! ```
//! use slate_sorted::SortedMap;
//!
//! let mut seen = SortedMap::new();
//! for word in ["map", "set", "map"] {
//!     *seen.entry(word).or_insert(0) += 1;
//! }
//! assert_eq!(seen.into_iter().collect::<Vec<_>>(), [("map", 2), ("set", 1)]);
//! ```
//!
//! [`BTreeMap`]: std::collections::BTreeMap

mod entry;
mod iterators;
mod map;
mod map_traits;
mod range;
mod serialization;
mod set;

pub use entry::{MapEntry, OccupiedEntry, VacantEntry};
pub use iterators::{Entries, EntriesMut, EntryRange, EntryRangeMut, IntoEntries};
pub use map::SortedMap;
pub use set::{IntoValues, SortedSet, ValueRange, Values};
