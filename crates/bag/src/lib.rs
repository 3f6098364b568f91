//! Recordings as [MCAP](https://mcap.dev) files.
//! They are read strictly, written whole, and repaired.
//!
//! - [`Reader`] returns the messages of a file, and an error instead of a wrong one when the file is damaged;
//!   [`verify`] returns the content of a whole file. A [`Decoder`] reads the values of messages.
//! - [`repair`] makes a whole file of the intact parts of a damaged one.
//! - [`Writer`] writes a file with all checksums and indexes.
//!
//! Chunks are read uncompressed, with LZ4 and with Zstandard, and written uncompressed or with LZ4.
//!
//! Reader and writer are own, beside the crate `mcap`, with which the recorder writes and the tests compare: that crate
//! repairs nothing, does not compare the indexes of a file with its records, and needs the C libraries of LZ4 and
//! Zstandard for compressed chunks.

mod compression;
mod definitions;
mod ends;
mod error;
mod info;
mod interface;
mod outline;
mod reader;
mod record;
mod repair;
mod repeated;
mod resume;
mod selection;
mod source;
mod summary;
mod tail;
mod time;
mod value;
pub mod whole;
mod writer;

pub use compression::Compression;
pub use error::Error;
pub use info::{AttachmentInfo, ChannelInfo, ChunksInfo, Info, verify};
pub use interface::interface;
pub use reader::{Attachment, Message, Reader};
pub use reader::{ChannelTopic, MessageLocation};
pub use record::{Channel, Header, Metadata, Schema};
pub use repair::REPAIR;
pub use repair::{Lost, Repaired, repair, repair_into};
pub use repeated::{REPEATED, Repeated};
pub use selection::Selection;
pub use time::seconds;
pub use value::{Decoder, Unread, Value};
pub use writer::Writer;

/// Maximum size of a record, or of the records of a chunk, bytes.
/// A longer one is refused.
pub const MAXIMUM_RECORD: u64 = 256 << 20;
