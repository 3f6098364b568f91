//! Encoding of values as CBOR: names as text, the shortest heads and floats.
//! A float is the shortest with the same bits.

use serde::Serialize;
use serde::ser::{
    SerializeMap, SerializeSeq, SerializeStruct, SerializeStructVariant, SerializeTuple,
    SerializeTupleStruct, SerializeTupleVariant, Serializer,
};

use super::embedded::EMBEDDED;
use super::error::CodecError;

const UNSIGNED: u8 = 0;
const NEGATIVE: u8 = 1;
const BYTES: u8 = 2;
const TEXT: u8 = 3;
const ARRAY: u8 = 4;
const MAP: u8 = 5;
const TAG: u8 = 6;

const NULL: u8 = 0xf6;
const BREAK: u8 = 0xff;

#[derive(Default)]
pub struct CborWriter {
    bytes: Vec<u8>,
    /// The next bytes are an encoded value.
    is_embedding: bool,
}

impl CborWriter {
    pub fn finish(self) -> Vec<u8> {
        self.bytes
    }

    #[inline(never)]
    fn head(&mut self, major: u8, argument: u64) {
        let major = major << 5;
        let wide = argument.to_be_bytes();
        let (kind, from) = match argument {
            0..24 => return self.bytes.push(major | argument as u8),
            24..0x100 => (24, 7),
            0x100..0x1_0000 => (25, 6),
            0x1_0000..0x1_0000_0000 => (26, 4),
            _ => (27, 0),
        };
        self.bytes.push(major | kind);
        self.bytes.extend_from_slice(&wide[from..]);
    }

    /// Writes the head of an array or a map; without a length, its end is marked.
    #[inline(never)]
    fn items(&mut self, major: u8, length: Option<usize>) -> CborItems<'_> {
        match length {
            Some(length) => self.head(major, length as u64),
            None => self.bytes.push(major << 5 | 31),
        }
        CborItems { writer: self, is_open: length.is_none() }
    }

    #[inline(never)]
    fn begin_newtype(&mut self, name: &str) {
        self.is_embedding = name == EMBEDDED;
    }

    /// Writes the head of a variant with content.
    #[inline(never)]
    fn variant(&mut self, name: &str) {
        self.head(MAP, 1);
        self.text(name);
    }

    #[inline(never)]
    fn text(&mut self, text: &str) {
        self.head(TEXT, text.len() as u64);
        self.bytes.extend_from_slice(text.as_bytes());
    }

    #[inline(never)]
    fn float(&mut self, value: f64) {
        let single = value as f32;
        if f64::from(single).to_bits() != value.to_bits() {
            self.bytes.push(0xfb);
            self.bytes.extend(value.to_be_bytes());
        } else if let Some(half) = half(single) {
            self.bytes.push(0xf9);
            self.bytes.extend(half.to_be_bytes());
        } else {
            self.bytes.push(0xfa);
            self.bytes.extend(single.to_be_bytes());
        }
    }

    /// Writes an integer beyond 64 bits, as a tag with bytes.
    #[inline(never)]
    fn wide(&mut self, is_negative: bool, magnitude: u128) {
        if let Ok(short) = u64::try_from(magnitude) {
            return self.head(if is_negative { NEGATIVE } else { UNSIGNED }, short);
        }
        let bytes = &magnitude.to_be_bytes()[magnitude.leading_zeros() as usize / 8..];
        self.head(TAG, if is_negative { 3 } else { 2 });
        self.head(BYTES, bytes.len() as u64);
        self.bytes.extend_from_slice(bytes);
    }
}

/// Converts to the float of 16 bits with the same value, if one exists.
fn half(single: f32) -> Option<u16> {
    let bits = single.to_bits();
    let (sign, exponent, fraction) = ((bits >> 16) as u16 & 0x8000, (bits >> 23) as u8, bits & 0x7f_ffff);
    let (magnitude, lost) = match exponent {
        0 => (0, fraction),
        // Subnormal in 16 bits.
        103..=112 => {
            let (full, shift) = (fraction | 0x80_0000, 126 - u32::from(exponent));
            (full >> shift, full & ((1 << shift) - 1))
        }
        113..=142 => ((u32::from(exponent) - 112) << 10 | fraction >> 13, fraction & 0x1fff),
        255 => (0x7c00 | fraction >> 13, fraction & 0x1fff),
        _ => return None,
    };
    (lost == 0).then_some(sign | magnitude as u16)
}

