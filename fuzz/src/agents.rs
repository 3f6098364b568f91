//! The agents that bytes are sent to, without threads and clocks.

use std::sync::Arc;

use slate_blackboard::channel::{Budget, Writer};
use slate_blackboard::interface::{Descriptor, Interface, View};
use slate_blackboard::message::Mailbox;
use slate_blackboard::wake::Wake;
use slate_blackboard::{Access, Board, Property, Store};
use slate_module::interface;
use slate_share::peers::{Peer, WantedProperty};
use slate_share::session::{Compression, Identity, Limits, Options};

/// A number.
#[interface]
pub struct Number {
    /// The number.
    pub value: u64,
}

/// Many bytes.
#[interface]
pub struct Blob {
    /// Value that was written.
    pub number: u64,
    /// The bytes.
    pub data: [u8],
}

/// Returns the limits of a session of these agents.
pub fn limits() -> Limits {
    Limits { value: 64 << 10, control: 64 << 10, subscriptions: 16, ..Limits::default() }
}

/// Upper bound of an agent's memory under any input, bytes.
/// Its board, a few streams and values of at most 64 KiB.
pub const BOUND: usize = 48 << 20;

/// An agent that has something to read, and reads from another one.
pub struct Agent {
    /// Its properties.
    pub board: Arc<Board>,
    /// The other agent, as it sees it.
    pub peer: Peer,
    value: Writer,
    blob: Writer,
    other: &'static str,
}

fn add(board: &Board, path: &str, descriptor: &'static Descriptor, capacity: usize) -> Arc<Property> {
    let store = Store { capacity, depth: 8, budget: Budget { latest: 4, queues: 4, window: 64 } };
    board.add_channel(path, "A test.", descriptor, store, Access::Output).expect("the path is free")
}

fn writer(property: &Property) -> Writer {
    property.channel().expect("it has values").writer().expect("nobody else writes")
}

impl Agent {
    /// Creates an agent of that name that reads from another one.
    /// The value of `out/other` that it reads may be anything.
    pub fn new(name: &str, other: &'static str, instance: u64) -> Self {
        let board = Arc::new(Board::new(name));
        let value = writer(&add(&board, "out/value", Number::DESCRIPTOR, 0));
        let blob = writer(&add(&board, "out/blob", Blob::DESCRIPTOR, 8192));
        let mailbox = Mailbox::new(Number::DESCRIPTOR.shape(0), 2, 4);
        board.add_mailbox("in/mail", "A test.", Number::DESCRIPTOR, mailbox).expect("the path is free");
        let identity = Identity { agent: name.into(), instance };
        let mut peer = Peer::new(&board, identity, other, limits(), &Arc::new(Wake::new()));
        let blobs = Options::default().compression(Compression::Lossless);
        for want in [
            WantedProperty::new("out/value", Options::queue()).expect(Number::DESCRIPTOR, 0),
            WantedProperty::new("out/blob", blobs).expect(Blob::DESCRIPTOR, 8192),
            WantedProperty::new("out/other", Options::default().best_effort()),
        ] {
            peer.subscribe(want).expect("there is room");
        }
        Self { board, peer, value, blob, other }
    }

    /// Writes a number to all that others may read.
    pub fn write(&mut self, number: u64, time: u64) {
        self.value.write(View::of(&mut Number { value: number }).bytes(), 0, time).expect("it fits");
        let mut blob = number.to_ne_bytes().to_vec();
        blob.resize(8 + 2048, number as u8);
        self.blob.write(&blob, 2048, time).expect("it fits");
    }

    /// The number that it has read last at that path of the other one.
    pub fn shown(&self, path: &str) -> Option<u64> {
        let (property, _) = self.board.get(&format!("agents/{}/{path}", self.other))?;
        let (bytes, ..) = property.newest().ok()??;
        Some(u64::from_ne_bytes(*bytes.first_chunk()?))
    }

    /// Its next packet.
    pub fn outgoing(&mut self, now: u64) -> Option<Vec<u8>> {
        let mut packet = Vec::new();
        self.peer.outgoing(now, 1200, &mut packet, None).then_some(packet)
    }
}

/// Nanoseconds of a millisecond.
pub const MILLISECOND: u64 = 1_000_000;

/// Lets two agents recover after any input.
/// After a silence they connect and read each other's values.
///
/// # Panics
/// When they do not.
pub fn recover(one: &mut Agent, other: &mut Agent, mut now: u64) {
    now += 1000 * MILLISECOND;
    one.peer.tick(now);
    other.peer.tick(now);
    let number = 0x51a7e;
    one.write(number, now);
    other.write(number, now);
    for _ in 0..300 {
        now += 5 * MILLISECOND;
        one.peer.tick(now);
        other.peer.tick(now);
        while let Some(packet) = one.outgoing(now) {
            other.peer.receive(now, &packet, None);
        }
        while let Some(packet) = other.outgoing(now) {
            one.peer.receive(now, &packet, None);
        }
        let is_there = |agent: &Agent| {
            agent.shown("out/value") == Some(number) && agent.shown("out/blob") == Some(number)
        };
        if is_there(one) && is_there(other) {
            return;
        }
    }
    panic!("the agents do not read from each other any more");
}
