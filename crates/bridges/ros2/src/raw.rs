//! Messages as they lie on the wire, of any type.

use std::convert::Infallible;

use rustdds::RepresentationIdentifier;
use rustdds::bytes::Bytes;
use rustdds::no_key::{Decode, DefaultDecoder, DeserializerAdapter, SerializerAdapter};

/// Bytes of the header before a message in CDR.
const HEADER: usize = 4;

/// A message in CDR, with its header.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct RawMessage(pub Vec<u8>);

/// Leaves messages as they are.
pub struct RawAdapter;

/// Reads them.
#[derive(Clone)]
pub struct RawDecoder;

impl SerializerAdapter<RawMessage> for RawAdapter {
    type Error = Infallible;

    fn output_encoding() -> RepresentationIdentifier {
        RepresentationIdentifier::CDR_LE
    }

    fn to_bytes(value: &RawMessage) -> Result<Bytes, Infallible> {
        Ok(Bytes::copy_from_slice(value.0.get(HEADER..).unwrap_or_default()))
    }
}

impl DeserializerAdapter<RawMessage> for RawAdapter {
    type Error = Infallible;
    type Decoded = RawMessage;

    fn supported_encodings() -> &'static [RepresentationIdentifier] {
        const KNOWN: [RepresentationIdentifier; 2] =
            [RepresentationIdentifier::CDR_LE, RepresentationIdentifier::CDR_BE];
        &KNOWN
    }

    fn transform_decoded(decoded: RawMessage) -> RawMessage {
        decoded
    }
}

impl DefaultDecoder<RawMessage> for RawAdapter {
    type Decoder = RawDecoder;
    const DECODER: RawDecoder = RawDecoder;
}

impl Decode<'_, RawMessage> for RawDecoder {
    type Error = Infallible;

    fn decode_bytes(
        self,
        bytes: &[u8],
        encoding: RepresentationIdentifier,
    ) -> Result<RawMessage, Infallible> {
        let is_little = encoding == RepresentationIdentifier::CDR_LE;
        let mut message = Vec::with_capacity(HEADER + bytes.len());
        message.extend_from_slice(&[0, u8::from(is_little), 0, 0]);
        message.extend_from_slice(bytes);
        Ok(RawMessage(message))
    }
}
