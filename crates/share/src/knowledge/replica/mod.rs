mod changed;
mod held;
mod origin;
mod own;
mod random;
mod receive;
mod spread;
mod stage;

use std::collections::BTreeSet;

pub use changed::Changed;
use held::HeldLives;
use random::Random;
pub use spread::Outgoing;
use spread::Spreader;

use super::limits::FACT_BYTES;
use super::version::{epoch, number};
use super::wire::{Message, WireReader};
use super::{Fact, Limits, RestoreError, Version, View};

/// What one robot holds of its team's knowledge; see [the module](super).
///
/// Give it a message with [`receive`](Self::receive), let it [`tick`](Self::tick) 5 times a second or so, and after
/// either, and after stating facts, send all that [`outgoing`](Self::outgoing) has.
#[derive(Clone, Debug)]
pub struct Replica {
    robot: u32,
    limits: Limits,
    /// The epoch of the present life, from its first statement on.
    epoch: u64,
    /// How often this run had to begin another life.
    rises: u32,
    held: HeldLives,
    spreader: Spreader,
    counters: Counters,
}

/// What did not go as it should.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Counters {
    /// Parts of lives that exceed the [`Limits`], such as those of a robot too many.
    pub refused: u64,
    /// Messages dropped as too many waited to be sent.
    pub dropped: u64,
    /// Another robot has the same number: this one no longer begins new lives, and the team does not agree on its facts.
    pub contested: bool,
}

impl Replica {
    /// The replica of the robot with that number, which no other robot of the team has, when nothing was saved. `random`
    /// must differ from start to start.
    ///
    /// [`Limits::message`] is raised to what the other limits need.
    pub fn new(robot: u32, random: u32, limits: Limits) -> Self {
        let lives = limits.lives.max(1);
        let statement = limits.key.saturating_add(limits.value).saturating_add(160);
        let message = limits.message.max(statement).max(lives.saturating_mul(64).saturating_add(32));
        let limits = Limits { message, lives, ..limits };
        Self {
            robot,
            limits,
            epoch: epoch(1, random),
            rises: 0,
            held: HeldLives::default(),
            spreader: Spreader::new(limits, Random::new(u64::from(robot) << 32 | u64::from(random))),
            counters: Counters::default(),
        }
    }

    /// The robot's number.
    pub fn robot(&self) -> u32 {
        self.robot
    }

    /// Notes that messages reach that robot.
    pub fn meet(&mut self, robot: u32) {
        if robot != self.robot {
            self.spreader.meet(robot);
        }
    }

    /// Notes that messages do not reach that robot any more; those that wait for it are dropped.
    pub fn part(&mut self, robot: u32) {
        self.spreader.part(robot);
    }

    /// Compares what is known with some neighbours. Call it regularly: 5 times a second is usual. The time between two
    /// calls is what the team's clocks, which are not asked, are replaced by.
    pub fn tick(&mut self) {
        self.held.stages.retain(|_, stage| stage.wait());
        self.spreader.compare(&self.held);
    }

    /// A message that says nothing but that a robot is there: the digest of no origins.
    pub fn greeting() -> Vec<u8> {
        Message::digest(1, 0).finish()
    }

    /// The next message to send, as long as there are any.
    pub fn outgoing(&mut self) -> Option<Outgoing> {
        self.spreader.next(&self.held)
    }

    /// What is stated about the key, by origin.
    pub fn facts<'a>(&'a self, key: &'a [u8]) -> impl Iterator<Item = Fact<'a>> {
        self.held.facts(key)
    }

    /// What is stated about the key, as that view shows it: at most one fact unless it is [`View::Union`].
    pub fn view<'a>(&'a self, key: &'a [u8], view: View) -> Vec<Fact<'a>> {
        view.of(self.facts(key))
    }

    /// All keys about which something is stated, in order.
    pub fn keys(&self) -> BTreeSet<&[u8]> {
        self.held.keys()
    }

    /// The keys about which something may have changed since the last call. So many are remembered as one life may have
    /// facts.
    pub fn take_changed(&mut self) -> Changed {
        std::mem::take(&mut self.held.changed)
    }

    /// How much of each life is held: the version of its last statement, by origin, the newest life first. Replicas with the
    /// same versions hold the same facts.
    pub fn versions(&self) -> impl Iterator<Item = (u32, Version)> {
        self.held.versions()
    }

    /// What did not go as it should since the start.
    pub fn counters(&self) -> Counters {
        Counters { dropped: self.spreader.dropped, ..self.counters }
    }

    /// The memory of all facts and messages, bytes, by the measure of [`Limits::memory`].
    pub fn memory(&self) -> usize {
        let changed = self.held.changed.len() * (FACT_BYTES + self.limits.key);
        self.held.bytes() + self.spreader.bytes() + changed
    }

    /// All that is known, for [`restore`](Self::restore). Save it now and then, such as at the end of a mission; nothing
    /// depends on how old it is.
    pub fn save(&self) -> Vec<u8> {
        let mut saved = [self.robot.to_le_bytes(), number(self.epoch).to_le_bytes()].concat();
        self.held.save(&mut saved, &self.limits);
        let checksum = xxhash_rust::xxh3::xxh3_64(&saved);
        saved.extend(checksum.to_le_bytes());
        saved
    }

    /// The replica of a robot that comes back with what it had [saved](Self::save). `random` must differ from start to
    /// start. The facts that it stated itself are those of an earlier life of it: they stand until it states something
    /// else about their keys or retracts them.
    ///
    /// # Errors
    /// When the bytes are damaged, another robot's, or were saved with other limits.
    pub fn restore(robot: u32, random: u32, limits: Limits, saved: &[u8]) -> Result<Self, RestoreError> {
        let (content, checksum) = saved.split_last_chunk().ok_or(RestoreError::Damaged)?;
        if xxhash_rust::xxh3::xxh3_64(content) != u64::from_le_bytes(*checksum) {
            return Err(RestoreError::Damaged);
        }
        let mut replica = Self::new(robot, random, limits);
        let mut reader = WireReader::new(content);
        let [who, life] = [reader.fixed()?, reader.fixed()?].map(u32::from_le_bytes);
        if who != robot {
            return Err(RestoreError::Robot { saved: who, robot });
        }
        replica.epoch = epoch(life.saturating_add(1), random);
        while !reader.is_empty() {
            let length = u32::from_le_bytes(reader.fixed()?);
            let message = reader.bytes(length as usize)?;
            replica.take_back(message)?;
        }
        Ok(replica)
    }
}
