//! Files of a mission in Lua.

use std::fs::File;
use std::io::Read;
use std::path::{Component, Path, PathBuf};

use slate_sorted::SortedMap;

use crate::error::BehaviorError;

/// Size above which a file is refused, bytes.
const LARGEST_FILE: u64 = 1 << 20;

/// Files of a mission: its main file, and those that it may require.
#[derive(Clone, Debug)]
pub struct SkillFiles {
    /// Module of the main file, such as `patrol` or `skills.nao`.
    main: String,
    source: SkillSource,
}

#[derive(Clone, Debug)]
enum SkillSource {
    /// Folders searched for modules, in order.
    Folders(Vec<PathBuf>),
    /// Texts by the names of their modules.
    Texts(SortedMap<String, String>),
}

impl SkillFiles {
    /// Returns a mission's file; modules are in its folder.
    ///
    /// The file may also be in a folder `skills` or `agents`, as Fawkes has them: then `skills.generic.say` is
    /// `generic/say.lua` in that folder.
    ///
    /// # Errors
    /// If the name of the file does not end in `.lua`.
    pub fn open(file: &Path) -> Result<Self, BehaviorError> {
        let stem = file.file_stem().and_then(|stem| stem.to_str());
        let (Some(stem), true) = (stem, file.extension().is_some_and(|end| end == "lua")) else {
            return Err(BehaviorError::new("expected a file whose name ends in `.lua`").of_file(file));
        };
        let folder = file.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."));
        let is_space =
            |folder: &&Path| folder.file_name().is_some_and(|name| name == "skills" || name == "agents");
        let outer = folder.ancestors().find(is_space).and_then(Path::parent);
        let Some(outer) = outer else {
            return Ok(Self { main: stem.into(), source: SkillSource::Folders(vec![folder.into()]) });
        };
        let below = folder.strip_prefix(outer).unwrap_or(folder).components();
        let mut parts: Vec<&str> = below.filter_map(|part| part.as_os_str().to_str()).collect();
        if stem != "init" {
            parts.push(stem);
        }
        let outer = if outer.as_os_str().is_empty() { Path::new(".") } else { outer };
        Ok(Self { main: parts.join("."), source: SkillSource::Folders(vec![folder.into(), outer.into()]) })
    }

    /// Texts by the names of their modules, of which `main` is the mission.
    pub fn from_texts(main: &str, texts: &[(&str, &str)]) -> Self {
        let texts = texts.iter().map(|(name, text)| ((*name).into(), (*text).into())).collect();
        Self { main: main.into(), source: SkillSource::Texts(texts) }
    }

    pub(crate) fn main(&self) -> &str {
        &self.main
    }

    pub(crate) fn exists(&self, name: &str) -> bool {
        match &self.source {
            SkillSource::Texts(texts) => texts.contains_key(name),
            SkillSource::Folders(folders) => find(folders, name).is_some(),
        }
    }

    /// Reads a module; returns its text and the short name of its file.
    pub(crate) fn read(&self, name: &str) -> Result<(String, String), String> {
        let missing = || format!("module `{name}` is not a file of the skill path");
        match &self.source {
            SkillSource::Texts(texts) => {
                Ok((texts.get(name).ok_or_else(missing)?.clone(), format!("{name}.lua")))
            }
            SkillSource::Folders(folders) => {
                let (folder, short) = find(folders, name).ok_or_else(missing)?;
                let path = folder.join(&short);
                let text = read(folder, &path).map_err(|reason| format!("{}: {reason}", path.display()))?;
                Ok((text, short))
            }
        }
    }

    /// Returns the path of a file by its short name.
    pub(crate) fn path(&self, short: &str) -> Option<PathBuf> {
        match &self.source {
            SkillSource::Texts(_) => Some(short.into()),
            SkillSource::Folders(folders) => {
                folders.iter().map(|folder| folder.join(short)).find(|path| path.is_file())
            }
        }
    }
}

/// Returns the folder that has a module, and its file in it.
fn find<'a>(folders: &'a [PathBuf], name: &str) -> Option<(&'a Path, String)> {
    let is_name =
        |part: &str| !part.is_empty() && part.chars().all(|c| c.is_alphanumeric() || c == '_' || c == '-');
    if !name.split('.').all(is_name) {
        return None;
    }
    let path = name.replace('.', "/");
    let candidates = [format!("{path}.lua"), format!("{path}/init.lua")];
    folders.iter().find_map(|folder| {
        let short = candidates.iter().find(|short| folder.join(short).is_file())?;
        Some((folder.as_path(), short.clone()))
    })
}

/// Reads a file that is in a folder, also where links lead elsewhere.
fn read(folder: &Path, path: &Path) -> Result<String, String> {
    let real = path.canonicalize().map_err(|error| error.to_string())?;
    let inside = folder.canonicalize().map_err(|error| error.to_string())?;
    if !real.starts_with(&inside) || real.components().any(|part| part == Component::ParentDir) {
        return Err("the file is outside of the skill path".into());
    }
    let mut text = String::new();
    let file = File::open(&real).map_err(|error| error.to_string())?;
    file.take(LARGEST_FILE + 1).read_to_string(&mut text).map_err(|error| error.to_string())?;
    if text.len() as u64 > LARGEST_FILE {
        return Err(format!("the file is larger than {LARGEST_FILE} bytes"));
    }
    Ok(text)
}
