use std::collections::{BTreeMap, BTreeSet};

use slate_blackboard::interface::Descriptor;
use slate_module::encode_interface;

use super::Layout;
use super::number::{clash, robot_number};
use crate::knowledge::{
    Counters, Fact, Limits, MessageError, Outgoing, Refusal, Replica, RestoreError, Statement,
};
use crate::schema::interface;

/// What stands between a topic and a key.
const SEPARATOR: u8 = b':';

/// The key under which each robot states its name.
const NAME: &[u8] = b":name";

/// Where an interface is stated begins so.
const INTERFACE: &[u8] = b":interface/";

/// Ticks after which a robot that tells nothing is not told anything either, as it seems to take no part: at least, and for each
/// neighbour. A tick compares with two of them, so 26 messages to each are to be expected meanwhile, and as many answers: most
/// of them may be lost.
const MINIMUM_SILENCE: usize = 25;
const SILENCE_PER_NEIGHBOUR: usize = 13;

/// After so many times that long it is tried again.
const AGAIN: usize = 10;

/// A robot of a team: what it states and knows, and whom it tells. It has neither threads nor sockets nor a clock.
///
/// Beside its facts each robot states its name, as facts carry numbers, and the interfaces of what it states, so that every robot
/// can show what it hears. Both are facts like others, of no topic.
#[derive(Debug)]
pub struct Member {
    name: String,
    replica: Replica,
    /// The robots that messages reach, by their numbers.
    neighbours: BTreeMap<u32, Neighbour>,
    /// The interfaces that this robot states.
    stated: BTreeSet<u64>,
}

#[derive(Debug)]
struct Neighbour {
    name: String,
    /// Ticks since it told something.
    silence: usize,
    /// Whether it was told something since the last tick.
    was_told: bool,
    /// Whether it waits for a word, so that it knows that this robot takes part.
    awaits: bool,
    /// Whether the host says that it is there, and not only what it tells.
    is_met: bool,
}

/// A fact that a team knows.
#[derive(Clone, Debug, PartialEq)]
pub struct Known<'a> {
    /// What it is about, in its topic.
    pub key: &'a str,
    /// The name of the robot that states it.
    pub robot: String,
    /// The fact.
    pub fact: Fact<'a>,
}

impl Member {
    /// What all robots of a team hold at most.
    pub fn limits() -> Limits {
        Limits { key: 192, ..Limits::default() }
    }

    /// A robot, with what it has saved. `random` must differ from start to start.
    ///
    /// # Errors
    /// When what was saved can't be restored.
    pub fn new(name: &str, random: u32, saved: Option<&[u8]>) -> Result<Self, RestoreError> {
        let (robot, limits) = (robot_number(name), Self::limits());
        let replica = match saved {
            Some(saved) => Replica::restore(robot, random, limits, saved)?,
            None => Replica::new(robot, random, limits),
        };
        Ok(Self { name: name.into(), replica, neighbours: BTreeMap::new(), stated: BTreeSet::new() })
    }

    /// The robot's name.
    pub fn name(&self) -> &str {
        &self.name
    }

    /// What it holds, as the protocol has it.
    pub fn replica(&self) -> &Replica {
        &self.replica
    }

    /// Another robot is within reach.
    ///
    /// # Errors
    /// In words, when its name has the number of another one: it is not told anything then.
    pub fn meet(&mut self, name: &str) -> Result<(), String> {
        self.neighbour(name)?.is_met = true;
        Ok(())
    }

    /// A neighbour of that name, who has just been heard.
    fn neighbour(&mut self, name: &str) -> Result<&mut Neighbour, String> {
        let number = robot_number(name);
        if number == self.replica.robot() {
            return Err(clash(&self.name, name));
        }
        let new =
            || Neighbour { name: name.into(), silence: 0, was_told: false, awaits: false, is_met: false };
        let neighbour = self.neighbours.entry(number).or_insert_with(new);
        if neighbour.name != name {
            return Err(clash(&neighbour.name, name));
        }
        neighbour.silence = 0;
        self.replica.meet(number);
        Ok(neighbour)
    }

    /// Another robot is out of reach.
    pub fn part(&mut self, name: &str) {
        let number = robot_number(name);
        if self.neighbours.get(&number).is_some_and(|known| known.name == name) {
            self.neighbours.remove(&number);
            self.replica.part(number);
        }
    }

    /// Takes what another robot tells, who is within reach as long as it does.
    ///
    /// # Errors
    /// When it makes no sense; nothing is taken over then.
    pub fn hear(&mut self, name: &str, message: &[u8]) -> Result<(), MessageError> {
        // Whoever has another one's number is not heard.
        let Ok(neighbour) = self.neighbour(name) else { return Ok(()) };
        // A greeting is not answered, or two robots would never stop.
        neighbour.awaits |= !neighbour.was_told && message != Replica::greeting();
        self.replica.receive(robot_number(name), message)
    }

    /// To be called several times a second.
    pub fn tick(&mut self) {
        let silence_limit = self.silence_limit();
        // Who was only heard, perhaps after it had gone, is not tried again.
        self.neighbours.retain(|number, neighbour| {
            neighbour.silence = neighbour.silence.saturating_add(1);
            neighbour.was_told = false;
            if neighbour.silence % (AGAIN * silence_limit) < silence_limit {
                self.replica.meet(*number);
            } else {
                self.replica.part(*number);
            }
            neighbour.is_met || neighbour.silence < silence_limit
        });
        self.replica.tick();
    }

