use std::fs::{self, File};
use std::io::{self, ErrorKind, Write};
use std::path::{Path, PathBuf};

use super::outage::Outage;
use super::{LogTarget, Record};

/// Limits of the log kept in files.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Rotation {
    /// Maximum size of a file, bytes, unless a single line exceeds it.
    pub size: u64,
    /// Number of older files kept beside the current one.
    pub keep: u32,
}

/// Log file with a line for each record, rotated when full.
/// A full file becomes `<path>.1`, the older one `<path>.2`, and so on.
///
/// A full disk stops the file, not the robot: the log says so once, and the file continues when there is space again.
#[derive(Debug)]
pub struct FileTarget {
    path: PathBuf,
    rotation: Rotation,
    /// Open file; `None` after an error, so that the next line opens it again.
    file: Option<OpenedFile>,
    outage: Outage,
    /// Name in messages.
    name: String,
}

#[derive(Debug)]
struct OpenedFile {
    file: File,
    size: u64,
    /// True for a file on a disk, which can be renamed and truncated.
    regular: bool,
}

impl FileTarget {
    /// Opens the file for appending, and creates its folder if missing.
    /// A full disk is not an error yet.
    ///
    /// # Errors
    /// When it can't be opened for another reason.
    pub fn open(path: impl AsRef<Path>, rotation: Rotation) -> io::Result<Self> {
        let path = path.as_ref().to_owned();
        let name = format!("the log file {}", slate_configuration::printable(&path));
        let mut target = Self { path, rotation, file: None, outage: Outage::default(), name };
        match target.open_file() {
            Ok(opened) => target.file = Some(opened),
            Err(error) if matches!(error.kind(), ErrorKind::StorageFull | ErrorKind::QuotaExceeded) => {
                target.outage.record_result(&target.name, Err(error));
            }
            Err(error) => return Err(error),
        }
        Ok(target)
    }

    fn open_file(&self) -> io::Result<OpenedFile> {
        if let Some(folder) = self.path.parent() {
            fs::create_dir_all(folder)?;
        }
        let file = File::options().append(true).create(true).open(&self.path)?;
        let metadata = file.metadata()?;
        Ok(OpenedFile { file, size: metadata.len(), regular: metadata.is_file() })
    }

    fn append(&mut self, line: &[u8]) -> io::Result<()> {
        let mut opened = match self.file.take() {
            Some(opened) => opened,
            None => self.open_file()?,
        };
        if opened.regular && opened.size > 0 && opened.size + line.len() as u64 > self.rotation.size {
            drop(opened);
            self.rotate()?;
            opened = self.open_file()?;
        }
        if let Err(error) = opened.file.write_all(line) {
            if opened.regular {
                // A part of the line may have found room; if it can't be cut off, the next line follows it.
                let _ = opened.file.set_len(opened.size);
            }
            return Err(error);
        }
        opened.size += line.len() as u64;
        self.file = Some(opened);
        Ok(())
    }

    /// Rotates the files to free `path`.
    /// After an error the next attempt continues at the failed step.
    fn rotate(&self) -> io::Result<()> {
        let keep = self.rotation.keep;
        if keep == 0 {
            return fs::remove_file(&self.path);
        }
        // Only files up to the first gap move, so that an attempt that fails half-way costs no further file.
        let gap = (1..keep).find(|number| !self.older(*number).exists()).unwrap_or(keep);
        for number in (1..gap).rev() {
            fs::rename(self.older(number), self.older(number + 1))?;
        }
        fs::rename(&self.path, self.older(1))
    }

    fn older(&self, number: u32) -> PathBuf {
        let mut name = self.path.clone().into_os_string();
        name.push(format!(".{number}"));
        name.into()
    }
}

impl LogTarget for FileTarget {
    fn write(&mut self, record: &Record) {
        let result = self.append(format!("{record}\n").as_bytes());
        self.outage.record_result(&self.name, result);
    }

    fn diagnostic(&mut self) -> Option<String> {
        self.outage.diagnostic()
    }
}
