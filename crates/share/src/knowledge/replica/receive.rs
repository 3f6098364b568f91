use std::cmp::Ordering;

use super::Replica;
use super::spread::{Fresh, LifeOffer};
use super::stage::LifeStage;
use crate::knowledge::MessageError;
use crate::knowledge::life::Life;
use crate::knowledge::wire::{Claim, LifeSection, Message};

/// Result of a received part of a life.
enum SectionResult {
    Nothing,
    /// New facts, which were applied.
    Something,
    /// Part that is kept until the rest arrives.
    Part,
    /// The parts before it are missing.
    Gap,
}

impl Replica {
    /// Applies a message of another robot, and prepares the answers.
    ///
    /// # Errors
    /// If the message is invalid; nothing is changed then.
    pub fn receive(&mut self, from: u32, message: &[u8]) -> Result<(), MessageError> {
        match Message::decode(message, &self.limits)? {
            Message::Digest { first, last, claims } => self.compare(from, first, last, &claims),
            Message::Request { claims } => {
                self.reassert(&claims);
                let offers = claims.iter().map(LifeOffer::beyond).collect();
                self.spreader.answer(&self.held, from, offers);
            }
            Message::Sections { more, sections } => {
                let (mut requests, mut progress) = (Vec::new(), false);
                for section in &sections {
                    let learned = self.receive_section(section, Some(from));
                    progress |= matches!(learned, SectionResult::Something | SectionResult::Part);
                    if matches!(learned, SectionResult::Part | SectionResult::Gap) {
                        requests.push(self.held.claim(section.origin, section.epoch));
                    }
                }
                if sections.iter().any(|section| section.origin == self.robot) {
                    // Facts of this robot's earlier lives are stated anew before they expire.
                    self.adopt(self.limits.lives / 2);
                }
                // Only a robot with progress requests more; else two robots that refuse each other's facts would never stop.
                if more && progress {
                    let (digest, _) = self
                        .spreader
                        .digest(&self.held, sections.first().map_or(0, |section| section.origin));
                    self.spreader.send(from, digest);
                } else {
                    self.spreader.request(from, requests);
                }
            }
        }
        Ok(())
    }

    /// Compares a digest: sends newer lives, and requests those that are newer there.
    fn compare(&mut self, from: u32, first: u32, last: u32, claims: &[Claim]) {
        self.reassert(claims);
        let (mut offers, mut requests) = (Vec::new(), Vec::new());
        let mut theirs = claims.iter().peekable();
        if first <= last {
            for (origin, held) in self.held.origins.range(first..=last) {
                for life in &held.lives {
                    let held_claim = Claim::known(*origin, life.epoch, life.version);
                    while let Some(claim) = theirs.next_if(|claim| claim.life_id() < held_claim.life_id()) {
                        self.collect_request(claim, &mut requests);
                    }
                    match theirs.next_if(|claim| claim.life_id() == held_claim.life_id()) {
                        None => offers.push(LifeOffer::whole(*origin, life.epoch)),
                        Some(claim) => match claim.known.cmp(&life.version) {
                            Ordering::Less => offers.push(LifeOffer::beyond(claim)),
                            Ordering::Equal => {}
                            Ordering::Greater => self.collect_request(claim, &mut requests),
                        },
                    }
                }
            }
        }
        for claim in theirs {
            self.collect_request(claim, &mut requests);
        }
        self.spreader.answer(&self.held, from, offers);
        self.spreader.request(from, requests);
    }

    fn collect_request(&self, claim: &Claim, requests: &mut Vec<Claim>) {
        let present = claim.origin == self.robot && claim.epoch >= self.epoch;
        let void = self
            .held
            .origins
            .get(&claim.origin)
            .is_some_and(|origin| origin.is_void(claim.epoch, &self.limits));
        if claim.known > 0 && !present && !void {
            requests.push(self.held.claim(claim.origin, claim.epoch));
        }
    }

    /// Ensures that this robot has the last statement about itself.
    fn reassert(&mut self, claims: &[Claim]) {
        let own = claims.partition_point(|claim| claim.origin < self.robot);
        // The newest of its lives stands first.
        if let Some(claim) = claims.get(own).filter(|claim| claim.origin == self.robot)
            && self.is_overruled_by(claim.epoch, claim.known)
        {
            self.begin_life_after(claim.epoch);
        }
    }

