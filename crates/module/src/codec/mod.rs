//! CBOR encoding of states, descriptions and all else that crosses a boundary.
//!
//! RFC 8949 in the form of the crate ciborium, which tests compare it with. The state of every module is compiled for this
//! writer and this reader, so their generic functions only pass on to others that are compiled once: ciborium took a
//! quarter of the time that a crate of modules takes to build, and its reader can't stand behind a trait object.

mod embedded;
mod error;
mod reader;
mod values;
mod writer;

use crate::Refusal;
pub use embedded::Embedded;
pub use error::CodecError;
use reader::CborReader;
use writer::CborWriter;

/// Encodes a state as CBOR with field names.
///
/// # Errors
/// A state that can't be encoded.
pub fn encode<T: serde::Serialize>(state: &T) -> Result<Vec<u8>, Refusal> {
    to_cbor(state).map_err(|error| Refusal(error.to_string()))
}

/// Decodes a state from CBOR; it fits if it deserializes.
///
/// # Errors
/// A state that doesn't fit.
pub fn decode<T: serde::de::DeserializeOwned>(bytes: &[u8]) -> Result<T, Refusal> {
    from_cbor(bytes).map_err(|error| Refusal(error.to_string()))
}

/// Writes a value as CBOR with field names.
///
/// # Errors
/// A value that its type refuses to write.
pub fn to_cbor<T: serde::Serialize>(value: &T) -> Result<Vec<u8>, CodecError> {
    let mut writer = CborWriter::default();
    value.serialize(&mut writer)?;
    Ok(writer.finish())
}

/// Reads a value from CBOR; bytes that follow it are not looked at.
///
/// # Errors
/// Bytes that are no CBOR, end too early, are nested too deeply or don't fit the type.
pub fn from_cbor<T: serde::de::DeserializeOwned>(bytes: &[u8]) -> Result<T, CodecError> {
    T::deserialize(&mut CborReader::new(bytes))
}

#[cfg(test)]
#[allow(clippy::unwrap_used, reason = "a test that fails panics")]
mod tests {
    use std::collections::BTreeMap;
    use std::fmt::Debug;

    use serde::de::DeserializeOwned;
    use serde::{Deserialize, Serialize};

    use super::{Embedded, decode, encode};

    #[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
    enum Kind {
        Unit,
        Newtype(Option<i8>),
        Tuple(u16, char),
        Struct { text: String, nothing: () },
    }

    #[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
    #[serde(untagged)]
    enum Untagged {
        Number(f64),
        Text(String),
        Map(BTreeMap<String, Untagged>),
    }

    #[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
    struct Whole {
        kinds: Vec<Kind>,
        numbers: BTreeMap<u32, [i64; 3]>,
        wide: Vec<(u128, i128)>,
        untagged: Vec<Untagged>,
        #[serde(flatten)]
        rest: BTreeMap<String, bool>,
    }

    fn whole() -> Whole {
        let text = "\u{e9}".repeat(200);
        let map = BTreeMap::from([
            ("x".to_owned(), Untagged::Number(0.1)),
            (text.clone(), Untagged::Text("y".into())),
        ]);
        Whole {
            kinds: vec![
                Kind::Unit,
                Kind::Newtype(None),
                Kind::Newtype(Some(-3)),
                Kind::Tuple(256, '\u{1f916}'),
                Kind::Struct { text, nothing: () },
            ],
            numbers: BTreeMap::from([(70_000, [i64::MIN, -1, i64::MAX])]),
            wide: vec![(u128::MAX, i128::MIN), (1, -1), (1 << 64, i128::from(u64::MAX)), (23, -(1 << 64))],
            untagged: vec![Untagged::Number(1.5), Untagged::Text(String::new()), Untagged::Map(map)],
            rest: BTreeMap::from([("yes".to_owned(), true), ("no".to_owned(), false)]),
        }
    }

    fn other<T: Serialize>(value: &T) -> Vec<u8> {
        let mut bytes = Vec::new();
        ciborium::into_writer(value, &mut bytes).unwrap();
        bytes
    }

    fn is_the_same_for_both<T: Serialize + DeserializeOwned + PartialEq + Debug>(value: &T) {
        let bytes = encode(value).unwrap();
        assert_eq!(bytes, other(value), "{value:?}");
        assert_eq!(decode::<T>(&bytes).unwrap(), *value);
    }

