use slate_blackboard::interface::Descriptor;
use slate_module::encode_interface;
use slate_sorted::{SortedMap, SortedSet};

use super::Layout;
use super::number::{clash, robot_number};
use crate::knowledge::{
    Counters, Fact, Limits, MessageError, Outgoing, Refusal, Replica, RestoreError, Statement,
};
use crate::schema::interface;

/// Separator between a topic and a key.
const SEPARATOR: u8 = b':';

/// Key of each robot's name.
const NAME_KEY: &[u8] = b":name";

/// Prefix of the keys of interfaces.
const INTERFACE_PREFIX: &[u8] = b":interface/";

/// Ticks without a message after which a robot receives no more messages.
/// It seems to take no part. The limit is at least this, and grows with each neighbor. A tick compares with two
/// neighbors, so 26 messages to each are to be expected meanwhile, and as many answers: most of them may be lost.
const SILENCE_TIMEOUT: usize = 25;
const SILENCE_TIMEOUT_PER_NEIGHBOR: usize = 13;

/// Number of such periods after which a silent robot is tried again.
const RETRY_PERIODS: usize = 10;

/// Member of a team: a robot's statements, its knowledge and its neighbors.
/// It has neither threads nor sockets nor a clock.
///
/// In addition to its facts each robot states its name, as facts carry numbers, and the interfaces of its statements,
/// so that every robot can show them. Both are facts like others, without a topic.
#[derive(Debug)]
pub struct Member {
    name: String,
    replica: Replica,
    /// Robots in reach, by their numbers.
    neighbors: SortedMap<u32, Neighbor>,
    /// Interfaces that this robot has stated.
    stated: SortedSet<u64>,
}

#[derive(Debug)]
struct Neighbor {
    name: String,
    /// Ticks since its last message.
    silence: usize,
    /// Flag of a message to it since the last tick.
    has_message: bool,
    /// Flag of an answer owed to it, which shows that this robot takes part.
    owes_answer: bool,
    /// Presence as reported by the host, not only inferred from its messages.
    is_reported: bool,
}

/// Fact of the team's knowledge.
#[derive(Clone, Debug, PartialEq)]
pub struct TeamFact<'a> {
    /// Subject of the fact in its topic.
    pub key: &'a str,
    /// The name of the robot that states it.
    pub robot: String,
    /// The fact.
    pub fact: Fact<'a>,
}

impl Member {
    /// Returns the limits of every robot of a team.
    pub fn limits() -> Limits {
        Limits { key: 192, ..Limits::default() }
    }

    /// Creates a robot from its saved knowledge, if any.
    /// `random` must differ from start to start.
    ///
    /// # Errors
    /// If the saved knowledge can't be restored.
    pub fn new(name: &str, random: u32, saved: Option<&[u8]>) -> Result<Self, RestoreError> {
        let (robot, limits) = (robot_number(name), Self::limits());
        let replica = match saved {
            Some(saved) => Replica::restore(robot, random, limits, saved)?,
            None => Replica::new(robot, random, limits),
        };
        Ok(Self { name: name.into(), replica, neighbors: SortedMap::new(), stated: SortedSet::new() })
    }

    /// Returns the robot's name.
    pub fn name(&self) -> &str {
        &self.name
    }

    /// Returns the replica, as the protocol sees it.
    pub fn replica(&self) -> &Replica {
        &self.replica
    }

    /// Adds a robot in reach.
    ///
    /// # Errors
    /// In words, if another robot's name has the same number; it receives no messages then.
    pub fn add_neighbor(&mut self, name: &str) -> Result<(), String> {
        self.neighbor(name)?.is_reported = true;
        Ok(())
    }

    /// Returns the neighbor with that name, which has just been heard.
    fn neighbor(&mut self, name: &str) -> Result<&mut Neighbor, String> {
        let number = robot_number(name);
        if number == self.replica.robot() {
            return Err(clash(&self.name, name));
        }
        let new = || Neighbor {
            name: name.into(),
            silence: 0,
            has_message: false,
            owes_answer: false,
            is_reported: false,
        };
        let neighbor = self.neighbors.entry(number).or_insert_with(new);
        if neighbor.name != name {
            return Err(clash(&neighbor.name, name));
        }
        neighbor.silence = 0;
        self.replica.add_neighbor(number);
        Ok(neighbor)
    }

