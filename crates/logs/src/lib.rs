//! Recordings of any origin.
//! Logs of other systems are read as recordings, and tools copy, merge and compare both.
//!
//! - [`recognize`] determines the format of a file from its content;
//! - [`import`] converts it to an MCAP file, with the interfaces of Slate where they exist, so that every command that knows
//!   recordings works on it;
//! - [`open`] reads it at once, without a file that stays;
//! - [`export_carmen`] and [`export_ros`] convert in the other direction;
//! - [`copy()`] copies a [`Selection`](slate_bag::Selection) of a recording, [`merge()`] makes one of several, [`diff()`] compares
//!   two, and [`export_csv`] writes numbers as tables.
//!
//! | [`Format`] | meaning |
//! |---|---|
//! | `mcap` | a recording in MCAP: of Slate, of ROS 2, or of any other program |
//! | `carmen` | lines of CARMEN's logger, old ones (`FLASER`) and new ones (`ROBOTLASER1`), also with gzip |
//! | `openrdk` | lines of OpenRDK's sensor logs |
//! | `bblogger` | a file of the blackboard logger of Fawkes |
//! | `rosbag1` | a recording of ROS 1 |
//! | `rosbag2` | a recording of ROS 2: a folder with MCAP files |

mod bblogger;
mod carmen;
mod copy;
mod diff;
mod format;
mod lines;
mod merge;
mod openrdk;
mod output;
mod rosbag1;
mod rosbag2;
mod table;
mod words;

pub use carmen::{CarmenLog, export_carmen};
pub use copy::{copy, merge};
pub use diff::{Compared, Counts, Diff, Difference, diff, diff_of};
pub use format::{Format, recognize};
pub use merge::Part;
pub use rosbag2::{RosExport, RosLog, export_ros};
pub use table::{Table, export_csv};

use std::fs::{File, OpenOptions};
use std::io::{BufReader, BufWriter, Seek, Write};
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicU64, Ordering};

use serde::Serialize;
use slate_sorted::SortedMap;

use lines::Lines;
use output::Output;
use slate_bag::{Error, Reader, whole};

/// Options of an import.
#[derive(Clone, Copy, Debug, Default)]
pub struct Options {
    /// Format of the log; by default detected from its content.
    pub format: Option<Format>,
    /// Set if invalid parts are skipped and counted, instead of ending the import.
    pub is_lenient: bool,
}

/// Result of an import.
#[derive(Clone, Debug, Serialize)]
pub struct Imported {
    /// Format of the log.
    pub format: Format,
    /// Number of messages of the result.
    pub messages: u64,
    /// Number of invalid lines or records, which are left out.
    pub wrong: u64,
    /// Errors of the first of them.
    pub wrongs: Vec<String>,
    /// Kinds of records without a meaning here, which are not read, with their counts.
    pub unread: SortedMap<String, u64>,
}

impl Imported {
    /// Maximum number of errors, and of names of unread records.
    const MAX_REPORTED: usize = 10;

    fn new(format: Format) -> Self {
        Self { format, messages: 0, wrong: 0, wrongs: Vec::new(), unread: SortedMap::new() }
    }

    /// Counts an error of a lenient import, else returns it.
    fn wrong(&mut self, options: &Options, error: Error) -> Result<(), Error> {
        if !options.is_lenient {
            return Err(error);
        }
        self.wrong += 1;
        if self.wrongs.len() < Self::MAX_REPORTED {
            self.wrongs.push(error.to_string());
        }
        Ok(())
    }

    /// Refuses a log without any message. A whole recording may be empty.
    fn check(&self, path: &Path) -> Result<(), Error> {
        let is_recording = matches!(self.format, Format::Mcap | Format::Rosbag1 | Format::Rosbag2);
        if self.messages > 0 || is_recording && self.wrong == 0 {
            return Ok(());
        }
        let mut why: Vec<String> = Vec::new();
        match (self.wrongs.first(), self.wrong) {
            (Some(first), 1) => why.push(format!("its content is invalid: {first}")),
            (Some(first), wrong) => why.push(format!("{wrong} parts are invalid, the first: {first}")),
            (None, _) => {}
        }
        if !self.unread.is_empty() {
            let names: Vec<_> = self.unread.keys().map(String::as_str).collect();
            why.push(format!("records of these names are not read: {}", names.join(", ")));
        }
        if why.is_empty() {
            why.push("it is empty".into());
        }
        let what = format!("as a log of format {} it has no message: {}", self.format, why.join("; "));
        Err(Error::Unfit { path: path.into(), what })
    }

