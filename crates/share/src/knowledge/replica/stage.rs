use crate::knowledge::Limits;
use crate::knowledge::life::Life;
use crate::knowledge::wire::Section;

/// After how many ticks without another part a life that is received in parts is given up, so that who sent them need
/// not come back.
const PATIENCE: u32 = 8;

/// A newer version of a life, as far as its parts are there.
///
/// Its parts may be of versions that grow, as the author goes on while they are sent: then it also has what is replaced
/// in later parts, and is exact at the version of its last part. What was retracted meanwhile is in later parts too, as
/// no part may have a floor above `base`.
#[derive(Clone, Debug)]
pub(super) struct Stage {
    /// What changed since this version is collected; for a whole life, the version of its first part.
    pub base: u64,
    /// Up to here it is there.
    pub position: u64,
    /// Whether it takes the place of all that is held of the life.
    pub whole: bool,
    /// What is there, with the version of the last part.
    pub life: Life,
    /// The floor of the last part.
    pub floor: u64,
    idle: u32,
}

impl Stage {
    /// Begins at what is known, or at nothing for a whole life.
    pub fn new(section: &Section<'_>, known: u64, whole: bool) -> Self {
        let (base, position) = if whole { (section.version, 0) } else { (known, known) };
        Self { base, position, whole, life: Life::new(section.epoch), floor: 0, idle: 0 }
    }

    /// Whether the part continues it.
    pub fn takes(&self, section: &Section<'_>) -> bool {
        section.version >= self.life.version
            && section.floor <= self.base
            && section.after <= self.position
            && section.through > self.position
    }

    /// Takes a part that [continues](Self::takes) it; false when it is larger than any life may become.
    pub fn extend(&mut self, section: &Section<'_>, limits: &Limits) -> bool {
        for entry in section.entries(self.position, limits) {
            self.life.insert(entry.sequence, entry.to_entry());
        }
        self.position = section.through;
        self.idle = 0;
        (self.life.version, self.life.closes, self.floor) = (section.version, section.closes, section.floor);
        self.life.len() <= 2 * limits.facts && self.life.bytes() <= 2 * limits.bytes
    }

    /// Lets a tick pass; says whether there is still hope.
    pub fn wait(&mut self) -> bool {
        self.idle += 1;
        self.idle <= PATIENCE
    }
}
