//! What robots say to each other, as bytes.
//!
//! A message is a version of the format, a kind, and items up to its end. Numbers are LEB128 varints unless their width
//! is named. Whoever decodes a message goes through all of it first, and allocates in proportion to what is there, not to what it
//! says of its length.

mod claim;
mod reader;
mod section;
mod writer;

pub(crate) use claim::Claim;
pub(crate) use reader::WireReader;
pub(crate) use section::{LifeSection, write_section};
pub(crate) use writer::WireWriter;

use super::{Limits, MessageError};

/// Changes with the format; another one is refused.
const FORMAT: u8 = 1;

const DIGEST: u8 = 0;
const REQUEST: u8 = 1;
const SECTIONS: u8 = 2;

/// A message, gone through.
pub(crate) enum Message<'a> {
    /// All that the sender knows of the origins from the first to the last.
    Digest { first: u32, last: u32, claims: Vec<Claim> },
    /// The sender wants what is newer than this, of these lives.
    Request { claims: Vec<Claim> },
    /// Parts of lives. With `more`, the sender had more than fitted.
    Sections { more: bool, sections: Vec<LifeSection<'a>> },
}

impl<'a> Message<'a> {
    pub fn decode(bytes: &'a [u8], limits: &Limits) -> Result<Self, MessageError> {
        let mut reader = WireReader::new(bytes);
        if bytes.len() > limits.message {
            return Err(reader.expected("no message of that length"));
        }
        if reader.byte()? != FORMAT {
            return Err(reader.expected("a format that this version of Slate knows"));
        }
        match reader.byte()? {
            DIGEST => {
                let (first, last) = (reader.small()?, reader.small()?);
                let claims = Claim::read_all(&mut reader)?;
                if claims.iter().any(|claim| !(first..=last).contains(&claim.origin)) {
                    return Err(reader.expected("only origins of the digest's range"));
                }
                Ok(Self::Digest { first, last, claims })
            }
            REQUEST => Ok(Self::Request { claims: Claim::read_all(&mut reader)? }),
            SECTIONS => {
                let more = reader.flag()?;
                let mut sections = Vec::new();
                while !reader.is_empty() {
                    sections.push(LifeSection::read(&mut reader, limits)?);
                }
                Ok(Self::Sections { more, sections })
            }
            _ => Err(reader.expected("a kind of message")),
        }
    }

    pub fn digest(first: u32, last: u32) -> WireWriter {
        let mut writer = WireWriter::new(&[FORMAT, DIGEST]);
        writer.number(first.into());
        writer.number(last.into());
        writer
    }

    pub fn request() -> WireWriter {
        WireWriter::new(&[FORMAT, REQUEST])
    }

    /// Followed by sections; `more` is set later.
    pub fn sections() -> WireWriter {
        WireWriter::new(&[FORMAT, SECTIONS, 0])
    }

    /// Says in a message with sections that there is more.
    pub fn set_more(bytes: &mut [u8]) {
        if let Some(more) = bytes.get_mut(2) {
            *more = 1;
        }
    }
}
