//! Summary of a file, behind its data.

use std::io::{Read, Seek};

use super::Error;
use super::definitions::Definitions;
use super::record::{
    AttachmentIndex, Channel, ChunkIndex, FRAME_SIZE, Footer, MAGIC, MetadataIndex, Record, Schema,
    Statistics, SummaryOffset,
};
use super::source::{RecordFrame, RecordSource};

/// Content of a summary.
#[derive(Debug, Default)]
pub(super) struct Summary {
    /// Offset of the summary.
    pub start: u64,
    pub definitions: Definitions,
    pub chunks: Vec<ChunkIndex>,
    pub attachments: Vec<AttachmentIndex>,
    pub metadata: Vec<MetadataIndex>,
    pub statistics: Option<Statistics>,
    /// Checksum; 0 for none.
    pub crc: u32,
}

impl Summary {
    /// Returns true if the summary is empty.
    pub fn is_empty(&self) -> bool {
        let Self { definitions: Definitions { schemas, channels }, chunks, attachments, metadata, .. } = self;
        let counts = [schemas.len(), channels.len(), chunks.len(), attachments.len(), metadata.len()];
        counts == [0; 5] && self.statistics.is_none()
    }

    /// Reads the records after the data, and the end of the file.
    pub fn read<R: Read + Seek>(source: &mut RecordSource<R>, body: &mut Vec<u8>) -> Result<Self, Error> {
        let start = source.position();
        source.crc.reset();
        let mut summary = Self { start, ..Self::default() };
        let mut groups: Vec<SummaryOffset> = Vec::new();
        let mut offsets: Vec<SummaryOffset> = Vec::new();
        let mut offsets_start = 0;
        loop {
            let before = source.crc.clone();
            let frame = source.frame()?;
            source.body(frame, body)?;
            match frame.opcode {
                Footer::OPCODE => {
                    let footer: Footer = source.parse(frame, body)?;
                    // Some writers give the place of the first record also without records.
                    let is_empty = groups.is_empty() && offsets.is_empty();
                    let is_start = footer.summary_start == start && !is_empty
                        || footer.summary_start == 0 && groups.is_empty();
                    let recorded = footer.summary_offset_start;
                    if !is_start
                        || recorded != offsets_start && (recorded, offsets.is_empty()) != (frame.offset, true)
                    {
                        let what = "the footer has a wrong position of the summary";
                        return Err(source.damaged(frame.offset, what));
                    }
                    summary.crc = footer.summary_crc;
                    check_crc(source, before, frame, body, footer.summary_crc)?;
                    break;
                }
                SummaryOffset::OPCODE => {
                    if offsets.is_empty() {
                        offsets_start = frame.offset;
                    }
                    offsets.push(source.parse(frame, body)?);
                }
                _ if !offsets.is_empty() => {
                    let what = "a record of the summary stands behind its offsets";
                    return Err(source.damaged(frame.offset, what));
                }
                opcode => {
                    summary.take(source, frame, body)?;
                    match groups.last_mut() {
                        Some(group) if group.group_opcode == opcode => group.group_length += frame.size(),
                        _ => groups.push(SummaryOffset {
                            group_opcode: opcode,
                            group_start: frame.offset,
                            group_length: frame.size(),
                        }),
                    }
                }
            }
        }
        let is_right = |offset: &SummaryOffset| match offset.group_length {
            // Some writers say also of what they have none where it would be.
            0 => {
                (start..=offsets_start).contains(&offset.group_start)
                    && groups.iter().all(|group| group.group_opcode != offset.group_opcode)
            }
            _ => groups.contains(offset),
        };
        if let Some(SummaryOffset { group_opcode, group_start, group_length }) =
            offsets.iter().find(|offset| !is_right(offset))
        {
            let what = format!(
                "its summary offset is wrong: {group_length} bytes of records of opcode {group_opcode:#04x} at \
                 byte {group_start}"
            );
            return Err(source.damaged(offsets_start, what));
        }
        end(source)?;
        Ok(summary)
    }

    fn take<R: Read + Seek>(
        &mut self,
        source: &RecordSource<R>,
        frame: RecordFrame,
        body: &[u8],
    ) -> Result<(), Error> {
        let damaged = |what: String| source.damaged(frame.offset, format!("in the summary, {what}"));
        match frame.opcode {
            Schema::OPCODE => {
                self.definitions.add_schema(source.parse(frame, body)?).map_err(damaged)?;
            }
            Channel::OPCODE => {
                // Its schema may follow; readers know it from the data.
                let channel: Channel = source.parse(frame, body)?;
                if self.definitions.channels.insert(channel.id, channel.into()).is_some() {
                    return Err(damaged("a channel stands twice".into()));
                }
            }
            ChunkIndex::OPCODE => self.chunks.push(source.parse(frame, body)?),
            AttachmentIndex::OPCODE => self.attachments.push(source.parse(frame, body)?),
            MetadataIndex::OPCODE => self.metadata.push(source.parse(frame, body)?),
            Statistics::OPCODE => {
                if self.statistics.replace(source.parse(frame, body)?).is_some() {
                    return Err(damaged("the statistics stand twice".into()));
                }
            }
            private if private >= 0x80 => {}
            other => return Err(damaged(format!("a record of opcode {other:#04x} is not allowed"))),
        }
        Ok(())
    }
}

fn check_crc<R: Read + Seek>(
    source: &RecordSource<R>,
    mut crc: crc32fast::Hasher,
    frame: RecordFrame,
    body: &[u8],
    recorded: u32,
) -> Result<(), Error> {
    // All but the checksum itself.
    crc.update(&frame.bytes());
    crc.update(&body[..body.len().saturating_sub(4)]);
    let found = crc.finalize();
    if recorded != 0 && found != recorded {
        let what = format!("the checksum of the summary is {found:08x} and should be {recorded:08x}");
        return Err(source.damaged(frame.offset, what));
    }
    Ok(())
}

/// Checks the end of the file.
fn end<R: Read + Seek>(source: &mut RecordSource<R>) -> Result<(), Error> {
    let offset = source.position();
    let mut bytes = Vec::new();
    source.part(MAGIC.len() as u64 + FRAME_SIZE, &mut bytes)?;
    match bytes == MAGIC {
        true => Ok(()),
        false => Err(source.damaged(offset, "what follows the footer is not the end of an MCAP file")),
    }
}
