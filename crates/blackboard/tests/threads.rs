//! Real threads at full speed: no value is torn, none comes twice or backwards, nothing is lost without being counted.
//!
//! A program of its own, so that ThreadSanitizer can watch it without the test harness and scoped threads of the
//! standard library, whose synchronization it can't see: `tests/thread_sanitizer.sh`.
#![allow(clippy::unwrap_used, reason = "all of it is a test")]

#[cfg(any(loom, feature = "shuttle"))]
fn main() {}

#[cfg(not(any(loom, feature = "shuttle")))]
fn main() {
    let tests: [(&str, fn()); 8] = [
        ("values stay whole for many readers", stress::values),
        ("queues lose nothing without counting it", stress::queues),
        ("a reader that blocks sees everything", stress::blocking),
        ("a channel becomes deeper while it is read", stress::deepening),
        ("snapshots are of one commit", stress::snapshots),
        ("handles come and go", stress::handles),
        ("messages arrive in order", stress::messages),
        ("every notification wakes", stress::notifications),
    ];
    for (name, test) in tests {
        test();
        println!("test {name} ... ok");
    }
}

#[cfg(not(any(loom, feature = "shuttle")))]
mod stress {
    use std::sync::Arc;
    use std::sync::atomic::{AtomicBool, AtomicU64, Ordering::Relaxed};
    use std::thread;
    use std::time::Duration;

    use slate_blackboard::Shape;
    use slate_blackboard::channel::{Budget, Channel, Latest, Loan, Policy, QueueReader, Start, Writer};
    use slate_blackboard::commit::{CommitWord, Pin, pin};
    use slate_blackboard::message::{Answer, Mailbox, Status};
    use slate_blackboard::wake::Wake;

    const VALUES: u64 = 20_000;
    const SIZE: usize = 256;
    const SHAPE: Shape = Shape::fixed(SIZE, 8);

    fn write(writer: &mut Writer, number: u64) -> bool {
        let mut value = [0; SIZE];
        value.chunks_exact_mut(8).for_each(|word| word.copy_from_slice(&number.to_ne_bytes()));
        writer.write(&value, 0, number).is_ok()
    }

    fn number(bytes: &[u8], time: u64) -> u64 {
        assert_eq!(bytes.len(), SIZE);
        assert!(bytes.chunks_exact(8).all(|word| word == time.to_ne_bytes()), "a torn value");
        time
    }

    fn number_of(loan: &Loan) -> u64 {
        number(loan.bytes(), loan.stamp().time)
    }

    fn follow(reader: &mut Latest) {
        let mut last = 0;
        while last < VALUES {
            if reader.refresh() {
                let number = number_of(&reader.value().unwrap());
                assert!(number > last, "{number} after {last}");
                last = number;
            }
        }
    }

    /// Runs each in a thread of its own while the last one runs here.
    fn together(threads: impl IntoIterator<Item = Box<dyn FnOnce() + Send>>, here: impl FnOnce()) {
        let threads: Vec<_> = threads.into_iter().map(thread::spawn).collect();
        here();
        threads.into_iter().for_each(|thread| thread.join().unwrap());
    }

    fn boxed(run: impl FnOnce() + Send + 'static) -> Box<dyn FnOnce() + Send> {
        Box::new(run)
    }

    pub fn values() {
        let channel = Channel::new(SHAPE, 1, Budget { latest: 3, queues: 0, window: 0 });
        let readers = [(); 3].map(|()| channel.latest().unwrap());
        let mut writer = channel.writer().unwrap();
        together(readers.map(|mut reader| boxed(move || follow(&mut reader))), || {
            assert!((1..=VALUES).all(|value| write(&mut writer, value)));
        });
    }

