use slate_share::knowledge::{Limits, Replica, Statement, Version};
use slate_sorted::SortedMap;

use crate::network::{Network, ROUND, Weather, What};
use crate::random::Random;
use crate::truth::{KEYS, Truth, shown};

/// A team, what happens to it, and how much.
#[derive(Clone, Copy)]
pub struct Scenario {
    pub robots: u32,
    /// Acquaintances of a robot beside its two neighbors in a ring.
    pub acquaintances: u32,
    pub weather: Weather,
    pub limits: Limits,
    /// Rounds in which robots speak, restart, and are partitioned.
    pub trouble: u64,
    /// Thousandths of robots that say something in a round: at most, each run has its own number.
    pub talk: u64,
    /// How much a robot says at once, at most.
    pub words: u64,
    /// Thousandths of robots that restart in a round: at most, each run has its own number.
    pub restarts: u64,
    /// Rounds after which all must be identical.
    pub rounds: u64,
}

/// How a run went.
pub struct Outcome {
    /// Rounds from the end of the trouble until all were identical.
    pub rounds: u64,
    pub messages: u64,
    pub bytes: u64,
    /// The largest memory of a replica, bytes.
    pub memory: usize,
    pub restarts: u64,
}

pub struct Simulation {
    scenario: Scenario,
    random: Random,
    network: Network,
    robots: Vec<Replica>,
    /// By how much each clock is ahead, microseconds.
    skew: Vec<u64>,
    saved: Vec<Option<Vec<u8>>>,
    truth: Truth,
    now: u64,
    stated: u64,
    restarts: u64,
    memory: usize,
    /// What some robots knew in the last round.
    watched: SortedMap<u32, SortedMap<(u32, u64), u64>>,
}

/// Microseconds; clocks are up to so much ahead.
const SKEW: u64 = 5 * 3600 * 1_000_000;

impl Simulation {
    pub fn new(scenario: Scenario, seed: u64) -> Self {
        let mut random = Random(seed);
        let scenario = Scenario {
            talk: 1 + random.below(scenario.talk),
            restarts: random.below(scenario.restarts + 1),
            ..scenario
        };
        let count = scenario.robots as usize;
        let mut network = Network::new(scenario.robots, scenario.acquaintances, &mut random);
        for robot in 0..scenario.robots {
            network.push(random.below(ROUND), robot, What::Tick);
        }
        let mut simulation = Self {
            scenario,
            network,
            robots: Vec::with_capacity(count),
            skew: (0..count).map(|_| random.below(SKEW)).collect(),
            saved: vec![None; count],
            truth: Truth::default(),
            now: 0,
            stated: 0,
            restarts: 0,
            memory: 0,
            watched: SortedMap::new(),
            random,
        };
        for robot in 0..scenario.robots {
            let started = simulation.start(robot);
            simulation.robots.push(started);
        }
        simulation
    }

    /// The whole of it. An error says what was promised and did not hold.
    pub fn run(mut self) -> Result<Outcome, String> {
        // One third alone, so that all know something; then two halves, and in the middle of that other halves.
        for round in 0..self.scenario.trouble {
            if round == self.scenario.trouble / 3 || round == self.scenario.trouble * 2 / 3 {
                self.partition();
            }
            for robot in 0..self.scenario.robots {
                self.trouble(robot);
            }
            self.round()?;
        }
        self.network.part.fill(0);
        let healed: Vec<Vec<(u32, Version)>> =
            self.robots.iter().map(|robot| robot.versions().collect()).collect();
        let mut rounds = 0;
        while !self.same_versions() {
            if rounds == self.scenario.rounds {
                return Err(format!("not identical {rounds} rounds after the partition was healed"));
            }
            rounds += 1;
            self.round()?;
        }
        self.check_end(&healed)?;
        let (messages, bytes) = (self.network.sent, self.network.bytes);
        Ok(Outcome { rounds, messages, bytes, memory: self.memory, restarts: self.restarts })
    }

    fn start(&mut self, robot: u32) -> Replica {
        let random = self.random.next() as u32;
        self.truth.start(robot, random);
        let limits = self.scenario.limits;
        let mut replica = match &self.saved[robot as usize] {
            None => Replica::new(robot, random, limits),
            Some(saved) => Replica::restore(robot, random, limits, saved).unwrap(),
        };
        for neighbor in &self.network.neighbors[robot as usize] {
            replica.add_neighbor(*neighbor);
        }
        replica
    }

    fn partition(&mut self) {
        for part in &mut self.network.part {
            *part = self.random.below(2) as u8;
        }
    }

    /// What may happen to a robot in a round.
    fn trouble(&mut self, robot: u32) {
        let at = robot as usize;
        if self.random.chance(self.scenario.talk) {
            for _ in 0..=self.random.below(self.scenario.words) {
                self.talk(robot);
            }
            self.drain(robot);
        }
        if self.random.chance(self.scenario.restarts) {
            // Half of them have lost their disk; the others come back with what they saved some time ago.
            if self.random.chance(500) {
                self.saved[at] = None;
            }
            self.restarts += 1;
            self.robots[at] = self.start(robot);
            self.watched.remove(&robot);
        }
        if self.random.chance(self.scenario.restarts * 5) {
            self.saved[at] = Some(self.robots[at].save());
        }
        if self.random.chance(self.scenario.restarts) {
            // New neighbors, and some that are out of reach for good. The ring stays, so a chain is always left.
            let other = self.random.below(self.scenario.robots.into()) as u32;
            let next = (robot + 1) % self.scenario.robots;
            let before = (robot + self.scenario.robots - 1) % self.scenario.robots;
            if self.network.neighbors[at].contains(&other) && other != next && other != before {
                self.network.neighbors[at].retain(|known| *known != other);
                self.network.neighbors[other as usize].retain(|known| *known != robot);
                self.robots[at].remove_neighbor(other);
                self.robots[other as usize].remove_neighbor(robot);
            } else {
                self.network.acquaint(robot, other);
                self.robots[at].add_neighbor(other);
                self.robots[other as usize].add_neighbor(robot);
            }
        }
    }

