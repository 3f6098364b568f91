//! Definitions repeated in a file outside of its chunks.
//! Thus a damaged chunk does not take other chunks with it, whose messages need its definitions.

use slate_sorted::SortedSet;

use super::definitions::Definitions;
use super::record::{Channel, Malformed, Record, Records, Schema};

/// Opcode of a record with repeated definitions.
/// Readers skip unknown records from 0x80 on.
pub const REPEATED: u8 = 0x80;

/// First bytes, as others may use that opcode; the checksum of the rest follows.
const MARKER: &[u8] = b"slate definitions\0";

/// Definitions that are to be repeated.
#[derive(Debug, Default)]
pub struct Repeated {
    records: Vec<u8>,
    schemas: SortedSet<u16>,
}

impl Repeated {
    /// Repeats a channel, with its schema.
    pub fn add(&mut self, schema: &Schema, channel: &Channel) {
        if self.schemas.insert(schema.id) {
            schema.append(&mut self.records);
        }
        channel.append(&mut self.records);
    }

    /// Returns the body of the next record.
    /// `None` if nothing was added since the last one.
    pub fn take(&mut self) -> Option<Vec<u8>> {
        let Self { records, .. } = std::mem::take(self);
        (!records.is_empty()).then(|| [MARKER, &crc32fast::hash(&records).to_le_bytes(), &records].concat())
    }
}

/// Returns the records in the body of such a record, or its fault.
/// `None` for a record of another writer.
pub(super) fn sound(body: &[u8]) -> Option<Result<&[u8], Malformed>> {
    let (recorded, records) = body.strip_prefix(MARKER)?.split_first_chunk::<4>()?;
    let (recorded, found) = (u32::from_le_bytes(*recorded), crc32fast::hash(records));
    Some(match recorded == found {
        true => Ok(records),
        false => {
            Err(format!("the checksum of repeated definitions is {found:08x} and should be {recorded:08x}"))
        }
    })
}

/// Adds the repeated definitions to the known ones.
pub(super) fn take(records: &[u8], definitions: &mut Definitions) -> Result<(), Malformed> {
    for record in Records::new(records) {
        let (_, opcode, bytes) = record?;
        definitions.take(opcode, bytes)?;
    }
    Ok(())
}
