//! Items of CBOR (RFC 8949, section 3).

use serde::Deserialize;
use serde::de::{Error, IgnoredAny, Unexpected};

use super::embedded::EMBEDDED;
use super::error::CodecError;

/// Maximum nesting of arrays and maps: hostile bytes must not exhaust the stack.
const DEPTH_LIMIT: usize = 256;

/// CBOR item, without the content of arrays and maps.
/// Their length is `None` if their end is marked.
#[derive(Clone, Copy)]
pub enum CborItem<'b> {
    Unsigned(u64),
    /// -1 minus this.
    Negative(u64),
    Wide(u128),
    /// -1 minus this.
    WideNegative(u128),
    Bytes(&'b [u8]),
    Text(&'b str),
    Array(Option<usize>),
    Map(Option<usize>),
    Bool(bool),
    Null,
    Float(f64),
    Break,
}

pub struct CborReader<'b> {
    bytes: &'b [u8],
    at: usize,
    depth: usize,
    /// The next value is wanted as it is encoded.
    is_embedded: bool,
}

impl<'b> CborReader<'b> {
    pub fn new(bytes: &'b [u8]) -> Self {
        Self { bytes, at: 0, depth: 0, is_embedded: false }
    }

    fn take(&mut self, count: usize) -> Result<&'b [u8], CodecError> {
        let (taken, _) = self.bytes[self.at..].split_at_checked(count).ok_or(CodecError::Short)?;
        self.at += count;
        Ok(taken)
    }

    /// Reads major type, argument (`None` for an open end) and its width in bytes.
    fn head(&mut self) -> Result<(u8, Option<u64>, usize), CodecError> {
        let start = self.at;
        let first = self.take(1)?[0];
        let (major, minor) = (first >> 5, first & 31);
        let width = match minor {
            0..=23 => return Ok((major, Some(minor.into()), 0)),
            24..=27 => 1 << (minor - 24),
            31 => return Ok((major, None, 0)),
            _ => return Err(CodecError::Syntax(start)),
        };
        let value = self.take(width)?.iter().fold(0, |value, byte| value << 8 | u64::from(*byte));
        Ok((major, Some(value), width))
    }

    /// Reads the next item; of tags, only those of wide integers have a meaning.
    #[inline(never)]
    pub fn item(&mut self) -> Result<CborItem<'b>, CodecError> {
        loop {
            let start = self.at;
            let (major, argument, width) = self.head()?;
            let length = match argument {
                Some(length) => Some(usize::try_from(length).map_err(|_| CodecError::Short)?),
                None => None,
            };
            return Ok(match (major, argument) {
                (0, Some(value)) => CborItem::Unsigned(value),
                (1, Some(value)) => CborItem::Negative(value),
                (2, Some(_)) => CborItem::Bytes(self.take(length.unwrap_or_default())?),
                (3, Some(_)) => {
                    let text = self.take(length.unwrap_or_default())?;
                    CborItem::Text(std::str::from_utf8(text).map_err(|_| CodecError::Syntax(start))?)
                }
                (4, _) => CborItem::Array(length),
                (5, _) => CborItem::Map(length),
                (6, Some(2)) => CborItem::Wide(self.magnitude()?),
                (6, Some(3)) => CborItem::WideNegative(self.magnitude()?),
                (6, Some(_)) => continue,
                (7, None) => CborItem::Break,
                (7, Some(value)) => simple(value, width).ok_or(CodecError::Syntax(start))?,
                // Text and bytes in pieces; nothing writes them.
                _ => return Err(CodecError::Syntax(start)),
            });
        }
    }

    /// Reads the bytes of a wide integer.
    /// They must follow the tag directly: a chain of tags would exhaust the stack.
    fn magnitude(&mut self) -> Result<u128, CodecError> {
        let start = self.at;
        let (2, Some(length), _) = self.head()? else { return Err(CodecError::Syntax(start)) };
        let length = usize::try_from(length).map_err(|_| CodecError::Short)?;
        self.take(length)?.iter().try_fold(0_u128, |value, byte| {
            let shifted = value.checked_mul(256).ok_or_else(|| CodecError::custom("bigint too large"))?;
            Ok(shifted | u128::from(*byte))
        })
    }

    /// Returns the next item without consuming it.
    pub fn peek(&mut self) -> Result<CborItem<'b>, CodecError> {
        let start = self.at;
        let item = self.item();
        self.at = start;
        item
    }

    #[inline(never)]
    pub fn begin_newtype(&mut self, name: &str) {
        self.is_embedded = name == EMBEDDED;
    }

    /// Returns the bytes of the next value, if it is to be read as they are.
    #[inline(never)]
    pub fn embedded(&mut self) -> Result<Option<&'b [u8]>, CodecError> {
        if !std::mem::take(&mut self.is_embedded) {
            return Ok(None);
        }
        let start = self.at;
        IgnoredAny::deserialize(&mut *self)?;
        Ok(Some(&self.bytes[start..self.at]))
    }

    #[inline(never)]
    pub fn is_null(&mut self) -> Result<bool, CodecError> {
        let is_null = matches!(self.peek()?, CborItem::Null);
        if is_null {
            self.item()?;
        }
        Ok(is_null)
    }

    #[inline(never)]
    pub fn bool(&mut self) -> Result<bool, CodecError> {
        match self.item()? {
            CborItem::Bool(value) => Ok(value),
            _ => Err(CodecError::custom("expected bool")),
        }
    }

    #[inline(never)]
    pub fn unsigned(&mut self) -> Result<u64, CodecError> {
        match self.item()? {
            CborItem::Unsigned(value) => Ok(value),
            item => u64::try_from(item.wide()?).map_err(|_| CodecError::custom("integer too large")),
        }
    }

    #[inline(never)]
    pub fn signed(&mut self) -> Result<i64, CodecError> {
        i64::try_from(self.item()?.wide_signed()?).map_err(|_| CodecError::custom("integer too large"))
    }

    #[inline(never)]
    pub fn float(&mut self) -> Result<f64, CodecError> {
        match self.item()? {
            CborItem::Float(value) => Ok(value),
            item => Err(item.type_error("float")),
        }
    }

    #[inline(never)]
    pub fn text(&mut self, expected: &str) -> Result<&'b str, CodecError> {
        match self.item()? {
            CborItem::Text(text) => Ok(text),
            item => Err(item.type_error(expected)),
        }
    }

    #[inline(never)]
    pub fn character(&mut self) -> Result<char, CodecError> {
        let text = self.text("char")?;
        let mut characters = text.chars();
        match (characters.next(), characters.next()) {
            (Some(character), None) => Ok(character),
            _ => Err(CborItem::Text(text).type_error("char")),
        }
    }

    #[inline(never)]
    pub fn unit(&mut self) -> Result<(), CodecError> {
        match self.item()? {
            CborItem::Null => Ok(()),
            item => Err(item.type_error("unit")),
        }
    }

    /// Begins an array; the caller ends it with [`leave`](Self::leave).
    #[inline(never)]
    pub fn array(&mut self) -> Result<Option<usize>, CodecError> {
        match self.item()? {
            CborItem::Array(length) => self.enter(length),
            item => Err(item.type_error("array")),
        }
    }

    /// Begins a map, as [`array`](Self::array).
    #[inline(never)]
    pub fn map(&mut self) -> Result<Option<usize>, CodecError> {
        // Another kind of file is not said to end too early: numbers, texts and arrays have major types below 5.
        if self.bytes.get(self.at).is_some_and(|first| first >> 5 < 5) {
            return Err(CodecError::custom("expected a map"));
        }
        match self.item()? {
            CborItem::Map(length) => self.enter(length),
            item => Err(item.type_error("map")),
        }
    }

    /// Begins a variant, which has content if this is true.
    #[inline(never)]
    pub fn variant(&mut self) -> Result<bool, CodecError> {
        match self.peek()? {
            CborItem::Map(Some(1)) => {
                self.item()?;
                self.enter(None).map(|_| true)
            }
            CborItem::Text(_) => self.enter(None).map(|_| false),
            item => Err(item.type_error("enum")),
        }
    }

    fn enter(&mut self, length: Option<usize>) -> Result<Option<usize>, CodecError> {
        if self.depth == DEPTH_LIMIT {
            return Err(CodecError::Deep);
        }
        self.depth += 1;
        Ok(length)
    }

    pub fn leave(&mut self) {
        self.depth -= 1;
    }

    /// Returns true if an array or a map has another item, and counts it off `left`.
    #[inline(never)]
    pub fn has_more(&mut self, left: &mut Option<usize>) -> Result<bool, CodecError> {
        match left {
            Some(0) => Ok(false),
            Some(count) => {
                *count -= 1;
                Ok(true)
            }
            None => {
                let is_end = matches!(self.peek()?, CborItem::Break);
                if is_end {
                    self.item()?;
                }
                Ok(!is_end)
            }
        }
    }
}

