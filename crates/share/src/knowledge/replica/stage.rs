use crate::knowledge::Limits;
use crate::knowledge::life::{Life, LifeEntry};
use crate::knowledge::wire::LifeSection;

/// After how many ticks without another part a life that is received in parts is given up, so that who sent them need
/// not come back.
const IDLE_TICKS: u32 = 8;

/// A newer version of a life, as far as its parts are there.
///
/// Its parts may be of versions that grow, as the author goes on while they are sent: then it also has what is replaced
/// in later parts, and is exact at the version of its last part. What was retracted meanwhile is in later parts too, as
/// no part may have a floor above `base`.
#[derive(Clone, Debug)]
pub(super) struct LifeStage {
    /// What changed since this version is collected; for a whole life, the version of its first part.
    pub base: u64,
    /// Up to here it is there.
    pub position: u64,
    /// Whether it takes the place of all that is held of the life.
    pub whole: bool,
    /// What is there, in order.
    pub entries: Vec<(u64, LifeEntry)>,
    /// What it counts for, bytes.
    pub bytes: usize,
    /// What the last part said of the life.
    pub version: u64,
    pub floor: u64,
    pub closes: bool,
    idle: u32,
}

impl LifeStage {
    /// Begins at what is known, or at nothing for a whole life.
    pub fn new(section: &LifeSection<'_>, known: u64, whole: bool) -> Self {
        let (base, position) = if whole { (section.version, 0) } else { (known, known) };
        Self {
            base,
            position,
            whole,
            entries: Vec::new(),
            bytes: 0,
            version: 0,
            floor: 0,
            closes: false,
            idle: 0,
        }
    }

    /// Whether the part continues it.
    pub fn takes(&self, section: &LifeSection<'_>) -> bool {
        section.version >= self.version
            && section.floor <= self.base
            && section.after <= self.position
            && section.through > self.position
    }

    /// Takes a part that [continues](Self::takes) it; false when it is larger than any life may become.
    pub fn extend(&mut self, section: &LifeSection<'_>, limits: &Limits) -> bool {
        for entry in section.entries(self.position, limits) {
            let (sequence, entry) = (entry.sequence, entry.to_entry());
            self.bytes += entry.bytes();
            self.entries.push((sequence, entry));
        }
        self.position = section.through;
        self.idle = 0;
        (self.version, self.floor, self.closes) = (section.version, section.floor, section.closes);
        self.entries.len() / 2 <= limits.facts && self.bytes / 2 <= limits.bytes
    }

    /// Makes the life what it is at the version of the last part.
    pub fn finish(self, life: &mut Life) {
        for (sequence, entry) in self.entries {
            life.insert(sequence, entry);
        }
        (life.version, life.closes) = (self.version, self.closes);
        life.raise_floor(self.floor);
    }

    /// Lets a tick pass; says whether there is still hope.
    pub fn wait(&mut self) -> bool {
        self.idle += 1;
        self.idle <= IDLE_TICKS
    }
}
