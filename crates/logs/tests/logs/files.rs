//! Logs in files, and what is in the recordings that become of them.

use std::io::Write;
use std::path::{Path, PathBuf};
use std::thread::sleep;
use std::time::{Duration, Instant};

use slate_bag::{Decoder, Value, seconds};
use slate_logs as logs;
use slate_logs::{Format, Imported, Options};

/// A fresh folder that a test works in.
pub fn folder(name: &str) -> PathBuf {
    let path = Path::new(env!("CARGO_TARGET_TMPDIR")).join(format!("logs-{name}"));
    let _ = std::fs::remove_dir_all(&path);
    std::fs::create_dir_all(&path).unwrap();
    path
}

pub fn write(folder: &Path, name: &str, bytes: impl AsRef<[u8]>) -> PathBuf {
    let path = folder.join(name);
    std::fs::write(&path, bytes).unwrap();
    path
}

pub const STRICT: Options = Options { format: None, is_lenient: false };
pub const LENIENT: Options = Options { format: None, is_lenient: true };

/// Imports a log, and reads what has become of it.
pub fn import(path: &Path, options: &Options) -> (Imported, Vec<(u64, String, Value)>) {
    let out = path.with_extension("imported.mcap");
    let imported = logs::import(path, &out, options).unwrap();
    let messages = messages(&out);
    assert_eq!(imported.messages, messages.len() as u64);
    (imported, messages)
}

/// The messages of any log.
pub fn messages(path: &Path) -> Vec<(u64, String, Value)> {
    let mut reader = logs::open(path).unwrap();
    let mut decoder = Decoder::default();
    let mut messages = Vec::new();
    while let Some(message) = reader.next_message().unwrap() {
        messages.push((message.log_time, message.channel.topic.clone(), decoder.decode(&message)));
    }
    messages
}

/// As `slate bag cat` has them.
pub fn lines(messages: &[(u64, String, Value)]) -> Vec<String> {
    messages.iter().map(|(time, topic, value)| format!("{} {topic} {value}", seconds(*time))).collect()
}

#[test]
fn a_log_is_known_by_its_content_whatever_it_is_called() {
    let folder = folder("known");
    let odometry = "ODOM 0 0 0 0 0 0 1.5 host 1.5\n";
    let mut packed = flate2::write::GzEncoder::new(Vec::new(), flate2::Compression::default());
    packed.write_all(odometry.as_bytes()).unwrap();
    let packed = packed.finish().unwrap();
    let cases: [(&[u8], Option<Format>); 8] = [
        (odometry.as_bytes(), Some(Format::Carmen)),
        (&packed, Some(Format::Carmen)),
        (b"# CARMEN Logfile\n", Some(Format::Carmen)),
        (b"# a comment\n\nODOM 0 0 0 0 0 0 15000 host 15003\n", Some(Format::OpenRdk)),
        (b"ODOM 0 0 0\n", None),
        (b"Dear reader,\n", None),
        (b"", None),
        (&packed[..packed.len() / 2], None),
    ];
    for (i, (bytes, format)) in cases.into_iter().enumerate() {
        let path = write(&folder, &format!("{i}.jpeg"), bytes);
        assert_eq!(logs::recognize(&path).unwrap(), format, "{}", String::from_utf8_lossy(bytes));
    }
    let path = write(&folder, "letter", b"Dear reader,\n");
    let error = logs::import(&path, &folder.join("x.mcap"), &STRICT).unwrap_err().to_string();
    assert!(
        error.contains("letter")
            && error.contains("known: mcap, carmen, openrdk, bblogger, rosbag1, rosbag2"),
        "{error}"
    );
    assert!(!folder.join("x.mcap").exists() && !folder.join("x.mcap.part").exists());
}

#[test]
#[allow(clippy::disallowed_methods, reason = "another test removes its file on the wall clock")]
fn a_log_is_read_at_once_as_it_is_imported_and_leaves_no_file() {
    let folder = folder("at-once");
    let path = write(
        &folder,
        "a.log",
        "ODOM 1 2 0.5 0.25 0.125 0 1.5 host 1.5\nODOM 2 2 0.5 0.25 0 0 2.5 host 2.5\n",
    );
    let out = folder.join("a.mcap");
    logs::import(&path, &out, &STRICT).unwrap();
    assert_eq!(messages(&path), messages(&out));
    let reader = logs::open(&path).unwrap();
    assert_eq!(reader.path(), path);
    let own = format!("slate-log-{}-", std::process::id());
    let entries = std::fs::read_dir(std::env::temp_dir()).unwrap().map(|entry| entry.unwrap().path());
    let is_own = |path: &PathBuf| path.file_name().unwrap().to_string_lossy().starts_with(&own);
    // Those of tests that import just now vanish, too.
    for file in entries.filter(is_own) {
        let begin = Instant::now();
        while file.exists() {
            assert!(begin.elapsed() < Duration::from_secs(10), "{} is left", file.display());
            sleep(Duration::from_millis(5));
        }
    }
}
