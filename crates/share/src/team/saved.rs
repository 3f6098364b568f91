use std::fs;
use std::io::{self, Write};
use std::path::{Path, PathBuf};

use super::Member;

/// The file in which a robot saves what it knows.
#[derive(Clone, Debug)]
pub struct SavedKnowledge {
    file: PathBuf,
}

impl SavedKnowledge {
    /// That of a robot, in a folder.
    pub fn new(folder: &Path, robot: &str) -> Self {
        Self { file: folder.join(format!("{robot}.knowledge")) }
    }

    /// The file.
    pub fn file(&self) -> &Path {
        &self.file
    }

    /// The robot with what it has saved, and without it where nothing is saved. What can't be restored is set aside; what
    /// became of it is told in words.
    pub fn restore(&self, robot: &str, random: u32) -> (Option<Member>, Option<String>) {
        let file = self.file.display();
        let saved = match fs::read(&self.file) {
            Ok(saved) => Some(saved),
            Err(error) if error.kind() == io::ErrorKind::NotFound => None,
            Err(error) => return (fresh(robot, random), Some(format!("{file} can't be read: {error}"))),
        };
        match Member::new(robot, random, saved.as_deref()) {
            Ok(member) => (Some(member), None),
            Err(error) => {
                let aside = self.file.with_extension("knowledge.damaged");
                let done = match fs::rename(&self.file, &aside) {
                    Ok(()) => format!("it is set aside as {}", aside.display()),
                    Err(error) => format!("it can't be set aside: {error}"),
                };
                let told = format!(
                    "{file} can't be restored: {error}; {done}, and the robot begins with what others tell"
                );
                (fresh(robot, random), Some(told))
            }
        }
    }

    /// Saves what a robot knows: the file is there as a whole or not at all.
    ///
    /// # Errors
    /// When it can't be written; what was saved before stays then.
    pub fn save(&self, member: &Member) -> io::Result<()> {
        let new = self.file.with_extension("knowledge.new");
        if let Some(folder) = self.file.parent() {
            fs::create_dir_all(folder)?;
        }
        let mut file = fs::File::create(&new)?;
        file.write_all(&member.replica().save())?;
        file.sync_all()?;
        fs::rename(&new, &self.file)
    }
}

fn fresh(robot: &str, random: u32) -> Option<Member> {
    // Only what was saved can be refused.
    Member::new(robot, random, None).ok()
}
