//! Every interleaving, and every value that weak orderings allow a load to see, of small uses of the crate.
//!
//! `RUSTFLAGS="--cfg loom" cargo test -p slate-blackboard --release --test loom --target-dir target/loom`
#![cfg(loom)]
#![allow(clippy::unwrap_used, reason = "all of it is a test")]
#![allow(unsafe_code, reason = "memory that is lent")]

use loom::sync::atomic::{AtomicU64, Ordering::Relaxed};
use loom::thread;
use slate_blackboard::channel::{Budget, Channel, Latest, LentBytes, Loan, Policy, Start, Writer};
use slate_blackboard::commit::{CommitWord, Pin, pin};
use slate_blackboard::interface::Interface;
use slate_blackboard::message::{Answer, Mailbox, Sender, Status};
use slate_blackboard::wake::Wake;
use slate_blackboard::{Access, Board, Event, Observer, Pattern, Shape, Store};
use std::ptr::NonNull;
use std::sync::Arc;

const SHAPE: Shape = Shape::fixed(16, 8);

fn check(preemptions: usize, model: impl Fn() + Send + Sync + 'static) {
    let mut builder = loom::model::Builder::new();
    builder.preemption_bound = Some(preemptions);
    builder.check(model);
}

fn write(writer: &mut Writer, number: u64) -> bool {
    let mut value = [0; 16];
    value[..8].copy_from_slice(&number.to_ne_bytes());
    value[8..].copy_from_slice(&number.to_ne_bytes());
    writer.write(&value, 0, number).is_ok()
}

/// The number that was written, the same in both halves and as the stamp's time.
fn number(loan: &Loan) -> u64 {
    let half = |bytes: &[u8]| u64::from_ne_bytes(bytes.try_into().unwrap());
    let (first, second) = loan.bytes().split_at(8);
    assert_eq!(half(first), half(second));
    assert_eq!(half(first), loan.stamp().time);
    half(first)
}

fn read(reader: &mut Latest) -> u64 {
    reader.refresh();
    reader.value().as_ref().map_or(0, number)
}

fn register(readers: u16, values: u64, preemptions: usize) {
    check(preemptions, move || {
        let channel = Channel::new(SHAPE, 1, Budget { latest: readers, queues: 0, window: 0 });
        let mut writer = channel.writer().unwrap();
        let threads: Vec<_> = (0..readers)
            .map(|_| {
                let mut reader = channel.latest().unwrap();
                thread::spawn(move || {
                    let first = read(&mut reader);
                    let second = read(&mut reader);
                    assert!(first <= second, "{second} after {first}");
                    reader
                })
            })
            .collect();
        for value in 1..=values {
            assert!(write(&mut writer, value));
        }
        for thread in threads {
            let mut reader = thread.join().unwrap();
            assert_eq!(read(&mut reader), values);
        }
    });
}

#[test]
fn a_reader_sees_whole_values_in_order_and_in_the_end_the_last() {
    register(1, 3, 3);
}

#[test]
fn two_readers_see_whole_values_in_order_and_the_last_one() {
    register(2, 3, 2);
}

/// A reader and a writer that take turns, while another reader does not. In the end a turn is given up: the late one still
/// looks at its value while the writer continues.
#[test]
fn held_value_is_unchanged_after_late_turn() {
    check(3, || {
        let channel = Channel::new(SHAPE, 1, Budget { latest: 2, queues: 0, window: 0 });
        let mut writer = channel.writer().unwrap();
        let mut reader = Box::new(channel.latest().unwrap());
        let mut other = channel.latest().unwrap();
        // SAFETY: until the last turn all is done in this thread.
        unsafe { writer.set_in_turn(true) };
        let other = thread::spawn(move || {
            let first = read(&mut other);
            assert!(first <= read(&mut other));
        });
        for value in 1..=2 {
            assert!(write(&mut writer, value));
            // SAFETY: as above.
            assert!(unsafe { reader.refresh_in_turn() });
            assert_eq!(reader.value().as_ref().map(number), Some(value));
        }
        let place = Address(&raw mut *reader);
        // SAFETY: the reader is not moved; its loan is not changed by the holder.
        let late = unsafe { (*place.0).value() }.unwrap();
        let watchdog = thread::spawn(move || {
            let place = place;
            // SAFETY: the other thread has what it looks at, and looks at nothing else of the reader.
            unsafe { (*place.0).hold() };
            (3..=5).for_each(|value| assert!(write(&mut writer, value)));
            writer
        });
        assert_eq!(number(&late), 2);
        drop(late);
        let mut writer = watchdog.join().unwrap();
        // SAFETY: the turn is over, and the other thread has ended.
        assert!(unsafe { reader.refresh_in_turn() });
        assert_eq!(reader.value().as_ref().map(number), Some(5));
        assert!(write(&mut writer, 6));
        other.join().unwrap();
    });
}

