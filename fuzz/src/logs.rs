//! Logs of other systems that become recordings; errors are reported or counted.

use std::path::PathBuf;
use std::sync::OnceLock;

use crate::memory::within;
use slate_bag::{Error, Selection};
use slate_logs::{Format, Options, export_carmen, import, open};

/// The first byte says what the others are.
pub const FORMATS: [Option<Format>; 6] = [
    None,
    Some(Format::Carmen),
    Some(Format::OpenRdk),
    Some(Format::Bblogger),
    Some(Format::Rosbag1),
    Some(Format::Rosbag2),
];

/// Reads a log of those bytes, strictly and leniently, and what has become of it.
pub fn run(bytes: &[u8]) {
    static FOLDER: OnceLock<PathBuf> = OnceLock::new();
    let folder = FOLDER.get_or_init(|| {
        let folder = crate::folder().join("fuzz-logs");
        std::fs::create_dir_all(&folder).expect("there is room");
        folder
    });
    let Some((first, bytes)) = bytes.split_first() else { return };
    let format = FORMATS[usize::from(*first) % FORMATS.len()];
    let (path, log) = match format {
        // What describes a folder of files.
        Some(Format::Rosbag2) => (folder.clone(), folder.join("metadata.yaml")),
        _ => (folder.join("log"), folder.join("log")),
    };
    std::fs::write(&log, bytes).expect("there is room");
    let out = folder.join("log.out");
    for is_lenient in [false, true] {
        // Chunks may be as large as a file says, which is why that has a limit; those of a fuzzer pack no more than a thousand to one.
        let options = Options { format, is_lenient };
        match within((16 << 20) + 4096 * bytes.len(), || import(&path, &out, &options)) {
            Ok(imported) => {
                assert!(is_lenient || imported.wrong == 0, "what is wrong is left out of a strict import");
                assert_eq!(messages(&out).ok(), Some(imported.messages), "what is imported is not whole");
                let _ = export_carmen(&out, &Selection::default(), &folder.join("log.carmen"));
            }
            Err(error) => assert!(error.to_string().contains("fuzz-logs"), "{error} names no file"),
        }
    }
    if format == Some(Format::Rosbag2) {
        std::fs::remove_file(&log).expect("it was written");
    }
}

/// Returns the number of messages of a log.
fn messages(path: &std::path::Path) -> Result<u64, Error> {
    let mut reader = open(path)?;
    let mut count = 0;
    while reader.next_message()?.is_some() {
        count += 1;
    }
    Ok(count)
}

/// Logs with something of each kind: what they are, and their bytes.
pub fn samples() -> Vec<(&'static str, u8, Vec<u8>)> {
    let carmen = "\
# CARMEN Logfile
PARAM robot_frontlaser_offset 0.25 nohost 0
SYNC start 1134863807.7 b21 0.05
ODOM 1.5 -2.25 0.5 0.4 -0.1 0.01 1134863807.75 b21 0.1
TRUEPOS 1.5 2.5 0.25 1.25 2.75 0.5 1134863807.76 b21 0.11
FLASER 3 1.09 81.91 2.5 0.1 0.2 0.3 0.4 0.5 0.6 1134863807.8 b21 0.15
RAWLASER1 0 -1.57 3.14 0.0174 80 0.01 0 2 1.5 2 1 99.5 1134863807.9 b21 0.25
ROBOTLASER1 2 -2 4 2 5.6 0.001 1 3 0.5 5.6 0.75 2 10 20 0.1 0.2 0.3 0.4 0.5 0.6 0.7 0.8 0.9 1.1 1.2 1134863807.95 b21 0.3
";
    let openrdk = "\
ODOM 1.5 2.25 0.1 1.4 2.2 0.11 86399900 rescue 86399905
FLASER 3 1.5 2 80 1.5 2.25 0.1 1.4 2.2 0.11 86399950 rescue 86399955
PANTILT 0.5 -0.25 1.5 2.25 0.1 1.4 2.2 0.11 50 rescue 55
";
    let rosbag2 =
        "rosbag2_bagfile_information:\n  storage_identifier: mcap\n  relative_file_paths:\n    - log\n";
    vec![
        ("carmen", 1, carmen.into()),
        ("known", 0, carmen.into()),
        ("openrdk", 2, openrdk.into()),
        ("bblogger", 3, bblogger()),
        ("rosbag1", 4, rosbag1()),
        ("rosbag2", 5, rosbag2.into()),
    ]
}

