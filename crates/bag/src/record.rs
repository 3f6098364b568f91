//! Records of an MCAP file, laid out by <https://mcap.dev/spec>, and nothing more.

use slate_sorted::SortedMap;

/// First and last bytes of a file.
pub(super) const MAGIC: [u8; 8] = *b"\x89MCAP0\r\n";

/// Size of the opcode and the length before each record, bytes.
pub(super) const FRAME_SIZE: u64 = 9;

/// Reason why bytes are no such record.
pub(super) type Malformed = String;

/// Bytes that are read from the front.
pub(super) struct RecordInput<'a>(pub &'a [u8]);

impl<'a> RecordInput<'a> {
    fn take(&mut self, length: u64) -> Result<&'a [u8], Malformed> {
        let available = self.0.len();
        let part = usize::try_from(length).ok().and_then(|length| self.0.split_at_checked(length));
        let (part, rest) =
            part.ok_or_else(|| format!("it needs {length} bytes where {available} are left"))?;
        self.0 = rest;
        Ok(part)
    }

    fn array<const N: usize>(&mut self) -> Result<[u8; N], Malformed> {
        let available = self.0.len();
        let (part, rest) = self
            .0
            .split_first_chunk::<N>()
            .ok_or_else(|| format!("it needs {N} bytes where {available} are left"))?;
        self.0 = rest;
        Ok(*part)
    }

    fn part(&mut self) -> Result<RecordInput<'a>, Malformed> {
        let length = u32::read(self)?;
        self.take(length.into()).map(RecordInput)
    }
}

/// Field of a record.
pub(super) trait Field<'a>: Sized {
    fn read(input: &mut RecordInput<'a>) -> Result<Self, Malformed>;
    fn write(&self, out: &mut Vec<u8>);
}

macro_rules! number {
    ($($type:ty)*) => {$(
        impl<'a> Field<'a> for $type {
            fn read(input: &mut RecordInput<'a>) -> Result<Self, Malformed> {
                input.array().map(Self::from_le_bytes)
            }

            fn write(&self, out: &mut Vec<u8>) {
                out.extend(self.to_le_bytes());
            }
        }
    )*};
}
number!(u8 u16 u32 u64);

/// Writes data after its length.
/// No record that Slate makes is too long for a length: a chunk has a smaller limit, and so have data from another
/// file.
fn write_counted(out: &mut Vec<u8>, write: impl FnOnce(&mut Vec<u8>)) {
    let start = out.len();
    out.extend([0; 4]);
    write(out);
    let length = u32::try_from(out.len() - start - 4).unwrap_or(u32::MAX);
    out[start..start + 4].copy_from_slice(&length.to_le_bytes());
}

impl<'a> Field<'a> for Vec<u8> {
    fn read(input: &mut RecordInput<'a>) -> Result<Self, Malformed> {
        Ok(input.part()?.0.to_vec())
    }

    fn write(&self, out: &mut Vec<u8>) {
        write_counted(out, |out| out.extend(self));
    }
}

impl<'a> Field<'a> for String {
    fn read(input: &mut RecordInput<'a>) -> Result<Self, Malformed> {
        let bytes = input.part()?.0;
        std::str::from_utf8(bytes).map(String::from).map_err(|_| "a text in it is not UTF-8".into())
    }

    fn write(&self, out: &mut Vec<u8>) {
        write_counted(out, |out| out.extend(self.as_bytes()));
    }
}

/// The data of chunks and attachments, whose length has 64 bits.
impl<'a> Field<'a> for &'a [u8] {
    fn read(input: &mut RecordInput<'a>) -> Result<Self, Malformed> {
        let length = u64::read(input)?;
        input.take(length)
    }

    fn write(&self, out: &mut Vec<u8>) {
        (self.len() as u64).write(out);
        out.extend(*self);
    }
}

impl<'a, K: Field<'a> + Ord, V: Field<'a>> Field<'a> for SortedMap<K, V> {
    fn read(input: &mut RecordInput<'a>) -> Result<Self, Malformed> {
        let mut part = input.part()?;
        let mut entries = Vec::new();
        while !part.0.is_empty() {
            entries.push((K::read(&mut part)?, V::read(&mut part)?));
        }
        // As a map is made of many of them the most quickly.
        entries.sort_unstable_by(|(a, _), (b, _)| a.cmp(b));
        if entries.windows(2).any(|pair| pair[0].0 == pair[1].0) {
            return Err("a key in it stands there twice".into());
        }
        Ok(entries.into_iter().collect())
    }

