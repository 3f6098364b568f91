//! File as a sequence of records, each of which is read whole.

use std::io::{self, Read, Seek, SeekFrom};
use std::path::{Path, PathBuf};

use super::record::{FRAME_SIZE, Record};
use super::{Error, MAXIMUM_RECORD};

/// Offset of a record, and the content of its frame.
#[derive(Clone, Copy, Debug)]
pub(super) struct RecordFrame {
    pub offset: u64,
    pub opcode: u8,
    pub length: u64,
}

impl RecordFrame {
    /// Returns the offset of the next record.
    pub fn end(&self) -> u64 {
        self.offset + self.size()
    }

    /// Returns the size of the record with its frame, bytes.
    pub fn size(&self) -> u64 {
        FRAME_SIZE + self.length
    }

    /// Returns the bytes of the frame in the file.
    pub fn bytes(&self) -> [u8; FRAME_SIZE as usize] {
        let mut bytes = [self.opcode; FRAME_SIZE as usize];
        bytes[1..].copy_from_slice(&self.length.to_le_bytes());
        bytes
    }
}

/// Reads records, with the checksum of everything read since its reset.
pub(super) struct RecordSource<R> {
    input: R,
    path: PathBuf,
    length: u64,
    position: u64,
    pub crc: crc32fast::Hasher,
}

impl<R: Read + Seek> RecordSource<R> {
    pub fn new(mut input: R, path: &Path) -> Result<Self, Error> {
        let length = input.seek(SeekFrom::End(0)).and_then(|length| input.rewind().map(|()| length));
        let failed = |source| Error::Read { path: path.into(), source };
        let (length, crc) = (length.map_err(failed)?, crc32fast::Hasher::new());
        Ok(Self { input, path: path.into(), length, position: 0, crc })
    }

    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Returns the size of the file, bytes.
    pub fn length(&self) -> u64 {
        self.length
    }

    /// Returns the current offset.
    pub fn position(&self) -> u64 {
        self.position
    }

    pub fn damaged(&self, offset: u64, what: impl Into<String>) -> Error {
        Error::Damaged { path: self.path.clone(), offset, what: what.into() }
    }

    pub fn seek(&mut self, offset: u64) -> Result<(), Error> {
        if self.position != offset {
            // A short seek keeps the buffer.
            let moved = match i64::try_from(i128::from(offset) - i128::from(self.position)) {
                Ok(distance) => self.input.seek_relative(distance),
                Err(_) => self.input.seek(SeekFrom::Start(offset)).map(drop),
            };
            moved.map_err(|error| self.failed(error))?;
            self.position = offset;
        }
        Ok(())
    }

    fn failed(&self, source: io::Error) -> Error {
        Error::Read { path: self.path.clone(), source }
    }

    /// Reads `length` bytes, or fewer at the end of the file.
    /// The buffer grows with the bytes read.
    pub fn part(&mut self, length: u64, buffer: &mut Vec<u8>) -> Result<(), Error> {
        buffer.clear();
        let read = (&mut self.input).take(length).read_to_end(buffer).map_err(|error| self.failed(error))?;
        self.position += read as u64;
        self.crc.update(buffer);
        Ok(())
    }

    /// Reads the frame of the next record, which is all there and not too long.
    pub fn frame(&mut self) -> Result<RecordFrame, Error> {
        let offset = self.position;
        let mut bytes = Vec::new();
        self.part(FRAME_SIZE, &mut bytes)?;
        let [opcode, length @ ..] = &bytes[..] else {
            return Err(self.damaged(offset, "the file ends where a record should begin"));
        };
        let Ok(length) = <[u8; 8]>::try_from(length) else {
            return Err(self.damaged(offset, "the file ends in the frame of a record"));
        };
        let frame = RecordFrame { offset, opcode: *opcode, length: u64::from_le_bytes(length) };
        let left = self.length.saturating_sub(self.position);
        if frame.length > left {
            let what = format!(
                "the file ends in a record of opcode {opcode:#04x}: it should have {} bytes, and {left} are left",
                frame.length
            );
            return Err(self.damaged(offset, what));
        }
        if frame.length > MAXIMUM_RECORD {
            let what = format!(
                "a record of opcode {opcode:#04x} has {} bytes, and at most {MAXIMUM_RECORD} are read",
                frame.length
            );
            return Err(self.damaged(offset, what));
        }
        Ok(frame)
    }

    /// Reads the body of a record, after its frame.
    pub fn body(&mut self, frame: RecordFrame, buffer: &mut Vec<u8>) -> Result<(), Error> {
        self.part(frame.length, buffer)?;
        if buffer.len() as u64 != frame.length {
            return Err(self.damaged(frame.offset, "the file has become shorter while it was read"));
        }
        Ok(())
    }

    /// Parses the record of a frame from its body.
    pub fn parse<'a, T: Record<'a>>(&self, frame: RecordFrame, body: &'a [u8]) -> Result<T, Error> {
        T::parse(body).map_err(|what| self.damaged(frame.offset, what))
    }
}