/// Where a reader is, for the thread that gives its turn up.
struct Address(*mut Latest);

// SAFETY: the test orders the uses.
unsafe impl Send for Address {}

/// Memory that is lent, one place for each number; loom checks that returned memory is not read.
struct Places(Vec<(loom::cell::UnsafeCell<()>, [u64; 2])>);

// SAFETY: the cells are only watched, and the numbers do not change.
unsafe impl Send for Places {}
// SAFETY: as above.
unsafe impl Sync for Places {}

impl Places {
    fn new(count: u64) -> Arc<Self> {
        Arc::new(Self((0..=count).map(|number| (loom::cell::UnsafeCell::new(()), [number; 2])).collect()))
    }

    fn adopt(self: &Arc<Self>, writer: &mut Writer, value: u64) {
        writer.adopt(Box::new(Lent { places: self.clone(), number: value as usize }), 0, value).unwrap();
    }

    /// The number of a value, which is read while it is pinned.
    fn number(&self, loan: &Loan) -> u64 {
        let number = number(loan);
        let (place, value) = &self.0[number as usize];
        if loan.as_ptr() == value.as_ptr().cast() {
            place.with(|_| ());
        }
        number
    }
}

struct Lent {
    places: Arc<Places>,
    number: usize,
}

impl std::fmt::Debug for Lent {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        self.number.fmt(f)
    }
}

// SAFETY: the numbers stay where they are, and as they are, while the places live.
unsafe impl LentBytes for Lent {
    fn bytes(&self) -> NonNull<[u8]> {
        NonNull::slice_from_raw_parts(NonNull::from(&self.places.0[self.number].1).cast(), 16)
    }
}

impl Drop for Lent {
    fn drop(&mut self) {
        self.places.0[self.number].0.with_mut(|_| ());
    }
}

#[test]
fn loan_is_returned_without_readers() {
    check(3, || {
        let channel = Channel::new(SHAPE, 1, Budget { latest: 1, queues: 0, window: 0 });
        let mut writer = channel.writer().unwrap();
        let mut reader = channel.latest().unwrap();
        let places = Places::new(4);
        let thread = {
            let places = places.clone();
            thread::spawn(move || {
                let mut last = 0;
                for _ in 0..2 {
                    reader.refresh();
                    let number = reader.value().as_ref().map_or(0, |loan| places.number(loan));
                    assert!(last <= number, "{number} after {last}");
                    last = number;
                }
                reader
            })
        };
        places.adopt(&mut writer, 1);
        places.adopt(&mut writer, 2);
        assert!(write(&mut writer, 3));
        places.adopt(&mut writer, 4);
        let mut reader = thread.join().unwrap();
        reader.refresh();
        assert_eq!(places.number(&reader.value().unwrap()), 4);
    });
}

#[test]
fn queue_loan_is_returned_without_readers() {
    check(2, || {
        let channel = Channel::new(SHAPE, 2, Budget { latest: 0, queues: 1, window: 2 });
        let mut writer = channel.writer().unwrap();
        let mut reader = channel.queue(Policy::Skip, Start::Oldest).unwrap();
        let places = Places::new(4);
        let thread = {
            let places = places.clone();
            thread::spawn(move || {
                let mut last = 0;
                for _ in 0..2 {
                    reader.pull().unwrap();
                    for loan in reader.window() {
                        assert!(places.number(&loan) > last);
                        last = places.number(&loan);
                    }
                }
                reader
            })
        };
        for value in 1..=4 {
            places.adopt(&mut writer, value);
        }
        drop(thread.join().unwrap());
    });
}

#[test]
fn lost_count_may_be_read_during_writes() {
    check(3, || {
        let channel = Channel::new(SHAPE, 2, Budget { latest: 0, queues: 1, window: 2 });
        let mut writer = channel.writer().unwrap();
        let reader = channel.queue(Policy::Skip, Start::Oldest).unwrap();
        let thread = thread::spawn(move || {
            let lost = reader.lost();
            assert!(lost <= 1, "two of three values are kept");
            reader
        });
        for value in 1..=3 {
            assert!(write(&mut writer, value));
        }
        assert_eq!(thread.join().unwrap().lost(), 1);
    });
}

