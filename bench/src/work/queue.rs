//! Every value of 64 bytes, from one writer to readers of which each sees all.

use std::hint::black_box;
use std::sync::{Arc, Barrier, Mutex};
use std::thread;
use std::time::Instant;

use iceoryx2::prelude::*;
use slate_blackboard::Shape;
use slate_blackboard::channel::{Budget, Channel, Policy, QueueReader, Start, Writer};
use tokio::sync::broadcast;

use super::latest_value::Bytes;
use crate::machine::pin;
use crate::measure::{Contest, Effort, Samples, consume};
use crate::table::{Role, Table};

const WORK: &str = "queue";

/// Depth of the queues, values.
const DEPTH: usize = 1024;

/// Values pushed before they are read, where one thread does both.
const BATCH: usize = 64;

type Item = Bytes<64>;

const VALUE: Item = Bytes([1; 64]);

/// Queue.
/// Shared parts are made first, the writer and the readers in their threads.
trait Queue: Sync {
    const NAME: &'static str;
    const ROLE: Role;
    type Shared: Sync;
    type Writer;
    type Reader;

    fn share(readers: usize) -> Self::Shared;
    fn writer(shared: &Self::Shared) -> Self::Writer;
    fn reader(shared: &Self::Shared) -> Self::Reader;
    /// False when there is no room.
    fn push(writer: &mut Self::Writer, value: &Item) -> bool;
    /// Looks at all that is there; says how many came or were lost.
    fn pull(reader: &mut Self::Reader) -> usize;
}

/// Things that were made together and are taken by threads one by one.
struct Handout<T>(Mutex<Vec<T>>);

impl<T> Handout<T> {
    fn new(all: impl IntoIterator<Item = T>) -> Self {
        Self(Mutex::new(all.into_iter().collect()))
    }

    fn take(&self) -> T {
        self.0.lock().ok().and_then(|mut all| all.pop()).expect("as many are taken as were made")
    }
}

/// Readers that hold the writer up, as recorders in lockstep.
struct Slate;

impl Queue for Slate {
    const NAME: &'static str = "Slate, lent; the writer waits for readers";
    const ROLE: Role = Role::Slate;
    type Shared = Arc<Channel>;
    type Writer = Writer;
    type Reader = QueueReader;

    fn share(readers: usize) -> Arc<Channel> {
        let budget = Budget { latest: 0, queues: readers as u16, window: BATCH as u16 };
        Channel::new(Shape::fixed(64, 8), DEPTH, budget)
    }

    fn writer(shared: &Arc<Channel>) -> Writer {
        shared.writer().expect("a new channel has no writer")
    }

    fn reader(shared: &Arc<Channel>) -> QueueReader {
        shared.queue(Policy::Block, Start::Next).expect("the budget is as large")
    }

    #[inline]
    fn push(writer: &mut Writer, value: &Item) -> bool {
        writer.write(&value.0, 0, 0).is_ok()
    }

    #[inline]
    fn pull(reader: &mut QueueReader) -> usize {
        let count = reader.pull().unwrap_or(0);
        reader.window().for_each(|loan| consume(loan.bytes()[0]));
        reader.release();
        count
    }
}

/// Readers that lose and count what they are too slow for, as modules.
struct Skipping;

impl Queue for Skipping {
    const NAME: &'static str = "Slate, lent; the writer never waits";
    const ROLE: Role = Role::Slate;
    type Shared = Arc<Channel>;
    type Writer = Writer;
    type Reader = (QueueReader, u64);

    fn share(readers: usize) -> Arc<Channel> {
        Slate::share(readers)
    }

    fn writer(shared: &Arc<Channel>) -> Writer {
        Slate::writer(shared)
    }

    fn reader(shared: &Arc<Channel>) -> Self::Reader {
        (shared.queue(Policy::Skip, Start::Next).expect("the budget is as large"), 0)
    }

    #[inline]
    fn push(writer: &mut Writer, value: &Item) -> bool {
        Slate::push(writer, value)
    }

    #[inline]
    fn pull((reader, lost): &mut Self::Reader) -> usize {
        let count = Slate::pull(reader);
        let before = std::mem::replace(lost, reader.lost());
        count + (*lost - before) as usize
    }
}

struct Disruptor;

type Push = Box<dyn FnMut(&Item) -> bool + Send>;
type Pull = Box<dyn FnMut() -> usize + Send>;

macro_rules! poller {
    ($poller:expr) => {{
        let mut poller = $poller;
        Box::new(move || {
            poller.poll().map_or(0, |mut events| {
                let mut count = 0_usize;
                for event in &mut events {
                    black_box(event.0[0]);
                    count += 1;
                }
                count
            })
        }) as Pull
    }};
}

impl Queue for Disruptor {
    const NAME: &'static str = "disruptor, polled";
    const ROLE: Role = Role::Lesser;
    type Shared = (Handout<Push>, Handout<Pull>);
    type Writer = Push;
    type Reader = Pull;

