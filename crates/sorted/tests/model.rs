//! Maps and sets do what those of the standard library do.

use std::collections::{BTreeMap, BTreeSet};
use std::ops::Bound;

use proptest::prelude::*;
use slate_sorted::{MapEntry, SortedMap, SortedSet};

#[derive(Debug, Clone)]
enum Step {
    Insert(u16, u8),
    InsertMany(u16, u16),
    Remove(u16),
    RemoveMany(u16, u16),
    Count(u16),
    Take(u16),
    PopFirst,
    PopLast,
    Retain(u16),
    Extract(u16),
    SplitOff(u16),
    Double,
}

fn step() -> impl Strategy<Value = Step> {
    let key = || 0..2000_u16;
    prop_oneof![
        6 => (key(), any::<u8>()).prop_map(|(key, value)| Step::Insert(key, value)),
        3 => (key(), 1..700_u16).prop_map(|(key, count)| Step::InsertMany(key, count)),
        6 => key().prop_map(Step::Remove),
        2 => (key(), 1..700_u16).prop_map(|(key, count)| Step::RemoveMany(key, count)),
        3 => key().prop_map(Step::Count),
        3 => key().prop_map(Step::Take),
        2 => Just(Step::PopFirst),
        2 => Just(Step::PopLast),
        1 => (2..5_u16).prop_map(Step::Retain),
        1 => (2..5_u16).prop_map(Step::Extract),
        1 => key().prop_map(Step::SplitOff),
        1 => Just(Step::Double),
    ]
}

fn apply(step: &Step, map: &mut SortedMap<u16, u8>, model: &mut BTreeMap<u16, u8>) {
    match *step {
        Step::Insert(key, value) => assert_eq!(map.insert(key, value), model.insert(key, value)),
        Step::InsertMany(key, count) => {
            map.extend((key..key + count).map(|key| (key, 1)));
            model.extend((key..key + count).map(|key| (key, 1)));
        }
        Step::Remove(key) => assert_eq!(map.remove(&key), model.remove(&key)),
        Step::RemoveMany(key, count) => {
            for key in key..key + count {
                assert_eq!(map.remove_entry(&key), model.remove_entry(&key));
            }
        }
        Step::Count(key) => {
            for value in [map.entry(key).or_default(), model.entry(key).or_default()] {
                *value = value.wrapping_add(1);
            }
        }
        Step::Take(key) => {
            let taken = match map.entry(key) {
                MapEntry::Occupied(entry) => Some(entry.remove()),
                MapEntry::Vacant(entry) => {
                    assert_eq!(entry.key(), &key);
                    None
                }
            };
            assert_eq!(taken, model.remove(&key));
        }
        Step::PopFirst => assert_eq!(map.pop_first(), model.pop_first()),
        Step::PopLast => assert_eq!(map.pop_last(), model.pop_last()),
        Step::Retain(part) => {
            map.retain(|key, _| key % part != 0);
            model.retain(|key, _| key % part != 0);
        }
        Step::Extract(part) => {
            let found = map.extract_if(|key, value| key % part == u16::from(*value % 2));
            assert_eq!(
                found,
                model.extract_if(.., |key, value| key % part == u16::from(*value % 2)).collect::<Vec<_>>()
            );
        }
        Step::SplitOff(key) => {
            let (mut upper, above) = (map.split_off(&key), model.split_off(&key));
            assert!(upper.iter().eq(&above));
            assert_eq!(upper.len(), above.len());
            upper.insert(key, 3);
            map.extend(upper);
            model.extend(above);
            model.insert(key, 3);
        }
        Step::Double => {
            map.values_mut().for_each(|value| *value = value.wrapping_mul(2));
            model.values_mut().for_each(|value| *value = value.wrapping_mul(2));
        }
    }
}