    pub fn queues() {
        let channel = Channel::new(SHAPE, 16, Budget { latest: 1, queues: 3, window: 8 });
        let mut newest = channel.latest().unwrap();
        let readers = [(); 3].map(|()| channel.queue(Policy::Skip, Start::Oldest).unwrap());
        let mut writer = channel.writer().unwrap();
        let mut threads: Vec<_> = readers
            .into_iter()
            .map(|mut reader| {
                boxed(move || {
                    let (mut seen, mut last) = (0, 0);
                    while seen + reader.skipped() < VALUES {
                        reader.pull().unwrap();
                        for loan in reader.window() {
                            assert!(number_of(&loan) > last);
                            last = number_of(&loan);
                            seen += 1;
                        }
                    }
                    assert_eq!((last, seen + reader.skipped()), (VALUES, VALUES));
                })
            })
            .collect();
        threads.push(boxed(move || follow(&mut newest)));
        together(threads, || assert!((1..=VALUES).all(|value| write(&mut writer, value))));
    }

    /// Pulls until that value came.
    fn pull_to(reader: &mut QueueReader, last: u64, mut each: impl FnMut(u64)) {
        let mut seen = 0;
        while seen < last {
            reader.pull().unwrap();
            for loan in reader.window() {
                assert!(number_of(&loan) > seen);
                seen = number_of(&loan);
                each(seen);
            }
        }
    }

    pub fn deepening() {
        const LAST: u64 = 400;
        for _ in 0..50 {
            let budget = Budget { latest: 1, queues: 1, window: 8 };
            let channel = Channel::new(SHAPE, 1, budget);
            let mut newest = channel.latest().unwrap();
            let mut early = channel.queue(Policy::Skip, Start::Oldest).unwrap();
            let mut writer = channel.writer().unwrap();
            let came = Arc::new(AtomicBool::new(false));
            let early = boxed(move || {
                let mut seen = 0;
                pull_to(&mut early, LAST, |_| seen += 1);
                assert_eq!(seen + early.skipped(), LAST);
            });
            let follow = boxed(move || {
                while newest.value().map_or(0, |loan| number_of(&loan)) < LAST {
                    newest.refresh();
                }
            });
            let late = {
                let (channel, came) = (Arc::clone(&channel), Arc::clone(&came));
                boxed(move || {
                    while !channel.keeps_enough(8) {
                        thread::yield_now();
                    }
                    let before = channel.published();
                    let mut reader = channel.queue(Policy::Evict, Start::Next).unwrap();
                    let after = channel.published();
                    came.store(true, Relaxed);
                    let mut next = None;
                    pull_to(&mut reader, LAST, |number| {
                        match next {
                            // The deeper channel gets each value a moment later.
                            None => assert!((before..=after + 1).contains(&number)),
                            Some(next) => assert_eq!(number, next),
                        }
                        next = Some(number + 1);
                    });
                    assert_eq!(reader.skipped(), 0);
                })
            };
            together([early, follow, late], || {
                for number in 1..=LAST {
                    assert!(write(&mut writer, number));
                    if number == LAST / 4 {
                        writer.deepen(channel.deeper(LAST as usize, budget).unwrap());
                    }
                    while number == LAST / 2 && !came.load(Relaxed) {
                        thread::yield_now();
                    }
                }
            });
        }
    }

    pub fn blocking() {
        let channel = Channel::new(SHAPE, 4, Budget { latest: 0, queues: 1, window: 3 });
        let mut reader = channel.queue(Policy::Block, Start::Next).unwrap();
        let mut writer = channel.writer().unwrap();
        let recorder = boxed(move || {
            let mut last = 0;
            while last < VALUES {
                reader.pull().unwrap();
                for loan in reader.window() {
                    assert_eq!(number_of(&loan), last + 1);
                    last += 1;
                }
                thread::yield_now();
            }
        });
        together([recorder], || {
            for value in 1..=VALUES {
                while !write(&mut writer, value) {
                    thread::yield_now();
                }
            }
        });
    }

    pub fn snapshots() {
        let channels = [(); 3].map(|()| Channel::new(SHAPE, 1, Budget { latest: 1, queues: 0, window: 0 }));
        let mut writers = channels.each_ref().map(|channel| channel.writer().unwrap());
        let mut readers = channels.each_ref().map(|channel| channel.latest().unwrap());
        let word = CommitWord::new();
        let reader = {
            let word = word.clone();
            boxed(move || {
                let mut last = 0;
                while last < VALUES {
                    let outcome = pin(&word, &mut readers, 4);
                    let values =
                        readers.each_ref().map(|reader| reader.value().as_ref().map_or(0, number_of));
                    assert!(values.iter().all(|value| *value == values[0]), "a torn snapshot: {values:?}");
                    assert_eq!(outcome == Pin::Fresh, values[0] > last);
                    last = values[0];
                }
            })
        };
        together([reader], || {
            for tick in 1..=VALUES {
                word.begin();
                assert!(writers.iter_mut().all(|writer| write(writer, tick)));
                word.end();
            }
        });
    }

