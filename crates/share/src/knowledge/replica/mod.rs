mod changed;
mod origin;
mod own;
mod random;
mod receive;
mod spread;
mod stage;
mod storage;

use std::collections::{BTreeMap, BTreeSet, VecDeque};

pub use changed::Changed;
use origin::Origin;
use random::Random;
use spread::Fresh;
pub use spread::Outgoing;
use stage::Stage;

use super::limits::FACT_BYTES;
use super::version::epoch;
use super::wire::Claim;
use super::{Fact, Limits, Version, View};

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
    random: Random,
    origins: BTreeMap<u32, Origin>,
    stages: BTreeMap<(u32, u64), Stage>,
    neighbours: Vec<u32>,
    /// Where the next digest begins, when one has no room for all.
    cursor: u32,
    fresh: BTreeMap<(u32, u64), Fresh>,
    outgoing: VecDeque<Outgoing>,
    changed: Changed,
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
        Self {
            robot,
            limits: Limits { message, lives, ..limits },
            epoch: epoch(1, random),
            rises: 0,
            random: Random::new(u64::from(robot) << 32 | u64::from(random)),
            origins: BTreeMap::new(),
            stages: BTreeMap::new(),
            neighbours: Vec::new(),
            cursor: 0,
            fresh: BTreeMap::new(),
            outgoing: VecDeque::new(),
            changed: Changed::default(),
            counters: Counters::default(),
        }
    }

    /// The robot's number.
    pub fn robot(&self) -> u32 {
        self.robot
    }

    /// Notes that messages reach that robot.
    pub fn meet(&mut self, robot: u32) {
        if let Err(at) = self.neighbours.binary_search(&robot)
            && robot != self.robot
        {
            self.neighbours.insert(at, robot);
        }
    }

    /// Notes that messages do not reach that robot any more; those that wait for it are dropped.
    pub fn part(&mut self, robot: u32) {
        self.neighbours.retain(|neighbour| *neighbour != robot);
        self.outgoing.retain(|message| message.to != robot);
    }

    /// What is stated about the key, by origin.
    pub fn facts<'a>(&'a self, key: &'a [u8]) -> impl Iterator<Item = Fact<'a>> {
        self.origins.iter().filter_map(move |(robot, origin)| origin.fact(*robot, key))
    }

    /// What is stated about the key, as that view shows it: at most one fact unless it is [`View::Union`].
    pub fn view<'a>(&'a self, key: &'a [u8], view: View) -> Vec<Fact<'a>> {
        view.of(self.facts(key))
    }

    /// All keys about which something is stated, in order.
    pub fn keys(&self) -> BTreeSet<&[u8]> {
        let mut keys = BTreeSet::new();
        for (robot, origin) in &self.origins {
            keys.extend(origin.keys().filter(|key| origin.fact(*robot, key).is_some()));
        }
        keys
    }

    /// The keys about which something may have changed since the last call. So many are remembered as one life may have
    /// facts.
    pub fn take_changed(&mut self) -> Changed {
        std::mem::take(&mut self.changed)
    }

    /// How much of each life is held: the version of its last statement, by origin, the newest life first. Replicas with the
    /// same versions hold the same facts.
    pub fn versions(&self) -> impl Iterator<Item = (u32, Version)> {
        self.origins.iter().flat_map(|(robot, origin)| {
            let versions = origin.lives.iter();
            versions.map(|life| (*robot, Version { epoch: life.epoch, sequence: life.version }))
        })
    }

    /// What did not go as it should since the start.
    pub fn counters(&self) -> Counters {
        self.counters
    }

    /// The memory of all facts and messages, bytes, by the measure of [`Limits::memory`].
    pub fn memory(&self) -> usize {
        let lives = self.origins.values().flat_map(|origin| &origin.lives).map(|life| life.bytes());
        let stages = self.stages.values().map(|stage| stage.bytes);
        let outgoing = self.outgoing.iter().map(|message| message.bytes.len());
        let changed = self.changed.len() * (FACT_BYTES + self.limits.key);
        lives.chain(stages).chain(outgoing).sum::<usize>() + changed
    }

    /// Notes that neighbours are to be told of a life.
    fn tell_of(&mut self, origin: u32, epoch: u64, fresh: Fresh) {
        // What has no room is left to comparison.
        if self.fresh.len() < self.limits.robots.saturating_mul(self.limits.lives) {
            self.fresh.entry((origin, epoch)).or_insert(fresh);
        }
    }

    /// How much of a life is held or being received.
    fn claim(&self, origin: u32, epoch: u64) -> Claim {
        let known = self.origins.get(&origin).map_or(0, |origin| origin.version(epoch));
        let mut claim = Claim::known(origin, epoch, known);
        if !self.stages.is_empty()
            && let Some(stage) = self.stages.get(&(origin, epoch))
        {
            (claim.base, claim.position) = (stage.base, stage.position);
        }
        claim
    }
}
