//! Several recordings made one, or a part of one copied.

mod copy_counts;
mod merge_check;

use std::fs::File;
use std::io::{BufReader, Write};
use std::path::Path;
use std::sync::Arc;

use copy_counts::CopyCounts;
pub(crate) use merge_check::MergeCheck;
pub use merge_check::Part;
use merge_check::prefixed_topic;
use slate_bag::{
    Attachment, Channel, Compression, Error, Header, Metadata, Reader, Schema, Selection, Writer,
};
use slate_sorted::SortedMap;

/// Copies all of several MCAP files that are one recording.
/// Errors name the output as `out_path`.
pub(crate) fn copy_into<W: Write>(inputs: &[&Path], out: W, out_path: &Path) -> Result<u64, Error> {
    let input = |path: &&Path| Ok(MergeInput::new(Reader::open(path)?, ""));
    let inputs = inputs.iter().map(input).collect::<Result<Vec<_>, Error>>()?;
    join(inputs, out, out_path, &Selection::default(), None)
}

/// Writes the selected messages of the inputs as one file, ordered by log time.
pub(crate) fn join<W: Write>(
    mut inputs: Vec<MergeInput>,
    out: W,
    out_path: &Path,
    selection: &Selection,
    merge_check: Option<(MergeCheck, bool)>,
) -> Result<u64, Error> {
    let profile = match &inputs[..] {
        [first, others @ ..] => {
            let profile = &first.reader.header().profile;
            let is_shared = others.iter().all(|other| other.reader.header().profile == *profile);
            if is_shared { profile.clone() } else { String::new() }
        }
        [] => String::new(),
    };
    let header = Header { profile, library: concat!("slate ", env!("CARGO_PKG_VERSION")).into() };
    let compression = match inputs.iter().any(|input| input.reader.is_compressed()) {
        true => Compression::Lz4,
        false => Compression::None,
    };
    let mut merger = Merger {
        writer: Writer::new(out, out_path, &header, compression)?,
        selection,
        merge_check,
        is_part: inputs.len() > 1 || !selection.is_all(),
        numbers: MergedIds::default(),
        heads: Heads::default(),
    };
    inputs.iter_mut().try_for_each(|input| merger.head(input))?;
    let messages = merger.messages(&mut inputs)?;
    let channels = inputs.iter().flat_map(|input| input.reader.channels());
    let path = inputs.first().map_or(out_path, |input| input.reader.path());
    selection.check(path, channels.map(|channel| channel.topic.as_str()))?;
    if let Some((merge_check, false)) = &merger.merge_check {
        merge_check.check(out_path)?;
    }
    for MergeInput { copy_counts, prefix, .. } in inputs {
        copy_counts
            .renewed_metadata(selection, &prefix)
            .iter()
            .try_for_each(|metadata| merger.writer.metadata(metadata))?;
    }
    merger.writer.finish()?;
    Ok(messages)
}

/// A file that is copied, and its next message.
pub(crate) struct MergeInput {
    reader: Reader<BufReader<File>>,
    prefix: String,
    held: Option<HeldMessage>,
    start: Option<u64>,
    copy_counts: CopyCounts,
}

struct HeldMessage {
    channel: Arc<Channel>,
    schema: Option<Arc<Schema>>,
    sequence: u32,
    log_time: u64,
    publish_time: u64,
    data: Vec<u8>,
}

impl HeldMessage {
    /// Returns a digest of a message, equal in other recordings of its run.
    fn digest(&self) -> u128 {
        let mut hash = xxhash_rust::xxh3::Xxh3Default::new();
        let sender = self.channel.metadata.get("sender").map_or("", String::as_str);
        for text in [&self.channel.topic, sender] {
            hash.update(&(text.len() as u64).to_le_bytes());
            hash.update(text.as_bytes());
        }
        hash.update(&self.log_time.to_le_bytes());
        hash.update(&self.publish_time.to_le_bytes());
        hash.update(&self.sequence.to_le_bytes());
        hash.update(&self.data);
        hash.digest128()
    }
}

impl MergeInput {
    pub fn new(reader: Reader<BufReader<File>>, prefix: &str) -> Self {
        Self { reader, prefix: prefix.into(), held: None, start: None, copy_counts: CopyCounts::default() }
    }

    /// Returns the run of the input, if it names one.
    pub fn run(&mut self) -> Result<Option<String>, Error> {
        let metadata = self.reader.metadata()?;
        let mut runs = metadata.into_iter().filter(|metadata| metadata.name == "run");
        let mut runs = runs.by_ref().map(|mut run| run.metadata.remove("run"));
        let first = runs.next().flatten();
        // A file of several runs is of none.
        Ok(first.filter(|first| runs.all(|other| other.as_ref() == Some(first))))
    }

    /// Reads the next message that is selected.
    fn advance(&mut self, selection: &Selection) -> Result<(), Error> {
        self.held = None;
        let start = self.start.or_else(|| self.reader.start());
        while let Some(message) = self.reader.next_message()? {
            let start = *self.start.insert(start.unwrap_or(message.log_time));
            self.copy_counts.note_drops(&message, start, selection);
            if selection.has(&message.channel.topic) && selection.has_time(message.log_time, start) {
                self.held = Some(HeldMessage {
                    channel: Arc::clone(message.channel),
                    schema: message.schema.cloned(),
                    sequence: message.sequence,
                    log_time: message.log_time,
                    publish_time: message.publish_time,
                    data: message.data.to_vec(),
                });
                break;
            }
        }
        Ok(())
    }
}