#[test]
fn an_overtaken_reader_of_a_queue_counts_what_it_lost() {
    check(3, || {
        let channel = Channel::new(SHAPE, 2, Budget { latest: 0, queues: 1, window: 2 });
        let mut writer = channel.writer().unwrap();
        let mut reader = channel.queue(Policy::Skip, Start::Oldest).unwrap();
        let thread = thread::spawn(move || {
            let mut seen = 0;
            let mut last = 0;
            for _ in 0..2 {
                reader.pull().unwrap();
                for loan in reader.window() {
                    assert!(number(&loan) > last);
                    last = number(&loan);
                    seen += 1;
                }
                assert!(seen + reader.skipped() >= last, "nothing is lost without being counted");
            }
            (reader, seen)
        });
        for value in 1..=4 {
            assert!(write(&mut writer, value));
        }
        let (mut reader, mut seen) = thread.join().unwrap();
        while reader.lag() > 0 {
            seen += reader.pull().unwrap() as u64;
        }
        assert_eq!(seen + reader.skipped(), 4);
    });
}

#[test]
fn a_reader_that_blocks_loses_nothing() {
    check(3, || {
        let channel = Channel::new(SHAPE, 1, Budget { latest: 0, queues: 1, window: 1 });
        let mut writer = channel.writer().unwrap();
        let mut reader = channel.queue(Policy::Block, Start::Next).unwrap();
        let thread = thread::spawn(move || {
            let mut last = 0;
            for _ in 0..2 {
                reader.pull().unwrap();
                for loan in reader.window() {
                    assert_eq!(number(&loan), last + 1);
                    last += 1;
                }
            }
            assert_eq!(reader.skipped(), 0);
            (reader, last)
        });
        let written = (1..=3).take_while(|value| write(&mut writer, *value)).count() as u64;
        let (mut reader, last) = thread.join().unwrap();
        let rest = reader.pull().unwrap() as u64;
        assert_eq!((last + rest, reader.skipped()), (written, 0));
    });
}

#[test]
fn a_snapshot_holds_values_of_one_commit() {
    check(2, || {
        let channels = [(); 2].map(|()| Channel::new(SHAPE, 1, Budget { latest: 1, queues: 0, window: 0 }));
        let mut writers = channels.each_ref().map(|channel| channel.writer().unwrap());
        let mut readers = channels.each_ref().map(|channel| channel.latest().unwrap());
        let word = CommitWord::new();
        let reader = {
            let word = word.clone();
            thread::spawn(move || {
                let mut last = 0;
                for _ in 0..2 {
                    let outcome = pin(&word, &mut readers, 1);
                    let values = readers.each_ref().map(|reader| reader.value().as_ref().map_or(0, number));
                    assert_eq!(values[0], values[1], "a torn snapshot");
                    assert_eq!(values[0] > last, outcome == Pin::Fresh);
                    last = values[0];
                }
                readers
            })
        };
        for tick in 1..=2 {
            word.begin();
            assert!(writers.iter_mut().all(|writer| write(writer, tick)));
            word.end();
        }
        let mut readers = reader.join().unwrap();
        assert_ne!(pin(&word, &mut readers, 1), Pin::Kept);
        assert_eq!(readers.each_ref().map(|reader| number(&reader.value().unwrap())), [2, 2]);
    });
}

fn send(sender: &mut Sender, number: u64) -> bool {
    sender.send(&[number.to_ne_bytes(), number.to_ne_bytes()].concat(), 0, number).is_ok()
}

#[test]
fn messages_of_two_senders_all_arrive_each_senders_in_order() {
    check(2, || {
        let mailbox = Mailbox::new(SHAPE, 2, 2);
        let mut receiver = mailbox.receiver().unwrap();
        let threads = [(); 2].map(|()| {
            let mut sender = mailbox.sender().unwrap();
            thread::spawn(move || {
                assert!(send(&mut sender, 1) && send(&mut sender, 2));
                sender
            })
        });
        let mut last = [0; 2];
        let mut count = 0;
        let mut collect = |count: &mut u64| {
            receiver.collect();
            for message in receiver.messages() {
                let number = u64::from_ne_bytes(message.bytes()[8..].try_into().unwrap());
                assert_eq!(number, message.time());
                let last = &mut last[message.sender() as usize];
                assert_eq!(number, *last + 1);
                *last = number;
                *count += 1;
                assert_eq!(message.sequence(), *count);
            }
        };
        collect(&mut count);
        let senders = threads.map(|thread| thread.join().unwrap());
        collect(&mut count);
        assert_eq!(count, 4);
        drop(senders);
    });
}

