//! Hostile bytes: an agent continues, its memory stays bounded, and afterwards all is as it should be.
#![allow(clippy::unwrap_used, reason = "a test that fails panics")]
#![allow(unsafe_code, reason = "memory is counted where it is allocated")]

mod agents;
#[path = "../../../fuzz/src/memory.rs"]
mod memory;

use std::sync::Arc;

use agents::{Blob, Number, add, output};
use proptest::prelude::*;
use slate_blackboard::Board;
use slate_blackboard::channel::Writer;
use slate_blackboard::interface::{Interface, View};
use slate_blackboard::wake::Wake;
use slate_share::peers::{Peer, WantedProperty};
use slate_share::session::{
    Application, Compression, Event, Identity, Limits, Options, Sample, Session, VERSION,
};

/// What the agents of these tests may take together: each has an interface, a few streams and values of at most 64 KiB.
const BOUND: usize = 64 << 20;

fn limits() -> Limits {
    Limits { value: 64 << 10, control: 64 << 10, ..Limits::default() }
}

struct Nothing;

impl Application for Nothing {
    fn event(&mut self, _: Event) {}
}

/// Two agents, each of which reads from the other.
struct Pair {
    boards: [Arc<Board>; 2],
    peers: [Peer; 2],
    values: [Writer; 2],
    blobs: [Writer; 2],
    written: u64,
    now: u64,
}

impl Pair {
    fn new() -> Self {
        let boards = ["base", "arm"].map(|name| Arc::new(Board::new(name)));
        let values = [0, 1].map(|i: usize| output(&boards[i], "out/value", 16));
        let blobs = [0, 1].map(|i: usize| {
            add(&boards[i], "out/blob", Blob::DESCRIPTOR, 8192, 2).channel().unwrap().writer().unwrap()
        });
        let peer = |own: usize, name: &str, other: &str| {
            let identity = Identity { agent: name.into(), instance: own as u64 + 1 };
            let mut peer = Peer::new(&boards[own], identity, other, limits(), &Arc::new(Wake::new()));
            let blob = Options::default().compression(Compression::Lossless);
            peer.subscribe(WantedProperty::new("out/value", Options::queue())).unwrap();
            peer.subscribe(WantedProperty::new("out/blob", blob)).unwrap();
            peer.subscribe(WantedProperty::new("out/missing", Options::default().best_effort())).unwrap();
            peer
        };
        let peers = [peer(0, "base", "arm"), peer(1, "arm", "base")];
        Self { boards, peers, values, blobs, written: 0, now: 0 }
    }

    fn write(&mut self) {
        self.written += 1;
        let mut number = Number { value: self.written };
        let mut blob = self.written.to_ne_bytes().to_vec();
        blob.resize(8 + 4096, self.written as u8);
        for i in [0, 1] {
            self.values[i].write(View::of(&mut number).bytes(), 0, self.now).unwrap();
            self.blobs[i].write(&blob, 4096, self.now).unwrap();
        }
    }

    /// A millisecond in which packets pass through `way`.
    fn step(&mut self, mut way: impl FnMut(Vec<u8>) -> Option<Vec<u8>>) {
        self.now += 1_000_000;
        for from in [0, 1] {
            self.peers[from].tick(self.now);
            let mut packet = Vec::new();
            for _ in 0..8 {
                if !self.peers[from].outgoing(self.now, 1200, &mut packet, None) {
                    break;
                }
                if let Some(packet) = way(packet.clone()) {
                    self.peers[1 - from].receive(self.now, &packet, None);
                }
            }
        }
    }

    fn shown(&self, own: usize, path: &str) -> Option<u64> {
        let (property, _) = self.boards[own].get(&format!("agents/{}/{path}", ["arm", "base"][own]))?;
        let (bytes, ..) = property.newest().unwrap()?;
        Some(u64::from_ne_bytes(bytes[..8].try_into().unwrap()))
    }
}

/// What happens to a packet.
#[derive(Clone, Debug)]
enum Damage {
    Flip(usize, u8),
    Cut(usize),
    Put(usize, Vec<u8>),
    Repeat(usize, usize),
}

