//! Values in memory that is given, and memory that is spent.
#![cfg(not(any(loom, feature = "shuttle")))]
#![allow(clippy::unwrap_used, reason = "a test that fails panics")]
#![allow(unsafe_code, reason = "a draft is written through a pointer")]

use crate::arena;
use crate::sample;

use arena::{Arena, BLOCK};
use sample::SAMPLE;
use slate_blackboard::channel::{Budget, LinkError, Policy, Start};
use slate_blackboard::interface::Value;
use slate_blackboard::{Access, Board, BoardError, Channel, Shape, Store};

const BUDGET: Budget = Budget { latest: 4, queues: 1, window: 2 };

#[test]
fn values_are_in_the_memory_that_is_given() {
    let arena = Arena::new(16);
    let channel = Channel::new_in(Shape::fixed(24, 8), 2, BUDGET, Some(arena.memory()));
    assert_eq!(arena.taken(), 0, "no handle, no memory");
    let mut writer = channel.writer().unwrap();
    let (mut latest, mut queue) =
        (channel.latest().unwrap(), channel.queue(Policy::Skip, Start::Next).unwrap());
    for number in 1..=20 {
        assert!(arena.contains(writer.draft_ptr()));
        writer.write(&[number; 24], 0, number.into()).unwrap();
        assert!(latest.refresh());
        let loan = latest.value().unwrap();
        assert!(arena.contains(loan.as_ptr()) && arena.contains(loan.bytes().as_ptr_range().end));
        assert_eq!((loan.bytes(), loan.stamp().time), (&[number; 24][..], number.into()));
        assert_eq!(queue.pull(), Ok(1));
        assert!(queue.window().all(|loan| arena.contains(loan.as_ptr())));
    }
    let aside = writer.set_aside().unwrap();
    drop((writer, latest, queue, channel));
    assert!(arena.taken() > 0, "a late step still writes");
    drop(aside);
    assert_eq!(arena.taken(), 0);
}

#[test]
fn earlier_values_reach_no_reader() {
    let arena = Arena::new(8);
    for _ in 0..2 {
        let channel = Channel::new_in(Shape::fixed(64, 8), 1, BUDGET, Some(arena.memory()));
        let mut writer = channel.writer().unwrap();
        let mut reader = channel.latest().unwrap();
        writer.publish(0, 0).unwrap();
        assert!(reader.refresh());
        assert_eq!(reader.value().unwrap().bytes(), [0; 64]);
        writer.write(&[7; 64], 0, 0).unwrap();
    }
}

#[test]
fn no_two_values_share_a_cache_line() {
    let arena = Arena::new(8);
    for (size, align) in [(0, 1), (1, 1), (64, 8), (65, 16)] {
        let channel = Channel::new_in(Shape::fixed(size, align), 1, BUDGET, Some(arena.memory()));
        let mut writer = channel.writer().unwrap();
        assert_eq!(writer.draft_ptr() as usize % 64, 0);
        assert!(writer.write(&vec![1; size], 0, 0).is_ok());
    }
}

#[test]
fn memory_that_is_spent_refuses_handles_and_no_more() {
    // One value is kept, one is worked on, one may be set aside, and a reader may pin two.
    let arena = Arena::new(3 + 2 + 1);
    let channel = Channel::new_in(Shape::fixed(100, 4), 1, BUDGET, Some(arena.memory()));
    let mut writer = channel.writer().unwrap();
    let mut reader = channel.latest().unwrap();
    let spent = LinkError::OutOfMemory { bytes: 128 };
    assert_eq!(spent.to_string(), "no memory is left for another value of 128 bytes");
    for _ in 0..2 {
        assert_eq!(channel.latest().err(), Some(spent));
        assert_eq!(channel.queue(Policy::Skip, Start::Next).err(), Some(spent));
    }
    assert_eq!((channel.readers(), arena.taken()), (1, 5), "what is refused takes nothing");
    let _aside = writer.set_aside().unwrap();
    for number in 1..10 {
        writer.write(&[number; 100], 0, 0).unwrap();
        assert!(reader.refresh() && reader.value().unwrap().bytes() == [number; 100]);
    }
    drop(reader);
    assert!(channel.latest().is_ok(), "one for the other is no more");
    // What another channel gives back is there for the next.
    let other = Channel::new_in(Shape::fixed(8, 8), 1, BUDGET, Some(arena.memory()));
    assert_eq!(other.writer().err(), Some(LinkError::OutOfMemory { bytes: 64 }));
    assert!(!other.has_writer() && other.generation() == 0);
    drop((writer, _aside, channel));
    let _reader = other.latest().unwrap();
    assert_eq!(other.writer().unwrap().generation(), 1);
}

