//! Real threads at full speed: no value is torn, none comes twice or backwards, nothing is lost without being counted.
//!
//! A program of its own, without the test harness of the standard library, so that ThreadSanitizer, which does not know
//! that harness, can watch it:
//!
//! `RUSTC_BOOTSTRAP=1 RUSTFLAGS="-Zsanitizer=thread -Cunsafe-allow-abi-mismatch=sanitizer"
//! cargo test -p slate-blackboard --test threads --target x86_64-unknown-linux-gnu --target-dir target/thread-sanitizer`

#[cfg(any(loom, feature = "shuttle"))]
fn main() {}

#[cfg(not(any(loom, feature = "shuttle")))]
fn main() {
    let tests: [(&str, fn()); 7] = [
        ("values stay whole for many readers", stress::values),
        ("queues lose nothing without counting it", stress::queues),
        ("a reader that blocks sees everything", stress::blocking),
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
    use slate_blackboard::channel::{Budget, Channel, Latest, Loan, Policy, Start, Writer};
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

    pub fn values() {
        let channel = Channel::new(SHAPE, 1, Budget { latest: 3, queues: 0, window: 0 });
        let mut readers = [(); 3].map(|()| channel.latest().unwrap());
        let mut writer = channel.writer().unwrap();
        thread::scope(|scope| {
            for reader in &mut readers {
                scope.spawn(|| follow(reader));
            }
            assert!((1..=VALUES).all(|value| write(&mut writer, value)));
        });
    }

    pub fn queues() {
        let channel = Channel::new(SHAPE, 16, Budget { latest: 1, queues: 3, window: 8 });
        let mut newest = channel.latest().unwrap();
        let readers = [(); 3].map(|()| channel.queue(Policy::Skip, Start::Oldest).unwrap());
        let mut writer = channel.writer().unwrap();
        thread::scope(|scope| {
            scope.spawn(|| follow(&mut newest));
            for mut reader in readers {
                scope.spawn(move || {
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
                });
            }
            assert!((1..=VALUES).all(|value| write(&mut writer, value)));
        });
    }

    pub fn blocking() {
        let channel = Channel::new(SHAPE, 4, Budget { latest: 0, queues: 1, window: 3 });
        let mut reader = channel.queue(Policy::Block, Start::Next).unwrap();
        let mut writer = channel.writer().unwrap();
        thread::scope(|scope| {
            scope.spawn(move || {
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
        let done = AtomicBool::new(false);
        thread::scope(|scope| {
            scope.spawn(|| {
                let mut last = 0;
                while last < VALUES {
                    let finished = done.load(Relaxed);
                    let outcome = pin(&word, &mut readers, 4);
                    let values =
                        readers.each_ref().map(|reader| reader.value().as_ref().map_or(0, number_of));
                    assert!(values.iter().all(|value| *value == values[0]), "a torn snapshot: {values:?}");
                    assert_eq!(outcome == Pin::Fresh, values[0] > last);
                    assert!(!finished || values[0] == VALUES || outcome == Pin::Kept);
                    last = values[0];
                }
            });
            for tick in 1..=VALUES {
                word.begin();
                assert!(writers.iter_mut().all(|writer| write(writer, tick)));
                word.end();
            }
            done.store(true, Relaxed);
        });
    }

    pub fn handles() {
        let channel = Channel::new(SHAPE, 2, Budget { latest: 1, queues: 1, window: 2 });
        let done = AtomicBool::new(false);
        thread::scope(|scope| {
            scope.spawn(|| {
                let mut last = 0;
                while !done.load(Relaxed) {
                    let mut reader = channel.latest().unwrap();
                    reader.refresh();
                    let now = reader.value().as_ref().map_or(0, number_of);
                    assert!(now >= last);
                    last = now;
                }
            });
            scope.spawn(|| {
                while !done.load(Relaxed) {
                    let mut reader = channel.queue(Policy::Skip, Start::Oldest).unwrap();
                    reader.pull().unwrap();
                    reader.window().for_each(|loan| assert!(number_of(&loan) > 0));
                }
            });
            for round in 0..VALUES / 10 {
                let mut writer = channel.writer().unwrap();
                assert!((1..=10).all(|value| write(&mut writer, round * 10 + value)));
                drop(writer.set_aside());
            }
            done.store(true, Relaxed);
        });
        assert_eq!((channel.generation(), channel.published()), (VALUES / 10, VALUES));
    }

    pub fn messages() {
        let mailbox = Mailbox::new(SHAPE, 3, 4);
        let senders = [(); 3].map(|()| mailbox.sender().unwrap());
        let mut receiver = mailbox.receiver().unwrap();
        thread::scope(|scope| {
            for mut sender in senders {
                scope.spawn(move || {
                    let mut number: u64 = 1;
                    while number <= VALUES {
                        let message: Vec<u8> = number.to_ne_bytes().repeat(SIZE / 8);
                        match sender.send(&message, 0, number) {
                            Ok(ticket) => {
                                let status = sender.status(ticket);
                                let answer = Status::Refused((number % 1000) as u16);
                                assert!(status == Status::Accepted || status == answer, "{status:?}");
                                number += 1;
                            }
                            Err(_) => thread::yield_now(),
                        }
                    }
                });
            }
            let mut last = [0; 3];
            while last != [VALUES; 3] {
                for index in 0..receiver.collect() {
                    let message = receiver.messages().nth(index).unwrap();
                    let number = number(message.bytes(), message.time());
                    let last = &mut last[message.sender() as usize];
                    assert_eq!(number, *last + 1);
                    *last = number;
                    drop(message);
                    receiver.answer(index, Answer::Refused((number % 1000) as u16));
                }
                receiver.release();
                thread::yield_now();
            }
        });
    }

    pub fn notifications() {
        let wakes = [Arc::new(Wake::new()), Arc::new(Wake::with_spins(100))];
        let data = AtomicU64::new(0);
        let rounds = VALUES / 10;
        thread::scope(|scope| {
            scope.spawn(|| {
                for round in 1..=rounds {
                    assert_eq!(wakes[0].wait(), 1);
                    assert_eq!(data.load(Relaxed), round);
                    wakes[1].notify(2);
                }
            });
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
