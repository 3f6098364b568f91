//! Newest value of a property, from one writer to readers that poll.

use std::hint::black_box;
use std::mem::MaybeUninit;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Barrier, Mutex, RwLock};
use std::thread;
use std::time::{Duration, Instant};

use arc_swap::ArcSwap;
use iceoryx2::prelude::*;
use slate_blackboard::Shape;
use slate_blackboard::channel::{Budget, Channel, Latest, Writer};
use tokio::sync::watch;

use crate::machine::pin;
use crate::measure::{Contest, Effort, Samples, consume};
use crate::table::{Role, Table};

const WORK: &str = "latest value";

/// A value.
#[repr(C, align(8))]
#[derive(Clone, Copy, Debug)]
pub struct Bytes<const SIZE: usize>(pub [u8; SIZE]);

// SAFETY: bytes without pointers.
unsafe impl<const SIZE: usize> ZeroCopySend for Bytes<SIZE> {}

/// Scheme of handing values over.
/// Shared parts are made first, the writer and the readers in their threads.
trait Scheme<const SIZE: usize> {
    const NAME: &'static str;
    const ROLE: Role;
    type Shared: Sync;
    type Writer;
    type Reader;

    fn share(readers: usize) -> Self::Shared;
    fn writer(shared: &Self::Shared) -> Self::Writer;
    fn reader(shared: &Self::Shared) -> Self::Reader;
    fn write(writer: &mut Self::Writer, value: &Bytes<SIZE>);
    /// Looks at the first and the last byte of the newest value.
    fn read(reader: &mut Self::Reader) -> u8;
}

fn ends(bytes: &[u8]) -> u8 {
    bytes[0] ^ bytes[bytes.len() - 1]
}

struct Slate;

impl<const SIZE: usize> Scheme<SIZE> for Slate {
    const NAME: &'static str = "Slate, lent";
    const ROLE: Role = Role::Slate;
    type Shared = Arc<Channel>;
    type Writer = Writer;
    type Reader = Latest;

    fn share(readers: usize) -> Arc<Channel> {
        let budget = Budget { latest: readers as u16, queues: 0, window: 0 };
        Channel::new(Shape::fixed(SIZE, 8), 1, budget)
    }

    fn writer(shared: &Arc<Channel>) -> Writer {
        shared.writer().expect("a new channel has no writer")
    }

    fn reader(shared: &Arc<Channel>) -> Latest {
        shared.latest().expect("the budget is as large")
    }

    #[inline]
    fn write(writer: &mut Writer, value: &Bytes<SIZE>) {
        let _ = black_box(writer.write(&value.0, 0, 0));
    }

    #[inline]
    fn read(reader: &mut Latest) -> u8 {
        reader.refresh();
        reader.value().map_or(0, |loan| ends(loan.bytes()))
    }
}

struct Swapped;

impl<const SIZE: usize> Scheme<SIZE> for Swapped {
    const NAME: &'static str = "arc-swap, a new Arc for each";
    const ROLE: Role = Role::Peer;
    type Shared = Arc<ArcSwap<Bytes<SIZE>>>;
    type Writer = Arc<ArcSwap<Bytes<SIZE>>>;
    type Reader = Arc<ArcSwap<Bytes<SIZE>>>;

    fn share(_: usize) -> Self::Shared {
        Arc::new(ArcSwap::new(fresh(&Bytes([0; SIZE]))))
    }

    fn writer(shared: &Self::Shared) -> Self::Writer {
        Arc::clone(shared)
    }

    fn reader(shared: &Self::Shared) -> Self::Reader {
        Arc::clone(shared)
    }

    #[inline]
    fn write(writer: &mut Self::Writer, value: &Bytes<SIZE>) {
        writer.store(fresh(value));
    }

    #[inline]
    fn read(reader: &mut Self::Reader) -> u8 {
        ends(&reader.load().0)
    }
}

/// A copy on the heap that never was on the stack.
fn fresh<const SIZE: usize>(value: &Bytes<SIZE>) -> Arc<Bytes<SIZE>> {
    let mut fresh = Arc::new_uninit();
    if let Some(place) = Arc::get_mut(&mut fresh) {
        let place: &mut MaybeUninit<Bytes<SIZE>> = place;
        // SAFETY: both are valid for the size of a value, and the new one has no other user.
        unsafe { place.as_mut_ptr().copy_from_nonoverlapping(value, 1) };
    }
    // SAFETY: a new `Arc` is unique, so it was written above.
    unsafe { fresh.assume_init() }
}

/// Lock and copy per reader, as in Fawkes.
struct Locked;

impl<const SIZE: usize> Scheme<SIZE> for Locked {
    const NAME: &'static str = "RwLock and a copy (Fawkes)";
    const ROLE: Role = Role::Peer;
    type Shared = Arc<RwLock<Box<[u8]>>>;
    type Writer = Arc<RwLock<Box<[u8]>>>;
    type Reader = (Arc<RwLock<Box<[u8]>>>, Box<[u8]>);