impl<'w> Serializer for &'w mut CborWriter {
    type Ok = ();
    type Error = CodecError;
    type SerializeSeq = CborItems<'w>;
    type SerializeTuple = CborItems<'w>;
    type SerializeTupleStruct = CborItems<'w>;
    type SerializeTupleVariant = CborItems<'w>;
    type SerializeMap = CborItems<'w>;
    type SerializeStruct = CborItems<'w>;
    type SerializeStructVariant = CborItems<'w>;

    fn serialize_bool(self, value: bool) -> Result<(), CodecError> {
        self.bytes.push(0xf4 | u8::from(value));
        Ok(())
    }

    fn serialize_i8(self, value: i8) -> Result<(), CodecError> {
        self.serialize_i64(value.into())
    }

    fn serialize_i16(self, value: i16) -> Result<(), CodecError> {
        self.serialize_i64(value.into())
    }

    fn serialize_i32(self, value: i32) -> Result<(), CodecError> {
        self.serialize_i64(value.into())
    }

    fn serialize_i64(self, value: i64) -> Result<(), CodecError> {
        match u64::try_from(value) {
            Ok(value) => self.head(UNSIGNED, value),
            Err(_) => self.head(NEGATIVE, !value as u64),
        }
        Ok(())
    }

    fn serialize_i128(self, value: i128) -> Result<(), CodecError> {
        self.wide(value < 0, if value < 0 { !value } else { value } as u128);
        Ok(())
    }

    fn serialize_u8(self, value: u8) -> Result<(), CodecError> {
        self.serialize_u64(value.into())
    }

    fn serialize_u16(self, value: u16) -> Result<(), CodecError> {
        self.serialize_u64(value.into())
    }

    fn serialize_u32(self, value: u32) -> Result<(), CodecError> {
        self.serialize_u64(value.into())
    }

    fn serialize_u64(self, value: u64) -> Result<(), CodecError> {
        self.head(UNSIGNED, value);
        Ok(())
    }

    fn serialize_u128(self, value: u128) -> Result<(), CodecError> {
        self.wide(false, value);
        Ok(())
    }

    fn serialize_f32(self, value: f32) -> Result<(), CodecError> {
        self.serialize_f64(value.into())
    }

    fn serialize_f64(self, value: f64) -> Result<(), CodecError> {
        self.float(value);
        Ok(())
    }

    fn serialize_char(self, value: char) -> Result<(), CodecError> {
        self.serialize_str(value.encode_utf8(&mut [0; 4]))
    }

    fn serialize_str(self, value: &str) -> Result<(), CodecError> {
        self.text(value);
        Ok(())
    }

    fn serialize_bytes(self, value: &[u8]) -> Result<(), CodecError> {
        if !std::mem::take(&mut self.is_embedding) {
            self.head(BYTES, value.len() as u64);
        }
        self.bytes.extend_from_slice(value);
        Ok(())
    }

    fn serialize_none(self) -> Result<(), CodecError> {
        self.bytes.push(NULL);
        Ok(())
    }

    fn serialize_some<T: ?Sized + Serialize>(self, value: &T) -> Result<(), CodecError> {
        value.serialize(self)
    }

    fn serialize_unit(self) -> Result<(), CodecError> {
        self.serialize_none()
    }

    fn serialize_unit_struct(self, _name: &'static str) -> Result<(), CodecError> {
        self.serialize_none()
    }

    fn serialize_unit_variant(
        self,
        _name: &'static str,
        _index: u32,
        variant: &'static str,
    ) -> Result<(), CodecError> {
        self.serialize_str(variant)
    }

