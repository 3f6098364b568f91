//! Content of a received value.
//! Content that decodes has its length, and equals the decoded encoding of itself.

use crate::agents::{Blob, Number};
use crate::input::Input;
use crate::memory::within;
use slate_blackboard::interface::Interface;
use slate_interfaces::Image;
use slate_share::encoding::{decode, encode};
use slate_share::session::{Compression, Encoding};

/// The largest value of a session of the target.
const LARGEST: usize = 1 << 20;

/// Reads a script: interface, encoding, claimed length, and content.
pub fn run(script: &[u8]) {
    let mut script = Input(script);
    let descriptor =
        [Image::DESCRIPTOR, Blob::DESCRIPTOR, Number::DESCRIPTOR][usize::from(script.byte() % 3)];
    let encoding = [Encoding::Plain, Encoding::Lz4, Encoding::Jpeg][usize::from(script.byte() % 3)];
    let length = script.word() as usize;
    if length > LARGEST {
        // A session refuses it before.
        return;
    }
    // A decoder of images has tables of its own.
    let bound = 8 * length + 4 * script.0.len() + (1 << 20);
    let decoded = within(bound, || decode(descriptor, encoding, script.0, length));
    let Some(decoded) = decoded else { return };
    assert_eq!(decoded.len(), length);
    for compression in [Compression::None, Compression::Lossless, Compression::Jpeg(80)] {
        let mut content = Vec::new();
        let encoding = encode(descriptor, &decoded, compression, &mut content);
        let again = decode(descriptor, encoding, &content, length).expect("what is encoded can be decoded");
        assert!(encoding == Encoding::Jpeg || again == decoded, "another value came out");
    }
}