    fn share(_: usize) -> Self::Shared {
        Arc::new(RwLock::new(vec![0; SIZE].into()))
    }

    fn writer(shared: &Self::Shared) -> Self::Writer {
        Arc::clone(shared)
    }

    fn reader(shared: &Self::Shared) -> Self::Reader {
        (Arc::clone(shared), vec![0; SIZE].into())
    }

    #[inline]
    fn write(writer: &mut Self::Writer, value: &Bytes<SIZE>) {
        writer.write().expect("nobody panics with it").copy_from_slice(&value.0);
    }

    #[inline]
    fn read((lock, own): &mut Self::Reader) -> u8 {
        own.copy_from_slice(&lock.read().expect("nobody panics with it"));
        ends(own)
    }
}

struct Watched;

impl<const SIZE: usize> Scheme<SIZE> for Watched {
    const NAME: &'static str = "tokio watch, in place";
    const ROLE: Role = Role::Peer;
    type Shared = (Mutex<Option<watch::Sender<Box<[u8]>>>>, watch::Receiver<Box<[u8]>>);
    type Writer = watch::Sender<Box<[u8]>>;
    type Reader = watch::Receiver<Box<[u8]>>;

    fn share(_: usize) -> Self::Shared {
        let (sender, receiver) = watch::channel(vec![0; SIZE].into());
        (Mutex::new(Some(sender)), receiver)
    }

    fn writer(shared: &Self::Shared) -> Self::Writer {
        shared.0.lock().ok().and_then(|mut sender| sender.take()).expect("there is one writer")
    }

    fn reader(shared: &Self::Shared) -> Self::Reader {
        shared.1.clone()
    }

    #[inline]
    fn write(writer: &mut Self::Writer, value: &Bytes<SIZE>) {
        writer.send_modify(|place| place.copy_from_slice(&value.0));
    }

    #[inline]
    fn read(reader: &mut Self::Reader) -> u8 {
        ends(&reader.borrow_and_update())
    }
}

/// The blackboard of iceoryx2 within a process: readers copy the value out.
struct Iceoryx;

type Board = iceoryx2::service::port_factory::blackboard::PortFactory<ipc::Service, u64>;

impl<const SIZE: usize> Scheme<SIZE> for Iceoryx {
    const NAME: &'static str = "iceoryx2 blackboard, copied";
    const ROLE: Role = Role::Peer;
    type Shared = (Node<ipc::Service>, Board);
    type Writer = iceoryx2::port::writer::EntryHandleMut<ipc::Service, u64, Bytes<SIZE>>;
    type Reader = iceoryx2::port::reader::EntryHandle<ipc::Service, u64, Bytes<SIZE>>;

    fn share(readers: usize) -> Self::Shared {
        let (node, name) = super::iceoryx::node("latest");
        let board = node.service_builder(&name).blackboard_creator::<u64>().max_readers(readers);
        let board = board.add::<Bytes<SIZE>>(0, Bytes([0; SIZE])).create();
        (node, board.expect("a new service"))
    }

    fn writer(shared: &Self::Shared) -> Self::Writer {
        let writer = shared.1.writer_builder().create().expect("there is one writer");
        writer.entry(&0).expect("the entry was added")
    }

    fn reader(shared: &Self::Shared) -> Self::Reader {
        let reader = shared.1.reader_builder().create().expect("there are so many readers");
        reader.entry(&0).expect("the entry was added")
    }

    #[inline]
    fn write(writer: &mut Self::Writer, value: &Bytes<SIZE>) {
        writer.update_with_copy(*value);
    }

    #[inline]
    fn read(reader: &mut Self::Reader) -> u8 {
        ends(&reader.get().0)
    }
}

/// Measures all lines.
pub fn run(effort: Effort, table: &mut Table) {
    // Values of a megabyte are returned over the stack.
    super::with_large_stack(|| {
        size::<64>(effort, table);
        size::<4096>(effort, table);
        size::<{ 1 << 20 }>(effort, table);
    });
}

fn size<const SIZE: usize>(effort: Effort, table: &mut Table) {
    pin(0);
    for readers in [1, 8] {
        let name = format!("{SIZE} B written, {readers} readers that hold a value");
        contest::<SIZE, _>(effort, table, &name, |kind| alone_writing(kind, readers, effort));
    }
    contest::<SIZE, _>(effort, table, &format!("{SIZE} B read, nothing new"), |kind| {
        alone_reading(kind, false, effort)
    });
    contest::<SIZE, _>(effort, table, &format!("{SIZE} B written and read"), |kind| {
        alone_reading(kind, true, effort)
    });
    for readers in [1, 8] {
        let side = format!("{readers} readers on another core as fast as they can");
        for writes in [true, false] {
            let what = if writes { "written" } else { "read" };
            let name = format!("{SIZE} B {what}, {side}");
            contest::<SIZE, _>(effort, table, &name, |kind| contended(kind, readers, writes, effort));
        }
    }
}