    fn serialize_newtype_struct<T: ?Sized + Serialize>(
        self,
        name: &'static str,
        value: &T,
    ) -> Result<(), CodecError> {
        self.begin_newtype(name);
        value.serialize(self)
    }

    fn serialize_newtype_variant<T: ?Sized + Serialize>(
        self,
        _name: &'static str,
        _index: u32,
        variant: &'static str,
        value: &T,
    ) -> Result<(), CodecError> {
        self.variant(variant);
        value.serialize(self)
    }

    fn serialize_seq(self, length: Option<usize>) -> Result<CborItems<'w>, CodecError> {
        Ok(self.items(ARRAY, length))
    }

    fn serialize_tuple(self, length: usize) -> Result<CborItems<'w>, CodecError> {
        Ok(self.items(ARRAY, Some(length)))
    }

    fn serialize_tuple_struct(self, _name: &'static str, length: usize) -> Result<CborItems<'w>, CodecError> {
        Ok(self.items(ARRAY, Some(length)))
    }

    fn serialize_tuple_variant(
        self,
        _name: &'static str,
        _index: u32,
        variant: &'static str,
        length: usize,
    ) -> Result<CborItems<'w>, CodecError> {
        self.variant(variant);
        Ok(self.items(ARRAY, Some(length)))
    }

    fn serialize_map(self, length: Option<usize>) -> Result<CborItems<'w>, CodecError> {
        Ok(self.items(MAP, length))
    }

    fn serialize_struct(self, _name: &'static str, length: usize) -> Result<CborItems<'w>, CodecError> {
        Ok(self.items(MAP, Some(length)))
    }

    fn serialize_struct_variant(
        self,
        _name: &'static str,
        _index: u32,
        variant: &'static str,
        length: usize,
    ) -> Result<CborItems<'w>, CodecError> {
        self.variant(variant);
        Ok(self.items(MAP, Some(length)))
    }

    fn is_human_readable(&self) -> bool {
        false
    }
}

/// Writes the items of an array or a map.
pub struct CborItems<'w> {
    writer: &'w mut CborWriter,
    is_open: bool,
}

impl CborItems<'_> {
    fn finish(self) {
        if self.is_open {
            self.writer.bytes.push(BREAK);
        }
    }
}

/// Implements traits whose only content is values in a row.
macro_rules! values {
    ($($trait:ident: $method:ident),*) => {$(
        impl $trait for CborItems<'_> {
            type Ok = ();
            type Error = CodecError;

            fn $method<T: ?Sized + Serialize>(&mut self, value: &T) -> Result<(), CodecError> {
                value.serialize(&mut *self.writer)
            }

            fn end(self) -> Result<(), CodecError> {
                self.finish();
                Ok(())
            }
        }
    )*};
}

values!(
    SerializeSeq: serialize_element,
    SerializeTuple: serialize_element,
    SerializeTupleStruct: serialize_field,
    SerializeTupleVariant: serialize_field
);

/// Implements traits whose content is values with names.
macro_rules! fields {
    ($($trait:ident),*) => {$(
        impl $trait for CborItems<'_> {
            type Ok = ();
            type Error = CodecError;

            fn serialize_field<T: ?Sized + Serialize>(&mut self, name: &'static str, value: &T) -> Result<(), CodecError> {
                self.writer.text(name);
                value.serialize(&mut *self.writer)
            }

            fn end(self) -> Result<(), CodecError> {
                Ok(())
            }
        }
    )*};
}

fields!(SerializeStruct, SerializeStructVariant);

impl SerializeMap for CborItems<'_> {
    type Ok = ();
    type Error = CodecError;

    fn serialize_key<T: ?Sized + Serialize>(&mut self, key: &T) -> Result<(), CodecError> {
        key.serialize(&mut *self.writer)
    }

    fn serialize_value<T: ?Sized + Serialize>(&mut self, value: &T) -> Result<(), CodecError> {
        value.serialize(&mut *self.writer)
    }

    fn end(self) -> Result<(), CodecError> {
        self.finish();
        Ok(())
    }
}