/// Two values of a switch, as Fawkes logs them.
fn bblogger() -> Vec<u8> {
    let padded = |text: &str, length: usize| {
        let mut bytes = text.as_bytes().to_vec();
        bytes.resize(length, 0);
        bytes
    };
    let mut bytes = vec![0xff, 0xbb, 0xff, 0xbb, 0, 0, 0, 1, 0, 0, 0, 0, 2, 0, 0, 0];
    bytes
        .extend([padded("fuzz", 32), padded("SwitchInterface", 48), padded("one", 64), vec![7; 16]].concat());
    bytes.extend(40_u32.to_le_bytes());
    bytes.extend([5_u64, 250_000].into_iter().flat_map(u64::to_le_bytes));
    for second in [0_u32, 1] {
        bytes.extend([second, 500_000].into_iter().flat_map(u32::to_le_bytes));
        bytes.extend([5_u64, 7].into_iter().flat_map(u64::to_le_bytes));
        bytes.extend([1, 0, 0, 0]);
        bytes.extend([0.5_f32, 0.25].into_iter().flat_map(f32::to_le_bytes));
        bytes.extend([3_u32, 4, 5].into_iter().flat_map(u32::to_le_bytes));
    }
    bytes
}

/// A recording of ROS 1 with one message in a chunk.
fn rosbag1() -> Vec<u8> {
    fn part(bytes: &[u8]) -> Vec<u8> {
        [&(bytes.len() as u32).to_le_bytes()[..], bytes].concat()
    }
    fn fields(fields: &[(&str, &[u8])]) -> Vec<u8> {
        fields.iter().flat_map(|(name, value)| part(&[name.as_bytes(), b"=", value].concat())).collect()
    }
    let record = |header: &[(&str, &[u8])], data: &[u8]| [part(&fields(header)), part(data)].concat();
    let definition = "Header header\nfloat32[] ranges\nstring[2] names\ntime[] times\n===\nMSG: std_msgs/Header\nuint32 seq\ntime stamp\nstring frame_id\n";
    let about = fields(&[
        ("type", b"test_msgs/Own"),
        ("md5sum", b"*"),
        ("message_definition", definition.as_bytes()),
    ]);
    let connection = record(&[("op", b"\x07"), ("conn", &[0; 4]), ("topic", b"/own")], &about);
    let (head, no_ranges) = ([3, 0, 0, 0, 9, 0, 0, 0, 8, 0, 0, 0], [0; 4]);
    let one_time = [1, 0, 0, 0, 1, 0, 0, 0, 2, 0, 0, 0];
    let data = [&head[..], &part(b"map"), &no_ranges, &part(b"a"), &part(b"b"), &one_time].concat();
    let message = record(&[("op", b"\x02"), ("conn", &[0; 4]), ("time", &[5, 0, 0, 0, 6, 0, 0, 0])], &data);
    let chunk = [connection, message].concat();
    let size = (chunk.len() as u32).to_le_bytes();
    let head = record(
        &[
            ("op", b"\x03"),
            ("index_pos", &[0; 8]),
            ("conn_count", &[1, 0, 0, 0]),
            ("chunk_count", &[1, 0, 0, 0]),
        ],
        b"  ",
    );
    let chunk = record(&[("op", b"\x05"), ("compression", b"none"), ("size", &size)], &chunk);
    [&b"#ROSBAG V2.0\n"[..], &head, &chunk].concat()
}
