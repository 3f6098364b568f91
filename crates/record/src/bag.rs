//! Recordings as files for other tools: [MCAP](https://mcap.dev).
//! They are read strictly, written whole, and repaired.
//!
//! - [`Reader`] returns the messages of a file, and an error instead of a wrong one when the file is damaged;
//!   [`verify`] returns the content of a whole file.
//! - [`repair`] makes a whole file of the intact parts of a damaged one.
//! - [`copy`] copies a [`Selection`] of a file, [`merge`] makes one of several, [`diff`] compares two, [`export_csv`] and [`plot`] show
//!   numbers to others, and a [`Decoder`] reads the values of messages.
//! - [`Writer`] writes a file with all checksums and indexes.
//!
//! Chunks are read uncompressed, with LZ4 and with Zstandard, and written uncompressed or with LZ4.

mod copy;
mod curves;
mod diff;
mod table;

pub use crate::merge::Part;
pub use crate::storage::{
    Attachment, AttachmentInfo, Channel, ChannelInfo, ChunksInfo, Compression, Decoder, Error, Header, Info,
    Lost, MAXIMUM_RECORD, Message, Metadata, Reader, Repaired, Schema, Selection, Unread, Value, Writer,
    repair, repair_into, seconds, verify,
};
pub use copy::{copy, merge};
pub use curves::plot;
pub use diff::{Compared, Counts, Diff, Difference, diff, diff_of};
pub use table::{Table, export_csv};
