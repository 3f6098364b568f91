//! Values that are published where they are.
#![cfg(not(any(loom, feature = "shuttle")))]
#![allow(clippy::unwrap_used, reason = "a test that fails panics")]

use crate::arena;
use crate::lender;

use std::collections::BTreeSet;
use std::sync::Arc;
use std::thread;

use arena::Arena;
use lender::Lender;
use slate_blackboard::channel::{AdoptError, Blocked, Budget, Channel, Policy, Start, Writer};
use slate_blackboard::{Shape, Stamp};

const SHAPE: Shape = Shape { size: 8, align: 8, item: 1, capacity: 24 };
const BUDGET: Budget = Budget { latest: 4, queues: 2, window: 4 };

fn channel(depth: usize) -> (Arc<Channel>, Writer, Lender) {
    let channel = Channel::new(SHAPE, depth, BUDGET);
    let writer = channel.writer().unwrap();
    (channel, writer, Lender::default())
}

fn adopt(writer: &mut Writer, lender: &Lender, number: u64) -> Result<Stamp, AdoptError> {
    writer.adopt(lender.lend(number, &[number as u8; 16]), 8, number)
}

fn numbers<const N: usize>(numbers: [u64; N]) -> BTreeSet<u64> {
    numbers.into()
}

#[test]
fn readers_see_the_bytes_where_they_are_until_they_let_them_go() {
    let (channel, mut writer, lender) = channel(1);
    let (mut latest, mut queue) =
        (channel.latest().unwrap(), channel.queue(Policy::Skip, Start::Next).unwrap());
    let stamp = adopt(&mut writer, &lender, 1).unwrap();
    assert_eq!(stamp, Stamp { sequence: 1, time: 1, generation: 1 });
    assert!(latest.refresh() && queue.pull() == Ok(1));
    let check = |bytes: &[u8], number: u64| {
        assert_eq!(bytes, [number as u8; 16]);
        assert!(lender.contains(bytes.as_ptr()));
    };
    for number in 2..=9 {
        adopt(&mut writer, &lender, number).unwrap();
        assert_eq!(lender.lent(), numbers([1, number]), "one is pinned, and one is the newest");
        check(latest.value().unwrap().bytes(), 1);
        check(queue.window().next().unwrap().bytes(), 1);
    }
    latest.refresh();
    let loan = latest.value().unwrap();
    check(loan.bytes(), 9);
    assert_eq!((loan.items(), loan.stamp().sequence), (8, 9));
    queue.release();
    writer.write(&[0; 8], 0, 0).unwrap();
    writer.give_back();
    assert_eq!(lender.lent(), numbers([9]));
    latest.refresh();
    writer.give_back();
    assert!(lender.lent().is_empty(), "who only writes can give back too");
}

#[test]
fn a_draft_is_in_memory_of_its_own() {
    let (channel, mut writer, lender) = channel(2);
    let mut reader = channel.latest().unwrap();
    for number in 1..=100_u64 {
        if number % 3 == 0 {
            let draft = writer.draft_ptr();
            assert!(!lender.contains(draft));
            assert_eq!(draft as usize % 64, 0);
            writer.write(&[number as u8; 16], 8, number).unwrap();
        } else {
            // Whether a draft was begun or not.
            if number % 2 == 0 {
                writer.draft();
            }
            adopt(&mut writer, &lender, number).unwrap();
        }
        assert!(reader.refresh());
        assert_eq!(reader.value().unwrap().bytes(), [number as u8; 16]);
    }
}

#[test]
fn mismatched_loan_is_returned_and_draft_stays() {
    let (channel, mut writer, lender) = channel(1);
    let mut reader = channel.queue(Policy::Block, Start::Next).unwrap();
    let few = writer.adopt(lender.lend(1, &[0; 15]), 8, 0);
    assert_eq!(few, Err(AdoptError::TooShort { length: 15, needed: 16 }));
    // Rounded up to the alignment.
    let few = writer.adopt(lender.lend(1, &[0; 9]), 1, 0);
    assert_eq!(few, Err(AdoptError::TooShort { length: 9, needed: 16 }));
    let askew = writer.adopt(lender.lend_at(1, &[0; 16], 4), 8, 0);
    assert_eq!(askew, Err(AdoptError::Misaligned { align: 8 }));
    assert!(lender.lent().is_empty() && channel.published() == 0);
    // As much as fits, whatever is said and however many there are.
    writer.adopt(lender.lend(1, &[1; 64]), usize::MAX, 0).unwrap();
    let draft = writer.draft_ptr();
    assert_eq!(adopt(&mut writer, &lender, 2), Err(AdoptError::Blocked(Blocked)));
    assert_eq!((lender.lent(), writer.draft_ptr()), (numbers([1]), draft));
    assert_eq!(reader.pull(), Ok(1));
    let loan = reader.window().next().unwrap();
    assert_eq!((loan.bytes(), loan.items()), (&[1; 32][..], 24));
    writer.write(&[3; 16], 8, 0).unwrap();
    assert_eq!(reader.pull(), Ok(1));
    assert_eq!(reader.window().next().unwrap().bytes(), [3; 16]);
}

#[test]
fn a_channel_in_memory_that_is_given_adopts_nothing() {
    let (arena, lender) = (Arena::new(8), Lender::default());
    let channel = Channel::new_in(SHAPE, 1, BUDGET, Some(arena.memory()));
    let mut writer = channel.writer().unwrap();
    assert_eq!(adopt(&mut writer, &lender, 1), Err(AdoptError::Given));
    assert!(lender.lent().is_empty() && channel.published() == 0);
}

