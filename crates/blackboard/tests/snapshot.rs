//! Values, cursors and messages that continue in another channel as if nothing had happened.
#![cfg(not(loom))]
#![allow(clippy::unwrap_used, reason = "a test that fails panics")]

use std::sync::Arc;

use proptest::prelude::*;
use slate_blackboard::channel::{
    Budget, Channel, ChannelSnapshot, Latest, LinkError, Policy, QueueReader, Start, Writer,
};
use slate_blackboard::message::{Mailbox, Receiver, Status};
use slate_blackboard::{Shape, Stamp};

const BUDGET: Budget = Budget { latest: 2, queues: 2, window: 3 };

fn channel(depth: usize) -> Arc<Channel> {
    Channel::new(Shape { size: 8, align: 8, item: 4, capacity: 4 }, depth, BUDGET)
}

fn write(writer: &mut Writer, number: u64) -> Stamp {
    let items = (number % 5) as usize;
    let bytes: Vec<u8> =
        number.to_le_bytes().into_iter().chain([number as u8; 16]).take(8 + 4 * items).collect();
    writer.write(&bytes, items, number * 10).unwrap()
}

/// What a reader of the newest value sees.
fn seen(reader: &mut Latest) -> Option<(Vec<u8>, usize, Stamp)> {
    reader.refresh();
    reader.value().map(|loan| (loan.bytes().to_vec(), loan.items(), loan.stamp()))
}

/// What a reader of every value gets next, and how many it has lost.
fn pulled(reader: &mut QueueReader) -> (Vec<(Vec<u8>, Stamp)>, u64) {
    reader.pull().unwrap();
    (reader.window().map(|loan| (loan.bytes().to_vec(), loan.stamp())).collect(), reader.skipped())
}

/// The same after it was written to a file and read again.
fn stored(saved: &ChannelSnapshot) -> ChannelSnapshot {
    serde_json::from_str(&serde_json::to_string(saved).unwrap()).unwrap()
}

proptest! {
    /// Two channels, of which one was saved and restored at any moment into used handles, are equal.
    #[test]
    fn restored_channel_continues_like_its_original(
        depth in 1usize..6,
        before in 0u64..12,
        pulls in proptest::collection::vec(any::<bool>(), 0..12),
        other in 0u64..20,
        after in 0u64..12,
    ) {
        let original = channel(depth);
        let mut writer = original.writer().unwrap();
        let mut latest = original.latest().unwrap();
        let mut queue = original.queue(Policy::Skip, Start::Oldest).unwrap();
        for number in 1..=before {
            write(&mut writer, number);
            if pulls.get(number as usize).is_some_and(|pull| *pull) {
                queue.pull().unwrap();
                latest.refresh();
            }
        }
        let saved = stored(&original.snapshot().unwrap());
        prop_assert_eq!(saved.published(), before);

        let copy = channel(depth);
        let mut its_writer = copy.writer().unwrap();
        let mut its_latest = copy.latest().unwrap();
        let mut its_queue = copy.queue(Policy::Skip, Start::Oldest).unwrap();
        for number in 1..=other {
            write(&mut its_writer, number + 100);
            its_latest.refresh();
            its_queue.pull().unwrap();
        }
        its_writer.restore(&saved).unwrap();
        its_latest.resume(latest.cursor());
        its_queue.resume(queue.cursor());

        prop_assert_eq!(copy.snapshot().unwrap(), saved);
        prop_assert_eq!(its_latest.has_news(), latest.has_news());
        prop_assert_eq!(its_queue.lag(), queue.lag());
        for number in 1..=after {
            prop_assert_eq!(seen(&mut its_latest), seen(&mut latest));
            prop_assert_eq!(pulled(&mut its_queue), pulled(&mut queue));
            prop_assert_eq!(write(&mut its_writer, number), write(&mut writer, number));
        }
        prop_assert_eq!(seen(&mut its_latest), seen(&mut latest));
        prop_assert_eq!(pulled(&mut its_queue), pulled(&mut queue));
    }
}

