//! Datagrams that come late, twice, out of order, or not at all: a relay between two agents sees to that.
#![cfg(all(feature = "tls", feature = "zenoh"))]
#![allow(clippy::unwrap_used, reason = "a test that fails panics")]
#![allow(clippy::disallowed_methods, reason = "what real networks do takes real time")]

use crate::agents;

use std::collections::BTreeMap;
use std::net::{SocketAddr, UdpSocket};
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};
use std::thread;
use std::time::{Duration, Instant};

use agents::net::port;
use agents::{Agent, Blob, Folder, Number, add, output, wait_for, write};
use slate_blackboard::channel::{Policy, Start};
use slate_blackboard::interface::{Interface, View};
use slate_blackboard::message::Mailbox;
use slate_share::peers::Want;
use slate_share::session::{Compression, DeliveryStatus, Options};

/// Of a hundred datagrams so many are lost, and so many come twice.
const LOST: u64 = 10;
const DOUBLED: u64 = 10;

/// Each is under way for up to this long, so they overtake each other.
const DELAY: u64 = 20;

/// What happened to the datagrams.
#[derive(Default)]
struct Counts {
    lost: AtomicU64,
    doubled: AtomicU64,
    overtaken: AtomicU64,
}

/// A port of this machine that leads to another one, in its own way.
struct Relay {
    port: u16,
    counts: Arc<Counts>,
}

impl Relay {
    /// Whoever sends to it has a socket of its own to the target, by which answers come back.
    fn to(endpoint: &str) -> Self {
        let target: u16 = endpoint.rsplit(':').next().unwrap().parse().unwrap();
        let target = SocketAddr::from(([127, 0, 0, 1], target));
        let (port, counts) = (port(), Arc::<Counts>::default());
        let near = Arc::new(UdpSocket::bind(("127.0.0.1", port)).unwrap());
        let shared = Arc::clone(&counts);
        thread::spawn(move || {
            let mut ways: BTreeMap<SocketAddr, Way> = BTreeMap::new();
            let mut packet = [0; 1 << 16];
            while let Ok((length, from)) = near.recv_from(&mut packet) {
                let way = ways.entry(from).or_insert_with(|| {
                    let far = Arc::new(UdpSocket::bind("127.0.0.1:0").unwrap());
                    let (back, answers, seen) = (Arc::clone(&near), Arc::clone(&far), Arc::clone(&shared));
                    thread::spawn(move || {
                        let mut way = Way::new(back, from, &seen);
                        let mut packet = [0; 1 << 16];
                        while let Ok(length) = answers.recv(&mut packet) {
                            way.carry(&packet[..length]);
                        }
                    });
                    Way::new(far, target, &shared)
                });
                way.carry(&packet[..length]);
            }
        });
        Self { port, counts }
    }

    fn endpoint(&self) -> String {
        format!("zenoh:udp/127.0.0.1:{}", self.port)
    }
}

/// One direction.
struct Way {
    socket: Arc<UdpSocket>,
    to: SocketAddr,
    random: u64,
    latest: Instant,
    counts: Arc<Counts>,
}

impl Way {
    fn new(socket: Arc<UdpSocket>, to: SocketAddr, counts: &Arc<Counts>) -> Self {
        Self { socket, to, random: 0x9e37_79b9, latest: Instant::now(), counts: Arc::clone(counts) }
    }

    /// The same numbers in each run.
    fn below(&mut self, limit: u64) -> u64 {
        self.random =
            self.random.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (self.random >> 33) % limit
    }

    fn carry(&mut self, packet: &[u8]) {
        if self.below(100) < LOST {
            self.counts.lost.fetch_add(1, Ordering::Relaxed);
            return;
        }
        let copies = if self.below(100) < DOUBLED { 2 } else { 1 };
        self.counts.doubled.fetch_add(copies - 1, Ordering::Relaxed);
        for _ in 0..copies {
            let delay = Duration::from_millis(self.below(DELAY));
            let at = Instant::now() + delay;
            self.counts.overtaken.fetch_add(u64::from(at < self.latest), Ordering::Relaxed);
            self.latest = self.latest.max(at);
            let (socket, to, packet) = (Arc::clone(&self.socket), self.to, packet.to_vec());
            thread::spawn(move || {
                thread::sleep(delay);
                // The agent there may have gone.
                let _ = socket.send_to(&packet, to);
            });
        }
    }
}

/// Two agents with a relay between them, which dials `base`.
fn pair() -> (Folder, Relay, Agent, Agent) {
    let folder = Folder::over("udp");
    let base = Agent::listening("base", &folder);
    let relay = Relay::to(&folder.endpoint("base"));
    let arm = Agent::start(folder.setup("arm"));
    arm.peers.connect("base", &relay.endpoint()).unwrap();
    (folder, relay, base, arm)
}

