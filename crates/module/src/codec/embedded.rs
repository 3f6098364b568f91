use std::fmt;

use serde::de::{Error, Visitor};
use serde::{Deserialize, Deserializer, Serialize, Serializer};

/// Name by which writer and reader know an embedded value.
pub const EMBEDDED: &str = "slate_module::Embedded";

/// Encoded value in another one, with the bytes that it would have itself.
/// What contains it does not compile the code for its type.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Embedded(Vec<u8>);

impl Embedded {
    /// Embeds the bytes of one value, as [`encode`](super::encode) returns them.
    #[must_use]
    pub fn new(encoded: Vec<u8>) -> Self {
        Self(encoded)
    }

    /// Bytes of the value.
    #[must_use]
    pub fn encoded(&self) -> &[u8] {
        &self.0
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
