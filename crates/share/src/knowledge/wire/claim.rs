use super::{WireReader, WireWriter};
use crate::knowledge::MessageError;
use crate::knowledge::version::{epoch, number};

/// How much of a life somebody knows.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Claim {
    pub origin: u32,
    pub epoch: u64,
    /// The version of the life that is known.
    pub known: u64,
    /// The version from which retractions must be told; less than the floor of who tells means: the whole life.
    pub base: u64,
    /// How far a newer version is received already. The same as `known` and `base` when none is being received.
    pub position: u64,
}

impl Claim {
    /// That a version is known, and no newer one is being received.
    pub fn known(origin: u32, epoch: u64, known: u64) -> Self {
        Self { origin, epoch, known, base: known, position: known }
    }

    /// By what claims are ordered in a message: origins upwards, the newest life of an origin first.
    pub fn place(&self) -> (u32, std::cmp::Reverse<u64>) {
        (self.origin, std::cmp::Reverse(self.epoch))
    }

    pub fn write(&self, writer: &mut WireWriter) {
        let staged = (self.base, self.position) != (self.known, self.known);
        writer.number(self.origin.into());
        writer.number(u64::from(number(self.epoch)) << 1 | u64::from(staged));
        writer.bytes(&(self.epoch as u32).to_le_bytes());
        writer.number(self.known);
        if staged {
            writer.number(self.base);
            writer.number(self.position);
        }
    }

    fn read(reader: &mut WireReader<'_>) -> Result<Self, MessageError> {
        let origin = reader.small()?;
        let life = reader.number()?;
        let number = u32::try_from(life >> 1).map_err(|_| reader.expected("a number of a life"))?;
        let epoch = epoch(number, u32::from_le_bytes(reader.fixed()?));
        let mut claim = Self::known(origin, epoch, reader.number()?);
        if life & 1 == 1 {
            (claim.base, claim.position) = (reader.number()?, reader.number()?);
        }
        Ok(claim)
    }

    /// All up to the end of the message, in order and each life once.
    pub fn read_all(reader: &mut WireReader<'_>) -> Result<Vec<Self>, MessageError> {
        let mut claims: Vec<Self> = Vec::new();
        while !reader.is_empty() {
            let claim = Self::read(reader)?;
            if claims.last().is_some_and(|last| last.place() >= claim.place()) {
                return Err(reader.expected("lives in order"));
            }
            claims.push(claim);
        }
        Ok(claims)
    }
}