    /// Removes a robot out of reach.
    pub fn remove_neighbor(&mut self, name: &str) {
        let number = robot_number(name);
        if self.neighbors.get(&number).is_some_and(|known| known.name == name) {
            self.neighbors.remove(&number);
            self.replica.remove_neighbor(number);
        }
    }

    /// Takes a message of another robot, which counts as in reach meanwhile.
    ///
    /// # Errors
    /// If the message is invalid; nothing is changed then.
    pub fn receive(&mut self, name: &str, message: &[u8]) -> Result<(), MessageError> {
        // Ignores a robot whose number is taken.
        let Ok(neighbor) = self.neighbor(name) else { return Ok(()) };
        // A greeting is not answered, or two robots would never stop.
        neighbor.owes_answer |= !neighbor.has_message && message != Replica::greeting();
        self.replica.receive(robot_number(name), message)
    }

    /// Advances the protocol; call it several times per second.
    pub fn tick(&mut self) {
        let silence_timeout = self.silence_timeout();
        // A robot known only from its messages is not retried.
        self.neighbors.retain(|number, neighbor| {
            neighbor.silence = neighbor.silence.saturating_add(1);
            neighbor.has_message = false;
            if neighbor.silence % (RETRY_PERIODS * silence_timeout) < silence_timeout {
                self.replica.add_neighbor(*number);
            } else {
                self.replica.remove_neighbor(*number);
            }
            neighbor.is_reported || neighbor.silence < silence_timeout
        });
        self.replica.tick();
    }

    /// Returns the number of ticks that a neighbor may be silent.
    fn silence_timeout(&self) -> usize {
        SILENCE_TIMEOUT.max(SILENCE_TIMEOUT_PER_NEIGHBOR * self.neighbors.len())
    }

    /// Returns the next message, and the name of its receiver.
    pub fn outgoing(&mut self) -> Option<(&str, Vec<u8>)> {
        let (to, bytes) = loop {
            match self.replica.outgoing() {
                Some(Outgoing { to, bytes }) if self.neighbors.contains_key(&to) => break (to, bytes),
                // It has gone meanwhile.
                Some(_) => {}
                // A robot with many neighbors compares rarely with one that has few, which must not count it as silent.
                None => {
                    let (to, _) = self.neighbors.iter().find(|(_, neighbor)| neighbor.owes_answer)?;
                    break (*to, Replica::greeting());
                }
            }
        };
        let neighbor = self.neighbors.get_mut(&to)?;
        (neighbor.has_message, neighbor.owes_answer) = (true, false);
        Some((&neighbor.name, bytes))
    }

    /// States a fact about a key of a topic.
    /// `now` is this robot's clock, ns since 1970. The value is one of that layout.
    ///
    /// # Errors
    /// When something is too long, or the robot states as much as it may.
    pub fn state(
        &mut self,
        now: u64,
        (topic, key): (&str, &str),
        layout: &Layout,
        certainty: f64,
        value: &[u8],
    ) -> Result<(), Refusal> {
        self.state_interface(now, layout.descriptor())?;
        let statement = Statement { schema: layout.descriptor().hash, certainty, value };
        self.replica.state(now, &join_key(topic, key), statement).map(drop)
    }

    /// Retracts this robot's statement about a key of a topic.
    ///
    /// # Errors
    /// As for [`Replica::retract`].
    pub fn retract(&mut self, now: u64, topic: &str, key: &str) -> Result<bool, Refusal> {
        self.replica.retract(now, &join_key(topic, key))
    }

