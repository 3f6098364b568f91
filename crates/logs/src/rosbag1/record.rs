use std::io::Read;

use slate_sorted::SortedMap;

use slate_bag::MAXIMUM_RECORD;

/// Named fields, and the bytes that they are about.
pub(super) struct BagRecord {
    pub header: SortedMap<Vec<u8>, Vec<u8>>,
    pub data: Vec<u8>,
}

/// Headers say little, but a connection's may hold a definition.
const MAX_HEADER_SIZE: u64 = 16 << 20;

impl BagRecord {
    /// Parses fields `name=value`, each with its length before it.
    pub fn fields(mut bytes: &[u8]) -> Result<SortedMap<Vec<u8>, Vec<u8>>, String> {
        let mut fields = SortedMap::new();
        while !bytes.is_empty() {
            let (length, rest) = bytes.split_first_chunk().ok_or("a field has no length")?;
            let length = u32::from_le_bytes(*length) as usize;
            let field = rest.get(..length);
            let field = field
                .ok_or_else(|| format!("a field should have {length} bytes, and {} are left", rest.len()))?;
            let end = field.iter().position(|byte| *byte == b'=').ok_or("a field has no `=`")?;
            fields.insert(field[..end].to_vec(), field[end + 1..].to_vec());
            bytes = &rest[length..];
        }
        Ok(fields)
    }

    fn field(&self, name: &[u8]) -> Result<&[u8], String> {
        let field = self.header.get(name).map(Vec::as_slice);
        field.ok_or_else(|| format!("it has no `{}`", String::from_utf8_lossy(name)))
    }

    /// Returns a little-endian number.
    pub fn number(&self, name: &[u8], size: usize) -> Result<u64, String> {
        let field = self.field(name)?;
        if field.len() != size {
            let name = String::from_utf8_lossy(name);
            return Err(format!("its `{name}` has {} bytes, not {size}", field.len()));
        }
        Ok(field.iter().rev().fold(0, |number, byte| number << 8 | u64::from(*byte)))
    }

    pub fn text(&self, name: &[u8]) -> Result<String, String> {
        let field = String::from_utf8(self.field(name)?.to_vec());
        field.map_err(|_| format!("its `{}` is not UTF-8", String::from_utf8_lossy(name)))
    }
}

/// The records of a file or of a chunk.
pub(super) struct Records<R> {
    input: R,
    offset: u64,
}

impl<R: Read> Records<R> {
    pub fn new(input: R, offset: u64) -> Self {
        Self { input, offset }
    }

    /// Returns the offset of the next record.
    pub fn offset(&self) -> u64 {
        self.offset
    }

    /// Returns the next record; `None` at the end.
    pub fn next(&mut self) -> Result<Option<BagRecord>, String> {
        let Some(header) = self.part(MAX_HEADER_SIZE, true)? else { return Ok(None) };
        let header = BagRecord::fields(&header)?;
        let data = self.part(MAXIMUM_RECORD, false)?.unwrap_or_default();
        Ok(Some(BagRecord { header, data }))
    }

    /// Reads bytes with their length before them.
    /// Memory is allocated as they come.
    fn part(&mut self, most: u64, may_end: bool) -> Result<Option<Vec<u8>>, String> {
        let length = self.bytes(4)?;
        if length.is_empty() && may_end {
            return Ok(None);
        }
        let length = <[u8; 4]>::try_from(length).map_err(|_| "the file ends in the length of a record")?;
        let length = u64::from(u32::from_le_bytes(length));
        if length > most {
            return Err(format!("a part of a record has {length} bytes, and at most {most} are read"));
        }
        let part = self.bytes(length)?;
        match part.len() as u64 {
            found if found == length => Ok(Some(part)),
            found => {
                Err(format!("the file ends in a record: {length} bytes should follow, there are {found}"))
            }
        }
    }

    fn bytes(&mut self, length: u64) -> Result<Vec<u8>, String> {
        let mut bytes = Vec::new();
        let read =
            (&mut self.input).take(length).read_to_end(&mut bytes).map_err(|error| error.to_string())?;
        self.offset += read as u64;
        Ok(bytes)
    }
}
