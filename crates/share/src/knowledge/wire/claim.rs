use super::{WireReader, WireWriter};
use crate::knowledge::MessageError;
use crate::knowledge::version::{epoch, number};

/// State of a life as one robot stores it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Claim {
    pub origin: u32,
    pub epoch: u64,
    /// Stored version of the life.
    pub known: u64,
    /// Version from which the robot needs retractions.
    /// If it is below the sender's floor, the robot needs the whole life.
    pub base: u64,
    /// Received position of a newer version.
    /// Equals `known` and `base` if no newer version is being received.
    pub position: u64,
}

impl Claim {
    /// Creates the claim of a known version without a newer one being received.
    pub fn known(origin: u32, epoch: u64, known: u64) -> Self {
        Self { origin, epoch, known, base: known, position: known }
    }

    /// Sort key of claims in a message: origins ascending, an origin's newest first.
    pub fn life_id(&self) -> (u32, std::cmp::Reverse<u64>) {
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

    /// Reads all claims to the end of the message.
    /// They must be in order, and each life must occur once.
    pub fn read_all(reader: &mut WireReader<'_>) -> Result<Vec<Self>, MessageError> {
        let mut claims: Vec<Self> = Vec::new();
        while !reader.is_empty() {
            let claim = Self::read(reader)?;
            if claims.last().is_some_and(|last| last.life_id() >= claim.life_id()) {
                return Err(reader.expected("lives in order"));
            }
            claims.push(claim);
        }
        Ok(claims)
    }
}
