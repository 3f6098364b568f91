//! Earlier values of a property, from a recorder or a playback.

use slate_blackboard::channel::StampedValue;
use slate_blackboard::interface::Descriptor;

/// Query for earlier values of a property.
/// Times are nanoseconds of the agent's time.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct HistoryRequest {
    /// The property, without a leading slash.
    pub path: String,
    /// Earliest time.
    pub from: u64,
    /// Smallest sequence number at the time `from`; 0 for all.
    pub sequence: u64,
    /// Latest time.
    pub to: u64,
    /// Largest number of values.
    /// If there are more, the result is spread evenly and contains the last one.
    pub most: usize,
}

/// Callback for the values in the order of time, each with its interface.
/// It returns false to refuse the value and all values after it.
pub type TakeValue<'a> = dyn FnMut(&'static Descriptor, StampedValue) -> bool + 'a;

/// Values that the callback has refused.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Left {
    /// Number of values.
    pub count: usize,
    /// Time of the first of them.
    pub time: u64,
    /// Sequence number of the first of them, as several may have one time.
    pub sequence: u64,
}

/// Result of a query.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct History {
    /// Refused values, if any.
    pub left: Option<Left>,
    /// Number of values between the times.
    pub count: usize,
    /// Time from which all values are known.
    pub from: u64,
    /// Time until which all values are known.
    pub to: u64,
}

impl HistoryRequest {
    /// Returns true if a value with that time and number is in the range.
    pub fn has(&self, time: u64, sequence: u64) -> bool {
        (self.from, self.sequence) <= (time, sequence) && time <= self.to
    }

    /// Returns the indices of the selected values among `count` values.
    pub fn places(&self, count: usize) -> impl Iterator<Item = usize> + use<> {
        let selected = self.most.min(count);
        // In 128 bits no product is too large.
        (1..=selected).map(move |place| (place as u128 * count as u128 / selected as u128) as usize - 1)
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    proptest! {
        /// Selects at most `most` values, each once, in order, with the last one.
        #[test]
        fn selection_is_spread_evenly_up_to_the_last(count in 0_usize..5000, most in 0_usize..5000) {
            let request = HistoryRequest { path: String::new(), from: 0, sequence: 0, to: 0, most };
            let places: Vec<_> = request.places(count).collect();
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
