//! In steady state nothing is allocated.
#![cfg(not(any(loom, feature = "shuttle")))]

use allocation_counter::measure;
use slate_blackboard::Shape;
use slate_blackboard::channel::{Budget, Channel, Policy, Start};
use slate_blackboard::commit::{CommitWord, Pin, pin};
use slate_blackboard::message::{Answer, Mailbox};
use slate_blackboard::wake::Wake;

/// How often this thread allocated or freed during `run`.
fn allocations(run: impl FnOnce()) -> i64 {
    let made = measure(run);
    2 * made.count_total as i64 - made.count_current
}

#[test]
fn the_counter_counts() {
    assert_eq!(allocations(|| drop(std::hint::black_box(Box::new(1)))), 2);
}

#[test]
fn writing_and_reading_values_allocates_nothing() {
    let channel = Channel::new(Shape::fixed(4096, 8), 8, Budget { latest: 2, queues: 2, window: 3 });
    let mut readers = [channel.latest().unwrap(), channel.latest().unwrap()];
    let mut skipping = channel.queue(Policy::Skip, Start::Next).unwrap();
    let mut blocking = channel.queue(Policy::Block, Start::Next).unwrap();
    let mut writer = channel.writer().unwrap();
    let word = CommitWord::new();
    let count = allocations(|| {
        for number in 0..1000_u64 {
            word.begin();
            let _ = writer.write(&[number as u8; 4096], 0, number);
            word.end();
            if number % 3 == 0 {
                assert_ne!(pin(&word, &mut readers, 1), Pin::Kept);
                assert!(readers[0].value().is_some());
            }
            readers[1].refresh();
            if number % 5 == 0 {
                skipping.pull().unwrap();
                assert!(skipping.window().all(|loan| loan.bytes().len() == 4096));
            }
            blocking.pull().unwrap();
        }
    });
    assert_eq!(count, 0);
    assert!(skipping.skipped() > 0 && blocking.skipped() == 0);
}

#[test]
fn leaving_a_draft_to_a_late_step_allocates_nothing() {
    let channel = Channel::new(Shape::fixed(4096, 8), 1, Budget { latest: 1, queues: 0, window: 0 });
    let mut writer = channel.writer().unwrap();
    let count = allocations(|| {
        for number in 0..10 {
            let aside = writer.set_aside();
            assert!(aside.is_some() && writer.write(&[1; 4096], 0, number).is_ok());
        }
    });
    assert_eq!(count, 0);
}

#[test]
fn sending_and_collecting_messages_allocates_nothing() {
    let mailbox = Mailbox::new(Shape::fixed(64, 8), 2, 4);
    let mut senders = [mailbox.sender().unwrap(), mailbox.sender().unwrap()];
    let mut receiver = mailbox.receiver().unwrap();
    let count = allocations(|| {
        for number in 0..1000_u64 {
            for sender in &mut senders {
                let ticket = sender.send(&[number as u8; 64], 0, number).unwrap();
                sender.status(ticket);
            }
            if number % 4 == 3 {
                assert_eq!(receiver.collect(), 8);
                assert!(receiver.messages().all(|message| message.bytes().len() == 64));
                receiver.answer(1, Answer::Refused(1));
                receiver.release();
            }
        }
    });
    assert_eq!(count, 0);
}

#[test]
fn waking_allocates_nothing_after_the_first_wait() {
    let wake = Wake::new();
    let limit = std::time::Duration::from_nanos(1);
    wake.wait_timeout(limit);
    let count = allocations(|| {
        for _ in 0..10 {
            assert_eq!(wake.wait_timeout(limit), 0);
            wake.notify(1);
            assert_eq!(wake.wait(), 1);
        }
    });
    assert_eq!(count, 0);
}
