use std::io::{Read, Seek};

use serde::Serialize;
use slate_sorted::SortedMap;

use super::record::Metadata;
use super::value::{Decoder, Unread};
use super::{Error, Reader};

/// Content of a file, all of which was read and checked.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct Info {
    /// Conventions, such as `ros2`; empty if none.
    pub profile: String,
    /// Program that wrote it.
    pub library: String,
    /// Length, bytes.
    pub bytes: u64,
    /// Number of messages.
    pub messages: u64,
    /// Earliest log time, nanoseconds; 0 without messages.
    pub from: u64,
    /// Latest log time, nanoseconds; 0 without messages.
    pub to: u64,
    /// Channels, by topic.
    pub channels: Vec<ChannelInfo>,
    /// Chunks, by compression; the empty name stands for none.
    pub chunks: SortedMap<String, ChunksInfo>,
    /// Attachments, in the order of the file.
    pub attachments: Vec<AttachmentInfo>,
    /// Metadata, in the order of the file: each with its name and texts.
    pub metadata: Vec<(String, SortedMap<String, String>)>,
    /// Records that only their writer knows, which are not read.
    pub private: u64,
    /// Parts that no checksum covers, so that damage may stay unseen.
    pub unchecked: Vec<&'static str>,
    /// Messages that are no values that can be read.
    pub unread: Vec<Unread>,
}

/// A channel of a file.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct ChannelInfo {
    /// Topic.
    pub topic: String,
    /// The name of its schema; empty if it has none.
    pub schema: String,
    /// Encoding of the messages, such as `cdr`.
    pub encoding: String,
    /// Number of messages.
    pub messages: u64,
    /// Message rate from the first to the last message of the channel, 1/s.
    /// `None` for fewer than two messages or for an empty interval.
    pub rate: Option<f64>,
}

/// The chunks of a file that are compressed in one way.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
pub struct ChunksInfo {
    /// Number of chunks.
    pub chunks: u64,
    /// Bytes of their records in the file.
    pub compressed: u64,
    /// Bytes of their records.
    pub uncompressed: u64,
}

/// An attachment of a file.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize)]
pub struct AttachmentInfo {
    /// Name.
    pub name: String,
    /// Media type, such as `application/toml`.
    pub media_type: String,
    /// Length, bytes.
    pub bytes: u64,
    /// Time of recording, nanoseconds.
    pub log_time: u64,
}

/// Reads the rest of a file, checks every record of it, and returns its content.
/// A file for which this succeeds is whole: `slate bag verify`.
///
/// # Errors
/// When it is damaged, with the place of the first record that is wrong.
pub fn verify<R: Read + Seek>(reader: &mut Reader<R>) -> Result<Info, Error> {
    let mut spans: SortedMap<u16, (u64, u64)> = SortedMap::new();
    let (mut messages, mut decoder) = (0, Decoder::default());
    while let Some(message) = reader.next_message()? {
        decoder.check(&message);
        let span = spans.entry(message.channel.id).or_insert((message.log_time, message.log_time));
        *span = (span.0.min(message.log_time), span.1.max(message.log_time));
        messages += 1;
    }
    let rate = |id: u16, count: u64| {
        let (from, to) = spans.get(&id)?;
        (to > from && count > 1).then(|| (count - 1) as f64 / ((to - from) as f64 * 1e-9))
    };
    let mut channels: Vec<_> = reader
        .channels()
        .map(|channel| ChannelInfo {
            topic: channel.topic.clone(),
            schema: reader.schema(channel).map(|schema| schema.name.clone()).unwrap_or_default(),
            encoding: channel.message_encoding.clone(),
            messages: reader.count(channel),
            rate: rate(channel.id, reader.count(channel)),
        })
        .collect();
    channels.sort_by(|a, b| a.topic.cmp(&b.topic));
    let metadata = reader.metadata()?.into_iter().map(|Metadata { name, metadata }| (name, metadata));
    let metadata = metadata.collect();
    let outline = reader.outline();
    let mut chunks: SortedMap<String, ChunksInfo> = SortedMap::new();
    for chunk in &outline.chunks {
        let entry = chunks.entry(chunk.compression.clone()).or_default();
        entry.chunks += 1;
        entry.compressed += chunk.compressed_size;
        entry.uncompressed += chunk.uncompressed_size;
    }
    let attachments = outline.attachments.iter().map(|index| AttachmentInfo {
        name: index.name.clone(),
        media_type: index.media_type.clone(),
        bytes: index.data_size,
        log_time: index.log_time,
    });
    let (from, to) = reader.times().unwrap_or_default();
    Ok(Info {
        profile: reader.header().profile.clone(),
        library: reader.header().library.clone(),
        bytes: reader.length(),
        messages,
        from,
        to,
        channels,
        chunks,
        attachments: attachments.collect(),
        metadata,
        private: outline.private,
        unchecked: outline.unchecked.clone(),
        unread: decoder.into_unread(),
    })
}
