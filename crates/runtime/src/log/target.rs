use std::collections::VecDeque;
use std::fs::File;
use std::io::{self, Write};
use std::path::Path;
use std::sync::{Arc, Mutex, PoisonError};

use super::Record;

/// Where lines of the log go.
pub trait LogTarget: Send {
    /// Takes a line. It may take its time: nobody waits for it.
    fn write(&mut self, record: &Record);
}

/// Standard error.
#[derive(Debug, Default)]
pub struct ConsoleTarget;

impl LogTarget for ConsoleTarget {
    fn write(&mut self, record: &Record) {
        eprintln!("{record}");
    }
}

/// A file, a line each.
#[derive(Debug)]
pub struct FileTarget {
    file: File,
    failed: bool,
}

impl FileTarget {
    /// Creates the file.
    ///
    /// # Errors
    /// When it can't be created.
    pub fn create(path: &Path) -> io::Result<Self> {
        Ok(Self { file: File::create(path)?, failed: false })
    }
}

impl LogTarget for FileTarget {
    fn write(&mut self, record: &Record) {
        if let Err(error) = writeln!(self.file, "{record}")
            && !self.failed
        {
            // Said once: a full disk stops the file, not the robot.
            self.failed = true;
            eprintln!("the log file can't be written: {error}");
        }
    }
}

/// The last lines in memory, for displays and tests.
#[derive(Clone, Debug, Default)]
pub struct MemoryTarget {
    lines: Arc<Mutex<VecDeque<Record>>>,
}

impl MemoryTarget {
    /// How many lines are kept.
    pub const CAPACITY: usize = 1000;

    /// A copy of the lines.
    pub fn lines(&self) -> Vec<Record> {
        self.lines.lock().unwrap_or_else(PoisonError::into_inner).iter().cloned().collect()
    }
}

impl LogTarget for MemoryTarget {
    fn write(&mut self, record: &Record) {
        let mut lines = self.lines.lock().unwrap_or_else(PoisonError::into_inner);
        if lines.len() == Self::CAPACITY {
            lines.pop_front();
        }
        lines.push_back(record.clone());
    }
}
