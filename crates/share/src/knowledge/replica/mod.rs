mod changed;
mod held;
mod origin;
mod own;
mod random;
mod receive;
mod spread;
mod stage;

pub use changed::Changed;
use held::HeldLives;
use random::Random;
use slate_sorted::SortedSet;
use spread::Disseminator;
pub use spread::Outgoing;

use super::limits::FACT_BYTES;
use super::version::{epoch, number};
use super::wire::{Message, WireReader};
use super::{Fact, Limits, RestoreError, Version, View};

/// Replica of a team's knowledge on one robot; see [the module](super).
///
/// Give it a message with [`receive`](Self::receive), let it [`tick`](Self::tick) 5 times a second or so, and after
/// either, and after stating facts, send all that [`outgoing`](Self::outgoing) has.
#[derive(Clone, Debug)]
pub struct Replica {
    robot: u32,
    limits: Limits,
    /// Epoch of the current life, from its first statement on.
    epoch: u64,
    /// Number of additional lives begun in this run.
    renewals: u32,
    held: HeldLives,
    spreader: Disseminator,
    counters: Counters,
}

/// Counters of errors and losses.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Counters {
    /// Parts of lives that exceed the [`Limits`], such as those of too many robots.
    pub refused: u64,
    /// Messages dropped because too many waited.
    pub dropped: u64,
    /// Conflict of robot numbers: another robot has the same number.
    /// This one no longer begins new lives, and the team does not agree on its facts.
    pub contested: bool,
}

impl Replica {
    /// Creates the empty replica of the robot with that number.
    /// The number must be unique in the team. `random` must differ from start to start.
    ///
    /// [`Limits::message`] is raised to the minimum that the other limits require.
    pub fn new(robot: u32, random: u32, limits: Limits) -> Self {
        let lives = limits.lives.max(1);
        let statement = limits.key.saturating_add(limits.value).saturating_add(160);
        let message = limits.message.max(statement).max(lives.saturating_mul(64).saturating_add(32));
        let limits = Limits { message, lives, ..limits };
        Self {
            robot,
            limits,
            epoch: epoch(1, random),
            renewals: 0,
            held: HeldLives::default(),
            spreader: Disseminator::new(limits, Random::new(u64::from(robot) << 32 | u64::from(random))),
            counters: Counters::default(),
        }
    }

    /// Returns the robot's number.
    pub fn robot(&self) -> u32 {
        self.robot
    }

    /// Adds a neighbor that messages reach.
    pub fn add_neighbor(&mut self, robot: u32) {
        if robot != self.robot {
            self.spreader.add_neighbor(robot);
        }
    }

    /// Removes a neighbor that messages no longer reach.
    /// Messages that wait for it are dropped.
    pub fn remove_neighbor(&mut self, robot: u32) {
        self.spreader.remove_neighbor(robot);
    }

    /// Compares the stored versions with some neighbors.
    /// Call it regularly; 5 Hz is usual. Ticks replace the team's clocks, which are not used.
    pub fn tick(&mut self) {
        self.held.stages.retain(|_, stage| stage.wait());
        self.spreader.compare(&self.held);
    }

    /// Returns a message that only shows presence: the digest of no origins.
    pub fn greeting() -> Vec<u8> {
        Message::digest(1, 0).finish()
    }

    /// Returns the next message to send, if any.
    pub fn outgoing(&mut self) -> Option<Outgoing> {
        self.spreader.next(&self.held)
    }

    /// Returns the facts about the key, by origin.
    pub fn facts<'a>(&'a self, key: &'a [u8]) -> impl Iterator<Item = Fact<'a>> {
        self.held.facts(key)
    }

    /// Returns the facts about the key that a view selects.
    /// At most one fact, except for [`View::Union`].
    pub fn view<'a>(&'a self, key: &'a [u8], view: View) -> Vec<Fact<'a>> {
        view.of(self.facts(key))
    }

    /// Returns all keys with facts, in order.
    pub fn keys(&self) -> SortedSet<&[u8]> {
        self.held.keys()
    }

    /// Returns the keys whose facts may have changed since the last call.
    /// At most as many are remembered as one life may have facts.
    pub fn take_changed(&mut self) -> Changed {
        std::mem::take(&mut self.held.changed)
    }

    /// Returns the stored version of each life, by origin, newest life first.
    /// Replicas with the same versions hold the same facts.
    pub fn versions(&self) -> impl Iterator<Item = (u32, Version)> {
        self.held.versions()
    }

    /// Returns the counters of errors and losses since the start.
    pub fn counters(&self) -> Counters {
        Counters { dropped: self.spreader.dropped, ..self.counters }
    }

    /// Returns the memory of all facts and messages, bytes.
    /// The measure is that of [`Limits::memory`].
    pub fn memory(&self) -> usize {
        let changed = self.held.changed.len() * (FACT_BYTES + self.limits.key);
        self.held.bytes() + self.spreader.bytes() + changed
    }

    /// Serializes all facts for [`restore`](Self::restore).
    /// Save occasionally, such as at the end of a mission; correctness does not depend on the age of the save.
    pub fn save(&self) -> Vec<u8> {
        let mut saved = [self.robot.to_le_bytes(), number(self.epoch).to_le_bytes()].concat();
        self.held.save(&mut saved, &self.limits);
        let checksum = xxhash_rust::xxh3::xxh3_64(&saved);
        saved.extend(checksum.to_le_bytes());
        saved
    }

    /// Restores the replica of a robot from its [saved](Self::save) bytes.
    /// `random` must differ from start to start. The robot's own facts belong to an earlier life: they hold until it
    /// states new facts about their keys or retracts them.
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
            replica.restore_sections(message)?;
        }
        Ok(replica)
    }
}
