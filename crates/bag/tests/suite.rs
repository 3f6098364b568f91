//! Recordings are read strictly, and repaired: a damaged file is an error or gives the right messages, never other ones.
#![allow(clippy::unwrap_used, clippy::panic, reason = "a test that fails panics")]

use std::collections::BTreeMap;
use std::io::Cursor;

use proptest::prelude::*;
use slate_bag::{
    Attachment, Channel, Compression, Error, Header, Info, Metadata, Reader, Repaired, Schema, Writer,
    repair_into, verify,
};
use slate_sorted::SortedMap;

/// A message as a test compares it.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord)]
struct Owned {
    topic: String,
    sequence: u32,
    log_time: u64,
    data: Vec<u8>,
}

/// How many messages a chunk of the reference files has.
const PER_CHUNK: usize = 6;
const CHUNKS: usize = 4;

/// The messages of the reference files: two types, three topics.
fn originals() -> Vec<Owned> {
    let topics = ["/r2/range", "/r2/pose", "/r1/range"];
    (0..PER_CHUNK * CHUNKS)
        .map(|i| Owned {
            topic: topics[i % 3].into(),
            sequence: (i / 3) as u32,
            log_time: 1_000_000 * i as u64,
            data: (0..10 + i).map(|byte| (byte * 7 + i) as u8).collect(),
        })
        .collect()
}

fn attachment() -> Attachment {
    let (name, media_type) = ("robot.toml".into(), "application/toml".into());
    Attachment { log_time: 3, create_time: 2, name, media_type, data: b"agent.seed = 3".to_vec() }
}

fn metadata() -> Metadata {
    Metadata { name: "run".into(), metadata: [("seed".into(), "3".into())].into() }
}

/// A file by this crate.
fn ours(compression: Compression) -> Vec<u8> {
    let header = Header { profile: "ros2".into(), library: "test".into() };
    let mut writer = Writer::new(Vec::new(), "test.mcap", &header, compression).unwrap();
    writer.attachment(&attachment()).unwrap();
    for (i, message) in originals().iter().enumerate() {
        let schema_id = if message.topic.ends_with("range") { 1 } else { 2 };
        let (name, data) =
            [("test/Range", b"float64 range"), ("test/Pose2", b"float64 theta")][schema_id - 1];
        let encoding = "ros2msg".to_owned();
        let id = schema_id as u16;
        writer.schema(&Schema { id, name: name.into(), encoding, data: data.to_vec() }).unwrap();
        let channel = Channel {
            id: (i % 3) as u16,
            schema_id: id,
            topic: message.topic.clone(),
            message_encoding: "cdr".into(),
            metadata: SortedMap::new(),
        };
        writer.channel(&channel).unwrap();
        let Owned { sequence, log_time, data, .. } = message;
        writer.message(channel.id, *sequence, *log_time, *log_time, data).unwrap();
        if (i + 1) % PER_CHUNK == 0 {
            writer.close_chunk().unwrap();
        }
    }
    writer.metadata(&metadata()).unwrap();
    writer.finish().unwrap()
}

/// The same by another implementation.
fn theirs(is_chunked: bool) -> Vec<u8> {
    let options = mcap::WriteOptions::new().profile("ros2").compression(None).use_chunks(is_chunked);
    let mut writer = options.create(Cursor::new(Vec::new())).unwrap();
    let range = writer.add_schema("test/Range", "ros2msg", b"float64 range").unwrap();
    let pose = writer.add_schema("test/Pose2", "ros2msg", b"float64 theta").unwrap();
    let mut channels = BTreeMap::new();
    for (i, message) in originals().into_iter().enumerate() {
        let schema = if message.topic.ends_with("range") { range } else { pose };
        let channel_id = *channels
            .entry(message.topic.clone())
            .or_insert_with(|| writer.add_channel(schema, &message.topic, "cdr", &BTreeMap::new()).unwrap());
        let Owned { sequence, log_time, data, .. } = message;
        let header = mcap::records::MessageHeader { channel_id, sequence, log_time, publish_time: log_time };
        writer.write_to_known_channel(&header, &data).unwrap();
        if (i + 1) % PER_CHUNK == 0 {
            writer.flush().unwrap();
        }
    }
    let Attachment { log_time, create_time, name, media_type, data } = attachment();
    writer.attach(&mcap::Attachment { log_time, create_time, name, media_type, data: data.into() }).unwrap();
    let Metadata { name, metadata } = metadata();
    writer
        .write_metadata(&mcap::records::Metadata { name, metadata: metadata.into_iter().collect() })
        .unwrap();
    writer.finish().unwrap();
    writer.into_inner().into_inner()
}

