//! CBOR to values.

use serde::Deserializer;
use serde::de::{
    DeserializeSeed, EnumAccess, Error, MapAccess, SeqAccess, Unexpected, VariantAccess, Visitor,
};

use super::error::CodecError;
use super::reader::{CborItem, CborReader};

/// Methods that read a value and give it to the visitor.
macro_rules! scalars {
    ($($method:ident: $read:ident => $visit:ident),*) => {$(
        fn $method<V: Visitor<'de>>(self, visitor: V) -> Result<V::Value, CodecError> {
            visitor.$visit(self.$read()?)
        }
    )*};
}

impl<'de> Deserializer<'de> for &mut CborReader<'de> {
    type Error = CodecError;

    fn deserialize_any<V: Visitor<'de>>(self, visitor: V) -> Result<V::Value, CodecError> {
        match self.peek()? {
            CborItem::Unsigned(_) => self.deserialize_u64(visitor),
            CborItem::Negative(value) if i64::try_from(value).is_ok() => self.deserialize_i64(visitor),
            CborItem::Negative(_) | CborItem::WideNegative(_) => self.deserialize_i128(visitor),
            CborItem::Wide(_) => self.deserialize_u128(visitor),
            CborItem::Bytes(_) => self.deserialize_bytes(visitor),
            CborItem::Text(_) => self.deserialize_str(visitor),
            CborItem::Array(_) => self.deserialize_seq(visitor),
            CborItem::Map(_) => self.deserialize_map(visitor),
            CborItem::Bool(_) => self.deserialize_bool(visitor),
            CborItem::Null => self.deserialize_option(visitor),
            CborItem::Float(_) => self.deserialize_f64(visitor),
            CborItem::Break => Err(CborItem::Break.type_error("non-break")),
        }
    }

    scalars!(
        deserialize_bool: bool => visit_bool,
        deserialize_i8: signed => visit_i64,
        deserialize_i16: signed => visit_i64,
        deserialize_i32: signed => visit_i64,
        deserialize_i64: signed => visit_i64,
        deserialize_u8: unsigned => visit_u64,
        deserialize_u16: unsigned => visit_u64,
        deserialize_u32: unsigned => visit_u64,
        deserialize_u64: unsigned => visit_u64,
        deserialize_f32: float => visit_f64,
        deserialize_f64: float => visit_f64,
        deserialize_char: character => visit_char
    );

    fn deserialize_i128<V: Visitor<'de>>(self, visitor: V) -> Result<V::Value, CodecError> {
        visitor.visit_i128(self.item()?.wide_signed()?)
    }

    fn deserialize_u128<V: Visitor<'de>>(self, visitor: V) -> Result<V::Value, CodecError> {
        visitor.visit_u128(self.item()?.wide()?)
    }

    fn deserialize_str<V: Visitor<'de>>(self, visitor: V) -> Result<V::Value, CodecError> {
        visitor.visit_str(self.text("str")?)
    }

    fn deserialize_string<V: Visitor<'de>>(self, visitor: V) -> Result<V::Value, CodecError> {
        visitor.visit_str(self.text("string")?)
    }

    fn deserialize_identifier<V: Visitor<'de>>(self, visitor: V) -> Result<V::Value, CodecError> {
        visitor.visit_str(self.text("str or bytes")?)
    }

    fn deserialize_bytes<V: Visitor<'de>>(self, visitor: V) -> Result<V::Value, CodecError> {
        if let Some(encoded) = self.embedded()? {
            return visitor.visit_bytes(encoded);
        }
        match self.peek()? {
            CborItem::Bytes(bytes) => {
                self.item()?;
                visitor.visit_bytes(bytes)
            }
            CborItem::Array(_) => self.deserialize_seq(visitor),
            item => Err(item.type_error("bytes")),
        }
    }

    fn deserialize_byte_buf<V: Visitor<'de>>(self, visitor: V) -> Result<V::Value, CodecError> {
        self.deserialize_bytes(visitor)
    }

    fn deserialize_option<V: Visitor<'de>>(self, visitor: V) -> Result<V::Value, CodecError> {
        if self.is_null()? { visitor.visit_none() } else { visitor.visit_some(self) }
    }

    fn deserialize_unit<V: Visitor<'de>>(self, visitor: V) -> Result<V::Value, CodecError> {
        self.unit()?;
        visitor.visit_unit()
    }

    fn deserialize_unit_struct<V: Visitor<'de>>(
        self,
        _name: &'static str,
        visitor: V,
    ) -> Result<V::Value, CodecError> {
        self.deserialize_unit(visitor)
    }

    fn deserialize_newtype_struct<V: Visitor<'de>>(
        self,
        name: &'static str,
        visitor: V,
    ) -> Result<V::Value, CodecError> {
        self.begin_newtype(name);
        visitor.visit_newtype_struct(self)
    }

    fn deserialize_seq<V: Visitor<'de>>(self, visitor: V) -> Result<V::Value, CodecError> {
        let left = self.array()?;
        let value = visitor.visit_seq(CborContent { reader: self, left });
        self.leave();
        value
    }

    fn deserialize_tuple<V: Visitor<'de>>(self, _length: usize, visitor: V) -> Result<V::Value, CodecError> {
        self.deserialize_seq(visitor)
    }

    fn deserialize_tuple_struct<V: Visitor<'de>>(
        self,
        _name: &'static str,
        _length: usize,
        visitor: V,
    ) -> Result<V::Value, CodecError> {
        self.deserialize_seq(visitor)
    }

    fn deserialize_map<V: Visitor<'de>>(self, visitor: V) -> Result<V::Value, CodecError> {
        let left = self.map()?;
        let value = visitor.visit_map(CborContent { reader: self, left });
        self.leave();
        value
    }

    fn deserialize_struct<V: Visitor<'de>>(
        self,
        _name: &'static str,
        _fields: &'static [&'static str],
        visitor: V,
    ) -> Result<V::Value, CodecError> {
        self.deserialize_map(visitor)
    }

    fn deserialize_enum<V: Visitor<'de>>(
        self,
        _name: &'static str,
        _variants: &'static [&'static str],
        visitor: V,
    ) -> Result<V::Value, CodecError> {
        let has_content = self.variant()?;
        let value = visitor.visit_enum(CborVariant { reader: self, has_content });
        self.leave();
        value
    }

    fn deserialize_ignored_any<V: Visitor<'de>>(self, visitor: V) -> Result<V::Value, CodecError> {
        self.deserialize_any(visitor)
    }

    fn is_human_readable(&self) -> bool {
        false
    }
}

