//! A channel that most use with a reader or two, and some with many: what these need comes with them, while the writer writes.
#![cfg(not(any(loom, feature = "shuttle")))]
#![allow(clippy::unwrap_used, reason = "a test that fails panics")]

use std::collections::VecDeque;

use slate_blackboard::Shape;
use slate_blackboard::channel::{Budget, Channel, Latest, Policy, QueueReader, Start, Writer};

const BUDGET: Budget = Budget { latest: 16, queues: 4, window: 16 };

fn write(writer: &mut Writer, number: u64) {
    writer.write(&number.to_le_bytes(), 0, number).unwrap();
}

fn number(bytes: &[u8]) -> u64 {
    u64::from_le_bytes(bytes.try_into().unwrap())
}

fn newest(reader: &Latest) -> u64 {
    number(reader.value().unwrap().bytes())
}

fn window(reader: &QueueReader) -> Vec<u64> {
    reader.window().map(|loan| number(loan.bytes())).collect()
}

#[test]
fn successive_readers_keep_the_value_each_has_seen() {
    for depth in [1, 3, 64] {
        let channel = Channel::new(Shape::fixed(8, 8), depth, BUDGET);
        let mut writer = channel.writer().unwrap();
        let mut readers: Vec<Latest> = Vec::new();
        for count in 1..=u64::from(BUDGET.latest) {
            write(&mut writer, count);
            let mut reader = channel.latest().unwrap();
            assert!(reader.refresh());
            readers.push(reader);
            // More values than there are slots, with all but the last reader behind.
            (0..300).for_each(|_| write(&mut writer, 1000));
            write(&mut writer, count);
            let held: Vec<u64> = readers.iter().map(newest).collect();
            assert_eq!(held, (1..=count).collect::<Vec<_>>(), "depth {depth}");
        }
        assert!(channel.latest().is_err(), "the budget is spent");
    }
}

#[test]
fn queues_beside_many_readers_get_every_value() {
    let channel = Channel::new(Shape::fixed(8, 8), 16, BUDGET);
    let mut writer = channel.writer().unwrap();
    let mut readers: Vec<Latest> = (0..BUDGET.latest).map(|_| channel.latest().unwrap()).collect();
    let queue = |_| channel.queue(Policy::Block, Start::Next).unwrap();
    let mut queues: Vec<QueueReader> = (0..BUDGET.queues).map(queue).collect();
    let mut expected: Vec<VecDeque<u64>> = vec![VecDeque::new(); queues.len()];
    for value in 1..=2000 {
        if writer.write(&u64::to_le_bytes(value), 0, value).is_ok() {
            expected.iter_mut().for_each(|expected| expected.push_back(value));
        }
        let place = (value % 16) as usize;
        readers[place].refresh();
        let place = (value % 5) as usize;
        if let (Some(queue), Some(expected)) = (queues.get_mut(place), expected.get_mut(place)) {
            queue.pull().unwrap();
            let seen = window(queue);
            assert_eq!(seen, expected.drain(..seen.len()).collect::<Vec<_>>());
        }
    }
}

#[test]
fn the_next_writer_knows_the_slots_added_for_many_readers() {
    let channel = Channel::new(Shape::fixed(8, 8), 1, BUDGET);
    let mut writer = channel.writer().unwrap();
    let mut readers: Vec<Latest> = (0..BUDGET.latest).map(|_| channel.latest().unwrap()).collect();
    for (reader, value) in readers.iter_mut().zip(1..) {
        write(&mut writer, value);
        reader.refresh();
    }
    drop(writer);
    let mut writer = channel.writer().unwrap();
    (0..100).for_each(|_| write(&mut writer, 1000));
    let held: Vec<u64> = readers.iter().map(newest).collect();
    assert_eq!(held, (1..=16).collect::<Vec<_>>());
}