#[test]
fn a_shorter_queue_keeps_what_fits_and_a_longer_one_tells_loss() {
    let original = channel(4);
    let mut writer = original.writer().unwrap();
    for number in 1..=9 {
        write(&mut writer, number);
    }
    let saved = original.snapshot().unwrap();
    for (depth, first, lost) in [(2, 8, 7), (4, 6, 5), (6, 6, 5)] {
        let copy = channel(depth);
        copy.restore(&saved).unwrap().unwrap();
        let mut queue = copy.queue(Policy::Skip, Start::Next).unwrap();
        queue.resume(slate_blackboard::channel::Cursor { next: 1, skipped: 0, evicted: false });
        let (values, skipped) = pulled(&mut queue);
        assert_eq!((values[0].1.sequence, skipped), (first, lost), "depth {depth}");
    }
}

#[test]
fn the_next_writer_has_the_next_generation() {
    let original = channel(1);
    drop(original.writer().unwrap());
    write(&mut original.writer().unwrap(), 1);
    let saved = original.snapshot().unwrap();
    let copy = channel(1);
    copy.restore(&saved).unwrap().unwrap();
    assert!(!copy.has_writer());
    assert_eq!(write(&mut copy.writer().unwrap(), 2), Stamp { sequence: 2, time: 20, generation: 3 });
}

#[test]
fn mismatch_changes_nothing() {
    let original = channel(2);
    let mut writer = original.writer().unwrap();
    write(&mut writer, 1);
    let good = original.snapshot().unwrap();
    let bad = |change: fn(&mut ChannelSnapshot)| {
        let mut saved = good.clone();
        change(&mut saved);
        saved
    };
    for saved in [
        bad(|saved| saved.values[0].bytes.truncate(7)),
        bad(|saved| saved.values[0].items = 5),
        bad(|saved| saved.values[0].stamp.sequence = 0),
        bad(|saved| saved.values.push(saved.values[0].clone())),
    ] {
        assert!(writer.restore(&saved).is_err(), "{saved:?}");
        assert_eq!(original.snapshot().unwrap(), good);
    }
    assert!(matches!(original.restore(&good), Err(LinkError::WriterTaken { .. })));
}

#[test]
fn messages_that_wait_are_copied_and_stay() {
    let mailbox = Mailbox::new(Shape::fixed(8, 8), 2, 2);
    let (mut first, mut second) = (mailbox.sender().unwrap(), mailbox.sender().unwrap());
    let mut receiver = mailbox.receiver().unwrap();
    first.send(&[1; 8], 0, 1).unwrap();
    assert_eq!(receiver.collect(), 1);
    receiver.release();
    second.send(&[2; 8], 0, 2).unwrap();
    let last = first.send(&[3; 8], 0, 3).unwrap();
    let waiting = receiver.waiting();
    let told: Vec<_> =
        waiting.iter().map(|message| (message.sender, message.bytes[0], message.time)).collect();
    assert_eq!(told, [(1, 2, 2), (0, 3, 3)]);
    assert_eq!(first.status(last), Status::Accepted);
    let got = |receiver: &mut Receiver| -> Vec<_> {
        receiver.collect();
        receiver
            .messages()
            .map(|message| (message.sender(), message.bytes()[0], message.sequence()))
            .collect()
    };
    // Another mailbox continues from there.
    let copy = Mailbox::new(Shape::fixed(8, 8), 2, 2);
    let mut senders = [copy.sender().unwrap(), copy.sender().unwrap()];
    let abandoned = senders[0].send(&[9; 8], 0, 9).unwrap();
    let mut its_receiver = copy.receiver().unwrap();
    its_receiver.resume(receiver.sequence());
    assert!(matches!(senders[0].status(abandoned), Status::Refused(_)));
    for message in waiting {
        senders[message.sender as usize].send(&message.bytes, message.items, message.time).unwrap();
    }
    assert_eq!(got(&mut its_receiver), got(&mut receiver));
}
