//! Random schedules of protocols that are too long for all schedules: unloading, relinking, late steps, waking.
//!
//! `cargo test -p slate-blackboard --release --features shuttle --test shuttle`
#![cfg(all(feature = "shuttle", not(loom)))]
#![allow(clippy::unwrap_used, reason = "all of it is a test")]
#![allow(unsafe_code, reason = "a late step writes through a pointer")]

use shuttle::{check_random, thread};
use slate_blackboard::channel::{Budget, Channel, Latest, Policy, Start, Writer};
use slate_blackboard::interface::Interface;
use slate_blackboard::wake::Wake;
use slate_blackboard::{Access, Board, Event, Pattern, Shape, Store};
use std::sync::Arc;
use std::time::Duration;

const SCHEDULES: usize = 2000;
const SHAPE: Shape = Shape::fixed(8, 8);

fn write(writer: &mut Writer, number: u64) {
    writer.write(&number.to_ne_bytes(), 0, number).unwrap();
}

/// Reads the newest value twice, and others may run in between.
fn read(reader: &mut Latest) -> Option<(u64, u64)> {
    reader.refresh();
    let loan = reader.value()?;
    let before = loan.bytes().to_vec();
    for _ in 0..3 {
        thread::yield_now();
    }
    assert_eq!(loan.bytes(), before, "a value changed while it was lent");
    assert_eq!(loan.stamp().time.to_ne_bytes(), *before);
    Some((loan.stamp().sequence, loan.stamp().generation))
}

fn next_writer(channel: &Arc<Channel>) -> Writer {
    loop {
        match channel.writer() {
            Ok(writer) => return writer,
            Err(_) => thread::yield_now(),
        }
    }
}

#[test]
fn a_reader_outlives_writers_and_tells_their_generations() {
    check_random(
        || {
            let channel = Channel::new(SHAPE, 1, Budget { latest: 2, queues: 0, window: 0 });
            let writers = [(); 2].map(|()| {
                let channel = channel.clone();
                thread::spawn(move || {
                    let mut writer = next_writer(&channel);
                    for _ in 0..3 {
                        let number = channel.generation() * 10 + channel.published() % 3;
                        write(&mut writer, number);
                    }
                    writer.last()
                })
            });
            let readers = [(); 2].map(|()| {
                let mut reader = channel.latest().unwrap();
                thread::spawn(move || {
                    let mut last = None;
                    for _ in 0..4 {
                        let now = read(&mut reader);
                        assert!(now >= last);
                        last = now;
                    }
                    reader
                })
            });
            let last =
                writers.map(|writer| writer.join().unwrap()).into_iter().max_by_key(|last| last.sequence);
            assert!(!channel.has_writer());
            for reader in readers {
                let mut reader = reader.join().unwrap();
                assert_eq!(read(&mut reader), Some((6, 2)));
                assert_eq!(reader.value().map(|loan| loan.stamp()), last);
            }
        },
        SCHEDULES,
    );
}

#[test]
fn readers_come_and_go_while_a_writer_writes() {
    check_random(
        || {
            let channel = Channel::new(SHAPE, 2, Budget { latest: 1, queues: 1, window: 2 });
            let mut writer = channel.writer().unwrap();
            let latest = {
                let channel = channel.clone();
                thread::spawn(move || {
                    for _ in 0..3 {
                        read(&mut channel.latest().unwrap());
                        assert_eq!(
                            channel.latest().map(drop),
                            Ok(()),
                            "a dropped reader gives its handle back"
                        );
                    }
                })
            };
            let queue = {
                let channel = channel.clone();
                thread::spawn(move || {
                    for _ in 0..3 {
                        let mut reader = channel.queue(Policy::Skip, Start::Oldest).unwrap();
                        reader.pull().unwrap();
                        let before: Vec<_> = reader.window().map(|loan| loan.bytes().to_vec()).collect();
                        thread::yield_now();
                        assert!(reader.window().map(|loan| loan.bytes().to_vec()).eq(before));
                    }
                })
            };
            for number in 1..=8 {
                write(&mut writer, number);
            }
            latest.join().unwrap();
            queue.join().unwrap();
        },
        SCHEDULES,
    );
}

