//! The past of a property, as what records an agent or plays a recording in it knows it.

use slate_blackboard::channel::FrozenValue;
use slate_blackboard::interface::Descriptor;

/// Which values are asked for. Times are nanoseconds of the agent's time.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct HistoryWish {
    /// The property, without a leading slash.
    pub path: String,
    /// The earliest time,
    pub from: u64,
    /// of whose values the first that is told has at least this sequence number; with 0 all of them are,
    pub sequence: u64,
    /// and the latest time.
    pub to: u64,
    /// At most so many; where there are more, they are spread evenly, and the last one is among them.
    pub most: usize,
}

/// Takes values one after the other, in the order of time, with what they are made of; false when it takes this one and those after
/// it no more.
pub type TakeValue<'a> = dyn FnMut(&'static Descriptor, FrozenValue) -> bool + 'a;

/// What was not taken.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Left {
    /// How many values.
    pub count: usize,
    /// The time of the first of them,
    pub time: u64,
    /// and its sequence number, as several may have one time.
    pub sequence: u64,
}

/// What is known.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct History {
    /// What was told but not taken, if there is anything.
    pub left: Option<Left>,
    /// How many there are between the times.
    pub count: usize,
    /// Since when every value is known,
    pub from: u64,
    /// and until when.
    pub to: u64,
}

impl HistoryWish {
    /// Whether a value of a time, with a sequence number, is between the times.
    pub fn has(&self, time: u64, sequence: u64) -> bool {
        (self.from, self.sequence) <= (time, sequence) && time <= self.to
    }

    /// The places of those that are told, of so many.
    pub fn places(&self, count: usize) -> impl Iterator<Item = usize> + use<> {
        let told = self.most.min(count);
        // In 128 bits no product is too large.
        (1..=told).map(move |place| (place as u128 * count as u128 / told as u128) as usize - 1)
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    proptest! {
        /// Whatever there is: no more than is asked for, each once, in order, and the last one.
        #[test]
        fn what_is_told_is_spread_evenly_up_to_the_last(count in 0_usize..5000, most in 0_usize..5000) {
            let wish = HistoryWish { path: String::new(), from: 0, sequence: 0, to: 0, most };
            let places: Vec<_> = wish.places(count).collect();
            prop_assert_eq!(places.len(), most.min(count));
            prop_assert!(places.windows(2).all(|two| two[0] < two[1]));
            if most > 0 && count > 0 {
                prop_assert_eq!(places.last(), Some(&(count - 1)));
                let gaps = places.windows(2).map(|two| two[1] - two[0]);
                let (least, largest) = gaps.fold((usize::MAX, 0), |(low, high), gap| (low.min(gap), high.max(gap)));
                prop_assert!(places.len() < 2 || largest - least <= 1);
            }
        }
    }
}