    /// Restores the saved lives from a message.
    pub(super) fn restore_sections(&mut self, message: &[u8]) -> Result<(), MessageError> {
        if let Message::Sections { sections, .. } = Message::decode(message, &self.limits)? {
            for section in &sections {
                self.receive_section(section, None);
            }
        }
        self.spreader.clear_fresh();
        Ok(())
    }

    fn receive_section(&mut self, section: &LifeSection<'_>, from: Option<u32>) -> SectionResult {
        if section.origin == self.robot {
            if self.is_overruled_by(section.epoch, section.version) {
                self.begin_life_after(section.epoch);
            }
            if section.epoch >= self.epoch {
                return SectionResult::Nothing;
            }
        }
        let mut known = 0;
        match self.held.origins.get(&section.origin) {
            Some(origin) if origin.is_void(section.epoch, &self.limits) => return SectionResult::Nothing,
            Some(origin) => known = origin.version(section.epoch),
            None if self.held.origins.len() >= self.limits.robots => {
                self.counters.refused += 1;
                return SectionResult::Nothing;
            }
            None => {}
        }
        if section.version <= known {
            return SectionResult::Nothing;
        }
        let life_id = (section.origin, section.epoch);
        let changes = section.after <= known && section.floor <= known;
        let whole = section.after == 0;
        let stage = match self.held.stages.remove(&life_id) {
            Some(stage) if stage.takes(section) => stage,
            // A part that is there already, or that can't continue. The stage is given up only when it must be.
            Some(stage) if !whole || section.floor <= stage.base && section.through < section.version => {
                self.held.stages.insert(life_id, stage);
                return SectionResult::Nothing;
            }
            _ if !changes && !whole => return SectionResult::Gap,
            _ if section.through < section.version && self.held.stages.len() >= self.limits.stages => {
                return SectionResult::Nothing;
            }
            _ => LifeStage::new(section, known, !changes),
        };
        self.extend(stage, section, from)
    }

    /// Adds a part, and takes the life over when it is the last one.
    fn extend(
        &mut self,
        mut stage: LifeStage,
        section: &LifeSection<'_>,
        from: Option<u32>,
    ) -> SectionResult {
        if !stage.extend(section, &self.limits) {
            self.counters.refused += 1;
            return SectionResult::Nothing;
        }
        if section.through == section.version {
            return self.take_over(section.origin, section.epoch, stage, from);
        }
        self.held.stages.insert((section.origin, section.epoch), stage);
        SectionResult::Part
    }

    /// Applies all parts of a life that were put aside.
    fn take_over(&mut self, robot: u32, epoch: u64, stage: LifeStage, from: Option<u32>) -> SectionResult {
        let held = self.held.origins.get(&robot).and_then(|origin| origin.life(epoch));
        let known = held.map_or(0, |held| held.version);
        let held = held.filter(|_| !stage.whole);
        let (facts, bytes) = held.map_or((0, 0), |held| (held.len(), held.bytes()));
        if facts + stage.entries.len() > self.limits.facts || bytes + stage.bytes > self.limits.bytes {
            // Replaced and dropped facts free memory, so only the result shows whether it fits.
            let mut outcome = held.cloned().unwrap_or_else(|| Life::new(epoch));
            stage.clone().finish(&mut outcome);
            if outcome.exceeds(&self.limits) {
                self.counters.refused += 1;
                return SectionResult::Nothing;
            }
        }
        self.spreader.mark_fresh(robot, epoch, Fresh { after: known, from });
        let origin = self.held.origins.entry(robot).or_default();
        let life = origin.life_mut(epoch);
        if stage.whole {
            self.held.changed.extend(life.keys().cloned(), self.limits.facts);
            *life = Life::new(epoch);
        }
        self.held.changed.extend(stage.entries.iter().map(|(_, entry)| entry.key.clone()), self.limits.facts);
        stage.finish(life);
        origin.drop_void(&self.limits, &mut self.held.changed);
        SectionResult::Something
    }
}
