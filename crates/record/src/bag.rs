//! Recordings as files that other tools read: [MCAP](https://mcap.dev), read strictly, written whole, and repaired.
//!
//! - [`Reader`] gives the messages of a file, and an error instead of a wrong one when the file is damaged; [`verify`] says
//!   of a whole file what is in it.
//! - [`repair`] makes a whole file of what is left of one.
//! - [`copy`] copies a [`Selection`] of a file, [`merge`] makes one of several, [`diff`] compares two, [`export_csv`] and [`plot`] show
//!   numbers to others, and a [`Decoder`] reads the values of messages.
//! - [`Writer`] writes a file with all checksums and indexes.
//!
//! Chunks are read uncompressed, with LZ4 and with Zstandard, and written uncompressed or with LZ4.

mod compression;
mod copy;
mod curves;
mod definitions;
mod diff;
mod ends;
mod error;
mod info;
mod outline;
mod reader;
mod record;
mod recount;
mod repair;
mod resume;
mod selection;
mod source;
mod summary;
mod table;
mod tail;
mod together;
mod value;
pub(crate) mod whole;
mod writer;

pub use compression::Compression;
pub(crate) use copy::copy_into;
pub use copy::{copy, merge};
pub use curves::plot;
pub use diff::{Compared, Counts, Diff, Difference, diff, diff_of};
pub use error::Error;
pub use info::{AttachmentInfo, ChannelInfo, ChunksInfo, Info, verify};
pub use reader::{Attachment, Message, Reader};
pub(crate) use reader::{ChannelTopic, Spot};
pub use record::{Channel, Header, Metadata, Schema};
pub(crate) use repair::REPAIR;
pub use repair::{Lost, Repaired, repair, repair_into};
pub use selection::Selection;
pub use table::{Table, export_csv, seconds};
pub use together::Part;
pub use value::{Decoder, Unread, Value};
pub use writer::Writer;

/// The most bytes that a record, or the records of a chunk, may have to be read. What is longer is refused.
pub const MAXIMUM_RECORD: u64 = 256 << 20;