/// Decodes a truth value, null, or a float.
fn simple(value: u64, width: usize) -> Option<CborItem<'static>> {
    Some(match (width, value) {
        (0, 20) => CborItem::Bool(false),
        (0, 21) => CborItem::Bool(true),
        (0, 22 | 23) => CborItem::Null,
        (2, _) => CborItem::Float(from_half(value as u16)),
        (4, _) => CborItem::Float(f32::from_bits(value as u32).into()),
        (8, _) => CborItem::Float(f64::from_bits(value)),
        _ => return None,
    })
}

fn from_half(half: u16) -> f64 {
    let (exponent, fraction) = (u64::from(half >> 10 & 31), u64::from(half & 0x3ff));
    let magnitude = match exponent {
        0 => fraction as f64 / f64::from(1 << 24),
        31 => f64::from_bits(0x7ff << 52 | fraction << 42),
        _ => f64::from_bits((exponent + 1008) << 52 | fraction << 42),
    };
    f64::from_bits(magnitude.to_bits() | u64::from(half >> 15) << 63)
}

impl CborItem<'_> {
    #[inline(never)]
    pub fn type_error(self, expected: &str) -> CodecError {
        let found = match self {
            Self::Unsigned(value) => Unexpected::Unsigned(value),
            Self::Negative(value) => Unexpected::Signed(!(value as i64)),
            Self::Wide(_) | Self::WideNegative(_) => Unexpected::Other("tag"),
            Self::Bytes(_) => Unexpected::Other("bytes"),
            Self::Text(_) => Unexpected::Other("string"),
            Self::Array(_) => Unexpected::Seq,
            Self::Map(_) => Unexpected::Map,
            Self::Bool(value) => Unexpected::Bool(value),
            Self::Null => Unexpected::Other("null"),
            Self::Float(value) => Unexpected::Float(value),
            Self::Break => Unexpected::Other("break"),
        };
        CodecError::invalid_type(found, &expected)
    }

    pub fn wide(self) -> Result<u128, CodecError> {
        match self {
            Self::Unsigned(value) => Ok(value.into()),
            Self::Wide(value) => Ok(value),
            Self::Negative(_) | Self::WideNegative(_) => {
                Err(CodecError::custom("unexpected negative integer"))
            }
            item => Err(item.type_error("integer")),
        }
    }

    pub fn wide_signed(self) -> Result<i128, CodecError> {
        let (is_negative, magnitude) = match self {
            Self::Unsigned(value) => (false, value.into()),
            Self::Negative(value) => (true, value.into()),
            Self::Wide(value) => (false, value),
            Self::WideNegative(value) => (true, value),
            item => return Err(item.type_error("integer")),
        };
        let value = i128::try_from(magnitude).map_err(|_| CodecError::custom("integer too large"))?;
        Ok(if is_negative { !value } else { value })
    }
}
