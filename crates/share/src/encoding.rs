//! Compression of values for transport, and decompression.

use std::borrow::Cow;

use slate_blackboard::interface::Descriptor;

use crate::session::{Compression, Encoding};

#[cfg(feature = "jpeg")]
mod image;

/// Size below which values are not compressed, bytes.
const MIN_COMPRESSED_SIZE: usize = 256;

/// Appends the content of a value of that interface.
/// It is compressed if that is requested and pays.
pub fn encode(
    descriptor: &'static Descriptor,
    bytes: &[u8],
    compression: Compression,
    content: &mut Vec<u8>,
) -> Encoding {
    if bytes.len() >= MIN_COMPRESSED_SIZE {
        #[cfg(feature = "jpeg")]
        if let Compression::Jpeg(quality) = compression
            && image::encode(descriptor, bytes, quality, content)
        {
            return Encoding::Jpeg;
        }
        if compression != Compression::None && lz4(bytes, content) {
            return Encoding::Lz4;
        }
    }
    // Only images have another way.
    let _ = descriptor;
    content.extend_from_slice(bytes);
    Encoding::Plain
}

/// Appends `bytes`, compressed by LZ4; false if that saves less than an eighth.
/// A smaller gain does not pay, as decompression takes time, too.
fn lz4(bytes: &[u8], content: &mut Vec<u8>) -> bool {
    let begin = content.len();
    content.resize(begin + lz4_flex::block::get_maximum_output_size(bytes.len()), 0);
    let written = lz4_flex::block::compress_into(bytes, &mut content[begin..]).unwrap_or(usize::MAX);
    let pays = written <= bytes.len() - bytes.len() / 8;
    content.truncate(if pays { begin + written } else { begin });
    pays
}

/// Decodes a value that takes `length` bytes in memory; `None` for invalid content.
pub fn decode<'a>(
    descriptor: &'static Descriptor,
    encoding: Encoding,
    content: &'a [u8],
    length: usize,
) -> Option<Cow<'a, [u8]>> {
    let whole = match encoding {
        Encoding::Plain => Cow::Borrowed(content),
        Encoding::Lz4 => {
            // LZ4 makes nothing more than 255 times as large, so no memory is taken for what can't be.
            if length / 256 > content.len() {
                return None;
            }
            let mut bytes = vec![0; length];
            let written = lz4_flex::block::decompress_into(content, &mut bytes).ok()?;
            bytes.truncate(written);
            Cow::Owned(bytes)
        }
        #[cfg(feature = "jpeg")]
        Encoding::Jpeg => Cow::Owned(image::decode(descriptor, content, length)?),
        #[cfg(not(feature = "jpeg"))]
        Encoding::Jpeg => return None,
        Encoding::Placed => return None,
    };
    let _ = descriptor;
    (whole.len() == length).then_some(whole)
}
