use std::fs;
use std::io::{self, Write};
use std::path::{Path, PathBuf};

use slate_runtime::replacement::Replacement;

use super::Member;

/// File of a robot's saved knowledge.
#[derive(Clone, Debug)]
pub struct SavedKnowledge {
    file: PathBuf,
    /// Protection of an existing file that could neither be restored nor set aside.
    /// Nothing replaces it.
    is_kept: bool,
}

impl SavedKnowledge {
    /// Creates the handle for a robot's file in a folder.
    pub fn new(folder: &Path, robot: &str) -> Self {
        Self { file: folder.join(format!("{robot}.knowledge")), is_kept: false }
    }

    /// Returns the path of the file.
    pub fn file(&self) -> &Path {
        &self.file
    }

    /// Restores a robot from its file, or creates it without one.
    /// An invalid file is set aside; the text describes that.
    pub fn restore(&mut self, robot: &str, random: u32) -> (Option<Member>, Option<String>) {
        let file = self.file.display();
        let trouble = match fs::read(&self.file) {
            Ok(saved) => match Member::new(robot, random, Some(&saved)) {
                Ok(member) => return (Some(member), None),
                Err(error) => format!("{file} can't be restored: {error}"),
            },
            Err(error) if error.kind() == io::ErrorKind::NotFound => return (fresh(robot, random), None),
            Err(error) => format!("{file} can't be read: {error}"),
        };
        let aside = self.file.with_extension("knowledge.damaged");
        let done = match fs::rename(&self.file, &aside) {
            Ok(()) => format!("it is set aside as {}", aside.display()),
            Err(error) => {
                self.is_kept = true;
                format!("it can't be set aside, so nothing is saved: {error}")
            }
        };
        let trouble = format!("{trouble}; {done}, and the robot begins with what others tell");
        (fresh(robot, random), Some(trouble))
    }

    /// Saves the robot's knowledge atomically.
    ///
    /// # Errors
    /// If the file can't be written, or if the existing one could neither be restored nor set aside; it stays then.
    pub fn save(&self, member: &Member) -> io::Result<()> {
        if self.is_kept {
            return Err(io::Error::other("the old file could neither be restored nor set aside"));
        }
        // It has a name, so it has a folder; that of a bare name is the present one.
        let folder = self.file.parent().filter(|folder| !folder.as_os_str().is_empty());
        let folder = folder.unwrap_or(Path::new("."));
        fs::create_dir_all(folder)?;
        let mut file = Replacement::create(&self.file)?;
        file.write_all(&member.replica().save())?;
        file.keep()
    }
}

fn fresh(robot: &str, random: u32) -> Option<Member> {
    // Only what was saved can be refused.
    Member::new(robot, random, None).ok()
}