    fn write(&self, out: &mut Vec<u8>) {
        write_counted(out, |out| {
            for (key, value) in self {
                key.write(out);
                value.write(out);
            }
        });
    }
}

impl<'a> Field<'a> for Vec<(u64, u64)> {
    fn read(input: &mut RecordInput<'a>) -> Result<Self, Malformed> {
        let mut part = input.part()?;
        let mut entries = Self::with_capacity(part.0.len() / 16);
        while !part.0.is_empty() {
            entries.push((u64::read(&mut part)?, u64::read(&mut part)?));
        }
        Ok(entries)
    }

    fn write(&self, out: &mut Vec<u8>) {
        write_counted(out, |out| {
            for (time, offset) in self {
                time.write(out);
                offset.write(out);
            }
        });
    }
}

/// Record of a file: its opcode, its reading and its writing.
pub(super) trait Record<'a>: Sized {
    const OPCODE: u8;
    const NAME: &'static str;

    fn fields(input: &mut RecordInput<'a>) -> Result<Self, Malformed>;
    fn write_fields(&self, out: &mut Vec<u8>);

    /// Reads all of the bytes.
    fn parse(bytes: &'a [u8]) -> Result<Self, Malformed> {
        let mut input = RecordInput(bytes);
        let record = Self::fields(&mut input).map_err(|what| format!("no whole {}: {what}", Self::NAME))?;
        match input.0.len() {
            0 => Ok(record),
            more => Err(format!("no {}: it has {more} bytes more than its fields", Self::NAME)),
        }
    }

    /// Appends the record with its frame.
    fn append(&self, out: &mut Vec<u8>) {
        out.push(Self::OPCODE);
        let start = out.len();
        out.extend([0; 8]);
        self.write_fields(out);
        let length = (out.len() - start - 8) as u64;
        out[start..start + 8].copy_from_slice(&length.to_le_bytes());
    }
}