    /// The ticks that a neighbour may be silent.
    fn silence_limit(&self) -> usize {
        MINIMUM_SILENCE.max(SILENCE_PER_NEIGHBOUR * self.neighbours.len())
    }

    /// The next message, and the name of the robot that it is for.
    pub fn outgoing(&mut self) -> Option<(&str, Vec<u8>)> {
        let (to, bytes) = loop {
            match self.replica.outgoing() {
                Some(Outgoing { to, bytes }) if self.neighbours.contains_key(&to) => break (to, bytes),
                // It has gone meanwhile.
                Some(_) => {}
                // A robot with many neighbours compares rarely with one that has few, who must not take it for silent.
                None => {
                    let (to, _) = self.neighbours.iter().find(|(_, neighbour)| neighbour.awaits)?;
                    break (*to, Replica::greeting());
                }
            }
        };
        let neighbour = self.neighbours.get_mut(&to)?;
        (neighbour.was_told, neighbour.awaits) = (true, false);
        Some((&neighbour.name, bytes))
    }

    /// States a fact about a key of a topic at `now`, nanoseconds since 1970 by this robot's clock; the value is one of
    /// that layout.
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
        self.introduce(now, layout.descriptor())?;
        let statement = Statement { schema: layout.descriptor().hash, certainty, value };
        self.replica.state(now, &joined(topic, key), statement).map(drop)
    }

    /// Takes back what this robot states about a key of a topic.
    ///
    /// # Errors
    /// As for [`Replica::retract`].
    pub fn retract(&mut self, now: u64, topic: &str, key: &str) -> Result<bool, Refusal> {
        self.replica.retract(now, &joined(topic, key))
    }

    /// States the robot's name and an interface, unless that is known.
    fn introduce(&mut self, now: u64, descriptor: &Descriptor) -> Result<(), Refusal> {
        if self.stated.contains(&descriptor.hash) {
            return Ok(());
        }
        let name = self.name.clone();
        self.state_once(now, NAME, name.as_bytes())?;
        // One that can't be written or is too long is not known to those who have no use for it themselves.
        let encoded = encode_interface(descriptor).map(|bytes| packed(&bytes)).unwrap_or_default();
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

    /// What is stated, by topic, by key and then by robot.
    pub fn known(&self) -> BTreeMap<&str, Vec<Known<'_>>> {
        let names = self.replica.facts(NAME).filter_map(|fact| {
            let name = std::str::from_utf8(fact.statement.value).ok()?;
            Some((fact.origin, name))
        });
        let names: BTreeMap<u32, &str> = names.collect();
        let mut known: BTreeMap<&str, Vec<Known<'_>>> = BTreeMap::new();
        for whole in self.replica.keys() {
            let Some((topic, key)) = split(whole) else { continue };
            let facts = self.replica.facts(whole).map(|fact| {
                let name = names.get(&fact.origin).copied();
                let robot = name.map_or_else(|| format!("{:08x}", fact.origin), str::to_owned);
                Known { key, robot, fact }
            });
            known.entry(topic).or_default().extend(facts);
        }
        known
    }

    /// The interface that some robot has stated.
    pub fn interface(&self, schema: u64) -> Option<&'static Descriptor> {
        let key = interface_key(schema);
        let mut stated = self.replica.facts(&key).filter_map(|fact| unpacked(fact.statement.value));
        stated.find_map(|bytes| interface(&bytes).ok().filter(|found| found.hash == schema))
    }

    /// What did not go as it should.
    pub fn counters(&self) -> Counters {
        self.replica.counters()
    }

    /// Whether something may have changed since this was asked last.
    pub fn take_changed(&mut self) -> bool {
        self.replica.take_changed() != crate::knowledge::Changed::default()
    }

    /// How many robots are within reach and take part.
    pub fn neighbours(&self) -> usize {
        let silence_limit = self.silence_limit();
        self.neighbours.values().filter(|neighbour| neighbour.silence < silence_limit).count()
    }
}

fn joined(topic: &str, key: &str) -> Vec<u8> {
    [topic.as_bytes(), &[SEPARATOR], key.as_bytes()].concat()
}

/// The topic and the key; nothing of what has no topic, or is no text.
fn split(key: &[u8]) -> Option<(&str, &str)> {
    let (topic, key) = std::str::from_utf8(key).ok()?.split_once(char::from(SEPARATOR))?;
    (!topic.is_empty()).then_some((topic, key))
}

fn interface_key(schema: u64) -> Vec<u8> {
    [INTERFACE, format!("{schema:016x}").as_bytes()].concat()
}

/// An interface takes little room when it is compressed: most of it are words.
fn packed(bytes: &[u8]) -> Vec<u8> {
    lz4_flex::block::compress_prepend_size(bytes)
}

fn unpacked(bytes: &[u8]) -> Option<Vec<u8>> {
    // Whatever another robot says of the size, LZ4 makes nothing more than 255 times as large.
    let size = u32::from_le_bytes(*bytes.first_chunk()?) as usize;
    if size / 256 > bytes.len() {
        return None;
    }
    lz4_flex::block::decompress_size_prepended(bytes).ok()
}