fn references() -> [(&'static str, Vec<u8>); 4] {
    [
        ("ours", ours(Compression::None)),
        ("ours with LZ4", ours(Compression::Lz4)),
        ("theirs", theirs(true)),
        ("theirs without chunks", theirs(false)),
    ]
}

/// All messages until the end, or until the error.
fn read(bytes: &[u8]) -> (Vec<Owned>, Option<Error>) {
    match Reader::new(Cursor::new(bytes), "test.mcap") {
        Ok(mut reader) => messages_of(&mut reader),
        Err(error) => (Vec::new(), Some(error)),
    }
}

/// As [`read`], of what may be cut off; also where it is.
fn read_unfinished(bytes: &[u8]) -> (Vec<Owned>, Option<u64>, Option<Error>) {
    match Reader::unfinished(Cursor::new(bytes), "test.mcap") {
        Ok(mut reader) => {
            let (messages, error) = messages_of(&mut reader);
            (messages, reader.cut_off(), error)
        }
        Err(error) => (Vec::new(), None, Some(error)),
    }
}

fn messages_of(reader: &mut Reader<Cursor<&[u8]>>) -> (Vec<Owned>, Option<Error>) {
    let mut messages = Vec::new();
    loop {
        match reader.next_message() {
            Ok(None) => return (messages, None),
            Err(error) => return (messages, Some(error)),
            Ok(Some(message)) => messages.push(Owned {
                topic: message.channel.topic.clone(),
                sequence: message.sequence,
                log_time: message.log_time,
                data: message.data.to_vec(),
            }),
        }
    }
}

/// All messages of a file that must be whole.
fn whole(bytes: &[u8], what: &str) -> Vec<Owned> {
    let (messages, error) = read(bytes);
    assert!(error.is_none(), "{what}: {error:?}");
    messages
}

fn checked(bytes: &[u8]) -> Result<Info, Error> {
    verify(&mut Reader::new(Cursor::new(bytes), "test.mcap")?)
}

fn repaired(bytes: &[u8], what: &str) -> (Vec<u8>, Repaired) {
    let mut out = Vec::new();
    let repaired =
        repair_into(Cursor::new(bytes), &mut out).unwrap_or_else(|error| panic!("{what}: {error}"));
    (out, repaired)
}

/// As the other implementation reads them.
fn read_by_them(bytes: &[u8]) -> Vec<Owned> {
    let messages = mcap::MessageStream::new(bytes).unwrap().map(|message| {
        let message = message.unwrap();
        Owned {
            topic: message.channel.topic.clone(),
            sequence: message.sequence,
            log_time: message.log_time,
            data: message.data.to_vec(),
        }
    });
    messages.collect()
}

/// Where each chunk ends.
fn chunk_ends(bytes: &[u8]) -> Vec<usize> {
    let summary = mcap::Summary::read(bytes).unwrap().unwrap();
    let ends = summary.chunk_indexes.iter().map(|chunk| chunk.chunk_start_offset + chunk.chunk_length);
    ends.map(|end| end as usize).collect()
}

#[test]
fn whole_file_of_any_writer_is_read_as_written() {
    for (name, bytes) in references() {
        assert_eq!(whole(&bytes, name), originals(), "{name}");
        let info = checked(&bytes).unwrap();
        let counts: Vec<_> =
            info.channels.iter().map(|channel| (channel.topic.as_str(), channel.messages)).collect();
        assert_eq!(counts, [("/r1/range", 8), ("/r2/pose", 8), ("/r2/range", 8)], "{name}");
        assert_eq!((info.profile.as_str(), info.messages, info.to), ("ros2", 24, 23_000_000), "{name}");
        assert_eq!(info.metadata, [(metadata().name, metadata().metadata)], "{name}");
        assert_eq!(info.unchecked, [""; 0], "{name}");
        let mut reader = Reader::new(Cursor::new(&bytes), "test.mcap").unwrap();
        assert_eq!(reader.attachment(0).unwrap(), Some(attachment()), "{name}");
        assert_eq!(reader.attachment(1).unwrap(), None, "{name}");
    }
    assert_eq!(read_by_them(&ours(Compression::None)), originals());
}

#[test]
fn files_of_the_python_writer_with_both_compressions_are_read() {
    for (name, bytes) in
        [("zstd", &include_bytes!("bag/zstd.mcap")[..]), ("lz4", &include_bytes!("bag/lz4.mcap")[..])]
    {
        let messages = whole(bytes, name);
        assert_eq!(messages.len(), 40);
        for (i, message) in messages.iter().enumerate() {
            let text = format!(r#"{{"count": {i}, "label": "the same words again and again"}}"#);
            assert_eq!(String::from_utf8_lossy(&message.data), text);
        }
        let info = checked(bytes).unwrap();
        assert!(info.chunks[name].compressed < info.chunks[name].uncompressed, "{info:?}");
        for length in 1..bytes.len() {
            let (mended, _) = repaired(&bytes[..length], name);
            let kept = whole(&mended, &format!("{name} cut at {length}"));
            assert_eq!(kept, messages[..kept.len()]);
        }
    }
}

#[test]
fn every_truncation_is_an_error_and_repair_keeps_whole_records() {
    for (name, bytes) in references() {
        let ends = chunk_ends(&bytes);
        for length in 0..bytes.len() {
            let what = format!("{name} cut at {length}");
            let cut = &bytes[..length];
            let (before, error) = read(cut);
            let text = error.unwrap_or_else(|| panic!("{what} is read as if it were whole")).to_string();
            assert!(text.contains("test.mcap"), "{what}: {text}");
            assert_eq!(before, [], "{what}: it is found before the first message is returned");
            if cut.is_empty() {
                assert!(repair_into(Cursor::new(cut), Vec::new()).is_err(), "{what}: nothing is left of it");
                continue;
            }
            let (mended, told) = repaired(cut, &what);
            let kept = whole(&mended, &what);
            let whole_chunks = ends.iter().filter(|end| **end <= length).count();
            assert!(kept.len() >= whole_chunks * PER_CHUNK, "{what}: {} messages", kept.len());
            assert_eq!(kept, originals()[..kept.len()], "{what}");
            assert_eq!(told.messages, kept.len() as u64, "{what}: {told:?}");
            // It is built without LZ4.
            if length % 50 == 0 && name != "ours with LZ4" {
                assert_eq!(read_by_them(&mended), kept, "{what}");
            }
        }
    }
}

#[test]
fn a_cut_file_is_read_to_its_last_whole_record_on_request() {
    for (name, bytes) in references() {
        let ends = chunk_ends(&bytes);
        // Before its first records nothing says what it is.
        let begin = 8 + 9 + u64::from_le_bytes(bytes[9..17].try_into().unwrap()) as usize;
        for length in 0..bytes.len() {
            let what = format!("{name} cut at {length}");
            let (messages, cut_off, error) = read_unfinished(&bytes[..length]);
            assert_eq!(error.is_some(), length < begin, "{what}: {error:?}");
            assert_eq!(cut_off.is_some(), length >= begin, "{what}");
            assert!(cut_off.is_none_or(|place| place <= length as u64), "{what}: {cut_off:?}");
            assert_eq!(messages, originals()[..messages.len()], "{what}");
            if !ends.is_empty() {
                let whole_chunks = ends.iter().filter(|end| **end <= length).count();
                assert_eq!(messages.len(), whole_chunks * PER_CHUNK, "{what}");
            }
        }
        assert_eq!(read_unfinished(&bytes).1, None, "{name} is whole");
        assert_eq!(read_unfinished(&bytes).0, originals(), "{name}");
    }
}

#[test]
fn damage_differs_from_truncation() {
    for (name, bytes) in references() {
        for place in 0..bytes.len() {
            // One bit of each byte, another one from byte to byte.
            let mut flipped = bytes.clone();
            flipped[place] ^= 1 << ((place * 3 + 6) % 8);
            let (messages, _, error) = read_unfinished(&flipped);
            let count = messages.len();
            assert!(error.is_some(), "{name} with a bit of byte {place} flipped is read: {count} messages");
        }
        for second in [&bytes[..], &bytes[..bytes.len() / 2]] {
            for first in [&bytes[..], &bytes[..bytes.len() / 2], &bytes[..bytes.len() - 5]] {
                let joined = [first, second].concat();
                assert!(read_unfinished(&joined).2.is_some(), "{name}: two files in one are read");
            }
        }
    }
}

#[test]
fn a_reader_that_goes_back_reads_the_same_again() {
    for (name, bytes) in references() {
        let mut reader = Reader::new(Cursor::new(&bytes[..]), "test.mcap").unwrap();
        for _ in 0..3 {
            assert!(reader.next_message().unwrap().is_some());
        }
        reader.rewind();
        for _ in 0..2 {
            let (messages, error) = messages_of(&mut reader);
            assert!(error.is_none(), "{name}: {error:?}");
            assert_eq!(messages, originals(), "{name}");
            reader.rewind();
        }
    }
}

#[test]
fn every_flipped_bit_is_an_error_and_costs_at_most_its_chunk() {
    for (name, bytes) in references() {
        let is_chunked = !chunk_ends(&bytes).is_empty();
        for place in 0..bytes.len() {
            // One bit of each byte, another one from byte to byte.
            let bit = (place * 5 + 3) % 8;
            let what = format!("{name} with bit {bit} of byte {place} flipped");
            let mut flipped = bytes.clone();
            flipped[place] ^= 1 << bit;
            let (before, error) = read(&flipped);
            assert!(error.is_some(), "{what} is read as if it were whole");
            assert_eq!(before, [], "{what}: it is found before the first message is returned");
            let (mended, told) = repaired(&flipped, &what);
            let kept = whole(&mended, &what);
            let all = originals();
            if is_chunked {
                let missing: Vec<_> = (0..CHUNKS)
                    .filter(|chunk| {
                        !all[chunk * PER_CHUNK..].iter().take(PER_CHUNK).all(|one| kept.contains(one))
                    })
                    .collect();
                assert!(missing.len() <= 1, "{what}: chunks {missing:?} are lost: {told:?}");
                assert_eq!(kept.len(), (CHUNKS - missing.len()) * PER_CHUNK, "{what}: {told:?}");
                assert!(kept.iter().all(|one| all.contains(one)), "{what}: {told:?}");
                assert!(missing.is_empty() || !told.lost.is_empty(), "{what}: {told:?}");
            } else if kept != all {
                // No checksum tells which message it is, so that all of them are suspect: the damaged one and that before it,
                // which seems to swallow it, are lost.
                assert!(told.unchecked > 0 && told.unchecked == told.messages, "{what}: {told:?}");
                let right = kept.iter().filter(|one| all.contains(one)).count();
                assert!(right + 2 >= all.len(), "{what}: {right} messages are right: {told:?}");
            }
        }
    }
}

#[test]
fn repairing_a_whole_file_keeps_all_and_reports_no_loss() {
    for (name, bytes) in references() {
        let (mended, told) = repaired(&bytes, name);
        assert_eq!(whole(&mended, name), originals(), "{name}");
        assert_eq!((told.lost.len(), told.unfinished, told.unchecked), (0, 0, 0), "{name}: {told:?}");
        assert_eq!((told.messages, told.attachments, told.metadata), (24, 1, 1), "{name}");
    }
}

#[test]
fn adjacent_losses_of_one_reason_are_reported_as_one() {
    let whole = ours(Compression::None);
    let (start, end) = {
        let ends = chunk_ends(&whole);
        let summary = mcap::Summary::read(&whole).unwrap().unwrap();
        (summary.chunk_indexes[1].chunk_start_offset as usize, ends[1])
    };
    // Where the records of a chunk begin: behind its length, times, sizes, checksum and compression.
    let records = start + 9 + 8 + 8 + 8 + 4 + 4 + 8;
    let bytes = [&whole[..start], &whole[records..end], &whole[end..]].concat();
    let (out, told) = repaired(&bytes, "without the head of a chunk");
    assert_eq!(checked(&out).unwrap().messages, (PER_CHUNK * (CHUNKS - 1)) as u64);
    let whats: Vec<_> = told.lost.iter().map(|lost| lost.what.as_str()).collect();
    assert!(whats.iter().any(|what| what.contains("a message stands outside of the chunks")), "{whats:?}");
    for two in told.lost.windows(2) {
        let is_beside = two[0].offset + two[0].bytes == two[1].offset;
        assert!(!is_beside || two[0].what != two[1].what, "{told:?}");
    }
    assert!(told.lost.len() < PER_CHUNK, "{told:?}");
}

#[test]
fn only_recordings_are_repaired_and_replaced_by_whole_files() {
    let folder = std::path::PathBuf::from(env!("CARGO_TARGET_TMPDIR")).join("bag-repair");
    let _ = std::fs::remove_dir_all(&folder);
    std::fs::create_dir_all(&folder).unwrap();
    let picture = folder.join("picture.jpeg");
    std::fs::write(&picture, [0xff; 5000]).unwrap();
    let error = slate_bag::repair(&picture, None).unwrap_err().to_string();
    assert!(error.contains("picture.jpeg` is not an MCAP file"), "{error}");
    assert_eq!(std::fs::read(&picture).unwrap(), [0xff; 5000]);
    let empty = folder.join("empty.mcap");
    std::fs::write(&empty, "").unwrap();
    for out in [None, Some(folder.join("mended.mcap"))] {
        let error = slate_bag::repair(&empty, out.as_deref()).unwrap_err().to_string();
        assert!(error.contains("empty.mcap` is not an MCAP file: it is empty"), "{error}");
        assert!(std::fs::read(&empty).unwrap().is_empty() && out.is_none_or(|out| !out.exists()));
    }
    let file = folder.join("run.mcap");
    let bytes = ours(Compression::None);
    std::fs::write(&file, &bytes[..bytes.len() / 2]).unwrap();
    let other = folder.join("other.mcap");
    let told = slate_bag::repair(&file, Some(&other)).unwrap();
    assert_eq!(std::fs::read(&file).unwrap(), bytes[..bytes.len() / 2]);
    assert_eq!(slate_bag::repair(&file, None).unwrap(), told);
    assert_eq!(std::fs::read(&file).unwrap(), std::fs::read(&other).unwrap());
    assert!(checked(&std::fs::read(&file).unwrap()).is_ok());
    assert_eq!(std::fs::read_dir(&folder).unwrap().count(), 4, "nothing else is left");
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(256))]

    #[test]
    fn written_values_are_read_back(
        messages in prop::collection::vec((0..4_u16, any::<u64>(), prop::collection::vec(any::<u8>(), 0..200)), 0..60),
        is_compressed in any::<bool>(),
        closed in prop::collection::vec(any::<bool>(), 60),
    ) {
        let compression = if is_compressed { Compression::Lz4 } else { Compression::None };
        let mut writer = Writer::new(Vec::new(), "test.mcap", &Header::default(), compression).unwrap();
        let mut expected = Vec::new();
        for (i, (id, time, data)) in messages.into_iter().enumerate() {
            let topic = format!("/topic/{id}");
            let (message_encoding, metadata) = (String::new(), SortedMap::new());
            writer.channel(&Channel { id, schema_id: 0, topic: topic.clone(), message_encoding, metadata }).unwrap();
            writer.message(id, i as u32, time, time, &data).unwrap();
            expected.push(Owned { topic, sequence: i as u32, log_time: time, data });
            if closed[i] {
                writer.close_chunk().unwrap();
            }
        }
        let bytes = writer.finish().unwrap();
        prop_assert_eq!(whole(&bytes, "written"), expected);
    }

    #[test]
    fn no_bytes_make_it_panic(bytes in prop::collection::vec(any::<u8>(), 0..400), is_begun in any::<bool>()) {
        let mut all = if is_begun { b"\x89MCAP0\r\n".to_vec() } else { Vec::new() };
        all.extend(bytes);
        let (messages, error) = read(&all);
        prop_assert!(error.is_some() && messages.is_empty());
        let mut out = Vec::new();
        if repair_into(Cursor::new(&all), &mut out).is_ok() {
            whole(&out, "repaired");
        }
    }

    #[test]
    fn any_damage_is_found_and_repaired(
        which in 0..4_usize,
        changes in prop::collection::vec((any::<prop::sample::Index>(), any::<u8>()), 1..12),
        cut in any::<prop::sample::Index>(),
        is_cut in any::<bool>(),
    ) {
        let (name, whole_file) = references().into_iter().nth(which).unwrap();
        let mut bytes = whole_file.clone();
        for (place, byte) in changes {
            let place = place.index(bytes.len());
            bytes[place] = byte;
        }
        if is_cut {
            bytes.truncate(cut.index(bytes.len()));
        }
        let (messages, error) = read(&bytes);
        prop_assert!(error.is_some() || (messages == originals() && bytes == whole_file));
        let (messages, _, error) = read_unfinished(&bytes);
        // Without chunks, no checksum covers a part of a file.
        prop_assert!(error.is_some() || which == 3 || messages == originals()[..messages.len()]);
        let mut out = Vec::new();
        if repair_into(Cursor::new(&bytes), &mut out).is_ok() {
            whole(&out, name);
        }
    }
}