    fn share(readers: usize) -> Self::Shared {
        use disruptor::{BusySpin, Producer, build_single_producer};
        let builder = build_single_producer(DEPTH, || Bytes([0; 64]), BusySpin);
        macro_rules! producer {
            ($builder:expr) => {{
                let mut producer = $builder.build();
                Box::new(move |value: &Item| producer.try_publish(|event| *event = *value).is_ok()) as Push
            }};
        }
        let (first, builder) = builder.new_event_poller();
        if readers == 1 {
            return (Handout::new([producer!(builder)]), Handout::new([poller!(first)]));
        }
        let (p2, builder) = builder.new_event_poller();
        let (p3, builder) = builder.new_event_poller();
        let (p4, builder) = builder.new_event_poller();
        let (p5, builder) = builder.new_event_poller();
        let (p6, builder) = builder.new_event_poller();
        let (p7, builder) = builder.new_event_poller();
        let (p8, builder) = builder.new_event_poller();
        let pollers = [
            poller!(first),
            poller!(p2),
            poller!(p3),
            poller!(p4),
            poller!(p5),
            poller!(p6),
            poller!(p7),
            poller!(p8),
        ];
        (Handout::new([producer!(builder)]), Handout::new(pollers))
    }

    fn writer(shared: &Self::Shared) -> Push {
        shared.0.take()
    }

    fn reader(shared: &Self::Shared) -> Pull {
        shared.1.take()
    }

    #[inline]
    fn push(writer: &mut Push, value: &Item) -> bool {
        writer(value)
    }

    #[inline]
    fn pull(reader: &mut Pull) -> usize {
        reader()
    }
}

struct Crossbeam;

type Ends = (crossbeam_channel::Sender<Item>, crossbeam_channel::Receiver<Item>);

impl Queue for Crossbeam {
    const NAME: &'static str = "crossbeam, a channel for each reader";
    const ROLE: Role = Role::Peer;
    type Shared = (Vec<crossbeam_channel::Sender<Item>>, Handout<crossbeam_channel::Receiver<Item>>);
    type Writer = Vec<crossbeam_channel::Sender<Item>>;
    type Reader = crossbeam_channel::Receiver<Item>;

    fn share(readers: usize) -> Self::Shared {
        let ends: Vec<Ends> = (0..readers).map(|_| crossbeam_channel::bounded(DEPTH)).collect();
        let (senders, receivers): (Vec<_>, Vec<_>) = ends.into_iter().unzip();
        (senders, Handout::new(receivers))
    }

    fn writer(shared: &Self::Shared) -> Self::Writer {
        shared.0.clone()
    }

    fn reader(shared: &Self::Shared) -> Self::Reader {
        shared.1.take()
    }

    #[inline]
    fn push(writer: &mut Self::Writer, value: &Item) -> bool {
        // All or none, so that it can be tried again.
        if writer.iter().any(crossbeam_channel::Sender::is_full) {
            return false;
        }
        writer.iter().all(|sender| sender.try_send(*value).is_ok())
    }

    #[inline]
    fn pull(reader: &mut Self::Reader) -> usize {
        reader.try_iter().map(|item| consume(item.0[0])).count()
    }
}

struct Broadcast;

impl Queue for Broadcast {
    const NAME: &'static str = "tokio broadcast";
    const ROLE: Role = Role::Lesser;
    type Shared = (broadcast::Sender<Item>, Handout<broadcast::Receiver<Item>>);
    type Writer = broadcast::Sender<Item>;
    type Reader = broadcast::Receiver<Item>;

    fn share(readers: usize) -> Self::Shared {
        let sender = broadcast::Sender::new(DEPTH);
        let receivers: Vec<_> = (0..readers).map(|_| sender.subscribe()).collect();
        (sender, Handout::new(receivers))
    }

    fn writer(shared: &Self::Shared) -> Self::Writer {
        shared.0.clone()
    }

    fn reader(shared: &Self::Shared) -> Self::Reader {
        shared.1.take()
    }

    #[inline]
    fn push(writer: &mut Self::Writer, value: &Item) -> bool {
        writer.send(*value).is_ok()
    }

    #[inline]
    fn pull(reader: &mut Self::Reader) -> usize {
        let mut count = 0;
        loop {
            match reader.try_recv() {
                Ok(item) => {
                    black_box(item.0[0]);
                    count += 1;
                }
                Err(broadcast::error::TryRecvError::Lagged(lost)) => count += lost as usize,
                Err(_) => return count,
            }
        }
    }
}

struct Iceoryx;

type Service = iceoryx2::service::port_factory::publish_subscribe::PortFactory<ipc::Service, Item, ()>;

impl Queue for Iceoryx {
    const NAME: &'static str = "iceoryx2 publish-subscribe";
    const ROLE: Role = Role::Peer;
    type Shared = (Node<ipc::Service>, Service);
    type Writer = iceoryx2::port::publisher::Publisher<ipc::Service, Item, ()>;
    type Reader = iceoryx2::port::subscriber::Subscriber<ipc::Service, Item, ()>;

