use std::path::{Path, PathBuf};
use std::sync::Arc;

use slate_sorted::{SortedMap, SortedSet};

/// Largest configuration file, bytes; a larger one is refused.
const LARGEST_FILE: u64 = 16 << 20;

/// Texts of files by path, each read once.
///
/// A configuration that is read with the files of an earlier one gets the same texts, even if the disk has others.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct Files(SortedMap<PathBuf, Result<File, Unreadable>>);

/// File that was read.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct File {
    /// Canonical path, the same for all paths that lead to the file.
    pub(super) canonical: PathBuf,
    pub(super) text: Arc<str>,
}

/// Reason for which a file can't be read, with a remedy.
/// `None` if the remedy is another path.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Unreadable {
    pub(super) reason: String,
    pub(super) help: Option<&'static str>,
}

impl Files {
    /// Returns the file at a path, read unless it is known.
    pub(super) fn read(&mut self, path: &Path) -> Result<File, Unreadable> {
        self.0.entry(path.to_owned()).or_insert_with(|| read(path)).clone()
    }

    /// Returns the file at a path, if it was read.
    pub(super) fn get(&self, path: &Path) -> Option<&File> {
        self.0.get(path)?.as_ref().ok()
    }

    /// Reads the present files of all paths of both.
    pub(super) fn fresh(&self, more: &Self) -> Self {
        Self(self.0.keys().chain(more.0.keys()).map(|path| (path.clone(), read(path))).collect())
    }

    /// Returns true if another one has the same content for all files of this one.
    pub(super) fn hold_in(&self, other: &Self) -> bool {
        self.0.iter().all(|(path, file)| other.0.get(path) == Some(file))
    }

    /// Changes the text of a file, for all paths that lead to it.
    pub(super) fn replace(&mut self, canonical: &Path, text: &Arc<str>) {
        for file in self.0.values_mut().flatten().filter(|file| file.canonical == canonical) {
            file.text = Arc::clone(text);
        }
    }
}

/// Walk over the files of a configuration while they are read.
#[derive(Default)]
pub(super) struct FileWalk {
    /// Known files, after reading all of them.
    pub(super) files: Files,
    /// Files that were read, each by its canonical path.
    pub(super) read: SortedSet<PathBuf>,
    /// Files that include the current one, outermost first.
    open: Vec<PathBuf>,
}

impl FileWalk {
    /// Begins with known files.
    pub(super) fn of(files: Files) -> Self {
        Self { files, ..Self::default() }
    }

    /// Enters a file until [`leave`](Self::leave), and returns its text.
    /// `None` if the file was read before.
    pub(super) fn enter(&mut self, path: &Path) -> Result<Option<Arc<str>>, Unreadable> {
        let File { canonical, text } = self.files.read(path)?;
        if self.open.contains(&canonical) {
            let help = Some("remove one `include` of the circle");
            return Err(Unreadable { reason: "it includes itself".into(), help });
        }
        if !self.read.insert(canonical.clone()) {
            return Ok(None);
        }
        self.open.push(canonical);
        Ok(Some(text))
    }

    /// Leaves the file that was entered last.
    pub(super) fn leave(&mut self) {
        self.open.pop();
    }
}

/// Reads a file from the disk.
pub(super) fn read(path: &Path) -> Result<File, Unreadable> {
    let unreadable = |reason: String| Unreadable { reason, help: None };
    let failed = |error: std::io::Error| unreadable(error.to_string());
    let canonical = path.canonicalize().map_err(failed)?;
    let data = std::fs::metadata(&canonical).map_err(failed)?;
    if !data.is_file() {
        return Err(unreadable("it is not a file".into()));
    }
    if data.len() > LARGEST_FILE {
        return Err(unreadable("it is too large".into()));
    }
    match String::from_utf8(std::fs::read(&canonical).map_err(failed)?) {
        Ok(text) => Ok(File { canonical, text: text.into() }),
        Err(error) => {
            let good = &error.as_bytes()[..error.utf8_error().valid_up_to()];
            let line = good.iter().filter(|byte| **byte == b'\n').count() + 1;
            let reason = format!("line {line} is not UTF-8 text");
            Err(Unreadable { reason, help: Some("save the file as UTF-8") })
        }
    }
}