#[test]
fn a_channel_of_large_values_in_a_row_keeps_its_depth() {
    let (channel, mut writer, lender) = channel(4);
    let mut reader = channel.queue(Policy::Skip, Start::Oldest).unwrap();
    for number in 1..=10 {
        adopt(&mut writer, &lender, number).unwrap();
    }
    assert_eq!(lender.lent(), numbers([7, 8, 9, 10]));
    assert_eq!((reader.pull(), reader.skipped()), (Ok(4), 6));
    for number in 11..=20 {
        adopt(&mut writer, &lender, number).unwrap();
    }
    assert_eq!(lender.lent().len(), 8);
    assert!(reader.window().map(|loan| loan.bytes()[0]).eq(7..=10));
    writer.skip(2);
    adopt(&mut writer, &lender, 23).unwrap();
    assert_eq!(reader.pull(), Ok(2));
    assert!(
        reader.window().map(|loan| loan.bytes()[0]).eq([20, 23]),
        "a cell that was skipped keeps what it has"
    );
}

#[test]
fn the_next_writer_and_the_end_of_the_channel_give_back() {
    let (channel, mut writer, lender) = channel(1);
    let mut readers = [(); 2].map(|()| channel.latest().unwrap());
    adopt(&mut writer, &lender, 1).unwrap();
    readers[0].refresh();
    adopt(&mut writer, &lender, 2).unwrap();
    drop(writer);
    assert_eq!(lender.lent(), numbers([1, 2]));
    assert_eq!(readers[0].value().unwrap().bytes(), [1; 16], "a reader outlives the writer");
    readers[0].refresh();
    drop(channel.writer().unwrap());
    assert_eq!(lender.lent(), numbers([2]), "the next writer gives back");
    readers[1].refresh();
    drop(channel);
    assert_eq!(readers.each_ref().map(|reader| reader.value().unwrap().bytes()[0]), [2, 2]);
    drop(readers);
    assert!(lender.lent().is_empty());
}

#[test]
fn freezing_copies_the_adopted_value() {
    let (channel, mut writer, lender) = channel(2);
    for number in 1..=3 {
        adopt(&mut writer, &lender, number).unwrap();
    }
    let saved = channel.snapshot().unwrap();
    for number in 4..=9 {
        adopt(&mut writer, &lender, number).unwrap();
    }
    let values: Vec<_> = saved.values.iter().map(|value| (value.stamp.sequence, &value.bytes[..])).collect();
    assert_eq!(values, [(2, &[2; 16][..]), (3, &[3; 16])]);
    writer.restore(&saved).unwrap();
    writer.give_back();
    assert!(lender.lent().is_empty());
    let mut reader = channel.queue(Policy::Skip, Start::Oldest).unwrap();
    assert_eq!(reader.pull(), Ok(2));
    assert!(reader.window().map(|loan| loan.bytes()[0]).eq([2, 3]));
}

#[test]
fn a_writer_without_a_free_slot_gives_back_first() {
    let (channel, mut writer, lender) = channel(1);
    let mut readers = [(); 4].map(|()| channel.latest().unwrap());
    let mut number = 0;
    for _ in 0..20 {
        for reader in &mut readers {
            let mut adopt = || {
                number += 1;
                adopt(&mut writer, &lender, number).unwrap();
            };
            adopt();
            assert!(reader.refresh());
            adopt();
            assert!(reader.propose());
        }
        assert_eq!(lender.lent().len(), 8, "all that they can pin is lent");
        for byte in 0..40 {
            assert!(!lender.contains(writer.draft_ptr()));
            writer.write(&[byte; 16], 8, 0).unwrap();
            let reader = &mut readers[usize::from(byte) % 4];
            assert!(reader.refresh() && reader.value().unwrap().bytes() == [byte; 16]);
        }
        writer.give_back();
        assert!(lender.lent().is_empty());
    }
}

#[test]
fn a_draft_that_is_set_aside_has_no_lent_bytes() {
    let (channel, mut writer, lender) = channel(1);
    let mut reader = channel.latest().unwrap();
    adopt(&mut writer, &lender, 1).unwrap();
    adopt(&mut writer, &lender, 2).unwrap();
    let late = writer.draft_ptr();
    let aside = writer.set_aside().unwrap();
    for number in 3..=20 {
        adopt(&mut writer, &lender, number).unwrap();
        assert!(reader.refresh() && reader.value().unwrap().as_ptr() != late.cast_const());
    }
    assert!(!lender.contains(late));
    drop(aside);
}

#[test]
fn threads_see_whole_values_whether_they_are_copied_or_adopted() {
    const VALUES: u64 = 20_000;
    let (channel, mut writer, lender) = channel(3);
    let check = |bytes: &[u8]| {
        let number = bytes[0];
        assert!(bytes.iter().all(|byte| *byte == number), "{bytes:?}");
    };
    thread::scope(|scope| {
        for _ in 0..2 {
            let mut reader = channel.latest().unwrap();
            scope.spawn(move || {
                while reader.value().is_none_or(|loan| loan.stamp().sequence < VALUES) {
                    reader.refresh();
                    reader.value().iter().for_each(|loan| check(loan.bytes()));
                }
            });
        }
        let mut queue = channel.queue(Policy::Skip, Start::Next).unwrap();
        scope.spawn(move || {
            while queue.cursor().next <= VALUES {
                queue.pull().unwrap();
                queue.window().for_each(|loan| check(loan.bytes()));
            }
        });
        for number in 1..=VALUES {
            let byte = (number % 100) as u8;
            if number % 5 == 0 {
                writer.write(&[byte; 16], 8, 0).unwrap();
            } else {
                writer.adopt(lender.lend(number, &[byte; 16]), 8, 0).unwrap();
            }
        }
    });
    drop((writer, channel));
    assert!(lender.lent().is_empty());
}
