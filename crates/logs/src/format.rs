use std::fmt;
use std::fs::File;
use std::io::{ErrorKind, Read};
use std::path::Path;

use serde::{Serialize, Serializer};

use super::lines::plain;
use super::{bblogger, carmen, openrdk, rosbag2};
use slate_bag::Error;

/// Format of a log.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Format {
    /// A recording in MCAP: of Slate, of ROS 2, or of any other program.
    Mcap,
    /// Lines of CARMEN's logger.
    Carmen,
    /// Lines of OpenRDK.
    OpenRdk,
    /// A file of the blackboard logger of Fawkes.
    Bblogger,
    /// A recording of ROS 1.
    Rosbag1,
    /// A recording of ROS 2: a folder.
    Rosbag2,
}

impl Format {
    /// All formats.
    pub const ALL: [Self; 6] =
        [Self::Mcap, Self::Carmen, Self::OpenRdk, Self::Bblogger, Self::Rosbag1, Self::Rosbag2];

    /// Returns the name of the format.
    pub fn name(self) -> &'static str {
        match self {
            Self::Mcap => "mcap",
            Self::Carmen => "carmen",
            Self::OpenRdk => "openrdk",
            Self::Bblogger => "bblogger",
            Self::Rosbag1 => "rosbag1",
            Self::Rosbag2 => "rosbag2",
        }
    }

    /// Returns the format of that name.
    pub fn named(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|format| format.name() == name)
    }
}

impl fmt::Display for Format {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}

impl Serialize for Format {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.serialize_str(self.name())
    }
}

/// Number of bytes of a file that are inspected.
const INSPECTED_BYTES: u64 = 256 << 10;

/// Detects the format of a log from its content; `None` when it is unknown.
///
/// # Errors
/// When it can't be read.
pub fn recognize(path: &Path) -> Result<Option<Format>, Error> {
    let failed = |source| Error::Read { path: path.into(), source };
    if path.is_dir() {
        return Ok(path.join(rosbag2::DESCRIPTION).is_file().then_some(Format::Rosbag2));
    }
    let mut head = Vec::new();
    let file = File::open(path).map_err(failed)?;
    // A file that can't be unpacked is not a log.
    match plain(file).and_then(|file| file.take(INSPECTED_BYTES).read_to_end(&mut head)) {
        Ok(_) => {}
        Err(error) if error.kind() == ErrorKind::InvalidData || error.kind() == ErrorKind::UnexpectedEof => {}
        Err(error) => return Err(failed(error)),
    }
    if head.starts_with(b"\x89MCAP") {
        return Ok(Some(Format::Mcap));
    }
    if head.starts_with(&bblogger::MAGIC) {
        return Ok(Some(Format::Bblogger));
    }
    if head.starts_with(b"#ROSBAG V") {
        return Ok(Some(Format::Rosbag1));
    }
    let text = String::from_utf8_lossy(&head);
    let lines: Vec<_> = text.lines().map(str::trim).filter(|line| !line.is_empty()).collect();
    // The last one may be cut off.
    let whole =
        if head.len() as u64 == INSPECTED_BYTES { lines.len().saturating_sub(1) } else { lines.len() };
    let lines = &lines[..whole];
    if !lines.iter().any(|line| carmen::is_line(line) || openrdk::is_line(line)) || text.contains('\0') {
        return Ok(None);
    }
    Ok(Some(if openrdk::is_openrdk_log(lines) { Format::OpenRdk } else { Format::Carmen }))
}