#[test]
fn a_message_stays_as_it_is_until_the_receiver_releases_it() {
    check(3, || {
        let mailbox = Mailbox::new(SHAPE, 1, 1);
        let mut receiver = mailbox.receiver().unwrap();
        let mut sender = mailbox.sender().unwrap();
        let thread = thread::spawn(move || {
            let ticket = sender.send(&[1; 16], 0, 1).unwrap();
            let status = sender.status(ticket);
            assert!(matches!(status, Status::Accepted | Status::Refused(7) | Status::Done), "{status:?}");
            let again = sender.send(&[2; 16], 0, 2).is_ok();
            assert!(!again || status != Status::Accepted || sender.status(ticket) == Status::Unknown);
            (sender, again)
        });
        let mut received = 0;
        for _ in 0..2 {
            received += receiver.collect();
            for message in receiver.messages() {
                assert_eq!(message.bytes(), [message.time() as u8; 16]);
            }
            receiver.answer(0, Answer::Refused(7));
        }
        let (_sender, again) = thread.join().unwrap();
        received += receiver.collect();
        assert_eq!(received, 1 + usize::from(again));
    });
}

#[test]
fn no_notification_is_lost_and_what_came_before_it_is_seen() {
    check(3, || {
        let wake = Arc::new(Wake::new());
        let data = Arc::new([AtomicU64::new(0), AtomicU64::new(0)]);
        let waiter = {
            let (wake, data) = (wake.clone(), data.clone());
            thread::spawn(move || {
                let mut bits = 0;
                while bits != 3 {
                    let new = wake.wait();
                    assert_eq!(bits & new, 0, "each notification is found once");
                    bits |= new;
                    for (i, data) in data.iter().enumerate() {
                        assert!(bits & 1 << i == 0 || data.load(Relaxed) == 1);
                    }
                }
            })
        };
        let notify = move |i: usize| {
            data[i].store(1, Relaxed);
            wake.notify(1 << i);
        };
        let other = {
            let notify = notify.clone();
            thread::spawn(move || notify(0))
        };
        notify(1);
        other.join().unwrap();
        waiter.join().unwrap();
    });
}

/// Board with a property `a`, and its observer.
fn observed(limit: usize, wake: Option<Arc<Wake>>) -> (Board, Arc<Channel>, Observer) {
    let board = Board::new("base");
    let store = Store { capacity: 0, depth: 1, budget: Budget { latest: 2, queues: 0, window: 0 } };
    let property = board.add_channel("a", "", <()>::DESCRIPTOR, store, Access::Output).unwrap();
    let observer = board.observe(&Pattern::parse("a").unwrap(), limit, wake);
    (board, property.channel().unwrap().clone(), observer)
}

#[test]
fn an_observer_gets_events_whole_and_in_order_or_counts_them() {
    check(3, || {
        let (board, channel, mut observer) = observed(1, None);
        // Loom forgets that a load came before the store of a thread that loads too: so the one that stores goes first.
        let thread = thread::spawn(move || {
            let seen: Vec<_> = (0..2).filter_map(|_| observer.next()).collect();
            (observer, seen)
        });
        drop(channel.writer().unwrap());
        drop(channel.latest().unwrap());
        let (mut observer, mut seen) = thread.join().unwrap();
        seen.extend(&mut observer);
        let a: Arc<str> = "a".into();
        let all = [
            Event::WriterCame(a.clone(), 1),
            Event::WriterLeft(a.clone(), 1),
            Event::ReaderCame(a.clone()),
            Event::ReaderLeft(a),
        ];
        let mut rest = all.iter();
        assert!(seen.iter().all(|event| rest.any(|other| other == event)), "{seen:?}");
        assert_eq!(seen.len() as u64 + observer.missed(), 4);
        drop(board);
    });
}

#[test]
fn an_observer_that_is_woken_finds_the_event() {
    check(3, || {
        let wake = Arc::new(Wake::new());
        let (board, channel, mut observer) = observed(2, Some(wake.clone()));
        let thread = thread::spawn(move || channel.latest().unwrap());
        wake.wait();
        assert_eq!(observer.next(), Some(Event::ReaderCame("a".into())));
        thread.join().unwrap();
        drop(board);
    });
}

#[test]
fn no_event_follows_removal_of_property() {
    check(3, || {
        let (board, channel, mut observer) = observed(8, None);
        let thread = thread::spawn(move || drop(channel.latest().unwrap()));
        board.remove("a").unwrap();
        thread.join().unwrap();
        let told: Vec<_> = observer.by_ref().collect();
        assert_eq!(told.last(), Some(&Event::Vanished("a".into())));
        assert_eq!(told.iter().filter(|event| matches!(event, Event::Vanished(_))).count(), 1);
        assert!(told.len() <= 3 && observer.missed() == 0);
    });
}
