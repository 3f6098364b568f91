//! Messages as they lie on the wire, of any type.

use std::convert::Infallible;

use rustdds::bytes::Bytes;
use rustdds::no_key::{
    Decode as NoKeyDecode, DefaultDecoder as NoKeyDefaultDecoder, DeserializerAdapter as NoKeyDeserializer,
    SerializerAdapter as NoKeySerializer,
};
use rustdds::with_key::{Decode, DefaultDecoder, DeserializerAdapter, SerializerAdapter};
use rustdds::{Keyed, RepresentationIdentifier as Encoding};

use crate::message::HEADER;

/// Message with its header.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct RawMessage(pub Vec<u8>);

/// Instances are one here: an input has the newest value of them all.
impl Keyed for RawMessage {
    type K = ();

    fn key(&self) {}
}

/// Leaves messages as they are; writers' messages have an encoding of that number.
#[derive(Debug)]
pub struct RawAdapter<const ENCODING: u8 = 1>;

/// Reads them.
#[derive(Clone, Debug)]
pub struct RawDecoder;

impl<const ENCODING: u8> NoKeySerializer<RawMessage> for RawAdapter<ENCODING> {
    type Error = Infallible;

    fn output_encoding() -> Encoding {
        match ENCODING {
            9 => Encoding::D_CDR2_LE,
            7 => Encoding::XCDR2_LE,
            _ => Encoding::CDR_LE,
        }
    }

    fn to_bytes(value: &RawMessage) -> Result<Bytes, Infallible> {
        Ok(Bytes::copy_from_slice(value.0.get(HEADER..).unwrap_or_default()))
    }
}

impl<const ENCODING: u8> SerializerAdapter<RawMessage> for RawAdapter<ENCODING> {
    fn key_to_bytes((): &()) -> Result<Bytes, Infallible> {
        Ok(Bytes::new())
    }
}

impl<const ENCODING: u8> NoKeyDeserializer<RawMessage> for RawAdapter<ENCODING> {
    type Error = Infallible;
    type Decoded = RawMessage;

    fn supported_encodings() -> &'static [Encoding] {
        // Those of mutable types, too, so that it is said what they are.
        const KNOWN: [Encoding; 10] = [
            Encoding::CDR_LE,
            Encoding::CDR_BE,
            Encoding::XCDR2_LE,
            Encoding::XCDR2_BE,
            Encoding::D_CDR2_LE,
            Encoding::D_CDR2_BE,
            Encoding::PL_CDR_LE,
            Encoding::PL_CDR_BE,
            Encoding::PL_XCDR2_LE,
            Encoding::PL_XCDR2_BE,
        ];
        &KNOWN
    }

    fn transform_decoded(decoded: RawMessage) -> RawMessage {
        decoded
    }
}

impl<const ENCODING: u8> DeserializerAdapter<RawMessage> for RawAdapter<ENCODING> {
    type DecodedKey = ();

    fn transform_decoded_key((): ()) {}
}

impl<const ENCODING: u8> NoKeyDefaultDecoder<RawMessage> for RawAdapter<ENCODING> {
    type Decoder = RawDecoder;
    const DECODER: RawDecoder = RawDecoder;
}

impl<const ENCODING: u8> DefaultDecoder<RawMessage> for RawAdapter<ENCODING> {
    type Decoder = RawDecoder;
    const DECODER: RawDecoder = RawDecoder;
}

impl NoKeyDecode<'_, RawMessage> for RawDecoder {
    type Error = Infallible;

    fn decode_bytes(self, bytes: &[u8], encoding: Encoding) -> Result<RawMessage, Infallible> {
        let mut message = Vec::with_capacity(HEADER + bytes.len());
        message.extend_from_slice(&encoding.to_bytes());
        message.extend_from_slice(&[0, 0]);
        message.extend_from_slice(bytes);
        Ok(RawMessage(message))
    }
}

impl Decode<'_, RawMessage, ()> for RawDecoder {
    fn decode_key_bytes(self, _: &[u8], _: Encoding) -> Result<(), Infallible> {
        Ok(())
    }
}
