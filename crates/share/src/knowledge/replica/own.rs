use super::Replica;
use super::spread::Fresh;
use crate::knowledge::life::{Life, LifeEntry, StatementBody};
use crate::knowledge::version::{epoch, number};
use crate::knowledge::{Refusal, Statement, Version};

/// Largest number of additional lives in one run.
/// After a lost disk one is begun for each life that it hears of late. More are needed only if another robot has the
/// same number.
const MAX_RENEWALS: u32 = 8;

impl Replica {
    /// States a fact; it replaces this robot's earlier statement about the key.
    /// `now` is the robot's clock, ns.
    ///
    /// # Errors
    /// If the key or the value is too long, the certainty is invalid, or the robot's limits are reached; nothing is
    /// changed then.
    pub fn state(&mut self, now: u64, key: &[u8], statement: Statement<'_>) -> Result<Version, Refusal> {
        let (length, limit) = (statement.value.len(), self.limits.value);
        if length > limit {
            return Err(Refusal::Value { length, limit });
        }
        if key.len() > self.limits.key {
            return Err(Refusal::Key { length: key.len(), limit: self.limits.key });
        }
        if !(0.0..=1.0).contains(&statement.certainty) {
            return Err(Refusal::Certainty);
        }
        let latest = self.held.facts(key).map(|fact| fact.order.saturating_add(1)).max();
        let Statement { schema, certainty, value } = statement;
        self.append(LifeEntry {
            key: key.into(),
            time: now,
            order: latest.unwrap_or_default().max(now),
            body: Some(StatementBody { schema, certainty, value: value.into() }),
        })
    }

    /// Retracts this robot's statement about the key, also one of an earlier life.
    /// Returns false if it states nothing about the key. Statements of other robots stay.
    ///
    /// # Errors
    /// If the robot's limits are reached and the fact is one of an earlier life; nothing is changed then.
    pub fn retract(&mut self, now: u64, key: &[u8]) -> Result<bool, Refusal> {
        let fact = self.held.origins.get(&self.robot).and_then(|own| own.fact(self.robot, key));
        if fact.is_none() {
            return Ok(false);
        }
        self.append(LifeEntry { key: key.into(), time: now, order: now, body: None }).map(|_| true)
    }

    fn append(&mut self, entry: LifeEntry) -> Result<Version, Refusal> {
        if !self.held.origins.contains_key(&self.robot) && self.held.origins.len() >= self.limits.robots {
            return Err(Refusal::Robots { limit: self.limits.robots });
        }
        if self.own_life().is_none() {
            // The first statement of a life makes the end of the lives void.
            self.adopt(self.limits.lives / 2);
        }
        let retractions = self.own_life().map_or(0, Life::retractions);
        if retractions > self.limits.facts / 4 {
            self.forget_retractions(retractions / 2);
        }
        if !self.has_room(&entry) {
            self.forget_retractions(0);
            if !self.has_room(&entry) {
                let (facts, bytes) = self.own_life().map_or((0, 0), |life| (life.len(), life.bytes()));
                return Err(Refusal::Full { facts, bytes });
            }
        }
        Ok(self.write(entry))
    }

    fn own_life(&self) -> Option<&Life> {
        self.held.origins.get(&self.robot)?.life(self.epoch)
    }

    fn has_room(&self, entry: &LifeEntry) -> bool {
        let room = |life: &Life| life.has_room(entry, &self.limits);
        self.own_life().map_or_else(|| room(&Life::new(self.epoch)), room)
    }

    /// Adds a statement to the present life.
    fn write(&mut self, entry: LifeEntry) -> Version {
        let known = self.own_life().map_or(0, |life| life.version);
        self.spreader.mark_fresh(self.robot, self.epoch, Fresh { after: known, from: None });
        self.held.changed.extend([entry.key.clone()], self.limits.facts);
        let own = self.held.origins.entry(self.robot).or_default();
        let life = own.life_mut(self.epoch);
        life.version += 1;
        let version = Version { epoch: self.epoch, sequence: life.version };
        life.insert(version.sequence, entry);
        own.drop_void(&self.limits, &mut self.held.changed);
        version
    }

    /// Forgets all but the newest `keep` retractions of the current life.
    /// A forgotten retraction can't override a fact of an earlier life, so earlier lives are closed. Their valid facts
    /// are stated again first.
    fn forget_retractions(&mut self, keep: usize) {
        let Some(life) = self.own_life() else { return };
        if life.retractions() <= keep || !self.adopt(1) {
            return;
        }
        let Some(life) = self.own_life() else { return };
        let retracted = life.after(0).filter(|(_, entry)| entry.body.is_none());
        let floor = retracted.map(|(sequence, _)| sequence).nth(life.retractions() - keep - 1);
        self.close(floor.unwrap_or_default());
    }

    /// Closes all earlier lives and forgets retractions up to `floor`.
    /// This is a new version of the current life.
    fn close(&mut self, floor: u64) {
        let known = self.own_life().map_or(0, |life| life.version);
        self.spreader.mark_fresh(self.robot, self.epoch, Fresh { after: known, from: None });
        let own = self.held.origins.entry(self.robot).or_default();
        let life = own.life_mut(self.epoch);
        life.version += 1;
        life.closes = true;
        life.raise_floor(floor);
        own.drop_void(&self.limits, &mut self.held.changed);
    }

    /// States the valid facts of earlier lives again, from life `rank` on.
    /// The current life has rank 0. Returns whether all of them were stated.
    pub(super) fn adopt(&mut self, rank: usize) -> bool {
        let Some(own) = self.held.origins.get(&self.robot) else { return true };
        // The present life begins with its first statement.
        let ahead = usize::from(own.life(self.epoch).is_none());
        let mut adopted: Vec<LifeEntry> = Vec::new();
        for life in own.lives.iter().skip(rank.saturating_sub(ahead)) {
            let stands = life.after(0).filter(|(sequence, entry)| {
                let version = Version { epoch: life.epoch, sequence: *sequence };
                entry.body.is_some()
                    && own.last_statement(&entry.key).is_some_and(|(last, _)| last == version)
            });
            adopted.extend(stands.map(|(_, entry)| entry.clone()));
        }
        for entry in adopted {
            if !self.has_room(&entry) {
                self.counters.refused += 1;
                return false;
            }
            self.write(entry);
        }
        true
    }

    /// Returns whether `version` of `epoch` is newer than this robot's own life.
    /// Another robot stated it in this one's name, or this robot in a life that it does not know of.
    pub(super) fn is_overruled_by(&self, epoch: u64, version: u64) -> bool {
        epoch > self.epoch || epoch == self.epoch && version > self.own_life().map_or(0, |life| life.version)
    }

    /// Begins a new life after epoch `seen`.
    /// All statements of this run are stated in it again.
    pub(super) fn begin_life_after(&mut self, seen: u64) {
        let next = number(seen).max(number(self.epoch)).checked_add(1);
        let Some(next) = next.filter(|_| self.renewals < MAX_RENEWALS) else {
            self.counters.contested = true;
            return;
        };
        let former = self.epoch;
        self.epoch = epoch(next, former as u32);
        let Some(life) = self.held.origins.get(&self.robot).and_then(|own| own.life(former)).cloned() else {
            return;
        };
        self.renewals += 1;
        for (_, entry) in life.after(0) {
            self.write(entry.clone());
        }
        if life.closes {
            // It has forgotten retractions, which might concern the life that was heard of.
            self.close(0);
        }
    }
}