#[test]
fn reliable_queues_come_whole_and_in_order_and_what_is_not_is_counted() {
    let (_folder, relay, base, arm) = pair();
    let mut writer = output(&base.board, "scan/points", 8192);
    let depth = |want: Want| want.expect(Number::DESCRIPTOR, 0).depth(8192);
    arm.peers.subscribe("base", depth(Want::new("scan/points", Options::queue()))).unwrap();
    let (mirror, _) = arm.board.find("agents/base/scan/points").unwrap();
    let mut reader = mirror.channel().unwrap().queue(Policy::Skip, Start::Oldest).unwrap();
    // Another agent wants the same, and nothing again of what is lost.
    let leg = Agent::start(Folder::over("udp").setup("leg"));
    leg.peers.connect("base", &relay.endpoint()).unwrap();
    leg.peers.subscribe("base", depth(Want::new("scan/points", Options::queue().best_effort()))).unwrap();
    let (mirror, _) = leg.board.find("agents/base/scan/points").unwrap();
    let mut lossy = mirror.channel().unwrap().queue(Policy::Skip, Start::Oldest).unwrap();
    wait_for("both", || base.board.find("scan/points").unwrap().0.readers() == 2);
    let (mut next, mut came, mut last) = (1, 0, 0);
    for value in 1..=2000 {
        write(&mut writer, value);
        thread::sleep(Duration::from_micros(500));
    }
    wait_for("the values", || {
        while reader.pull().unwrap() > 0 {
            for loan in reader.window() {
                assert_eq!(u64::from_ne_bytes(loan.bytes()[..8].try_into().unwrap()), next);
                next += 1;
            }
        }
        next > 2000
    });
    assert_eq!(reader.skipped(), 0);
    let count = |what: &str| {
        let path = format!("peers/base/reads/scan/points/{what}");
        leg.board.read(&path).ok().flatten().and_then(|(value, _)| value.as_integer()).unwrap_or_default()
    };
    // The last ones may be among those that are lost, so others follow.
    let mut value = 2000;
    wait_for("an end that arrives", || {
        value += 1;
        write(&mut writer, value);
        while lossy.pull().unwrap() > 0 {
            for loan in lossy.window() {
                let number = u64::from_ne_bytes(loan.bytes()[..8].try_into().unwrap());
                assert!(number > last, "{number} after {last}");
                (came, last) = (came + 1, number);
            }
        }
        last > 2000
    });
    wait_for("the counts", || count("received") + count("lost") >= last.into());
    assert!(came < last, "nothing was lost");
    assert_eq!(came + lossy.skipped(), last, "what a reader has not got is counted, each once");
    let counts = &relay.counts;
    for (what, number) in
        [("lost", &counts.lost), ("doubled", &counts.doubled), ("overtaken", &counts.overtaken)]
    {
        let number = number.load(Ordering::Relaxed);
        println!("{number} datagrams were {what}");
        assert!(number > 20, "the test is about datagrams that are {what}");
    }
}

#[test]
fn messages_arrive_once_each_and_in_order() {
    let (_folder, _relay, base, arm) = pair();
    wait_for("a connection", || arm.peers.is_connected("base"));
    let mailbox = Mailbox::new(Number::DESCRIPTOR.shape(0), 16, 16);
    base.board.add_mailbox("drive/commands", "Commands.", Number::DESCRIPTOR, mailbox.clone()).unwrap();
    let mut receiver = mailbox.receiver().unwrap();
    for round in 0..10 {
        let send = |value| {
            let mut number = Number { value: round * 10 + value };
            let bytes = View::of(&mut number);
            arm.peers.send("base", "drive/commands", Number::DESCRIPTOR.hash, 0, bytes.bytes()).unwrap()
        };
        let answers: Vec<_> = (0..10).map(send).collect();
        for answer in answers {
            assert_eq!(answer.recv_timeout(Duration::from_secs(20)), Ok(DeliveryStatus::Accepted));
        }
        assert_eq!(receiver.collect(), 10);
        let values: Vec<_> = receiver.messages().map(|message| u64::from(message.bytes()[0])).collect();
        assert_eq!(values, (round * 10..round * 10 + 10).collect::<Vec<_>>());
        receiver.release();
    }
}

#[test]
fn a_large_value_is_put_together_again() {
    let (_folder, _relay, base, arm) = pair();
    let size = 256 << 10;
    let property = add(&base.board, "camera/blob", Blob::DESCRIPTOR, size, 4);
    let mut writer = property.channel().unwrap().writer().unwrap();
    let options = Options::queue().compression(Compression::None);
    arm.peers.subscribe("base", Want::new("camera/blob", options)).unwrap();
    for number in 1..=5_u64 {
        let mut bytes = number.to_ne_bytes().to_vec();
        bytes.extend((0..size).map(|i| ((i as u64 * 31 * number) >> 3) as u8));
        writer.write(&bytes, size, 0).unwrap();
        wait_for("the blob", || {
            let came = arm.newest("agents/base/camera/blob");
            came.is_some_and(|(came, items)| items == size && came[..bytes.len()] == bytes[..])
        });
    }
}
