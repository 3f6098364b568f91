//! Recordings that the program most used outside of ROS writes are read, in every form that it knows.

use crate::python;

use std::path::Path;
use std::process::Command;

use slate_bag::{Compression, Decoder, Header, Metadata, Reader, Writer, verify};

#[test]
fn bags_of_the_python_writer_are_whole_with_all_messages() {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join("bags-of-python");
    let _ = std::fs::remove_dir_all(&folder);
    std::fs::create_dir_all(&folder).unwrap();
    let script = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/others/write_bags.py");
    python::run(Command::new(python::python()).arg(script).arg(&folder), "the files can't be written");
    let mut files = 0;
    for entry in std::fs::read_dir(&folder).unwrap() {
        let path = entry.unwrap().path();
        let name = path.file_name().unwrap().to_string_lossy().into_owned();
        let info = Reader::open(&path).and_then(|mut reader| verify(&mut reader));
        let info = info.unwrap_or_else(|error| panic!("{name}: {error}"));
        let extras = usize::from(name.contains("_extras"));
        assert_eq!(
            (info.messages, info.attachments.len(), info.metadata.len()),
            (10, extras, extras),
            "{name}"
        );
        let mut reader = Reader::open(&path).unwrap();
        let (mut decoder, mut ranges) = (Decoder::default(), Vec::new());
        while let Some(message) = reader.next_message().unwrap() {
            ranges.push(decoder.decode(&message).number("range").unwrap());
        }
        assert_eq!(ranges, (0..10).map(f64::from).collect::<Vec<_>>(), "{name}");
        files += 1;
    }
    assert_eq!(files, 21);
}

#[test]
fn an_offset_that_contradicts_the_summary_is_reported() {
    // The last summary offset is before the footer: 9 + 20 bytes of it, and 8 of the end; its length is its last 8 bytes.
    let header = Header::default();
    let mut writer = Writer::new(Vec::new(), "x", &header, Compression::None).unwrap();
    let metadata = Metadata { name: "run".into(), ..Default::default() };
    writer.metadata(&metadata).unwrap();
    let mut bytes = writer.finish().unwrap();
    let end = bytes.len() - 8 - 29;
    bytes[end - 8..end].fill(0);
    // Without its checksum, as some writers leave it.
    let crc = bytes.len() - 8 - 4;
    bytes[crc..crc + 4].fill(0);
    let error = Reader::new(std::io::Cursor::new(bytes), "x").map(drop).unwrap_err().to_string();
    assert!(error.contains("its summary offset is wrong: 0 bytes of records of opcode 0x0d"), "{error}");
}
