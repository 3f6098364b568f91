//! World files of a recorded run, from its recording.

use std::fs::DirBuilder;
use std::os::unix::fs::DirBuilderExt;
use std::path::{Path, PathBuf};

use slate::bag::Error;
use slate::replay::Run;
use slate::runtime::configuration::{Configuration, Value};

use crate::failure::Failure;

/// Files of a recording in a temporary folder, as long as this value lives.
/// Only those that on the disk differ or are missing.
#[derive(Default)]
pub struct Attached {
    /// Settings that name the extracted files.
    pub sets: Vec<String>,
    /// Files that differ on the disk.
    pub replaced: Vec<String>,
    /// Files on the disk that the recording lacks.
    pub absent: Vec<String>,
    folder: Option<PathBuf>,
}

impl Attached {
    pub fn of(run: &Run, configuration: &Configuration) -> Result<Self, Failure> {
        let mut attached = Self::default();
        for setting in configuration.settings("world").unwrap_or_default() {
            let Some(name) = setting.value.as_str().filter(|name| name.ends_with(".toml")) else { continue };
            let recorded = run.files().iter().find(|(own, _)| own == name).map(|(_, bytes)| bytes);
            let (place, found) = match (recorded, std::fs::read(name)) {
                (None, Ok(_)) => {
                    attached.absent.push(name.to_owned());
                    continue;
                }
                // Its reader reports that it is missing.
                (None, Err(_)) => continue,
                (Some(recorded), Ok(found)) if *recorded == found => continue,
                (Some(recorded), found) => (attached.write(recorded)?, found),
            };
            attached.replaced.extend(found.is_ok().then(|| name.to_owned()));
            let place = Value::Text(place.to_string_lossy().into());
            attached.sets.push(format!("{}={place}", setting.path));
        }
        Ok(attached)
    }

    fn write(&mut self, bytes: &[u8]) -> Result<PathBuf, Error> {
        let failed = |path: &Path| {
            let path = path.to_owned();
            move |source| Error::Write { path, source }
        };
        let folder = match &self.folder {
            Some(folder) => folder.clone(),
            None => {
                let folder = std::env::temp_dir().join(format!("slate-verify-{}", std::process::id()));
                DirBuilder::new().mode(0o700).create(&folder).map_err(failed(&folder))?;
                self.folder.insert(folder).clone()
            }
        };
        let place = folder.join(format!("{}.toml", self.sets.len()));
        std::fs::write(&place, bytes).map_err(failed(&place))?;
        Ok(place)
    }
}

impl Drop for Attached {
    fn drop(&mut self) {
        if let Some(folder) = &self.folder {
            // A remaining file is small, and in a temporary folder.
            let _ = std::fs::remove_dir_all(folder);
        }
    }
}
