use std::fmt;

use serde::de::{DeserializeOwned, Error, Visitor};
use serde::{Deserialize, Deserializer, Serialize, Serializer};

use super::{decode, encode};
use crate::Refusal;

/// Name by which writer and reader know an embedded value.
pub const EMBEDDED: &str = "slate_module::Embedded";

/// Encoded value in another one, with the bytes that it would have itself.
/// What contains it does not compile the code for its type. It is for states alone, and no part of a type that serde reads
/// twice (`flatten`, `untagged`).
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Embedded(Vec<u8>);

impl Embedded {
    /// Encodes a value.
    ///
    /// # Errors
    /// A value that can't be encoded.
    pub fn of<T: Serialize>(value: &T) -> Result<Self, Refusal> {
        encode(value).map(Self)
    }

    /// Decodes the value.
    ///
    /// # Errors
    /// A value of another type.
    pub fn decode<T: DeserializeOwned>(&self) -> Result<T, Refusal> {
        decode(&self.0)
    }
}

impl Serialize for Embedded {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.serialize_newtype_struct(EMBEDDED, &EncodedBytes(&self.0))
    }
}

struct EncodedBytes<'e>(&'e [u8]);

impl Serialize for EncodedBytes<'_> {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.serialize_bytes(self.0)
    }
}

impl<'de> Deserialize<'de> for Embedded {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        deserializer.deserialize_newtype_struct(EMBEDDED, EmbeddedVisitor)
    }
}

struct EmbeddedVisitor;

impl<'de> Visitor<'de> for EmbeddedVisitor {
    type Value = Embedded;

    fn expecting(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.write_str("an embedded value")
    }

    fn visit_newtype_struct<D: Deserializer<'de>>(self, deserializer: D) -> Result<Embedded, D::Error> {
        deserializer.deserialize_bytes(self)
    }

    fn visit_bytes<E: Error>(self, encoded: &[u8]) -> Result<Embedded, E> {
        Ok(Embedded(encoded.into()))
    }
}
