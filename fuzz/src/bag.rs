//! Recording files: damage is an error and can be repaired to a whole file.

use std::io::Cursor;

use slate_bag::{
    Attachment, Channel, Compression, Decoder, Error, Header, Metadata, Reader, Schema, Writer, repair_into,
};
use slate_sorted::SortedMap;

/// Reads a file of those bytes and all values in it, and repairs it.
pub fn run(bytes: &[u8]) {
    if let Err(error) = messages(bytes) {
        assert!(error.to_string().contains("fuzz.mcap"), "{error} names no file");
    }
    let unfinished = Reader::unfinished(Cursor::new(bytes), "fuzz.mcap");
    let unfinished = unfinished.and_then(|mut reader| Ok((reader.cut_off(), all(&mut reader)?)));
    match (messages(bytes), unfinished) {
        (Ok(count), other) => assert_eq!(other.ok(), Some((None, count)), "a whole file is not cut off"),
        (Err(_), Ok((cut_off, _))) => assert!(cut_off.is_some(), "what is damaged is read"),
        (Err(_), Err(error)) => assert!(error.to_string().contains("fuzz.mcap"), "{error} names no file"),
    }
    let mut whole = Vec::new();
    let Ok(repaired) = repair_into(Cursor::new(bytes), &mut whole) else { return };
    let read = messages(&whole);
    assert_eq!(read.ok(), Some(repaired.messages), "what is repaired is not whole");
    let mut again = Vec::new();
    let repaired = repair_into(Cursor::new(&whole), &mut again).expect("it is in memory");
    assert!(repaired.lost.is_empty(), "something of a whole file is lost");
}

/// Returns the number of messages of a whole file.
fn messages(bytes: &[u8]) -> Result<u64, Error> {
    all(&mut Reader::new(Cursor::new(bytes), "fuzz.mcap")?)
}

fn all(reader: &mut Reader<Cursor<&[u8]>>) -> Result<u64, Error> {
    let mut decoder = Decoder::default();
    let mut count = 0;
    while let Some(message) = reader.next_message()? {
        let _ = decoder.decode(&message).fields(true);
        count += 1;
    }
    for number in 0..reader.attachments() {
        reader.attachment(number)?;
    }
    reader.metadata()?;
    Ok(count)
}

/// A short recording with something of each kind.
///
/// # Panics
/// Never: it is in memory.
pub fn recording(compression: Compression) -> Vec<u8> {
    let header = Header { profile: "ros2".into(), library: "fuzz".into() };
    let mut writer = Writer::new(Vec::new(), "fuzz.mcap", &header, compression).expect("it is in memory");
    let attachment = Attachment { name: "robot.toml".into(), data: vec![b'a'; 20], ..Attachment::default() };
    writer.attachment(&attachment).expect("it is short");
    let data = b"float64 range\nstring frame\n".to_vec();
    let schema = Schema { id: 1, name: "test/msg/Range".into(), encoding: "ros2msg".into(), data };
    writer.schema(&schema).expect("it is the only one");
    for (id, schema_id, encoding) in [(1, 1, "cdr"), (2, 0, "json")] {
        let (topic, message_encoding) = (format!("/topic/{id}"), encoding.into());
        let channel = Channel { id, schema_id, topic, message_encoding, metadata: SortedMap::new() };
        writer.channel(&channel).expect("its schema is defined");
    }
    for i in 0..20_u32 {
        let time = u64::from(i) * 1_000;
        let mut range = vec![0, 1, 0, 0];
        range.extend(f64::from(i).to_le_bytes());
        range.extend(*b"\x04\0\0\0map\0");
        writer.message(1, i, time, time, &range).expect("its channel is defined");
        writer.message(2, i, time, time, br#"{"x":1}"#).expect("its channel is defined");
        if i % 5 == 4 {
            writer.close_chunk().expect("it is in memory");
        }
    }
    let metadata = SortedMap::from([("seed".to_owned(), "3".to_owned())]);
    writer.metadata(&Metadata { name: "run".into(), metadata }).expect("it is in memory");
    writer.finish().expect("it is in memory")
}