fn compare(map: &SortedMap<u16, u8>, model: &BTreeMap<u16, u8>, from: u16, to: u16) {
    assert_eq!(map.len(), model.len());
    assert_eq!(map.is_empty(), model.is_empty());
    assert!(map.iter().eq(model));
    assert!(map.iter().rev().eq(model.iter().rev()));
    assert!(map.clone().into_iter().eq(model.clone()));
    assert!(map.clone().into_iter().rev().eq(model.clone().into_iter().rev()));
    assert!(map.clone().iter_mut().rev().eq(model.clone().iter_mut().rev()));
    assert!(map.keys().eq(model.keys()) && map.values().eq(model.values()));
    assert_eq!(map.iter().len(), model.len());
    assert_eq!(map.first_key_value(), model.first_key_value());
    assert_eq!(map.last_key_value(), model.last_key_value());
    assert_eq!(format!("{map:?}"), format!("{model:?}"));
    for key in [from, to] {
        assert_eq!(map.get(&key), model.get(&key));
        assert_eq!(map.get_key_value(&key), model.get_key_value(&key));
        assert_eq!(map.contains_key(&key), model.contains_key(&key));
    }
    assert!(map.range(from..).eq(model.range(from..)));
    assert!(map.range(..=to).rev().eq(model.range(..=to).rev()));
    assert!(map.clone().range_mut(from..).eq(model.clone().range_mut(from..)));
    assert!(map.clone().range_mut(..to).rev().eq(model.clone().range_mut(..to).rev()));
    if from < to {
        assert!(map.clone().range_mut(from..to).eq(model.clone().range_mut(from..to)));
        assert!(map.range(from..to).eq(model.range(from..to)));
        let outside = (Bound::Excluded(from), Bound::Included(to));
        assert!(map.range(outside).eq(model.range(outside)));
        assert_eq!(map.range(to..from).count(), 0);
    }
}

/// Takes items from both ends in turns.
fn both_ends<T>(mut items: impl DoubleEndedIterator<Item = T>) -> Vec<T> {
    let mut found = Vec::new();
    while let Some(first) = items.next() {
        found.push(first);
        found.extend(items.next_back());
    }
    assert!(items.next_back().is_none() && items.next().is_none());
    found
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]

    #[test]
    fn maps_do_what_b_trees_do(
        steps in prop::collection::vec(step(), 1..60),
        (from, to) in (0..2000_u16, 0..2000_u16),
    ) {
        let (mut map, mut model) = (SortedMap::new(), BTreeMap::new());
        for step in &steps {
            apply(step, &mut map, &mut model);
            compare(&map, &model, from, to);
        }
        prop_assert_eq!(both_ends(map.iter()), both_ends(model.iter()));
        prop_assert_eq!(both_ends(map.range(from..)), both_ends(model.range(from..)));
        prop_assert_eq!(both_ends(map.clone().into_iter()), both_ends(model.clone().into_iter()));
        let text = serde_json::to_string(&map)?;
        prop_assert_eq!(&text, &serde_json::to_string(&model)?);
        prop_assert_eq!(&serde_json::from_str::<SortedMap<u16, u8>>(&text)?, &map);
        // Whatever its chunks are, a map is what it contains.
        prop_assert_eq!(map, model.into_iter().collect());
    }

    #[test]
    fn maps_and_sets_compare_as_b_trees_do(
        pairs in prop::collection::vec(prop::collection::vec((0..4_u8, 0..3_u8), 0..6), 2),
    ) {
        let [a, b] = [&pairs[0], &pairs[1]].map(|pairs| pairs.iter().copied().collect::<SortedMap<_, _>>());
        let [c, d] = [&pairs[0], &pairs[1]].map(|pairs| pairs.iter().copied().collect::<BTreeMap<_, _>>());
        prop_assert_eq!(a.cmp(&b), c.cmp(&d));
        prop_assert_eq!(a == b, c == d);
        let [a, b] = [a, b].map(|map| map.into_keys().collect::<SortedSet<_>>());
        let [c, d] = [c, d].map(|map| map.into_keys().collect::<BTreeSet<_>>());
        prop_assert_eq!(a.cmp(&b), c.cmp(&d));
        prop_assert!(a.difference(&b).eq(c.difference(&d)));
        prop_assert_eq!(a.is_subset(&b), c.is_subset(&d));
        prop_assert_eq!(a.is_disjoint(&b), c.is_disjoint(&d));
        prop_assert!(a.range(1..3).eq(c.range(1..3)));
        prop_assert_eq!(format!("{a:?}"), format!("{c:?}"));
        prop_assert_eq!(serde_json::to_string(&a)?, serde_json::to_string(&c)?);
    }
}

