//! Memories of modules: states read from files before the run, written after.

use std::io::{self, Write};
use std::path::{Path, PathBuf};

use slate_sorted::SortedMap;
use xxhash_rust::xxh3::xxh3_64;

use super::assembly::ModuleStates;
use super::handle::AgentHandle;
use super::snapshot::SnapshotTaker;
use crate::memory::{MemoryError, ModuleMemory, help};
use slate_configuration::replacement::Replacement;
use slate_configuration::{Configuration, Diagnostic, Module, Report, Span};

/// Module with a memory.
#[derive(Debug)]
struct Remembering {
    module: String,
    file: PathBuf,
    at: Span,
    /// Hash of the initial file; `None` without a file.
    began: Option<u64>,
    /// Replacement of the file at the end, locked until then.
    /// `None` if this run is not remembered.
    place: Option<Replacement>,
}

/// Memories of all modules that have one.
#[derive(Debug, Default)]
pub(super) struct Memories(Vec<Remembering>);

impl Memories {
    /// Reads all memory files of a configuration.
    /// `keeps` is true if they are written at the end.
    pub fn read(configuration: &Configuration, keeps: bool) -> Result<(Self, ModuleStates), Report> {
        let (mut memories, mut states, mut wrong) = (Vec::new(), ModuleStates::new(), Vec::new());
        for module in configuration.modules() {
            let Some(file) = &module.memory else { continue };
            match begin(module, &file.value, keeps) {
                Ok((began, place)) => {
                    let name = module.name.value.clone();
                    let (began, state) = began.unzip();
                    states.extend(state.map(|state| (name.clone(), Ok(state))));
                    memories.push(Remembering {
                        module: name,
                        file: file.value.clone(),
                        at: file.span,
                        began,
                        place,
                    });
                }
                Err((problem, help)) => {
                    wrong.push(restore_error(configuration, module, file.span, &problem, help))
                }
            }
        }
        if wrong.is_empty() { Ok((Self(memories), states)) } else { Err(Report::from(wrong)) }
    }

    /// Checks that all modules with memories are present and took their states.
    pub fn check(
        &self,
        configuration: &Configuration,
        restored: &SortedMap<String, Result<(), String>>,
        is_present: impl Fn(&str) -> bool,
    ) -> Result<(), Report> {
        let mut wrong = Vec::new();
        for own in &self.0 {
            let problem = match restored.get(&own.module) {
                Some(Err(reason)) => format!("`{}` can't restore its content: {reason}", own.module),
                None if !is_present(&own.module) => format!("`{}` is not loaded at the start", own.module),
                _ => continue,
            };
            if let Some(module) =
                configuration.modules().iter().find(|module| module.name.value == own.module)
            {
                wrong.push(restore_error(configuration, module, own.at, &problem, AFRESH));
            }
        }
        if wrong.is_empty() { Ok(()) } else { Err(Report::from(wrong)) }
    }

    /// Returns the modules, each with the hash of its initial file, if it had one.
    pub fn begun(&self) -> impl Iterator<Item = (&str, Option<u64>)> {
        self.0.iter().map(|own| (own.module.as_str(), own.began))
    }

    /// Writes the modules' states into their files, once, after the run.
    /// Memories that are not kept are left out.
    ///
    /// # Errors
    /// When a module is busy or absent, or a file can't be written: the earlier file stays.
    pub fn write(&mut self, agent: &AgentHandle) -> Result<(), MemoryError> {
        let mut all = std::mem::take(&mut self.0);
        all.retain(|own| own.place.is_some());
        if all.is_empty() {
            return Ok(());
        }
        let mut modules = SnapshotTaker::new(agent).snapshot()?.image.modules;
        let mut written = Vec::new();
        for Remembering { module, file, place, .. } in all {
            let state = modules.remove(&module).and_then(|own| Some((own.kind, own.state?.0)));
            let Some((kind, state)) = state else { return Err(MemoryError::Lost { module, file }) };
            let failed = |source: io::Error| MemoryError::File {
                module: module.clone(),
                file: file.clone(),
                help: help(source.kind()),
                source,
            };
            let bytes = ModuleMemory { kind, state }.to_bytes().map_err(failed)?;
            let Some(mut place) = place else { continue };
            place.write_all(&bytes).map_err(failed)?;
            written.push((place, module, file));
        }
        // Only when all are written does any take its place.
        for (place, module, file) in written {
            place.keep().map_err(|source| MemoryError::File {
                module,
                file,
                help: help(source.kind()),
                source,
            })?;
        }
        Ok(())
    }
}

const AFRESH: &str = "put a copy of it there, or move it away to begin without a memory";

/// Problem and remedy.
type MemoryProblem = (String, &'static str);

/// Hash of a file and the state in it; `None` without a file.
type Began = Option<(u64, Vec<u8>)>;

/// Reads a module's initial memory, and prepares the replacement of its file.
fn begin(module: &Module, file: &Path, keeps: bool) -> Result<(Began, Option<Replacement>), MemoryProblem> {
    // A name that leads to the file stays one, and all names of it are kept from other runs.
    let file = &target(file);
    // First, so that no other run writes it between.
    let unwritable = |error: io::Error| match error.kind() {
        io::ErrorKind::AlreadyExists => ("another run or module has it".into(), help(error.kind())),
        kind => (format!("it can't be written: {error}"), help(kind)),
    };
    let place = keeps.then(|| Replacement::create(file)).transpose().map_err(unwritable)?;
    let bytes = match std::fs::read(file) {
        Ok(bytes) => bytes,
        Err(error) if error.kind() == io::ErrorKind::NotFound => return Ok((None, place)),
        Err(error) => return Err((format!("it can't be read: {error}"), AFRESH)),
    };
    let memory = ModuleMemory::from_bytes(&bytes).map_err(|problem| (problem, AFRESH))?;
    if memory.kind != module.kind.value {
        return Err((
            format!("it is that of a `{}`, and this is a `{}`", memory.kind, module.kind.value),
            AFRESH,
        ));
    }
    Ok((Some((xxh3_64(&bytes), memory.state)), place))
}

/// Resolves the links of a file name; the target need not exist yet.
fn target(file: &Path) -> PathBuf {
    let mut file = file.to_owned();
    // As many as the system follows; of more the file can't be written, which is said then.
    for _ in 0..40 {
        let Ok(next) = file.read_link() else { break };
        // One that is relative begins at the folder of the link.
        file = file.parent().unwrap_or(Path::new("")).join(next);
    }
    let (Some(folder), Some(name)) = (file.parent(), file.file_name()) else { return file };
    let folder = if folder.as_os_str().is_empty() { Path::new(".") } else { folder };
    // Also the way there may have several names.
    folder.canonicalize().map_or_else(|_| file.clone(), |folder| folder.join(name))
}

fn restore_error(
    configuration: &Configuration,
    module: &Module,
    at: Span,
    problem: &str,
    help: &str,
) -> Diagnostic {
    let file = module.memory.as_ref().map(|file| slate_configuration::printable(&file.value).to_string());
    let message = format!("the memory of `{}` ({}): {problem}", module.name.value, file.unwrap_or_default());
    configuration.diagnostic(at, message, Some(help.into()))
}
