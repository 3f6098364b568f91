use super::Changed;
use crate::knowledge::life::{Life, LifeEntry};
use crate::knowledge::{Fact, Limits, Statement, Version};

/// Stored lives of one robot.
#[derive(Clone, Debug, Default)]
pub(super) struct OriginLives {
    /// Lives, newest first.
    pub lives: Vec<Life>,
}

impl OriginLives {
    pub fn life(&self, epoch: u64) -> Option<&Life> {
        self.lives.iter().find(|life| life.epoch == epoch)
    }

    pub fn version(&self, epoch: u64) -> u64 {
        self.life(epoch).map_or(0, |life| life.version)
    }

    /// Returns the life, which is created if it is missing.
    pub fn life_mut(&mut self, epoch: u64) -> &mut Life {
        let at = self.lives.partition_point(|life| life.epoch > epoch);
        if self.lives.get(at).is_none_or(|life| life.epoch != epoch) {
            self.lives.insert(at, Life::new(epoch));
        }
        &mut self.lives[at]
    }

    /// Returns whether a life of that epoch is closed or too old to be stored.
    pub fn is_void(&self, epoch: u64, limits: &Limits) -> bool {
        let closed = self.lives.iter().any(|life| life.closes && life.epoch > epoch);
        closed
            || self.lives.len() >= limits.lives
                && self.lives.last().is_some_and(|oldest| oldest.epoch > epoch)
    }

    /// Drops lives that are closed or too old; their keys count as changed.
    pub fn drop_void(&mut self, limits: &Limits, changed: &mut Changed) {
        let closing = self.lives.iter().position(|life| life.closes).map_or(usize::MAX, |at| at + 1);
        let keep = closing.min(limits.lives);
        for life in self.lives.drain(keep.min(self.lives.len())..) {
            changed.extend(life.keys().cloned(), limits.facts);
        }
    }

    /// Returns the last statement about the key, from the newest life with one.
    pub fn last_statement(&self, key: &[u8]) -> Option<(Version, &LifeEntry)> {
        self.lives.iter().find_map(|life| {
            let (sequence, entry) = life.entry(key)?;
            Some((Version { epoch: life.epoch, sequence }, entry))
        })
    }

    pub fn fact<'a>(&'a self, origin: u32, key: &[u8]) -> Option<Fact<'a>> {
        let (version, entry) = self.last_statement(key)?;
        let body = entry.body.as_ref()?;
        let statement = Statement { schema: body.schema, certainty: body.certainty, value: &body.value };
        Some(Fact { key: &entry.key, origin, version, time: entry.time, order: entry.order, statement })
    }

    pub fn keys(&self) -> impl Iterator<Item = &[u8]> {
        self.lives.iter().flat_map(|life| life.keys().map(|key| &**key))
    }
}