    fn talk(&mut self, robot: u32) {
        let key = self.random.below(KEYS) as u8;
        let now = (self.now + self.skew[robot as usize]) * 1000;
        let replica = &mut self.robots[robot as usize];
        self.stated += 1;
        let value = self.stated.to_le_bytes();
        let statement = if self.random.chance(650) {
            let certainty = self.random.below(1001) as f64 / 1000.0;
            let statement = Statement { schema: 7, certainty, value: &value };
            replica.state(now, &[key], statement).is_ok().then_some(Some(self.stated))
        } else {
            replica.retract(now, &[key]).unwrap_or(false).then_some(None)
        };
        match statement {
            Some(word) => self.truth.note(replica, key, word),
            // A refusal may have stated earlier facts anew.
            None => self.truth.catch_up(replica),
        }
    }

    /// Lets everything happen that happens in a round.
    fn round(&mut self) -> Result<(), String> {
        let end = self.now + ROUND;
        while let Some(event) = self.network.next(end) {
            self.now = event.time;
            let at = event.to as usize;
            match event.what {
                What::Tick => {
                    self.robots[at].tick();
                    // Clocks are not exact.
                    let next = self.now + ROUND - 5_000 + self.random.below(10_000);
                    self.network.push(next, event.to, What::Tick);
                }
                What::Message { from, bytes } => {
                    if !self.network.reaches(from, event.to) {
                        continue;
                    }
                    if bytes.len() > self.scenario.limits.message {
                        return Err(format!("a message of {} bytes", bytes.len()));
                    }
                    self.robots[at].receive(from, &bytes).map_err(|error| error.to_string())?;
                    self.truth.catch_up(&self.robots[at]);
                }
            }
            self.drain(event.to);
        }
        self.now = end;
        self.check_some()
    }

    fn drain(&mut self, robot: u32) {
        while let Some(message) = self.robots[robot as usize].outgoing() {
            let (weather, random) = (&self.scenario.weather, &mut self.random);
            self.network.send(self.now, robot, message.to, message.bytes, weather, random);
        }
    }

    fn same_versions(&self) -> bool {
        self.robots.windows(2).all(|pair| pair[0].versions().eq(pair[1].versions()))
    }

    /// What holds at any time, looked at in a few robots.
    fn check_some(&mut self) -> Result<(), String> {
        let robot = self.random.below(self.scenario.robots.into()) as u32;
        let replica = &self.robots[robot as usize];
        if shown(replica) != self.truth.expected(replica) {
            return Err(format!(
                "robot {robot} does not show what was said up to the versions that it holds"
            ));
        }
        self.memory = self.memory.max(replica.memory());
        if replica.memory() > self.scenario.limits.memory() {
            return Err(format!("robot {robot} uses {} bytes", replica.memory()));
        }
        for robot in 0..self.scenario.robots.min(3) {
            let replica = &self.robots[robot as usize];
            let versions: SortedMap<(u32, u64), u64> = (replica.versions())
                .map(|(origin, version)| ((origin, version.epoch), version.sequence))
                .collect();
            let before = self.watched.insert(robot, versions.clone()).unwrap_or_default();
            for (life, version) in before {
                if !self.is_kept(&versions, life, version) {
                    return Err(format!("robot {robot} has forgotten what it knew of {life:?}"));
                }
            }
        }
        Ok(())
    }

    /// Whether the life is known at least so far, or is void.
    fn is_kept(&self, versions: &SortedMap<(u32, u64), u64>, life: (u32, u64), version: u64) -> bool {
        let newer = versions.range((life.0, life.1 + 1)..=(life.0, u64::MAX)).count();
        let may_be_closed = self.scenario.limits.facts < 2 * KEYS as usize && newer > 0;
        match versions.get(&life) {
            Some(known) => *known >= version,
            None => newer >= self.scenario.limits.lives || may_be_closed,
        }
    }

    /// What holds when all are identical.
    fn check_end(&mut self, healed: &[Vec<(u32, Version)>]) -> Result<(), String> {
        // To the byte, but for what is the robot's own: its number and life, and the checksum.
        let content = |robot: &Replica| {
            let saved = robot.save();
            saved[8..saved.len() - 8].to_vec()
        };
        let first = content(&self.robots[0]);
        if let Some(robot) = self.robots.iter().find(|robot| content(robot) != first) {
            return Err(format!("robot {} has the same versions, but other bytes", robot.robot()));
        }
        let shown = shown(&self.robots[0]);
        if shown != self.truth.expected(&self.robots[0]) {
            return Err("what all show is not what was said".into());
        }
        for (robot, key, word) in self.truth.last_words() {
            if shown.get(&(key, robot)).map(|(_, value)| *value) != word {
                return Err(format!("robot {robot} has {word:?} as its last word about {key}"));
            }
        }
        let versions: SortedMap<(u32, u64), u64> = (self.robots[0].versions())
            .map(|(origin, version)| ((origin, version.epoch), version.sequence))
            .collect();
        for (origin, version) in healed.iter().flatten() {
            if !self.is_kept(&versions, (*origin, version.epoch), version.sequence) {
                return Err(format!("{version:?} of robot {origin} is lost"));
            }
        }
        let contested = self.robots.iter().any(|robot| robot.counters().contested);
        if contested { Err("a robot believes that another one has its number".into()) } else { Ok(()) }
    }
}
