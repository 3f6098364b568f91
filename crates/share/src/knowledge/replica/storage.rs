use super::Replica;
use crate::knowledge::version::{epoch, number};
use crate::knowledge::wire::{Message, Reader, write_section};
use crate::knowledge::{Limits, RestoreError};

impl Replica {
    /// All that is known, for [`restore`](Self::restore). Save it now and then, such as at the end of a mission; nothing
    /// depends on how old it is.
    pub fn save(&self) -> Vec<u8> {
        let mut saved = [self.robot.to_le_bytes(), number(self.epoch).to_le_bytes()].concat();
        for (robot, origin) in &self.origins {
            for life in &origin.lives {
                let mut position = 0;
                while position < life.version {
                    let mut writer = Message::sections();
                    let through = write_section(&mut writer, *robot, life, position, self.limits.message);
                    let Some(through) = through else { break };
                    position = through;
                    let message = writer.finish();
                    saved.extend((message.len() as u32).to_le_bytes());
                    saved.extend(message);
                }
            }
        }
        let checksum = xxhash_rust::xxh3::xxh3_64(&saved);
        saved.extend(checksum.to_le_bytes());
        saved
    }

    /// The replica of a robot that comes back with what it had [saved](Self::save). `random` must differ from start to
    /// start. The facts that it stated itself are those of an earlier life of it: they stand until it states something
    /// else about their keys or retracts them.
    ///
    /// # Errors
    /// When the bytes are damaged, another robot's, or were saved with other limits.
    pub fn restore(robot: u32, random: u32, limits: Limits, saved: &[u8]) -> Result<Self, RestoreError> {
        let (content, checksum) = saved.split_last_chunk().ok_or(RestoreError::Damaged)?;
        if xxhash_rust::xxh3::xxh3_64(content) != u64::from_le_bytes(*checksum) {
            return Err(RestoreError::Damaged);
        }
        let mut replica = Self::new(robot, random, limits);
        let mut reader = Reader::new(content);
        let [who, life] = [reader.fixed()?, reader.fixed()?].map(u32::from_le_bytes);
        if who != robot {
            return Err(RestoreError::Robot { saved: who, robot });
        }
        replica.epoch = epoch(life.saturating_add(1), random);
        while !reader.is_empty() {
            let length = u32::from_le_bytes(reader.fixed()?);
            let message = reader.bytes(length as usize)?;
            replica.take_back(message)?;
        }
        Ok(replica)
    }
}