#[test]
fn a_value_that_no_memory_can_hold_is_refused() {
    let huge = |capacity| Shape { size: 8, align: 8, item: 8, capacity };
    for capacity in [usize::MAX, usize::MAX / 8, isize::MAX as usize / 8 - 64] {
        let channel = Channel::new(huge(capacity), 1, BUDGET);
        assert!(matches!(channel.writer(), Err(LinkError::OutOfMemory { .. })), "{capacity}");
        assert!(matches!(channel.latest(), Err(LinkError::OutOfMemory { .. })), "{capacity}");
    }
    let arena = Arena::new(8);
    for capacity in [usize::MAX, BLOCK] {
        let channel = Channel::new_in(huge(capacity), 1, BUDGET, Some(arena.memory()));
        assert!(channel.queue(Policy::Skip, Start::Next).is_err(), "{capacity}");
        assert_eq!(arena.taken(), 0);
    }
}

#[test]
fn a_property_may_be_in_memory_that_is_given() {
    let arena = Arena::new(5);
    let board = Board::new("base");
    let store = Store { capacity: 4, depth: 1, budget: BUDGET };
    let add = |path: &str, access| {
        board.add_channel_in(path, "A sample.", &SAMPLE, store, access, Some(arena.memory()))
    };
    let limits = add("drive/limits", Access::Setting).unwrap();
    board.write("drive/limits/point/x", &Value::Float(2.5), 0).unwrap();
    assert_eq!(board.read("drive/limits/point/x").unwrap().unwrap().0, Value::Float(2.5));
    let mut probe = limits.channel().unwrap().latest();
    let error = add("drive/more", Access::Setting).unwrap_err();
    assert!(matches!(&error, BoardError::Link { url, .. } if url == "/drive/more"), "{error}");
    assert!(error.to_string().starts_with("/drive/more: no memory is left"), "{error}");
    assert!(board.find("drive/more").is_err(), "nothing half made is left");
    assert!(probe.is_err());
    // An output has its memory when it is linked.
    let state = add("drive/state", Access::Output).unwrap();
    assert!(state.channel().unwrap().writer().is_err() && state.newest().is_err());
    board.remove("drive/limits").unwrap();
    probe = state.channel().unwrap().latest();
    assert!(probe.is_err(), "who has the removed property has its memory");
    drop(limits);
    assert!(state.channel().unwrap().latest().is_ok());
}

#[test]
fn one_draft_at_a_time_is_set_aside() {
    let channel = Channel::new(Shape::fixed(8, 8), 1, BUDGET);
    let mut reader = channel.latest().unwrap();
    let mut writer = channel.writer().unwrap();
    let late = writer.draft_ptr();
    let aside = writer.set_aside().unwrap();
    assert!(writer.set_aside().is_none());
    drop(writer);
    let mut writer = channel.writer().unwrap();
    assert!(writer.set_aside().is_none(), "the next writer leaves it alone too");
    for number in 1..=20_u64 {
        assert_ne!(writer.draft_ptr(), late);
        // SAFETY: it was set aside, and has room for a number.
        unsafe { late.cast::<u64>().write(u64::MAX) };
        writer.write(&number.to_ne_bytes(), 0, 0).unwrap();
        assert!(reader.refresh());
        assert_eq!(reader.value().unwrap().bytes(), number.to_ne_bytes());
    }
    drop(aside);
    let used = (0..20_u64).any(|number| {
        let same = writer.draft_ptr() == late;
        writer.write(&number.to_ne_bytes(), 0, 0).unwrap();
        reader.refresh();
        same
    });
    assert!(used && writer.set_aside().is_some(), "its slot is in use again");
}
