//! A channel that gets a deeper one while it is written and read.
#![allow(clippy::unwrap_used, reason = "tests stop at the first surprise")]

use std::sync::Arc;

use allocation_counter::measure;
use proptest::prelude::*;
use slate_blackboard::Shape;
use slate_blackboard::channel::{Budget, Channel, Policy, QueueReader, Start};

const BUDGET: Budget = Budget { latest: 4, queues: 2, window: 8 };

fn channel(depth: usize) -> Arc<Channel> {
    Channel::new(Shape { size: 8, item: 0, align: 8, capacity: 0 }, depth, BUDGET)
}

fn pulled(reader: &mut QueueReader) -> Vec<(u64, u64, u64)> {
    let _ = reader.pull();
    let values = reader.window().map(|loan| {
        let stamp = loan.stamp();
        (u64::from_le_bytes(loan.bytes().try_into().unwrap()), stamp.sequence, stamp.generation)
    });
    values.collect()
}

#[test]
fn a_deeper_reader_gets_every_value_written_from_then_on() {
    let channel = channel(1);
    let mut latest = channel.latest().unwrap();
    let mut writer = channel.writer().unwrap();
    for value in 1..=5_u64 {
        writer.write(&value.to_le_bytes(), 0, value).unwrap();
    }
    assert!(!channel.keeps_enough(8));
    writer.deepen(channel.deeper(16, BUDGET).unwrap());
    assert!(channel.keeps_enough(8));
    assert_eq!((channel.depth(), channel.published()), (16, 5));
    let mut every = channel.queue(Policy::Evict, Start::Next).unwrap();
    let mut oldest = channel.queue(Policy::Evict, Start::Oldest).unwrap();
    assert_eq!(channel.readers(), 3);
    for value in 6..=9_u64 {
        writer.write(&value.to_le_bytes(), 0, value).unwrap();
    }
    assert_eq!(pulled(&mut every), [(6, 6, 1), (7, 7, 1), (8, 8, 1), (9, 9, 1)]);
    assert_eq!(pulled(&mut oldest), [(5, 5, 1), (6, 6, 1), (7, 7, 1), (8, 8, 1), (9, 9, 1)]);
    assert_eq!((every.skipped(), oldest.skipped()), (0, 0));
    assert!(latest.refresh());
    assert_eq!(latest.value().unwrap().bytes(), 9_u64.to_le_bytes());
    assert_eq!(channel.snapshot().unwrap().values.len(), 5);
    // What never came is missed here too, and the next writer writes to both.
    writer.skip(2);
    drop(writer);
    let mut writer = channel.writer().unwrap();
    writer.write(&12_u64.to_le_bytes(), 0, 12).unwrap();
    assert_eq!(pulled(&mut every), []);
    drop(oldest);
    let mut again = channel.queue(Policy::Skip, Start::Next).unwrap();
    writer.write(&13_u64.to_le_bytes(), 0, 13).unwrap();
    assert_eq!(pulled(&mut again), [(13, 13, 2)]);
}

#[test]
fn unread_deeper_channels_are_freed() {
    let channel = channel(1);
    let mut writer = channel.writer().unwrap();
    let mut reader = channel.queue(Policy::Skip, Start::Next).unwrap();
    let mut deepen = |time: u64| {
        writer.deepen(channel.deeper(64, BUDGET).unwrap());
        // The former reader goes when the new one is there.
        reader = channel.queue(Policy::Skip, Start::Next).unwrap();
        writer.write(&time.to_le_bytes(), 0, time).unwrap();
        assert_eq!(pulled(&mut reader), [(time, time, 1)]);
        assert_eq!(channel.readers(), 1);
    };
    (1..=6).for_each(&mut deepen);
    for time in 7..=20 {
        assert_eq!(measure(|| deepen(time)).bytes_current, 0, "{time}");
    }
    // One that is read stays, whatever comes beyond it.
    let mut other = channel.queue(Policy::Skip, Start::Next).unwrap();
    for _ in 0..3 {
        writer.deepen(channel.deeper(64, BUDGET).unwrap());
    }
    writer.write(&21_u64.to_le_bytes(), 0, 21).unwrap();
    assert_eq!(pulled(&mut reader), pulled(&mut other));
}

proptest! {
    /// Whatever is written, skipped, deepened and taken over by another writer: a reader sees what one of a channel that was
    /// deep from the beginning sees.
    #[test]
    fn it_is_as_if_the_channel_had_been_deep_from_the_beginning(steps in prop::collection::vec(0_u8..8, 0..80)) {
        let (plain, deep) = (channel(1), channel(16));
        let mut writers = [Some(plain.writer().unwrap()), Some(deep.writer().unwrap())];
        let mut readers: Option<[QueueReader; 2]> = None;
        let mut depth = 16;
        for (time, step) in steps.into_iter().enumerate() {
            match step {
                0 => {
                    writers.iter_mut().for_each(|writer| drop(writer.take()));
                    writers = [Some(plain.writer().unwrap()), Some(deep.writer().unwrap())];
                }
                1 => writers.iter_mut().flatten().for_each(|writer| writer.skip(2)),
                2 if depth < 64 => {
                    let deeper = plain.deeper(depth, BUDGET).unwrap();
                    writers[0].as_mut().unwrap().deepen(deeper);
                    depth *= 2;
                }
                3 if depth == 32 && readers.is_none() => {
                    let own = |channel: &Arc<Channel>| channel.queue(Policy::Skip, Start::Next).unwrap();
                    readers = Some([own(&plain), own(&deep)]);
                }
                4 => {
                    if let Some([one, other]) = &mut readers {
                        prop_assert_eq!(pulled(one), pulled(other));
                        prop_assert_eq!(one.skipped(), other.skipped());
                    }
                }
                _ => {
                    let bytes = (time as u64).to_le_bytes();
                    for writer in writers.iter_mut().flatten() {
                        writer.write(&bytes, 0, time as u64).unwrap();
                    }
                }
            }
        }
        prop_assert_eq!(plain.published(), deep.published());
        prop_assert_eq!(plain.generation(), deep.generation());
    }
}