#[test]
fn outputs_of_late_step_reach_no_reader() {
    check_random(
        || {
            let channel = Channel::new(SHAPE, 1, Budget { latest: 1, queues: 0, window: 0 });
            let mut writer = channel.writer().unwrap();
            let mut reader = channel.latest().unwrap();
            let late = {
                let draft = writer.draft_ptr() as usize;
                let aside = writer.set_aside().unwrap();
                thread::spawn(move || {
                    for _ in 0..4 {
                        // SAFETY: the draft was set aside, and has room for a number.
                        unsafe { (draft as *mut u64).write(u64::MAX) };
                        thread::yield_now();
                    }
                    drop(aside);
                })
            };
            let reader = thread::spawn(move || {
                for _ in 0..4 {
                    read(&mut reader);
                }
            });
            for number in 1..=4 {
                write(&mut writer, number);
            }
            // The late step may outlive the writer, and the channel.
            drop(writer);
            let mut writer = channel.writer().unwrap();
            write(&mut writer, 5);
            drop((writer, channel));
            reader.join().unwrap();
            late.join().unwrap();
        },
        SCHEDULES,
    );
}

#[test]
fn a_writer_that_was_blocked_goes_on_when_the_reader_is_gone() {
    check_random(
        || {
            let channel = Channel::new(SHAPE, 1, Budget { latest: 0, queues: 1, window: 1 });
            let mut writer = channel.writer().unwrap();
            let mut reader = channel.queue(Policy::Block, Start::Next).unwrap();
            let reader = thread::spawn(move || {
                let seen = reader.pull().unwrap() as u64;
                assert_eq!(reader.skipped(), 0);
                seen
            });
            let mut blocked = 0;
            for number in 1..=3_u64 {
                while writer.write(&number.to_ne_bytes(), 0, number).is_err() {
                    blocked += 1;
                    thread::yield_now();
                }
            }
            assert_eq!(channel.published(), 3);
            assert!(reader.join().unwrap() <= 1 || blocked > 0);
        },
        SCHEDULES,
    );
}

#[test]
fn no_notification_is_lost_when_the_waiting_thread_changes() {
    check_random(
        || {
            let wake = Arc::new(Wake::new());
            let notifiers = [1, 2, 4].map(|bit| {
                let wake = wake.clone();
                thread::spawn(move || wake.notify(bit))
            });
            let first = {
                let wake = wake.clone();
                thread::spawn(move || wake.wait_timeout(Duration::from_millis(1)))
            };
            let mut bits = first.join().unwrap();
            let second = thread::spawn(move || {
                while bits != 7 {
                    bits |= wake.wait();
                }
            });
            second.join().unwrap();
            notifiers.into_iter().for_each(|notifier| notifier.join().unwrap());
        },
        SCHEDULES,
    );
}

#[test]
fn events_tell_what_comes_and_goes_while_all_comes_and_goes() {
    check_random(
        || {
            let board = Arc::new(Board::new("base"));
            let wake = Arc::new(Wake::new());
            let pattern = Pattern::parse("*").unwrap();
            let mut all = board.observe(&pattern, 100, Some(wake.clone()));
            let mut few = board.observe(&pattern, 2, None);
            let store = Store { capacity: 0, depth: 1, budget: Budget { latest: 1, queues: 1, window: 1 } };
            let adding = {
                let board = board.clone();
                thread::spawn(move || {
                    for _ in 0..3 {
                        board.add_channel("a", "", <()>::DESCRIPTOR, store, Access::Output).unwrap();
                        thread::yield_now();
                        board.remove("a").unwrap();
                    }
                })
            };
            let linking = [false, true].map(|writes| {
                let board = board.clone();
                thread::spawn(move || {
                    for _ in 0..4 {
                        let Ok((property, _)) = board.find("a") else { continue };
                        let channel = property.channel().unwrap();
                        if writes {
                            drop(channel.writer().unwrap());
                        } else {
                            drop(channel.latest().unwrap());
                        }
                    }
                })
            });
            let observing = thread::spawn(move || {
                let (mut present, mut vanished, mut readers, mut writer, mut told) = (false, 0, 0, None, 0);
                while vanished < 3 {
                    assert_eq!(wake.wait(), 1);
                    for event in &mut all {
                        told += 1;
                        assert_eq!(present, !matches!(event, Event::Appeared(_)), "{event:?}");
                        match event {
                            Event::Appeared(_) => (present, readers, writer) = (true, 0, None),
                            Event::Vanished(_) => (present, vanished) = (false, vanished + 1),
                            Event::WriterCame(_, generation) => writer = Some(generation),
                            Event::WriterLeft(_, generation) => assert_eq!(writer.take(), Some(generation)),
                            Event::ReaderCame(_) => readers += 1,
                            Event::ReaderLeft(_) => readers -= 1,
                        }
                        assert!((0..=1).contains(&readers));
                    }
                }
                assert_eq!(all.missed(), 0);
                told
            });
            adding.join().unwrap();
            linking.into_iter().for_each(|thread| thread.join().unwrap());
            let told = observing.join().unwrap();
            assert_eq!(few.by_ref().count() as u64 + few.missed(), told);
        },
        SCHEDULES,
    );
}