fn damage() -> impl Strategy<Value = Damage> {
    prop_oneof![
        (any::<usize>(), 1..=255_u8).prop_map(|(at, bits)| Damage::Flip(at, bits)),
        any::<usize>().prop_map(Damage::Cut),
        (any::<usize>(), prop::collection::vec(any::<u8>(), 1..12))
            .prop_map(|(at, bytes)| Damage::Put(at, bytes)),
        (any::<usize>(), any::<usize>()).prop_map(|(at, length)| Damage::Repeat(at, length)),
    ]
}

fn harm(packet: &mut Vec<u8>, damage: &Damage) {
    // The head says whose packet it is; what is behind it is more worth the damage.
    let place =
        |at: usize, length: usize| if length > 18 { 18 + at % (length - 18) } else { at % length.max(1) };
    match damage {
        Damage::Flip(at, bits) => {
            let at = place(*at, packet.len());
            packet[at] ^= bits;
        }
        Damage::Cut(at) => packet.truncate(place(*at, packet.len())),
        Damage::Put(at, bytes) => {
            let at = place(*at, packet.len());
            packet.splice(at..at, bytes.iter().copied());
        }
        Damage::Repeat(at, length) => {
            let at = place(*at, packet.len());
            let part = packet[at..(at + length % 64).min(packet.len())].to_vec();
            packet.splice(at..at, part);
        }
    }
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 96, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn any_bytes_leave_a_session_as_it_is(packets in prop::collection::vec(prop::collection::vec(any::<u8>(), 0..200), 1..50)) {
        let identity = Identity { agent: "base".into(), instance: 1 };
        let mut session = Session::new(identity, None, limits());
        for (packet, now) in packets.iter().zip(1..) {
            session.receive(now, packet, &mut Nothing);
            let mut known = vec![b'S', VERSION];
            known.extend(packet);
            session.receive(now, &known, &mut Nothing);
        }
        prop_assert!(session.other().is_none());
        prop_assert_eq!(session.counters().packets_received, 2 * packets.len() as u64);
    }

    #[test]
    fn damaged_packets_leave_no_damage(
        storm in prop::collection::vec((0_usize..4, damage()), 50..250),
    ) {
        let mut pair = Pair::new();
        (0..60).for_each(|_| pair.step(Some));
        let mut next = 0;
        for _ in 0..storm.len() / 2 {
            pair.write();
            pair.step(|mut packet| {
                let (rare, damage) = &storm[next % storm.len()];
                next += 1;
                if *rare == 0 {
                    harm(&mut packet, damage);
                }
                Some(packet)
            });
        }
        // Both see that the other one is silent, so nothing of what was damaged is left.
        (0..400).for_each(|_| pair.step(|_| None));
        (0..400).for_each(|_| pair.step(Some));
        // A number that was damaged may say that a value was seen which was not, but not one that is written from now on.
        pair.write();
        (0..50).for_each(|_| pair.step(Some));
        for own in [0, 1] {
            prop_assert_eq!(pair.shown(own, "out/value"), Some(pair.written));
            prop_assert_eq!(pair.shown(own, "out/blob"), Some(pair.written));
        }
        prop_assert!(memory::most() < BOUND, "{} bytes", memory::most());
    }
}

#[test]
fn another_version_is_refused_in_words() {
    let identity = Identity { agent: "base".into(), instance: 1 };
    let mut session = Session::new(identity, None, limits());
    let mut hello = Vec::new();
    assert!(session.outgoing(1, 1200, &mut hello, &mut Nothing));
    let mut other = Session::new(Identity { agent: "arm".into(), instance: 2 }, None, limits());
    hello[1] = 9;
    other.receive(1, &hello, &mut Nothing);
    let mut refusal = Vec::new();
    assert!(other.outgoing(1, 1200, &mut refusal, &mut Nothing));
    session.receive(2, &refusal, &mut Nothing);
    let reason = format!(
        "agent `arm` speaks version {VERSION} of the sharing protocol and got version 9: let both agents run the same release"
    );
    assert_eq!(session.refused(), Some(&*reason));
}

/// An agent that is connected and says what no honest one does. Tuples stand for frames and messages, as they are written
/// the same way.
struct Hostile {
    session: Session,
    head: Vec<u8>,
    values: Vec<Vec<u8>>,
}

