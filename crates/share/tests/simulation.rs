//! Agents in a network that loses, doubles, delays and is cut, with clocks hours apart; some are started again. All
//! time is virtual and all chance comes from a seed, so what is found can be found again.
#![allow(clippy::unwrap_used, reason = "a test that fails panics")]

use std::sync::Arc;

use slate_blackboard::channel::{Budget, Policy, QueueReader, Start, Writer};
use slate_blackboard::interface::View;
use slate_blackboard::wake::Wake;
use slate_blackboard::{Access, Board, Store};
use slate_module::{Interface, interface};
use slate_share::peers::{Peer, WantedProperty};
use slate_share::session::{Identity, Limits, Options};
use slate_sorted::SortedMap;

/// Which start of its agent wrote a value, and which of its values it is.
#[interface]
#[derive(PartialEq)]
struct Count {
    /// Counts the starts of the agent.
    life: u64,
    /// Counts the values of this life.
    number: u64,
}

const MILLISECOND: u64 = 1_000_000;
const LARGEST: usize = 1200;
const QUEUE: usize = 64;

struct Chance(u64);

impl Chance {
    fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut mixed = self.0;
        mixed = (mixed ^ (mixed >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        mixed = (mixed ^ (mixed >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        mixed ^ (mixed >> 31)
    }

    fn below(&mut self, limit: u64) -> u64 {
        self.next() % limit
    }

    fn happens(&mut self, percent: u64) -> bool {
        self.below(100) < percent
    }
}

struct Agent {
    board: Arc<Board>,
    skew: u64,
    life: u64,
    value: Writer,
    queue: Writer,
    written: u64,
    peers: SortedMap<usize, Other>,
}

/// Another agent, and what was seen of it here.
struct Other {
    peer: Peer,
    value: u32,
    queue: u32,
    effort: u32,
    values: Seen,
    queues: Seen,
    efforts: Seen,
}

/// What a mirror showed.
struct Seen {
    reader: QueueReader,
    last: (u64, u64),
    count: u64,
    /// How many values of the same life lie between those that were shown.
    missed: u64,
}

fn name(agent: usize) -> String {
    format!("robot-{agent}")
}

fn bytes(count: &Count) -> Vec<u8> {
    let mut count = *count;
    View::of(&mut count).bytes().to_vec()
}

impl Seen {
    fn new(board: &Board, path: &str) -> Self {
        let (property, _) = board.find(path).unwrap();
        let reader = property.channel().unwrap().queue(Policy::Skip, Start::Oldest).unwrap();
        Self { reader, last: (0, 0), count: 0, missed: 0 }
    }

    /// Looks at what came, which never goes back.
    fn look(&mut self) {
        let mut same_life = true;
        while self.reader.pull().unwrap() > 0 {
            for loan in self.reader.window() {
                let number = |at: usize| u64::from_ne_bytes(loan.bytes()[at..at + 8].try_into().unwrap());
                let now = (number(0), number(8));
                assert!(now > self.last, "{now:?} was shown after {:?}", self.last);
                if now.0 > self.last.0 {
                    self.count = 0;
                    same_life = false;
                } else {
                    self.missed += now.1 - self.last.1 - 1;
                }
                self.last = now;
                self.count += 1;
            }
        }
        if same_life {
            assert_eq!(self.reader.skipped(), self.missed, "the reader is told of all that did not come");
        }
        self.missed = self.reader.skipped();
    }
}

impl Agent {
    fn new(own: usize, agents: usize, life: u64, skew: u64) -> Self {
        let board = Arc::new(Board::new(&name(own)));
        let budget = Budget { latest: 16, queues: 16, window: 16 };
        let add = |path: &str, depth| {
            let store = Store { capacity: 0, depth, budget };
            board.add_channel(path, "Counts.", Count::DESCRIPTOR, store, Access::Output).unwrap()
        };
        let value = add("out/value", 1).channel().unwrap().writer().unwrap();
        let queue = add("out/queue", QUEUE).channel().unwrap().writer().unwrap();
        let identity = Identity { agent: name(own), instance: life * 1000 + own as u64 };
        let others = (0..agents).filter(|other| *other != own);
        let peers = others
            .map(|other| {
                let wake = Arc::new(Wake::new());
                let mut peer = Peer::new(&board, identity.clone(), &name(other), Limits::default(), &wake);
                let mut want = |path: &str, options| {
                    let want = WantedProperty::new(path, options).expect(Count::DESCRIPTOR, 0).depth(1024);
                    peer.subscribe(want).unwrap()
                };
                let value = want("out/value", Options::default());
                let queue = want("out/queue", Options::queue());
                // The same property under another name, to read it in another way.
                let effort = want("other/queue", Options::queue().best_effort());
                let mirror = |path: &str| Seen::new(&board, &format!("agents/{}/{path}", name(other)));
                let (values, queues, efforts) =
                    (mirror("out/value"), mirror("out/queue"), mirror("other/queue"));
                (other, Other { peer, value, queue, effort, values, queues, efforts })
            })
            .collect();
        board.add_alias("other/queue", "out/queue").unwrap();
        Self { board, skew, life, value, queue, written: 0, peers }
    }

    fn write(&mut self, now: u64) {
        self.written += 1;
        let count = bytes(&Count { life: self.life, number: self.written });
        self.value.write(&count, 0, now + self.skew).unwrap();
        self.queue.write(&count, 0, now + self.skew).unwrap();
    }
}

/// What the network does to packets, percent, and how long they take, milliseconds.
#[derive(Clone, Copy)]
struct Weather {
    loss: u64,
    double: u64,
    delay: u64,
}

const FAIR: Weather = Weather { loss: 0, double: 0, delay: 1 };

struct World {
    chance: Chance,
    now: u64,
    agents: Vec<Agent>,
    packets: SortedMap<(u64, u64), (usize, usize, Vec<u8>)>,
    sent: u64,
    weather: Weather,
    /// Agents up to this one do not reach the others.
    cut: usize,
}

impl World {
    fn new(seed: u64, count: usize, weather: Weather) -> Self {
        let mut chance = Chance(seed);
        let hour = 3_600_000 * MILLISECOND;
        let agents = (0..count).map(|own| Agent::new(own, count, 1, chance.below(12) * hour)).collect();
        Self { chance, now: 0, agents, packets: SortedMap::new(), sent: 0, weather, cut: 0 }
    }

    fn run(&mut self, milliseconds: u64, writes_percent: u64) {
        for _ in 0..milliseconds {
            self.now += MILLISECOND;
            self.deliver();
            for own in 0..self.agents.len() {
                if self.chance.happens(writes_percent) {
                    self.agents[own].write(self.now);
                }
                self.send(own);
            }
        }
    }

    fn deliver(&mut self) {
        while self.packets.first_key_value().is_some_and(|(key, _)| key.0 <= self.now) {
            let (_, (from, to, packet)) = self.packets.pop_first().unwrap();
            let agent = &mut self.agents[to];
            let other = agent.peers.get_mut(&from).unwrap();
            other.peer.receive(self.now + agent.skew, &packet, None);
            [&mut other.values, &mut other.queues, &mut other.efforts].into_iter().for_each(Seen::look);
        }
    }

    fn send(&mut self, own: usize) {
        let agent = &mut self.agents[own];
        let mut packet = Vec::new();
        for (to, other) in &mut agent.peers {
            let now = self.now + agent.skew;
            other.peer.tick(now);
            for _ in 0..16 {
                if !other.peer.outgoing(now, LARGEST, &mut packet, None) {
                    break;
                }
                assert!(packet.len() <= LARGEST);
                let copies = 1 + u64::from(self.chance.happens(self.weather.double));
                for _ in 0..copies {
                    let cut = (own < self.cut) != (*to < self.cut);
                    if cut || self.chance.happens(self.weather.loss) {
                        continue;
                    }
                    let at = self.now + MILLISECOND * (1 + self.chance.below(self.weather.delay));
                    self.sent += 1;
                    self.packets.insert((at, self.sent), (own, *to, packet.clone()));
                }
            }
        }
    }

    fn restart(&mut self, own: usize) {
        let (life, skew) = (self.agents[own].life + 1, self.agents[own].skew);
        let count = self.agents.len();
        self.agents[own] = Agent::new(own, count, life, skew);
    }

    /// Whether everybody shows the last values of everybody.
    fn check(&self, seed: u64) {
        for (own, agent) in self.agents.iter().enumerate() {
            for (from, other) in &agent.peers {
                let origin = &self.agents[*from];
                let what = format!("seed {seed}: {} of {}", name(own), name(*from));
                let identity = other.peer.session().other();
                assert!(identity.is_some(), "{what}: not connected: {:?}", other.peer.session().refused());
                let end = (origin.life, origin.written);
                if origin.written == 0 {
                    continue;
                }
                assert_eq!(other.values.last, end, "{what}: value");
                assert_eq!(other.queues.last, end, "{what}: queue");
                let path = format!("agents/{}/out/value", name(*from));
                assert!(agent.board.find(&path).unwrap().0.has_writer(), "{what}: the mirror has a writer");
                let estimate = other.peer.session().estimate().unwrap();
                let offset = origin.skew as i64 - agent.skew as i64;
                let error = (estimate.offset - offset).unsigned_abs();
                assert!(
                    error <= estimate.round_trip / 2 + MILLISECOND,
                    "{what}: {estimate:?}, it is {offset}"
                );
                assert!(other.peer.session().counters().malformed == 0, "{what}: {:?}", other.peer.session());
                assert!(other.peer.session().progress(other.value).unwrap().received > 0);
            }
        }
    }

    /// Whether of every queue everything came or is counted as lost.
    fn check_counts(&self, seed: u64, lossless: bool) {
        for (own, agent) in self.agents.iter().enumerate() {
            for (from, other) in &agent.peers {
                let origin = &self.agents[*from];
                let what = format!("seed {seed}: {} of {}", name(own), name(*from));
                let queue = other.peer.session().progress(other.queue).unwrap();
                assert_eq!(queue.received, other.queues.count, "{what}");
                assert_eq!(queue.received + queue.lost, origin.written, "{what}: reliable {queue:?}");
                if lossless {
                    assert_eq!(queue.lost, 0, "{what}: reliable");
                }
                let effort = other.peer.session().progress(other.effort).unwrap();
                assert_eq!(effort.received + effort.lost, origin.written, "{what}: best effort {effort:?}");
            }
        }
    }
}

#[test]
fn lost_messages_are_retransmitted() {
    for seed in 0..20 {
        let count = 2 + (seed as usize % 3);
        let mut world = World::new(seed, count, Weather { loss: 30, double: 10, delay: 50 });
        world.run(1000, 0);
        // Slower than what the queue keeps on a line that takes long to tell what is missing.
        world.run(3000, 10);
        world.run(1500, 0);
        // In such weather an agent may be taken for gone at any time, also at the end.
        world.weather = FAIR;
        world.run(600, 0);
        world.check(seed);
        world.check_counts(seed, false);
    }
}

#[test]
fn a_line_that_loses_little_loses_nothing_of_a_reliable_queue() {
    for seed in 100..110 {
        let mut world = World::new(seed, 2, Weather { loss: 2, double: 2, delay: 3 });
        world.run(300, 0);
        world.run(2000, 30);
        world.run(1000, 0);
        world.check(seed);
        world.check_counts(seed, true);
    }
}

#[test]
fn a_cut_that_is_mended_leaves_no_trace_but_what_is_counted() {
    for seed in 200..215 {
        let count = 2 + (seed as usize % 4);
        let mut world = World::new(seed, count, Weather { loss: 5, double: 5, delay: 10 });
        world.run(500, 10);
        world.cut = 1 + (seed as usize % (count - 1));
        world.run(2000, 10);
        world.cut = 0;
        world.run(1000, 10);
        world.run(2000, 0);
        world.check(seed);
        world.check_counts(seed, false);
    }
}

#[test]
fn restarted_agent_is_found_again() {
    for seed in 300..320 {
        let count = 2 + (seed as usize % 7);
        let mut world = World::new(seed, count, Weather { loss: 10, double: 5, delay: 20 });
        world.run(600, 10);
        for _ in 0..3 {
            let own = world.chance.below(count as u64) as usize;
            world.restart(own);
            let pause = world.chance.below(700);
            world.run(pause, 10);
        }
        world.weather = FAIR;
        world.run(1500, 10);
        world.run(1000, 0);
        world.check(seed);
    }
}

#[test]
fn the_same_seed_gives_the_same_run() {
    let run = || {
        let mut world = World::new(7, 3, Weather { loss: 20, double: 10, delay: 30 });
        world.run(1500, 20);
        let counters: Vec<_> = world
            .agents
            .iter()
            .flat_map(|agent| agent.peers.values().map(|other| other.peer.session().counters()))
            .collect();
        (world.sent, counters)
    };
    assert_eq!(run(), run());
}
