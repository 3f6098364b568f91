//! Stored lives of all robots.

use slate_sorted::{SortedMap, SortedSet};

use super::Changed;
use super::origin::OriginLives;
use super::stage::LifeStage;
use crate::knowledge::wire::{Claim, Message, write_section};
use crate::knowledge::{Fact, Limits, Version};

/// Stored lives, and incomplete ones that are still being received.
#[derive(Clone, Debug, Default)]
pub(super) struct HeldLives {
    pub origins: SortedMap<u32, OriginLives>,
    pub stages: SortedMap<(u32, u64), LifeStage>,
    pub changed: Changed,
}

impl HeldLives {
    /// Returns the facts about the key, by origin.
    pub fn facts<'a>(&'a self, key: &'a [u8]) -> impl Iterator<Item = Fact<'a>> {
        self.origins.iter().filter_map(move |(robot, origin)| origin.fact(*robot, key))
    }

    /// Returns all keys with facts, in order.
    pub fn keys(&self) -> SortedSet<&[u8]> {
        let mut keys = SortedSet::new();
        for (robot, origin) in &self.origins {
            keys.extend(origin.keys().filter(|key| origin.fact(*robot, key).is_some()));
        }
        keys
    }

    /// Returns the version of each life, by origin, newest life first.
    pub fn versions(&self) -> impl Iterator<Item = (u32, Version)> {
        self.origins.iter().flat_map(|(robot, origin)| {
            let versions = origin.lives.iter();
            versions.map(|life| (*robot, Version { epoch: life.epoch, sequence: life.version }))
        })
    }

    /// Returns the memory of all lives, bytes.
    pub fn bytes(&self) -> usize {
        let lives = self.origins.values().flat_map(|origin| &origin.lives).map(|life| life.bytes());
        lives.chain(self.stages.values().map(|stage| stage.bytes)).sum()
    }

    /// Returns the version of a life that is stored or being received.
    pub fn claim(&self, origin: u32, epoch: u64) -> Claim {
        let known = self.origins.get(&origin).map_or(0, |origin| origin.version(epoch));
        let mut claim = Claim::known(origin, epoch, known);
        if !self.stages.is_empty()
            && let Some(stage) = self.stages.get(&(origin, epoch))
        {
            (claim.base, claim.position) = (stage.base, stage.position);
        }
        claim
    }

    /// Returns the claims about all lives, from that origin on.
    pub fn claims(&self, first: u32) -> Vec<Claim> {
        let mut claims: Vec<Claim> = (self.origins.range(first..))
            .flat_map(|(origin, held)| {
                let lives = held.lives.iter();
                lives.map(|life| Claim::known(*origin, life.epoch, life.version))
            })
            .collect();
        if !self.stages.is_empty() {
            claims.retain(|claim| !self.stages.contains_key(&(claim.origin, claim.epoch)));
            let staged = self.stages.keys().filter(|(origin, _)| *origin >= first);
            claims.extend(staged.map(|(origin, epoch)| self.claim(*origin, *epoch)));
            claims.sort_by_key(Claim::life_id);
        }
        claims
    }

    /// Appends all lives to `saved`, as messages of limited length.
    /// Each has as many sections as fit.
    pub fn save(&self, saved: &mut Vec<u8>, limits: &Limits) {
        for (robot, origin) in &self.origins {
            for life in &origin.lives {
                let mut position = 0;
                while position < life.version {
                    let mut writer = Message::sections();
                    let through = write_section(&mut writer, *robot, life, position, limits.message);
                    let Some(through) = through else { break };
                    position = through;
                    let message = writer.finish();
                    saved.extend((message.len() as u32).to_le_bytes());
                    saved.extend(message);
                }
            }
        }
    }
}
