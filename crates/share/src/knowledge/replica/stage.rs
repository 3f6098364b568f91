use crate::knowledge::Limits;
use crate::knowledge::life::{Life, LifeEntry};
use crate::knowledge::wire::LifeSection;

/// Ticks without another part after which a partly received life is dropped.
/// The sender may never return.
const STAGE_TIMEOUT: u32 = 8;

/// Partly received newer version of a life.
///
/// Its parts may belong to growing versions, as the author continues during the transfer. It then also contains entries
/// that later parts replace, and is exact at the version of its last part. Meanwhile retracted facts are in later
/// parts, too, as no part may have a floor above `base`.
#[derive(Clone, Debug)]
pub(super) struct LifeStage {
    /// Version whose changes are collected.
    /// For a whole life, the version of its first part.
    pub base: u64,
    /// Position up to which entries are received.
    pub position: u64,
    /// Replacement of the whole stored life, not only of changes.
    pub whole: bool,
    /// Received entries, in order.
    pub entries: Vec<(u64, LifeEntry)>,
    /// Memory of the entries, bytes, by the measure of [`Limits::bytes`].
    pub bytes: usize,
    /// Version, floor and closing flag of the last part.
    pub version: u64,
    pub floor: u64,
    pub closes: bool,
    idle: u32,
}

impl LifeStage {
    /// Begins at the known version, or at 0 for a whole life.
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

    /// Returns whether the part continues the received ones.
    pub fn takes(&self, section: &LifeSection<'_>) -> bool {
        section.version >= self.version
            && section.floor <= self.base
            && section.after <= self.position
            && section.through > self.position
    }

    /// Appends a part that [continues](Self::takes) the received ones.
    /// Returns false if they exceed the limits of a life.
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

    /// Brings the life to the version of the last part.
    pub fn finish(self, life: &mut Life) {
        for (sequence, entry) in self.entries {
            life.insert(sequence, entry);
        }
        (life.version, life.closes) = (self.version, self.closes);
        life.raise_floor(self.floor);
    }

    /// Counts a tick; returns false if the stage has timed out.
    pub fn wait(&mut self) -> bool {
        self.idle += 1;
        self.idle <= STAGE_TIMEOUT
    }
}