#[test]
fn keys_are_found_by_what_they_borrow_as() {
    let mut map = SortedMap::from([("left".to_owned(), 1), ("right".to_owned(), 2)]);
    assert_eq!(map["left"], 1);
    assert_eq!(map.get_mut("right").map(std::mem::take), Some(2));
    assert_eq!(
        map.range::<str, _>((Bound::Included("m"), Bound::Unbounded))
            .map(|(key, _)| key.as_str())
            .collect::<Vec<_>>(),
        ["right"]
    );
    let mut set: SortedSet<String> = map.into_keys().collect();
    assert!(set.remove("left") && !set.insert("right".to_owned()));
    assert_eq!(set.take("right").as_deref(), Some("right"));
}

#[test]
fn entries_in_any_order_end_sorted() {
    // An odd factor goes through all numbers below a power of two.
    let mixed = |number: u32| number.wrapping_mul(2_654_435_761) % (1 << 20);
    let orders: [&dyn Fn(u32) -> u32; 3] = [&mixed, &|number| number, &|number| (1 << 20) - 1 - number];
    for order in orders {
        let mut map: SortedMap<u32, u32> = (0..1 << 20).map(|number| (order(number), number)).collect();
        assert!(map.keys().copied().eq(0..1 << 20));
        for number in 0..1 << 20 {
            assert_eq!(map.remove(&order(number)), Some(number));
        }
        assert!(map.is_empty());
    }
}

/// Maps that lose most of their entries give the room back.
#[test]
fn room_is_given_back() {
    let map = |keys: &dyn Fn(u32) -> bool| {
        let mut map: SortedMap<u32, u64> = (0..1 << 16).map(|key| (key, 0)).collect();
        (0..1 << 16).filter(|key| !keys(*key)).for_each(|key| assert_eq!(map.remove(&key), Some(0)));
        map
    };
    let thinned = |kept: &dyn Fn(u32) -> bool| {
        let mut held = None;
        let bytes = allocation_counter::measure(|| held = Some(map(kept))).bytes_current;
        let length = held.map_or(0, |map| map.len() as i64);
        (bytes, length)
    };
    for every in [16, 127, 1000] {
        let (bytes, length) = thinned(&|key| key % every == 0);
        assert!(bytes < 16 * (4 * length + 1024), "{length} entries hold {bytes} bytes");
    }
}

/// A map whose closure panics has all entries that it was not asked to give.
#[test]
fn maps_are_whole_after_a_panic() {
    let full = || (0..1000).map(|key| (key, key)).collect::<SortedMap<_, _>>();
    let mut kept = full();
    let mut taken = full();
    let panicked = std::panic::catch_unwind(std::panic::AssertUnwindSafe(|| {
        kept.retain(|key, _| if *key == 700 { panic!("enough") } else { key % 2 == 0 });
    }));
    assert!(panicked.is_err());
    assert!(kept.keys().copied().eq((0..700).step_by(2).chain(700..1000)));
    let panicked = std::panic::catch_unwind(std::panic::AssertUnwindSafe(|| {
        taken.extract_if(|key, _| if *key == 700 { panic!("enough") } else { true })
    }));
    assert!(panicked.is_err());
    assert!(taken.keys().copied().eq(700..1000));
    for mut map in [kept, taken] {
        let mut left = map.len();
        while map.pop_first().is_some() {
            left -= 1;
        }
        assert_eq!((left, map.pop_last(), map.insert(1, 1), map.len()), (0, None, None, 1));
    }
}