    /// States the robot's name and an interface, unless they are known.
    fn state_interface(&mut self, now: u64, descriptor: &Descriptor) -> Result<(), Refusal> {
        if self.stated.contains(&descriptor.hash) {
            return Ok(());
        }
        let name = self.name.clone();
        self.state_once(now, NAME_KEY, name.as_bytes())?;
        // A fact that can't be encoded or is too long is not forwarded.
        let encoded = encode_interface(descriptor).map(|bytes| compress(&bytes)).unwrap_or_default();
        if (1..=Self::limits().value).contains(&encoded.len()) {
            self.state_once(now, &interface_key(descriptor.hash), &encoded)?;
        }
        self.stated.insert(descriptor.hash);
        Ok(())
    }

    fn state_once(&mut self, now: u64, key: &[u8], value: &[u8]) -> Result<(), Refusal> {
        let own = self.replica.robot();
        let known = self.replica.facts(key).find(|fact| fact.origin == own);
        if known.is_some_and(|fact| fact.statement.value == value) {
            return Ok(());
        }
        let statement = Statement { schema: 0, certainty: 1.0, value };
        self.replica.state(now, key, statement).map(drop)
    }

    /// Returns all facts by topic, key and robot.
    pub fn known(&self) -> SortedMap<&str, Vec<TeamFact<'_>>> {
        let names = self.replica.facts(NAME_KEY).filter_map(|fact| {
            let name = std::str::from_utf8(fact.statement.value).ok()?;
            Some((fact.origin, name))
        });
        let names: SortedMap<u32, &str> = names.collect();
        let mut known: SortedMap<&str, Vec<TeamFact<'_>>> = SortedMap::new();
        for whole in self.replica.keys() {
            let Some((topic, key)) = split_key(whole) else { continue };
            let facts = self.replica.facts(whole).map(|fact| {
                let name = names.get(&fact.origin).copied();
                let robot = name.map_or_else(|| format!("{:08x}", fact.origin), str::to_owned);
                TeamFact { key, robot, fact }
            });
            known.entry(topic).or_default().extend(facts);
        }
        known
    }

    /// Returns an interface that some robot has stated.
    pub fn interface(&self, schema: u64) -> Option<&'static Descriptor> {
        let key = interface_key(schema);
        let mut stated = self.replica.facts(&key).filter_map(|fact| decompress(fact.statement.value));
        stated.find_map(|bytes| interface(&bytes).ok().filter(|found| found.hash == schema))
    }

    /// Returns the counters of errors and losses.
    pub fn counters(&self) -> Counters {
        self.replica.counters()
    }

    /// Returns whether a fact may have changed since the last call.
    pub fn take_changed(&mut self) -> bool {
        self.replica.take_changed() != crate::knowledge::Changed::default()
    }

    /// Returns the number of robots that are within reach and take part.
    pub fn neighbors(&self) -> usize {
        let silence_timeout = self.silence_timeout();
        self.neighbors.values().filter(|neighbor| neighbor.silence < silence_timeout).count()
    }
}

fn join_key(topic: &str, key: &str) -> Vec<u8> {
    [topic.as_bytes(), &[SEPARATOR], key.as_bytes()].concat()
}

/// Splits a key into topic and key; `None` without a topic, or for invalid text.
fn split_key(key: &[u8]) -> Option<(&str, &str)> {
    let (topic, key) = std::str::from_utf8(key).ok()?.split_once(char::from(SEPARATOR))?;
    (!topic.is_empty()).then_some((topic, key))
}

fn interface_key(schema: u64) -> Vec<u8> {
    [INTERFACE_PREFIX, format!("{schema:016x}").as_bytes()].concat()
}

/// Compresses an interface, which is mostly words.
fn compress(bytes: &[u8]) -> Vec<u8> {
    lz4_flex::block::compress_prepend_size(bytes)
}

fn decompress(bytes: &[u8]) -> Option<Vec<u8>> {
    // LZ4 expands at most by a factor of 255, whatever size the sender declares.
    let size = u32::from_le_bytes(*bytes.first_chunk()?) as usize;
    if size / 256 > bytes.len() {
        return None;
    }
    lz4_flex::block::decompress_size_prepended(bytes).ok()
}
