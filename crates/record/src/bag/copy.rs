use std::collections::BTreeMap;
use std::fs::File;
use std::io::{BufReader, Write};
use std::path::Path;
use std::sync::Arc;

use super::record::{Channel, Header, Schema};
use super::{Compression, Error, Reader, Selection, Writer, whole};
use crate::logs::open;

/// Copies what is selected of one or several files into one, in the order of the log times; of a file itself the order
/// stays as it is. Attachments and metadata are copied all; a part of a run, or several, are no longer said to be a whole
/// run. Channels of the same topic, type and encoding are one.
/// Returns how many messages it has.
///
/// # Errors
/// When a file is damaged or can't be read, `out` can't be written, or a topic is not there.
pub fn copy(inputs: &[&Path], out: &Path, selection: &Selection) -> Result<u64, Error> {
    let sources = inputs.iter().map(open).collect::<Result<Vec<_>, _>>()?;
    whole::write(out, |file| join(sources, file, out, selection))
}

/// Copies all of files of which each is MCAP; errors name what is written as `out_path`.
pub(crate) fn copy_into<W: Write>(inputs: &[&Path], out: W, out_path: &Path) -> Result<u64, Error> {
    let sources = inputs.iter().map(Reader::open).collect::<Result<Vec<_>, _>>()?;
    join(sources, out, out_path, &Selection::default())
}

fn join<W: Write>(
    readers: Vec<Reader<BufReader<File>>>,
    out: W,
    out_path: &Path,
    selection: &Selection,
) -> Result<u64, Error> {
    let mut sources = Vec::with_capacity(readers.len());
    for reader in readers {
        sources.push(Input { reader, held: None, start: None });
    }
    let profile = match &sources[..] {
        [first, others @ ..] => {
            let profile = &first.reader.header().profile;
            let is_shared = others.iter().all(|other| other.reader.header().profile == *profile);
            if is_shared { profile.clone() } else { String::new() }
        }
        [] => String::new(),
    };
    let header = Header { profile, library: concat!("slate ", env!("CARGO_PKG_VERSION")).into() };
    let is_compressed =
        |input: &Input| input.reader.outline().chunks.iter().any(|chunk| !chunk.compression.is_empty());
    let compression = match sources.iter().any(is_compressed) {
        true => Compression::Lz4,
        false => Compression::None,
    };
    let mut writer = Writer::new(out, out_path, &header, compression)?;
    let is_part = sources.len() > 1 || !selection.is_all();
    for input in &mut sources {
        input.head(&mut writer, is_part)?;
    }
    let messages = merge(&mut sources, selection, &mut writer)?;
    let channels = sources.iter().flat_map(|input| input.reader.channels());
    let path = sources.first().map_or(out_path, |input| input.reader.path());
    selection.check(path, channels.map(|channel| channel.topic.as_str()))?;
    writer.finish()?;
    Ok(messages)
}

/// A file that is copied, and its next message.
struct Input {
    reader: Reader<BufReader<File>>,
    held: Option<Held>,
    start: Option<u64>,
}

struct Held {
    channel: Arc<Channel>,
    schema: Option<Arc<Schema>>,
    sequence: u32,
    log_time: u64,
    publish_time: u64,
    data: Vec<u8>,
}

impl Input {
    fn head<W: Write>(&mut self, writer: &mut Writer<W>, is_part: bool) -> Result<(), Error> {
        for mut metadata in self.reader.metadata()? {
            // What is made again from a run, and compared with it, has all that the run wrote and nothing else.
            if is_part
                && metadata.name == "run"
                && let Some(whole) = metadata.metadata.get_mut("whole")
            {
                *whole = "false".into();
            }
            writer.metadata(&metadata)?;
        }
        for number in 0..self.reader.attachments() {
            if let Some(attachment) = self.reader.attachment(number)? {
                writer.attachment(&attachment)?;
            }
        }
        Ok(())
    }

    /// Reads the next message that is selected.
    fn advance(&mut self, selection: &Selection) -> Result<(), Error> {
        self.held = None;
        let start = self.start.or_else(|| self.reader.start());
        while let Some(message) = self.reader.next_message()? {
            let start = *self.start.insert(start.unwrap_or(message.log_time));
            if selection.has(&message.channel.topic) && selection.has_time(message.log_time, start) {
                self.held = Some(Held {
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

/// Writes all messages, the earliest first.
fn merge<W: Write>(
    inputs: &mut [Input],
    selection: &Selection,
    writer: &mut Writer<W>,
) -> Result<u64, Error> {
    let mut numbers = Numbers::default();
    let mut messages = 0;
    for input in inputs.iter_mut() {
        input.advance(selection)?;
    }
    loop {
        let waiting = inputs.iter_mut().enumerate();
        let waiting = waiting.filter_map(|(i, input)| Some((input.held.as_ref()?.log_time, i)));
        let Some((_, next)) = waiting.min() else { return Ok(messages) };
        let input = &mut inputs[next];
        if let Some(held) = input.held.take() {
            let channel = numbers.channel(next, &held, writer)?;
            writer.message(channel, held.sequence, held.log_time, held.publish_time, &held.data)?;
            messages += 1;
        }
        input.advance(selection)?;
    }
}

/// The numbers that schemas and channels have in the new file.
#[derive(Default)]
struct Numbers {
    /// By name, encoding and definition.
    schemas: BTreeMap<(String, String, Vec<u8>), u16>,
    /// By all that a channel says but its number.
    channels: BTreeMap<(String, String, u16, BTreeMap<String, String>), u16>,
    /// By file and number there.
    known: BTreeMap<(usize, u16), u16>,
}

impl Numbers {
    fn channel<W: Write>(&mut self, input: usize, held: &Held, writer: &mut Writer<W>) -> Result<u16, Error> {
        if let Some(known) = self.known.get(&(input, held.channel.id)) {
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
        let Channel { topic, message_encoding, metadata, .. } = &*held.channel;
        let key = (topic.clone(), message_encoding.clone(), schema_id, metadata.clone());
        let id = *self.channels.entry(key).or_insert(next_channel);
        writer.channel(&Channel { id, schema_id, ..Channel::clone(&held.channel) })?;
        self.known.insert((input, held.channel.id), id);
        Ok(id)
    }
}