impl Application for Hostile {
    fn event(&mut self, _: Event) {}
    fn sample(&mut self, _: u32, _: &Sample, _: u64, content: &[u8]) {
        self.values.push(content.to_vec());
    }
    fn has_update(&mut self, _: u32) -> bool {
        false
    }
    fn take(&mut self, _: u32, _: &mut Vec<u8>) -> Option<Sample> {
        None
    }
}

impl Hostile {
    /// To an agent that has subscribed.
    fn new(options: Options) -> Self {
        let identity = Identity { agent: "base".into(), instance: 1 };
        let mut session = Session::new(identity, None, limits());
        session.subscribe("out/value", options).unwrap();
        let mut greeting = Vec::new();
        assert!(session.outgoing(1, 1200, &mut greeting, &mut Nothing));
        let head = [&greeting[..2], &9_u64.to_le_bytes(), &greeting[2..10]].concat();
        let mut hostile = Self { session, head, values: Vec::new() };
        hostile.say(&(0_u8, "arm", 7_u64, 1_u64));
        assert!(hostile.session.other().is_some());
        hostile
    }

    fn say(&mut self, frame: &impl serde::Serialize) {
        let packet = postcard::to_extend(frame, self.head.clone()).unwrap();
        let identity = Identity { agent: "none".into(), instance: 0 };
        let mut session = std::mem::replace(&mut self.session, Session::new(identity, None, limits()));
        session.receive(2, &packet, self);
        self.session = session;
    }

    fn fragment(&mut self, stream: u32, number: u64, (index, count): (u32, u32), bytes: &[u8]) {
        self.say(&(2_u8, stream, number, index, count, bytes));
    }

    /// Offers the values after that number.
    fn offer(&mut self, number: u64, epoch: u32, after: u64) {
        let offer = ("out/value", [0_u8; 0].as_slice(), "", "", 0_u64, 1_u32, after);
        let message = postcard::to_allocvec(&(2_u8, 1_u32, epoch, offer)).unwrap();
        self.fragment(0, number, (0, 1), &message);
    }

    /// What the agent has to say to all of that.
    fn receive(&mut self) {
        let mut packet = Vec::new();
        while self.session.outgoing(3, 1200, &mut packet, &mut Nothing) {}
    }
}

#[test]
fn the_last_numbers_there_are_end_nothing() {
    let mut hostile = Hostile::new(Options::queue());
    for stream in [0, 1] {
        for number in [u64::MAX - 2, u64::MAX - 1, u64::MAX] {
            hostile.fragment(stream, number, (0, 1), b"x");
            hostile.say(&(3_u8, stream, number, number, number, 0_u32));
            hostile.say(&(4_u8, stream, number, vec![(0_u64, number)]));
            hostile.receive();
        }
    }
    assert!(hostile.session.other().is_some());
}

#[test]
fn losses_beyond_all_numbers_are_counted_as_many() {
    let mut hostile = Hostile::new(Options::queue());
    for (number, after) in [0, u64::MAX, 0, u64::MAX].into_iter().enumerate() {
        hostile.offer(number as u64 + 1, number as u32 + 1, after);
    }
    assert_eq!(hostile.session.progress(1).unwrap().lost, u64::MAX);
}

#[test]
fn a_value_in_more_pieces_than_bytes_is_refused() {
    let mut hostile = Hostile::new(Options::default().best_effort());
    for index in 0..1000 {
        hostile.fragment(1, 1 + u64::from(index), (index, u32::MAX), b"");
    }
    assert_eq!(hostile.session.counters().malformed, 1000);
}

#[test]
fn a_piece_that_comes_again_counts_once() {
    let mut hostile = Hostile::new(Options::default().best_effort());
    hostile.offer(1, 1, 0);
    let mut head = [0; 37];
    (head[0], head[8], head[28], head[33]) = (1, 1, 8, 1);
    hostile.fragment(1, 1, (0, 2), &head);
    // Longer each time, for as long as anybody listens.
    for length in 0..100 {
        hostile.fragment(1, 1, (0, 2), &vec![7; length * 500]);
    }
    hostile.fragment(1, 2, (1, 2), b"12345678");
    assert_eq!(hostile.values, [b"12345678"]);
}