/// Metadata and attachments of several files, each copied once.
#[derive(Default)]
struct Heads {
    metadata: Vec<Metadata>,
    attachments: Vec<Attachment>,
}

/// The merged file.
struct Merger<'a, W> {
    writer: Writer<W>,
    selection: &'a Selection,
    /// Check that several files may be one, and whether their messages may be mixed.
    merge_check: Option<(MergeCheck, bool)>,
    is_part: bool,
    numbers: MergedIds,
    heads: Heads,
}

impl<W: Write> Merger<'_, W> {
    /// Copies metadata and attachments.
    fn head(&mut self, input: &mut MergeInput) -> Result<(), Error> {
        let all = input.reader.metadata()?;
        let run = all.iter().find(|metadata| metadata.name == "run");
        let is_counted = self.is_part && run.is_some();
        input.copy_counts = CopyCounts::new(run);
        for mut metadata in all {
            if is_counted && metadata.name == "run" {
                let texts = &mut metadata.metadata;
                // Only a whole run can be repeated and compared.
                texts.get_mut("whole").into_iter().for_each(|whole| *whole = "false".into());
            }
            let kept = if is_counted { input.copy_counts.keep(metadata) } else { Some(metadata) };
            if let Some(metadata) = kept.filter(|own| !self.heads.metadata.contains(own)) {
                self.writer.metadata(&metadata)?;
                if self.merge_check.is_some() {
                    self.heads.metadata.push(metadata);
                }
            }
        }
        for number in 0..input.reader.attachments() {
            let attachment = input.reader.attachment(number)?;
            if let Some(own) = attachment.filter(|own| !self.heads.attachments.contains(own)) {
                self.writer.attachment(&own)?;
                if self.merge_check.is_some() {
                    self.heads.attachments.push(own);
                }
            }
        }
        Ok(())
    }

    /// Writes all messages, the earliest first.
    fn messages(&mut self, inputs: &mut [MergeInput]) -> Result<u64, Error> {
        let mut messages = 0;
        for input in inputs.iter_mut() {
            input.advance(self.selection)?;
        }
        loop {
            let waiting = inputs.iter_mut().enumerate();
            let waiting = waiting.filter_map(|(i, input)| Some((input.held.as_ref()?.log_time, i)));
            let Some((_, next)) = waiting.min() else { return Ok(messages) };
            let input = &mut inputs[next];
            if let Some(held) = input.held.take()
                && self.write(next, &input.prefix, &held)?
            {
                input.copy_counts.count(&held.channel.topic, held.log_time);
                messages += 1;
            }
            input.advance(self.selection)?;
        }
    }

    /// Writes a message; false when another file of its run had it already.
    fn write(&mut self, file: usize, prefix: &str, held: &HeldMessage) -> Result<bool, Error> {
        let channel = self.numbers.channel((file, prefix), held, &mut self.writer)?;
        if let Some((merge_check, _)) = &mut self.merge_check {
            let topic = self.writer.topic(channel);
            if !merge_check.is_new(file, topic, held.log_time, || held.digest()) {
                return Ok(false);
            }
        }
        self.writer.message(channel, held.sequence, held.log_time, held.publish_time, &held.data)?;
        Ok(true)
    }
}

/// The numbers that schemas and channels have in the new file.
#[derive(Default)]
struct MergedIds {
    /// Schemas by name, encoding and definition.
    schemas: SortedMap<(String, String, Vec<u8>), u16>,
    /// Channels by topic, encoding, schema and metadata.
    channels: SortedMap<(String, String, u16, SortedMap<String, String>), u16>,
    /// Channels by file and number there.
    known: SortedMap<(usize, u16), u16>,
}

impl MergedIds {
    fn channel<W: Write>(
        &mut self,
        (file, prefix): (usize, &str),
        held: &HeldMessage,
        writer: &mut Writer<W>,
    ) -> Result<u16, Error> {
        if let Some(known) = self.known.get(&(file, held.channel.id)) {
            return Ok(*known);
        }
        let full = |_| writer.unfit("it would have more than 65535 channels or schemas; select fewer".into());
        let next_schema = u16::try_from(self.schemas.len() + 1).map_err(full)?;
        let next_channel = u16::try_from(self.channels.len() + 1).map_err(full)?;
        let mut schema_id = 0;
        if let Some(schema) = &held.schema {
            let key = (schema.name.clone(), schema.encoding.clone(), schema.data.clone());
            schema_id = *self.schemas.entry(key).or_insert(next_schema);
            writer.schema(&Schema { id: schema_id, ..Schema::clone(schema) })?;
        }
        let Channel { message_encoding, metadata, .. } = &*held.channel;
        let topic = prefixed_topic(prefix, &held.channel.topic);
        let key = (topic.clone(), message_encoding.clone(), schema_id, metadata.clone());
        let id = *self.channels.entry(key).or_insert(next_channel);
        writer.channel(&Channel { id, schema_id, topic, ..Channel::clone(&held.channel) })?;
        self.known.insert((file, held.channel.id), id);
        Ok(id)
    }
}