macro_rules! record {
    ($(#[$about:meta])* $visibility:vis $name:ident $(<$life:lifetime>)?, $opcode:literal, $text:literal {
        $($(#[$of_field:meta])* $field:ident: $type:ty,)*
    }) => {
        $(#[$about])*
        #[derive(Clone, Debug, Default, PartialEq, Eq)]
        $visibility struct $name $(<$life>)? {
            $($(#[$of_field])* pub $field: $type,)*
        }

        impl<'a> Record<'a> for record!(@type $name $($life)?) {
            const OPCODE: u8 = $opcode;
            const NAME: &'static str = $text;

            fn fields(input: &mut RecordInput<'a>) -> Result<Self, Malformed> {
                Ok(Self { $($field: Field::read(input)?,)* })
            }

            fn write_fields(&self, out: &mut Vec<u8>) {
                $(self.$field.write(out);)*
            }
        }
    };
    (@type $name:ident) => { $name };
    (@type $name:ident $life:lifetime) => { $name<'a> };
}

record! {
    /// Program that wrote a file, and its conventions.
    pub Header, 0x01, "header" {
        /// Profile: conventions of the file, such as `ros2`; empty if none.
        profile: String,
        /// Program that wrote it.
        library: String,
    }
}

record! {
    pub(super) Footer, 0x02, "footer" {
        summary_start: u64,
        summary_offset_start: u64,
        summary_crc: u32,
    }
}

record! {
    /// Layout of the values of channels.
    pub Schema, 0x03, "schema" {
        /// Number in the file, never 0.
        id: u16,
        /// The name of the type, such as `sensor_msgs/msg/Range`.
        name: String,
        /// Encoding of `data`, such as `ros2msg`.
        encoding: String,
        /// The definition.
        data: Vec<u8>,
    }
}

record! {
    /// A stream of messages of one type.
    pub Channel, 0x04, "channel" {
        /// Number in the file.
        id: u16,
        /// The number of its schema; 0 if it has none.
        schema_id: u16,
        /// Name, such as `/r2/wheels/odometry`.
        topic: String,
        /// Encoding of messages, such as `cdr`.
        message_encoding: String,
        /// Further properties.
        metadata: SortedMap<String, String>,
    }
}

/// All remaining bytes.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub(super) struct Rest<'a>(pub &'a [u8]);

impl<'a> Field<'a> for Rest<'a> {
    fn read(input: &mut RecordInput<'a>) -> Result<Self, Malformed> {
        Ok(Self(std::mem::take(&mut input.0)))
    }

    fn write(&self, out: &mut Vec<u8>) {
        out.extend(self.0);
    }
}

record! {
    pub(super) MessageRecord<'a>, 0x05, "message" {
        channel_id: u16,
        sequence: u32,
        log_time: u64,
        publish_time: u64,
        data: Rest<'a>,
    }
}

record! {
    pub(super) Chunk<'a>, 0x06, "chunk" {
        message_start_time: u64,
        message_end_time: u64,
        uncompressed_size: u64,
        uncompressed_crc: u32,
        compression: String,
        records: &'a [u8],
    }
}

record! {
    pub(super) MessageIndex, 0x07, "message index" {
        channel_id: u16,
        records: Vec<(u64, u64)>,
    }
}

record! {
    pub(super) ChunkIndex, 0x08, "chunk index" {
        message_start_time: u64,
        message_end_time: u64,
        chunk_start_offset: u64,
        chunk_length: u64,
        message_index_offsets: SortedMap<u16, u64>,
        message_index_length: u64,
        compression: String,
        compressed_size: u64,
        uncompressed_size: u64,
    }
}

record! {
    pub(super) AttachmentRecord<'a>, 0x09, "attachment" {
        log_time: u64,
        create_time: u64,
        name: String,
        media_type: String,
        data: &'a [u8],
        crc: u32,
    }
}

record! {
    pub(super) AttachmentIndex, 0x0a, "attachment index" {
        offset: u64,
        length: u64,
        log_time: u64,
        create_time: u64,
        data_size: u64,
        name: String,
        media_type: String,
    }
}

record! {
    pub(super) Statistics, 0x0b, "statistics" {
        message_count: u64,
        schema_count: u16,
        channel_count: u32,
        attachment_count: u32,
        metadata_count: u32,
        chunk_count: u32,
        message_start_time: u64,
        message_end_time: u64,
        channel_message_counts: SortedMap<u16, u64>,
    }
}

record! {
    /// Texts under a name, such as the metadata of a run.
    pub Metadata, 0x0c, "metadata" {
        /// Name of the metadata.
        name: String,
        /// The texts by key.
        metadata: SortedMap<String, String>,
    }
}

record! {
    pub(super) MetadataIndex, 0x0d, "metadata index" {
        offset: u64,
        length: u64,
        name: String,
    }
}

record! {
    pub(super) SummaryOffset, 0x0e, "summary offset" {
        group_opcode: u8,
        group_start: u64,
        group_length: u64,
    }
}

record! {
    pub(super) DataEnd, 0x0f, "end of data" {
        data_section_crc: u32,
    }
}

/// Returns the checksum of an attachment: of its record without that checksum.
pub(super) fn attachment_crc(record: &[u8]) -> u32 {
    crc32fast::hash(&record[..record.len().saturating_sub(4)])
}

/// Iterator over the records of a chunk: offset in the chunk, opcode and bytes.
pub(super) struct Records<'a> {
    bytes: &'a [u8],
    offset: usize,
}

impl<'a> Records<'a> {
    pub fn new(bytes: &'a [u8]) -> Self {
        Self { bytes, offset: 0 }
    }
}

impl<'a> Iterator for Records<'a> {
    type Item = Result<(u64, u8, &'a [u8]), Malformed>;

    /// Returns the next record; an invalid frame ends the iteration.
    fn next(&mut self) -> Option<Self::Item> {
        let rest = &self.bytes[self.offset..];
        if rest.is_empty() {
            return None;
        }
        let offset = self.offset as u64;
        let mut input = RecordInput(rest);
        let record = u8::read(&mut input).and_then(|opcode| Ok((offset, opcode, Field::read(&mut input)?)));
        self.offset = match &record {
            Ok(_) => self.bytes.len() - input.0.len(),
            Err(_) => self.bytes.len(),
        };
        Some(record.map_err(|what| format!("no whole record at byte {offset} of it: {what}")))
    }
}
