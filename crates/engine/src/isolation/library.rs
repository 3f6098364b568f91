//! Plugins that the host must not open, run in other processes.
//! A panic in a library that was built with `panic = "abort"` ends its process, and Python needs an interpreter.

use std::any::Any;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use slate_module::{InstanceFactory, ModuleKind, Refusal, Setup, decode, encode};

use super::arena::length;
use super::process::{Process, REGULAR_END};
use super::proxy::TABLE;
use super::python::{help, python_source, run_alone};
use super::wire::{Begin, Code, InstanceRequest, KindText, Topic};
use crate::library::Library;

/// Kind of such a library, for isolated modules.
/// Short-lived processes describe it.
struct ExternalKind {
    program: Option<PathBuf>,
    file: PathBuf,
    kind: String,
}

/// Kind of module in Python, with its description, which depends on no setup.
struct PythonKind(Result<Vec<u8>, Refusal>);

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
        kind_of(&text, factory, library)
    };
    Ok(texts.into_iter().map(kind).collect())
}

/// Returns the kinds of a source file in Python, which run in processes only.
///
/// # Errors
/// Why an interpreter can't open it, with what helps.
pub(crate) fn python_kinds(library: Library) -> Result<Vec<ModuleKind>, (Refusal, String)> {
    const SEE: &str = "see the message of Python";
    let begin = begin_with(Code::Python(python_source(&library)));
    let mut process = Process::launch(None, &begin.code).map_err(|refusal| (refusal, help()))?;
    let begun = process.begin(&begin, &[]);
    if let Err(refusal) = begun {
        let help = match process.end() {
            // No interpreter, no package, or one that is too old.
            Some("ended with exit code 1" | "ended with exit code 2") => help(),
            Some(_) => format!("see why by running it alone: {}", run_alone(library.source())),
            None if !process.is_same_build() => help(),
            None => SEE.into(),
        };
        return Err((refusal, help));
    }
    let library: Arc<dyn Any + Send + Sync> = Arc::new(library);
    let described = describe_python(&mut process, &library);
    process.finish();
    described.map_err(|refusal| (refusal, SEE.into()))
}

/// Asks an interpreter for its kinds, and ends it.
fn describe_python(
    process: &mut Process,
    library: &Arc<dyn Any + Send + Sync>,
) -> Result<Vec<ModuleKind>, Refusal> {
    let timeout = process.start_timeout();
    let texts: Vec<KindText> = decode(process.request(Topic::Kinds, &[], timeout)?)?;
    let mut kinds = Vec::new();
    for text in texts {
        let setup = Setup { name: &text.name, seed: 0, period: 20_000_000, section: None, params: None };
        let request = encode(&InstanceRequest::new(&text.name, &setup, &[], 0))?;
        let description = process.request(Topic::Describe, &request, timeout).map(<[u8]>::to_vec);
        kinds.push(kind_of(&text, PythonKind(description), library).in_processes());
    }
    // There is no instance, so this only ends the process.
    let _ = process.request(Topic::Destroy, &[], timeout);
    Ok(kinds)
}

/// Returns a kind of which the host makes no instance.
fn kind_of(
    text: &KindText,
    factory: impl InstanceFactory + 'static,
    library: &Arc<dyn Any + Send + Sync>,
) -> ModuleKind {
    let library = Some(Arc::clone(library));
    // SAFETY: the factory makes no instance, so no call of the table is ever made.
    unsafe {
        ModuleKind::with_factory(Arc::new(factory), TABLE, (&text.name, &text.doc, &text.section), library)
    }
}

/// Probes a library in a process of its own, before the host opens it.
/// The process opens it, describes its kinds and closes it: damage that no header shows ends that process only. A
/// refusal that the library returns is ignored here.
///
/// # Errors
/// Description of the process's end.
pub fn probe(program: Option<&Path>, file: &Path) -> Result<(), String> {
    // Where no process can be started, there is nothing to be found out.
    let begin = begin_with(Code::Library(file.into()));
    let Ok(mut process) = Process::launch(program, &begin.code) else { return Ok(()) };
    let timeout = process.start_timeout();
    let request = process.begin(&begin, &[]).and_then(|_| {
        let kinds: Vec<KindText> = decode(process.request(Topic::Kinds, &[], timeout)?)?;
        for kind in kinds {
            let setup = Setup { name: &kind.name, seed: 0, period: 20_000_000, section: None, params: None };
            let request = encode(&InstanceRequest::new(&kind.name, &setup, &[], 0))?;
            // It may refuse to be described so, and it may not end.
            let described = process.request(Topic::Describe, &request, timeout).map(drop);
            if process.end().is_some() {
                return described;
            }
        }
        // It has no instance, so this only closes the library and ends.
        let _ = process.request(Topic::Destroy, &[], timeout);
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

fn begin_with(code: Code) -> Begin {
    Begin { name: "describe".into(), code, memory: 0, arenas: Vec::new(), arena_length: length() }
}

/// Asks a process that is made for this.
fn request_once(program: Option<&Path>, file: &Path, topic: Topic, body: &[u8]) -> Result<Vec<u8>, Refusal> {
    let (mut process, _) = Process::start(program, &begin_with(Code::Library(file.into())), &[])?;
    let timeout = process.start_timeout();
    process.request(topic, body, timeout).map(<[u8]>::to_vec)
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

impl InstanceFactory for PythonKind {
    fn describe(&self, _: &Setup<'_>) -> Result<Vec<u8>, Refusal> {
        self.0.clone()
    }

    fn create(&self, _: &Setup<'_>, _: &[u8]) -> Result<*mut (), Refusal> {
        Err("a module in Python runs in a process of its own".into())
    }
}
