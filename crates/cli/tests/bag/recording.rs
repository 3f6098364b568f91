//! Recordings that the tests read, made here to the byte.

use slate::bag::{Attachment, Channel, Compression, Header, Metadata, Schema, Writer};
use slate_sorted::SortedMap;

/// A range and two beams as CDR lays them out.
fn range(range: f64) -> Vec<u8> {
    let mut bytes = vec![0, 1, 0, 0];
    bytes.extend(range.to_le_bytes());
    bytes.extend(2_u32.to_le_bytes());
    bytes.extend([0; 4]);
    bytes.extend([range + 1.0, range + 2.0].into_iter().flat_map(f64::to_le_bytes));
    bytes
}

/// A recording of five seconds, ten messages a second; the last range is as given.
pub fn recording(last: f64, compression: Compression) -> Vec<u8> {
    recording_of("r2-1", last, compression)
}

/// The same of a run.
pub fn recording_of(run: &str, last: f64, compression: Compression) -> Vec<u8> {
    let header = Header { profile: "ros2".into(), library: "test 1".into() };
    let mut writer = Writer::new(Vec::new(), "test", &header, compression).unwrap();
    let texts = |key: &str, text: &str| SortedMap::from([(key.to_owned(), text.to_owned())]);
    let all = [texts("seed", "3"), texts("whole", "true"), texts("run", run)].into_iter().flatten();
    writer.metadata(&Metadata { name: "run".into(), metadata: all.collect() }).unwrap();
    writer.metadata(&Metadata { name: "dropped".into(), metadata: texts("/r2/image", "7") }).unwrap();
    let (name, media_type) = ("robot.toml".into(), "application/toml".into());
    let attachment =
        Attachment { name, media_type, data: b"agent.seed = 3".to_vec(), ..Attachment::default() };
    writer.attachment(&attachment).unwrap();
    let data = b"float64 range\nfloat64[] beams\n".to_vec();
    writer
        .schema(&Schema { id: 1, name: "test/msg/Range".into(), encoding: "ros2msg".into(), data })
        .unwrap();
    let channels = [("/r2/range", 1, "cdr"), ("/r2/pose", 0, "json")];
    for (id, (topic, schema_id, encoding)) in channels.into_iter().enumerate() {
        let (id, message_encoding, metadata) = (id as u16, encoding.into(), SortedMap::new());
        writer.channel(&Channel { id, schema_id, topic: topic.into(), message_encoding, metadata }).unwrap();
    }
    for i in 0..50_u32 {
        let time = 2_000_000_000 + u64::from(i) * 100_000_000;
        let value = if i == 49 { last } else { f64::from(i) / 4.0 };
        writer.message(0, i, time, time, &range(value)).unwrap();
        let pose = format!(r#"{{"x":{i},"frame":"map, \"odom\""}}"#);
        writer.message(1, i, time, time, pose.as_bytes()).unwrap();
        if i % 10 == 9 {
            writer.close_chunk().unwrap();
        }
    }
    let end = ["values", "dropped", "time_ns", "cycles", "digest"].map(|key| texts(key, "107"));
    writer.metadata(&Metadata { name: "end".into(), metadata: end.into_iter().flatten().collect() }).unwrap();
    writer.finish().unwrap()
}

/// A recording of which some messages are no values.
pub fn unreadable() -> Vec<u8> {
    let mut writer = Writer::new(Vec::new(), "test", &Header::default(), Compression::None).unwrap();
    let data = b"float64 range\n".to_vec();
    writer
        .schema(&Schema { id: 1, name: "test/msg/Range".into(), encoding: "ros2msg".into(), data })
        .unwrap();
    for (id, schema_id, topic) in [(0, 1, "/range"), (1, 0, "/bare")] {
        let (topic, message_encoding, metadata) = (topic.into(), "cdr".into(), SortedMap::new());
        writer.channel(&Channel { id, schema_id, topic, message_encoding, metadata }).unwrap();
    }
    for second in 0..6_u32 {
        let time = u64::from(second) * 1_000_000_000;
        let bytes = [&[0, 1, 0, 0][..], &f64::from(second).to_le_bytes()].concat();
        let bytes = if second % 2 == 1 { &bytes[..7] } else { &bytes };
        writer.message(0, second, time, time, bytes).unwrap();
    }
    writer.message(1, 0, 2_500_000_000, 0, &[0, 1, 0, 0]).unwrap();
    writer.finish().unwrap()
}

/// A recording with a message of so many bytes, of which the file has few, and a short one behind it.
pub fn with_a_long_message(length: usize) -> Vec<u8> {
    let mut writer = Writer::new(Vec::new(), "test", &Header::default(), Compression::Lz4).unwrap();
    let (topic, message_encoding, metadata) = ("/text".into(), "json".into(), SortedMap::new());
    writer.channel(&Channel { id: 0, schema_id: 0, topic, message_encoding, metadata }).unwrap();
    writer.message(0, 0, 1, 1, format!("\"{}\"", "a".repeat(length)).as_bytes()).unwrap();
    writer.message(0, 1, 2, 2, b"\"short\"").unwrap();
    writer.finish().unwrap()
}
