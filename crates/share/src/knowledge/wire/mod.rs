//! Wire format of messages between robots.
//!
//! A message is a version of the format, a kind, and items up to its end. Numbers are LEB128 varints unless their width
//! is given. The decoder validates the whole message first, and allocates in proportion to its actual size, not to the
//! lengths that it claims.

mod claim;
mod reader;
mod section;
mod writer;

pub(crate) use claim::Claim;
pub(crate) use reader::WireReader;
pub(crate) use section::{LifeSection, write_section};
pub(crate) use writer::WireWriter;

use super::{Limits, MessageError};

/// Version of the format; messages of others are refused.
const FORMAT_VERSION: u8 = 1;

const DIGEST: u8 = 0;
const REQUEST: u8 = 1;
const SECTIONS: u8 = 2;

/// Decoded message.
pub(crate) enum Message<'a> {
    /// Claims of the sender about origins `first` to `last`.
    Digest { first: u32, last: u32, claims: Vec<Claim> },
    /// Request for newer versions of these lives.
    Request { claims: Vec<Claim> },
    /// Parts of lives; with `more`, further ones did not fit.
    Sections { more: bool, sections: Vec<LifeSection<'a>> },
}

impl<'a> Message<'a> {
    pub fn decode(bytes: &'a [u8], limits: &Limits) -> Result<Self, MessageError> {
        let mut reader = WireReader::new(bytes);
        if bytes.len() > limits.message {
            return Err(reader.expected("no message of that length"));
        }
        if reader.byte()? != FORMAT_VERSION {
            return Err(reader.expected("a format of this version of Slate"));
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
        let mut writer = WireWriter::new(&[FORMAT_VERSION, DIGEST]);
        writer.number(first.into());
        writer.number(last.into());
        writer
    }

    pub fn request() -> WireWriter {
        WireWriter::new(&[FORMAT_VERSION, REQUEST])
    }

    /// Begins a message of sections; `more` is set later.
    pub fn sections() -> WireWriter {
        WireWriter::new(&[FORMAT_VERSION, SECTIONS, 0])
    }

    /// Sets the flag `more` in a message of sections.
    pub fn set_more(bytes: &mut [u8]) {
        if let Some(more) = bytes.get_mut(2) {
            *more = 1;
        }
    }
}