/// Scheme without its types.
trait Kind<const SIZE: usize> {
    fn name(&self) -> &'static str;
    fn role(&self) -> Role;
    fn writing(&self, readers: usize, bursts: usize, samples: &mut Samples);
    fn reading(&self, always_new: bool, bursts: usize, samples: &mut Samples);
    fn both(&self, readers: usize, writes: bool, time: Duration, samples: &mut Samples);
}

/// Returns the operations per sample.
/// A clock is too slow for a single small one.
fn burst(size: usize) -> u32 {
    (1 << 14 >> size.ilog2()).clamp(1, 64)
}

impl<S: Scheme<SIZE>, const SIZE: usize> Kind<SIZE> for S {
    fn name(&self) -> &'static str {
        S::NAME
    }

    fn role(&self) -> Role {
        S::ROLE
    }

    fn writing(&self, readers: usize, bursts: usize, samples: &mut Samples) {
        let shared = S::share(readers);
        let (mut writer, value) = (S::writer(&shared), fresh(&Bytes([1; SIZE])));
        let mut readers: Vec<_> = (0..readers).map(|_| S::reader(&shared)).collect();
        S::write(&mut writer, &value);
        readers.iter_mut().for_each(|reader| consume(S::read(reader)));
        for _ in 0..bursts {
            samples.burst(burst(SIZE), |_| S::write(&mut writer, black_box(&value)));
        }
    }

    fn reading(&self, always_new: bool, bursts: usize, samples: &mut Samples) {
        let shared = S::share(1);
        let (mut writer, mut reader) = (S::writer(&shared), S::reader(&shared));
        let value = fresh(&Bytes([1; SIZE]));
        S::write(&mut writer, &value);
        for _ in 0..bursts {
            samples.burst(burst(SIZE), |_| {
                if always_new {
                    S::write(&mut writer, black_box(&value));
                }
                black_box(S::read(&mut reader));
            });
        }
    }

    fn both(&self, readers: usize, writes: bool, time: Duration, samples: &mut Samples) {
        let shared = S::share(readers);
        let (stop, start) = (AtomicBool::new(false), Barrier::new(readers + 1));
        thread::scope(|scope| {
            let read = || {
                pin(1);
                let mut reader = S::reader(&shared);
                start.wait();
                let mut samples = Samples::new();
                while !stop.load(Ordering::Relaxed) {
                    samples.burst(burst(SIZE), |_| consume(S::read(&mut reader)));
                }
                samples
            };
            let threads: Vec<_> = (0..readers)
                .map(|_| super::large_stack().spawn_scoped(scope, read).expect("a thread can be started"))
                .collect();
            let (mut writer, value) = (S::writer(&shared), fresh(&Bytes([1; SIZE])));
            start.wait();
            let mut written = Samples::new();
            let begin = Instant::now();
            while begin.elapsed() < time {
                written.burst(burst(SIZE), |_| S::write(&mut writer, black_box(&value)));
            }
            stop.store(true, Ordering::Relaxed);
            let read = threads.into_iter().filter_map(|thread| thread.join().ok());
            if writes {
                samples.join(&written);
            } else {
                read.for_each(|read| samples.join(&read));
            }
        });
    }
}

fn alone_writing<const SIZE: usize>(
    kind: &'static dyn Kind<SIZE>,
    readers: usize,
    effort: Effort,
) -> impl FnMut(&mut Samples) {
    move |samples| kind.writing(readers, effort.count(if SIZE > 1 << 16 { 300 } else { 3000 }), samples)
}

fn alone_reading<const SIZE: usize>(
    kind: &'static dyn Kind<SIZE>,
    always_new: bool,
    effort: Effort,
) -> impl FnMut(&mut Samples) {
    move |samples| kind.reading(always_new, effort.count(if SIZE > 1 << 16 { 300 } else { 3000 }), samples)
}

fn contended<const SIZE: usize>(
    kind: &'static dyn Kind<SIZE>,
    readers: usize,
    writes: bool,
    effort: Effort,
) -> impl FnMut(&mut Samples) {
    move |samples| kind.both(readers, writes, effort.time(Duration::from_millis(150)), samples)
}

fn contest<const SIZE: usize, Round: FnMut(&mut Samples) + 'static>(
    effort: Effort,
    table: &mut Table,
    line: &str,
    round: impl Fn(&'static dyn Kind<SIZE>) -> Round,
) {
    let mut contest = Contest::new(WORK, line);
    let kinds: [&'static dyn Kind<SIZE>; 5] = [&Slate, &Swapped, &Locked, &Watched, &Iceoryx];
    for kind in kinds {
        contest.with(kind.name(), kind.role(), round(kind));
    }
    contest.run(effort, table);
}