    fn unread(&mut self, name: &str) {
        let is_new = !self.unread.contains_key(name);
        // A hostile file has as many names as lines.
        let name = if is_new && self.unread.len() >= Self::MAX_REPORTED { "others" } else { name };
        *self.unread.entry(name.into()).or_default() += 1;
    }
}

/// Converts a log to an MCAP file.
///
/// # Errors
/// When the log is of no known format, something in it is wrong and [`Options::is_lenient`] is not set, it has no message at all, or
/// a file can't be read or written.
pub fn import(path: &Path, out: &Path, options: &Options) -> Result<Imported, Error> {
    let format = match options.format {
        Some(format) => format,
        None => recognize(path)?.ok_or_else(|| unknown(path))?,
    };
    whole::write(out, |file| {
        let imported = read(format, path, file, out, options)?;
        imported.check(path)?;
        Ok(imported)
    })
}

/// Opens a log of any known format as a recording.
/// A format other than MCAP goes through a temporary file.
///
/// # Errors
/// As [`import`].
pub fn open(path: impl AsRef<Path>) -> Result<Reader<BufReader<File>>, Error> {
    let path = path.as_ref();
    match recognize(path)? {
        // The reader of recordings names an unknown format.
        None | Some(Format::Mcap) => Reader::open(path),
        Some(format) => {
            let failed = |source| Error::Write { path: std::env::temp_dir(), source };
            let mut file = unnamed().map_err(failed)?;
            read(format, path, BufWriter::new(&file), path, &Options::default())?;
            file.rewind().map_err(failed)?;
            Reader::new(BufReader::with_capacity(1 << 16, file), path)
        }
    }
}

fn unknown(path: &Path) -> Error {
    let names: Vec<_> = Format::ALL.iter().map(|format| format.name()).collect();
    let what = format!("unknown log format; known: {}", names.join(", "));
    Error::Unfit { path: path.into(), what }
}

/// Returns a file without a name, which disappears when it is closed.
fn unnamed() -> std::io::Result<File> {
    static NEXT: AtomicU64 = AtomicU64::new(0);
    loop {
        let number = NEXT.fetch_add(1, Ordering::Relaxed);
        let name = format!("slate-log-{}-{number}.mcap", std::process::id());
        let path: PathBuf = std::env::temp_dir().join(name);
        match OpenOptions::new().read(true).write(true).create_new(true).open(&path) {
            Ok(file) => {
                std::fs::remove_file(&path)?;
                return Ok(file);
            }
            // Left by a process that had the same number.
            Err(error) if error.kind() == std::io::ErrorKind::AlreadyExists => {}
            Err(error) => return Err(error),
        }
    }
}

/// Reads a log, and writes its messages to `out`, which errors name `out_path`.
fn read<W: Write>(
    format: Format,
    path: &Path,
    out: W,
    out_path: &Path,
    options: &Options,
) -> Result<Imported, Error> {
    let mut imported = Imported::new(format);
    let text = |output: &mut Output<W>, imported: &mut Imported| {
        let mut lines = Lines::open(path)?;
        match format {
            Format::OpenRdk => openrdk::read(&mut lines, output, options, imported),
            _ => carmen::read(&mut lines, output, options, imported),
        }
    };
    match format {
        Format::Mcap => imported.messages = crate::merge::copy_into(&[path], out, out_path)?,
        Format::Rosbag2 => {
            let files = rosbag2::files(path)?;
            let files: Vec<_> = files.iter().map(PathBuf::as_path).collect();
            imported.messages = crate::merge::copy_into(&files, out, out_path)?;
        }
        Format::Bblogger => {
            let mut output = Output::new(out, out_path)?;
            bblogger::read(path, &mut output, options, &mut imported)?;
            imported.messages = output.finish()?;
        }
        Format::Rosbag1 => {
            let mut output = Output::new(out, out_path)?;
            rosbag1::read(path, &mut output, options, &mut imported)?;
            imported.messages = output.finish()?;
        }
        Format::Carmen | Format::OpenRdk => {
            let mut output = Output::new(out, out_path)?;
            text(&mut output, &mut imported)?;
            imported.messages = output.finish()?;
        }
    }
    Ok(imported)
}