    pub fn handles() {
        let channel = Channel::new(SHAPE, 2, Budget { latest: 1, queues: 1, window: 2 });
        let done = Arc::new(AtomicBool::new(false));
        let latest = {
            let (channel, done) = (channel.clone(), done.clone());
            boxed(move || {
                let mut last = 0;
                while !done.load(Relaxed) {
                    let mut reader = channel.latest().unwrap();
                    reader.refresh();
                    let now = reader.value().as_ref().map_or(0, number_of);
                    assert!(now >= last);
                    last = now;
                }
            })
        };
        let queue = {
            let (channel, done) = (channel.clone(), done.clone());
            boxed(move || {
                while !done.load(Relaxed) {
                    let mut reader = channel.queue(Policy::Skip, Start::Oldest).unwrap();
                    reader.pull().unwrap();
                    reader.window().for_each(|loan| assert!(number_of(&loan) > 0));
                }
            })
        };
        together([latest, queue], || {
            for round in 0..VALUES / 10 {
                let mut writer = channel.writer().unwrap();
                assert!((1..=10).all(|value| write(&mut writer, round * 10 + value)));
                assert!(writer.set_aside().is_some());
            }
            done.store(true, Relaxed);
        });
        assert_eq!((channel.generation(), channel.published()), (VALUES / 10, VALUES));
    }

    pub fn messages() {
        let mailbox = Mailbox::new(SHAPE, 3, 4);
        let senders = [(); 3].map(|()| mailbox.sender().unwrap());
        let mut receiver = mailbox.receiver().unwrap();
        let answer = |number: u64| (number % 1000) as u16;
        let threads = senders.map(|mut sender| {
            boxed(move || {
                let mut number: u64 = 1;
                while number <= VALUES {
                    let message: Vec<u8> = number.to_ne_bytes().repeat(SIZE / 8);
                    match sender.send(&message, 0, number) {
                        Ok(ticket) => {
                            let status = sender.status(ticket);
                            let possible = [Status::Accepted, Status::Refused(answer(number))];
                            assert!(possible.contains(&status), "{status:?}");
                            number += 1;
                        }
                        Err(_) => thread::yield_now(),
                    }
                }
            })
        });
        together(threads, || {
            let mut last = [0; 3];
            while last != [VALUES; 3] {
                receiver.collect();
                let mut numbers = Vec::new();
                for message in receiver.messages() {
                    let number = number(message.bytes(), message.time());
                    let last = &mut last[message.sender() as usize];
                    assert_eq!(number, *last + 1);
                    *last = number;
                    numbers.push(number);
                }
                for (index, number) in numbers.into_iter().enumerate() {
                    receiver.answer(index, Answer::Refused(answer(number)));
                }
                receiver.release();
                thread::yield_now();
            }
        });
    }

    pub fn notifications() {
        let wakes = Arc::new([Wake::new(), Wake::with_spins(100)]);
        let data = Arc::new(AtomicU64::new(0));
        let rounds = VALUES / 10;
        let answering = {
            let (wakes, data) = (wakes.clone(), data.clone());
            boxed(move || {
                for round in 1..=rounds {
                    assert_eq!(wakes[0].wait(), 1);
                    assert_eq!(data.load(Relaxed), round);
                    wakes[1].notify(2);
                }
            })
        };
        together([answering], || {
            for round in 1..=rounds {
                data.store(round, Relaxed);
                wakes[0].notify(1);
                if round % 2 == 0 {
                    assert_eq!(wakes[1].wait(), 2);
                } else {
                    while wakes[1].wait_timeout(Duration::from_millis(1)) == 0 {}
                }
            }
        });
    }
}
