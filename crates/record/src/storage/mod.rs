//! MCAP files: read strictly, written whole, and repaired.

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
pub(crate) mod whole;
mod writer;

pub use compression::Compression;
pub use error::Error;
pub use info::{AttachmentInfo, ChannelInfo, ChunksInfo, Info, verify};
pub(crate) use interface::interface;
pub use reader::{Attachment, Message, Reader};
pub(crate) use reader::{ChannelTopic, MessageLocation};
pub use record::{Channel, Header, Metadata, Schema};
pub(crate) use repair::REPAIR;
pub use repair::{Lost, Repaired, repair, repair_into};
pub(crate) use repeated::{REPEATED, Repeated};
pub use selection::Selection;
pub use time::seconds;
pub use value::{Decoder, Unread, Value};
pub use writer::Writer;

/// Maximum size of a record, or of the records of a chunk, bytes.
/// A longer one is refused.
pub const MAXIMUM_RECORD: u64 = 256 << 20;
