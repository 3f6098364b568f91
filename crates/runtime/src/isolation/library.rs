//! Libraries that the host does not open: a panic in one that was built with `panic = "abort"` ends its process.

use std::any::Any;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use slate_module::{Maker, ModuleKind, Refusal, Setup, decode, encode};

use super::arena::length;
use super::process::{Process, STARTING};
use super::proxy::TABLE;
use super::wire::{Asked, Begin, Code, KindText, Topic};

/// A kind of such a library, for isolated modules. Processes that end at once describe it.
struct Outside {
    program: Option<PathBuf>,
    file: PathBuf,
    kind: String,
}

/// The kinds of the library in `file`, which `library` keeps there.
///
/// # Errors
/// Why another process can't open it.
pub(crate) fn kinds(
    program: Option<&Path>,
    file: &Path,
    library: &Arc<dyn Any + Send + Sync>,
) -> Result<Vec<ModuleKind>, Refusal> {
    let texts: Vec<KindText> = decode(&ask(program, file, Topic::Kinds, &[])?)?;
    let kind = |text: KindText| {
        let outside =
            Outside { program: program.map(Into::into), file: file.into(), kind: text.name.clone() };
        let library = Some(Arc::clone(library));
        // SAFETY: it makes no instance, so no call of the table is ever made.
        unsafe {
            ModuleKind::made_by(Arc::new(outside), TABLE, (&text.name, &text.doc, &text.section), library)
        }
    };
    Ok(texts.into_iter().map(kind).collect())
}

/// Asks a process that is made for this.
fn ask(program: Option<&Path>, file: &Path, topic: Topic, body: &[u8]) -> Result<Vec<u8>, Refusal> {
    let begin = Begin {
        name: "describe".into(),
        code: Code::Library(file.into()),
        memory: 0,
        arenas: Vec::new(),
        arena_length: length(),
    };
    let (mut process, _) = Process::start(program, &begin, &[])?;
    process.ask(topic, body, STARTING).map(<[u8]>::to_vec)
}

impl Maker for Outside {
    fn describe(&self, setup: &Setup<'_>) -> Result<Vec<u8>, Refusal> {
        let asked = encode(&Asked::new(&self.kind, setup, &[], 0))?;
        ask(self.program.as_deref(), &self.file, Topic::Describe, &asked)
    }

    fn create(&self, _: &Setup<'_>, _: &[u8]) -> Result<*mut (), Refusal> {
        Err("its library was built with panic = \"abort\", so it must be run with `isolated = true`".into())
    }
}