    fn share(readers: usize) -> Self::Shared {
        let (node, name) = super::iceoryx::node("queue");
        let service = node.service_builder(&name).publish_subscribe::<Item>();
        let service = service.max_publishers(1).max_subscribers(readers).subscriber_max_buffer_size(DEPTH);
        let service = service.enable_safe_overflow(false).create().expect("a new service");
        (node, service)
    }

    fn writer(shared: &Self::Shared) -> Self::Writer {
        let publisher = shared.1.publisher_builder();
        let publisher = publisher.backpressure_strategy(BackpressureStrategy::RetryUntilDelivered);
        publisher.create().expect("there is one publisher")
    }

    fn reader(shared: &Self::Shared) -> Self::Reader {
        shared.1.subscriber_builder().create().expect("there are so many subscribers")
    }

    #[inline]
    fn push(writer: &mut Self::Writer, value: &Item) -> bool {
        writer.send_copy(*value).is_ok()
    }

    #[inline]
    fn pull(reader: &mut Self::Reader) -> usize {
        let mut count = 0;
        while let Ok(Some(sample)) = reader.receive() {
            black_box(sample.payload().0[0]);
            count += 1;
        }
        count
    }
}

/// Measures all lines.
pub fn run(effort: Effort, table: &mut Table) {
    pin(0);
    for readers in [1, 8] {
        for (what, line) in [
            (What::Push, "pushed"),
            (What::Pull, "pulled, each value and reader"),
            (What::Through, "from a core to readers on another, until all have it"),
        ] {
            let mut contest = Contest::new(WORK, format!("64 B, {readers} readers: {line}"));
            add::<Slate>(&mut contest, what, readers, effort);
            add::<Skipping>(&mut contest, what, readers, effort);
            add::<Disruptor>(&mut contest, what, readers, effort);
            add::<Crossbeam>(&mut contest, what, readers, effort);
            add::<Broadcast>(&mut contest, what, readers, effort);
            add::<Iceoryx>(&mut contest, what, readers, effort);
            contest.run(effort, table);
        }
    }
}

#[derive(Clone, Copy, PartialEq)]
enum What {
    Push,
    Pull,
    Through,
}

fn add<Q: Queue + 'static>(contest: &mut Contest<'_>, what: What, readers: usize, effort: Effort) {
    contest.with(Q::NAME, Q::ROLE, move |samples| match what {
        What::Through => through::<Q>(readers, effort, samples),
        _ => alone::<Q>(readers, what, effort, samples),
    });
}

/// One thread pushes a batch, and every reader pulls it.
fn alone<Q: Queue>(readers: usize, what: What, effort: Effort, samples: &mut Samples) {
    let shared = Q::share(readers);
    let mut readers: Vec<_> = (0..readers).map(|_| Q::reader(&shared)).collect();
    let mut writer = Q::writer(&shared);
    let (mut pushes, mut pulls) = (Samples::new(), Samples::new());
    for _ in 0..effort.count(2000) {
        pushes.burst(BATCH as u32, |_| {
            assert!(Q::push(&mut writer, black_box(&VALUE)), "{}: a batch fits", Q::NAME);
        });
        let before = crate::measure::allocations();
        let start = Instant::now();
        for reader in &mut readers {
            let mut count = 0;
            while count < BATCH {
                count += Q::pull(reader);
            }
        }
        let values = (BATCH * readers.len()) as u32;
        pulls.add_mean(start.elapsed(), values);
        pulls.allocated(values.into(), crate::measure::allocations() - before);
    }
    samples.join(if what == What::Push { &pushes } else { &pulls });
}

/// Measures a core that pushes and readers that pull on another one.
/// A sample is the time until all readers have many values, per value.
fn through<Q: Queue>(readers: usize, effort: Effort, samples: &mut Samples) {
    let values = effort.count(20_000) / readers;
    let groups = effort.count(20);
    let shared = Q::share(readers);
    let (start, done) = (Barrier::new(readers + 1), Barrier::new(readers + 1));
    thread::scope(|scope| {
        for _ in 0..readers {
            scope.spawn(|| {
                pin(1);
                let mut reader = Q::reader(&shared);
                for _ in 0..groups {
                    start.wait();
                    let mut count = 0;
                    while count < values {
                        match Q::pull(&mut reader) {
                            0 => thread::yield_now(),
                            more => count += more,
                        }
                    }
                    done.wait();
                }
            });
        }
        let mut writer = Q::writer(&shared);
        for _ in 0..groups {
            start.wait();
            let before = crate::measure::allocations();
            let begin = Instant::now();
            for _ in 0..values {
                while !Q::push(&mut writer, black_box(&VALUE)) {
                    thread::yield_now();
                }
            }
            done.wait();
            samples.add_mean(begin.elapsed(), values as u32);
            samples.allocated(values as u64, crate::measure::allocations() - before);
        }
    });
}
