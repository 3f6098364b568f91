//! Plugin libraries that the host must not open, run in other processes.
//! A panic in one that was built with `panic = "abort"` ends its process.

use std::any::Any;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use slate_module::{InstanceFactory, ModuleKind, Refusal, Setup, decode, encode};

use super::arena::length;
use super::process::{Process, REGULAR_END, START_TIMEOUT};
use super::proxy::TABLE;
use super::wire::{Begin, Code, InstanceRequest, KindText, Topic};

/// Kind of such a library, for isolated modules.
/// Short-lived processes describe it.
struct ExternalKind {
    program: Option<PathBuf>,
    file: PathBuf,
    kind: String,
}

/// Returns the kinds of the library in `file`, which `library` keeps there.
///
/// # Errors
/// Why another process can't open it.
pub fn kinds(
    program: Option<&Path>,
    file: &Path,
    library: &Arc<dyn Any + Send + Sync>,
) -> Result<Vec<ModuleKind>, Refusal> {
    let texts: Vec<KindText> = decode(&request_once(program, file, Topic::Kinds, &[])?)?;
    let kind = |text: KindText| {
        let factory =
            ExternalKind { program: program.map(Into::into), file: file.into(), kind: text.name.clone() };
        let library = Some(Arc::clone(library));
        // SAFETY: it makes no instance, so no call of the table is ever made.
        unsafe {
            ModuleKind::with_factory(
                Arc::new(factory),
                TABLE,
                (&text.name, &text.doc, &text.section),
                library,
            )
        }
    };
    Ok(texts.into_iter().map(kind).collect())
}

/// Probes a library in a process of its own, before the host opens it.
/// The process opens it, describes its kinds and closes it: damage that no header shows ends that process only. A
/// refusal that the library returns is ignored here.
///
/// # Errors
/// Description of the process's end.
pub fn probe(program: Option<&Path>, file: &Path) -> Result<(), String> {
    // Where no process can be started, there is nothing to be found out.
    let Ok(mut process) = Process::launch(program) else { return Ok(()) };
    let request = process.begin(&begin_with(file), &[]).and_then(|_| {
        let kinds: Vec<KindText> = decode(process.request(Topic::Kinds, &[], START_TIMEOUT)?)?;
        for kind in kinds {
            let setup = Setup { name: &kind.name, seed: 0, period: 20_000_000, section: None, params: None };
            let request = encode(&InstanceRequest::new(&kind.name, &setup, &[], 0))?;
            // It may refuse to be described so, and it may not end.
            let described = process.request(Topic::Describe, &request, START_TIMEOUT).map(drop);
            if process.end().is_some() {
                return described;
            }
        }
        // It has no instance, so this only closes the library and ends.
        let _ = process.request(Topic::Destroy, &[], START_TIMEOUT);
        process.finish();
        Ok(())
    });
    match process.end() {
        Some(end) if request.is_err() || end.starts_with("ended ") && end != REGULAR_END => {
            Err(end.to_owned())
        }
        _ => Ok(()),
    }
}

fn begin_with(file: &Path) -> Begin {
    Begin {
        name: "describe".into(),
        code: Code::Library(file.into()),
        memory: 0,
        arenas: Vec::new(),
        arena_length: length(),
    }
}

/// Asks a process that is made for this.
fn request_once(program: Option<&Path>, file: &Path, topic: Topic, body: &[u8]) -> Result<Vec<u8>, Refusal> {
    let (mut process, _) = Process::start(program, &begin_with(file), &[])?;
    process.request(topic, body, START_TIMEOUT).map(<[u8]>::to_vec)
}

impl InstanceFactory for ExternalKind {
    fn describe(&self, setup: &Setup<'_>) -> Result<Vec<u8>, Refusal> {
        let request = encode(&InstanceRequest::new(&self.kind, setup, setup.params.unwrap_or_default(), 0))?;
        request_once(self.program.as_deref(), &self.file, Topic::Describe, &request)
    }

    fn create(&self, _: &Setup<'_>, _: &[u8]) -> Result<*mut (), Refusal> {
        Err("its library was built with panic = \"abort\", so it must be run with `isolated = true`".into())
    }
}