/// Items of an array or a map that are still to be read.
struct CborContent<'r, 'b> {
    reader: &'r mut CborReader<'b>,
    left: Option<usize>,
}

impl<'de> SeqAccess<'de> for CborContent<'_, 'de> {
    type Error = CodecError;

    fn next_element_seed<S: DeserializeSeed<'de>>(
        &mut self,
        seed: S,
    ) -> Result<Option<S::Value>, CodecError> {
        if self.reader.has_more(&mut self.left)? {
            seed.deserialize(&mut *self.reader).map(Some)
        } else {
            Ok(None)
        }
    }

    fn size_hint(&self) -> Option<usize> {
        self.left
    }
}

impl<'de> MapAccess<'de> for CborContent<'_, 'de> {
    type Error = CodecError;

    fn next_key_seed<S: DeserializeSeed<'de>>(&mut self, seed: S) -> Result<Option<S::Value>, CodecError> {
        self.next_element_seed(seed)
    }

    fn next_value_seed<S: DeserializeSeed<'de>>(&mut self, seed: S) -> Result<S::Value, CodecError> {
        seed.deserialize(&mut *self.reader)
    }

    fn size_hint(&self) -> Option<usize> {
        self.left
    }
}

/// Variant whose name comes next.
struct CborVariant<'r, 'b> {
    reader: &'r mut CborReader<'b>,
    has_content: bool,
}

impl CborVariant<'_, '_> {
    #[inline(never)]
    fn check(&self, expected: &str) -> Result<(), CodecError> {
        if self.has_content {
            return Ok(());
        }
        Err(CodecError::invalid_type(Unexpected::UnitVariant, &expected))
    }
}

impl<'de> EnumAccess<'de> for CborVariant<'_, 'de> {
    type Error = CodecError;
    type Variant = Self;

    fn variant_seed<S: DeserializeSeed<'de>>(self, seed: S) -> Result<(S::Value, Self), CodecError> {
        Ok((seed.deserialize(&mut *self.reader)?, self))
    }
}

impl<'de> VariantAccess<'de> for CborVariant<'_, 'de> {
    type Error = CodecError;

    fn unit_variant(self) -> Result<(), CodecError> {
        Ok(())
    }

    fn newtype_variant_seed<S: DeserializeSeed<'de>>(self, seed: S) -> Result<S::Value, CodecError> {
        self.check("newtype variant")?;
        seed.deserialize(&mut *self.reader)
    }

    fn tuple_variant<V: Visitor<'de>>(self, _length: usize, visitor: V) -> Result<V::Value, CodecError> {
        self.check("tuple variant")?;
        self.reader.deserialize_seq(visitor)
    }

    fn struct_variant<V: Visitor<'de>>(
        self,
        _fields: &'static [&'static str],
        visitor: V,
    ) -> Result<V::Value, CodecError> {
        self.check("struct variant")?;
        self.reader.deserialize_map(visitor)
    }
}