    #[test]
    fn bytes_are_those_of_ciborium() {
        is_the_same_for_both(&whole());
        for shift in 0..64 {
            for value in [1_u64 << shift, (1 << shift) - 1, u64::MAX >> shift] {
                is_the_same_for_both(&value);
                is_the_same_for_both(&(value as i64));
                is_the_same_for_both(&!(value as i64));
            }
        }
    }

    #[test]
    fn floats_are_as_short_as_those_of_ciborium() {
        // All signs and exponents, with fractions that fit 16, 32 and 64 bits.
        for head in 0..1_u64 << 12 {
            for fraction in
                [0, 1, 1 << 13, 1 << 29, 1 << 41, 1 << 42, 1 << 47, 1 << 51, 3 << 42, (1 << 52) - 1]
            {
                let value = f64::from_bits(head << 52 | fraction);
                let bytes = encode(&value).unwrap();
                assert_eq!(bytes, other(&value), "{value:e} {fraction:x}");
                assert_eq!(
                    decode::<f64>(&bytes).unwrap().to_bits(),
                    value.to_bits(),
                    "{value:e} {fraction:x}"
                );
            }
        }
    }

    #[test]
    fn unknown_lengths_and_unknown_fields_are_read() {
        assert_eq!(decode::<Vec<u8>>(&[0x9f, 1, 2, 0xff]).unwrap(), [1, 2]);
        #[derive(Serialize)]
        struct Longer {
            before: Whole,
            value: u8,
        }
        #[derive(Deserialize)]
        struct Shorter {
            value: u8,
        }
        let bytes = encode(&Longer { before: whole(), value: 7 }).unwrap();
        assert_eq!(decode::<Shorter>(&bytes).unwrap().value, 7);
    }

    #[test]
    fn embedded_values_have_the_bytes_that_they_have_themselves() {
        #[derive(Debug, PartialEq, Serialize, Deserialize)]
        struct Around<T> {
            before: u8,
            inner: T,
            after: Vec<u8>,
        }
        let around = Around { before: 1, inner: whole(), after: vec![2, 3] };
        let bytes = encode(&around).unwrap();
        let inner = Embedded::of(&around.inner).unwrap();
        let embedded = Around { before: 1, inner, after: vec![2, 3] };
        assert_eq!(encode(&embedded).unwrap(), bytes);
        assert_eq!(decode::<Around<Embedded>>(&bytes).unwrap(), embedded);
        assert_eq!(embedded.inner.decode::<Whole>().unwrap(), around.inner);
        for length in 0..bytes.len() {
            assert!(decode::<Around<Embedded>>(&bytes[..length]).is_err());
        }
    }

    #[test]
    fn damaged_bytes_end_as_an_error_or_a_value() {
        let bytes = encode(&whole()).unwrap();
        for at in 0..bytes.len() {
            assert!(decode::<Whole>(&bytes[..at]).is_err());
            for flip in [1, 0x20, 0x80, 0xff] {
                let mut damaged = bytes.clone();
                damaged[at] ^= flip;
                let _ = decode::<Whole>(&damaged);
            }
        }
        let nested = decode::<Untagged>(&[0xa1, 0x61, 0x78].repeat(1000)).unwrap_err();
        assert_eq!(nested.0, "it is nested too deeply");
        assert!(decode::<u64>(&[0xc2; 1 << 20]).is_err());
        assert!(decode::<u64>(&[0xc6; 1 << 20]).is_err());
        assert_eq!(
            decode::<String>(&[0x7b, 255, 255, 255, 255, 255, 255, 255, 255]).unwrap_err().0,
            "it ends too early"
        );
        assert_eq!(decode::<u8>(&[0x1c]).unwrap_err().0, "byte 0 is no CBOR");
    }

    #[test]
    fn state_that_does_not_fit_is_refused_in_words() {
        let saved = encode(&None::<u64>).unwrap();
        assert_eq!(decode::<u64>(&saved).unwrap_err().0, "invalid type: null, expected integer");
        assert_eq!(decode::<u64>(&[]).unwrap_err().0, "it ends too early");
    }
}
