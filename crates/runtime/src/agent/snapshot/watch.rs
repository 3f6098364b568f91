//! Automatic snapshots, as the configuration says.

use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::thread::JoinHandle;

use slate_blackboard::channel::Latest;
use slate_blackboard::interface::{Descriptor, FieldPath, Kind, Primitive, Value, View, find};
use slate_module::Level;

use super::SnapshotTaker;
use super::capture::{SnapshotSubjects, marks};
use crate::agent::composition::AutomaticSnapshot;
use crate::agent::handle::{AgentHandle, WeakHandle};
use crate::snapshot::{Snapshot, SnapshotCondition, SnapshotError};
use slate_composition::{PropertyFacts, PropertyIndex};
use slate_configuration::{Configuration, Report, Spanned};
use slate_engine::main_loop::{Flow, SharedLoop};

/// Check at the end of each cycle for snapshots that are due.
pub(crate) struct SnapshotWatch {
    agent: WeakHandle,
    at: Option<u64>,
    file: PathBuf,
    check_state: Mutex<CheckState>,
    /// True if a snapshot is due that could not be taken yet.
    due: AtomicBool,
    writing: Arc<Mutex<Writing>>,
}

/// State of the thread that writes snapshots one by one, into one file.
#[derive(Default)]
struct Writing {
    /// Next task.
    /// A newer one replaces one that has not begun, whose file it would overwrite.
    next: Option<Task>,
    /// Number of replaced tasks.
    left_out: u64,
    /// True while the thread looks for tasks.
    is_at_work: bool,
    thread: Option<JoinHandle<()>>,
}

/// Writes a snapshot, or takes and writes one; returns its time and cycle.
type Task = Box<dyn FnOnce() -> Result<(u64, u64), SnapshotError> + Send>;

/// Result of the last look.
struct CheckState {
    /// True if the time had come.
    late: bool,
    /// True if the condition held.
    held: bool,
    field: Option<ConditionField>,
}

/// Field of a condition.
struct ConditionField {
    condition: SnapshotCondition,
    reader: Latest,
    descriptor: &'static Descriptor,
    path: FieldPath,
}

impl ConditionField {
    fn holds(&mut self) -> bool {
        self.reader.refresh();
        let value = self.reader.value().and_then(|loan| {
            match View::new(self.descriptor, loan.bytes(), loan.items())?.at(&self.path)? {
                Value::Bool(value) => Some(u8::from(value).into()),
                value => value.as_f64(),
            }
        });
        value.is_some_and(|value| self.condition.holds(value))
    }
}

/// Returns true if values of a type can be compared with a number.
fn is_number(kind: &Kind) -> bool {
    matches!(
        kind,
        Kind::Primitive(Primitive::Bool)
            | Kind::Primitive(Primitive::U8)
            | Kind::Primitive(Primitive::U16)
            | Kind::Primitive(Primitive::U32)
            | Kind::Primitive(Primitive::U64)
            | Kind::Primitive(Primitive::I8)
            | Kind::Primitive(Primitive::I16)
            | Kind::Primitive(Primitive::I32)
            | Kind::Primitive(Primitive::I64)
            | Kind::Primitive(Primitive::F32)
            | Kind::Primitive(Primitive::F64)
    )
}

/// Checks at the start that the snapshot can be written.
/// At the moment of the snapshot it would be too late.
fn check_folder(configuration: &Configuration, file: &Spanned<PathBuf>) -> Result<(), Report> {
    let wrong = |message: String, help: &str| -> Result<(), Report> {
        Err(configuration.diagnostic(file.span, message, Some(help.into())).into())
    };
    if file.value.is_dir() {
        let message = format!("{} is a folder", slate_configuration::printable(&file.value));
        return wrong(message, "name a file in it");
    }
    let folder = folder_of(&file.value);
    let is_log = |log: &Path| {
        let there = folder_of(log).canonicalize().ok();
        log.file_name() == file.value.file_name() && there.is_some() && there == folder.canonicalize().ok()
    };
    if configuration.log().targets.file.as_ref().is_some_and(|log| is_log(&log.path.value)) {
        return wrong("a snapshot would take the place of the log".into(), "name another file");
    }
    match std::fs::metadata(folder) {
        Ok(folder) if folder.is_dir() => Ok(()),
        _ => {
            let message = format!(
                "there is no folder {} to write snapshots to",
                slate_configuration::printable(folder)
            );
            wrong(message, "make it, or name a file in one that is there")
        }
    }
}

/// Checks the table of automatic snapshots.
/// Returns the property of its condition, with the field.
///
/// # Errors
/// A file that can't be written, or a condition on no number.
pub(in crate::agent) fn check_trigger<I: PropertyIndex>(
    configuration: &Configuration,
    index: &I,
) -> Result<Option<(I::Property, FieldPath)>, Report> {
    let Some(trigger) = configuration.snapshot() else { return Ok(None) };
    check_folder(configuration, &trigger.file)?;
    let Some(when) = &trigger.when else { return Ok(None) };
    let wrong = |message: String, help: &str| -> Report {
        configuration.diagnostic(when.span, message, Some(help.into())).into()
    };
    let found = index.resolve(&when.value.field);
    let (property, field) =
        found.map_err(|error| wrong(error.to_string(), "name a property and a field of it"))?;
    let path = find(property.descriptor(), &field)
        .map_err(|error| wrong(error.to_string(), "name a field of the property"))?;
    if !property.has_value() {
        return Err(no_value(configuration, when, property.path()));
    }
    if !is_number(path.kind()) {
        let message = format!("`{}` is {}", when.value.field, path.kind().describe());
        return Err(wrong(message, "name a field that is a number or a truth value"));
    }
    Ok(Some((property, path)))
}

fn no_value(configuration: &Configuration, when: &Spanned<SnapshotCondition>, path: &str) -> Report {
    let message = format!("/{path} has no value to look at");
    configuration.diagnostic(when.span, message, Some("name another property".into())).into()
}

fn folder_of(file: &Path) -> &Path {
    file.parent().filter(|parent| !parent.as_os_str().is_empty()).unwrap_or(Path::new("."))
}

impl SnapshotWatch {
    /// Returns the automatic snapshots of a configuration, if it has any.
    pub fn of(
        configuration: &Configuration,
        shared: &SharedLoop,
        agent: &AgentHandle,
    ) -> Result<Option<Arc<Self>>, Report> {
        let Some(trigger) = configuration.snapshot() else { return Ok(None) };
        let field = match (check_trigger(configuration, &*shared.board)?, &trigger.when) {
            (Some((property, path)), Some(when)) => {
                let condition = when.value.clone();
                let reader = property.channel().and_then(|channel| channel.latest().ok());
                let reader = reader.ok_or_else(|| no_value(configuration, when, property.path()))?;
                Some(ConditionField { condition, reader, descriptor: property.descriptor(), path })
            }
            _ => None,
        };
        let check_state = CheckState { late: false, held: false, field };
        Ok(Some(Arc::new(Self {
            agent: agent.downgrade(),
            at: trigger.at.as_ref().map(|at| at.value),
            file: trigger.file.value.clone(),
            check_state: Mutex::new(check_state),
            due: AtomicBool::new(false),
            writing: Arc::default(),
        })))
    }

    fn check_state(&self) -> MutexGuard<'_, CheckState> {
        self.check_state.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Checks after a cycle whether a snapshot is due; takes some nanoseconds.
    /// In lockstep the snapshot is taken here, so that it is always of the same cycle. On the wall clock a thread takes
    /// it.
    pub fn check(self: &Arc<Self>, shared: &SharedLoop, now: u64) -> Flow {
        let is_due = {
            let mut check_state = self.check_state();
            let late = self.at.is_some_and(|at| now >= at);
            let held = check_state.field.as_mut().is_some_and(ConditionField::holds);
            let is_due = late && !check_state.late || held && !check_state.held;
            (check_state.late, check_state.held) = (late, held);
            is_due
        };
        if !is_due && !self.due.load(Ordering::Relaxed) {
            return Flow::Next;
        }
        let Some(agent) = self.agent.upgrade() else { return Flow::Next };
        if !shared.lockstep {
            self.due.store(false, Ordering::Relaxed);
            let own = Arc::clone(self);
            self.write(shared, move || {
                let snapshot = SnapshotTaker::new(&agent).save(&own.file)?;
                Ok((snapshot.time(), snapshot.cycle()))
            });
            return Flow::Next;
        }
        // Another thread that changes the agent may wait for the loop; then it is the cycle after that.
        let Some(composition) = agent.try_composition() else {
            self.due.store(true, Ordering::Relaxed);
            return Flow::Next;
        };
        self.due.store(false, Ordering::Relaxed);
        let image = match SnapshotSubjects::of(&composition, shared).map(|subjects| subjects.capture(shared))
        {
            Ok(None) => return Flow::Lost,
            Ok(Some(image)) => image,
            Err(error) => Err(error),
        };
        let snapshot = image.map(|image| Snapshot::new(shared.board.agent(), marks(&composition), image));
        drop(composition);
        let file = self.file.clone();
        self.write(shared, move || {
            let snapshot = snapshot?;
            snapshot.write(file)?;
            Ok((snapshot.time(), snapshot.cycle()))
        });
        Flow::Next
    }

    /// Queues a snapshot for writing, without waiting.
    /// The thread that takes one waits for the loop.
    fn write(
        &self,
        shared: &SharedLoop,
        write: impl FnOnce() -> Result<(u64, u64), SnapshotError> + Send + 'static,
    ) {
        let mut writing = locked(&self.writing);
        writing.left_out += u64::from(writing.next.replace(Box::new(write)).is_some());
        if writing.is_at_work {
            return;
        }
        let (logger, clock, file) =
            (Arc::clone(&shared.logger), Arc::clone(&shared.clock), self.file.clone());
        let own = Arc::clone(&self.writing);
        let work = move || {
            while let Some((task, left_out)) = next(&own) {
                let (level, text) = match task() {
                    Ok((time, cycle)) => {
                        let (seconds, file) = (time as f64 * 1e-9, file.display());
                        let text = format!("a snapshot of {seconds:.3} s, after cycle {cycle}, is in {file}");
                        match left_out {
                            0 => (Level::Info, text),
                            _ => (
                                Level::Warn,
                                format!("{text}; {left_out} that were due before it are left out"),
                            ),
                        }
                    }
                    Err(error) => (Level::Error, format!("no snapshot was taken: {error}")),
                };
                logger.log(clock.now(), level, &text);
            }
        };
        match std::thread::Builder::new().name("snapshot".into()).spawn(work) {
            // The one before is at its end, if there was one.
            Ok(thread) => (writing.thread, writing.is_at_work) = (Some(thread), true),
            Err(error) => {
                writing.next = None;
                let text = format!("no snapshot was taken: a thread can't be started: {error}");
                shared.logger.log(shared.clock.now(), Level::Error, &text);
            }
        }
    }
}

impl AutomaticSnapshot for SnapshotWatch {
    fn begin(&self, shared: &SharedLoop) {
        let mut check_state = self.check_state();
        self.due.store(false, Ordering::Relaxed);
        check_state.late = self.at.is_some_and(|at| shared.clock.now() >= at);
        if let Some(field) = &mut check_state.field {
            // It may have seen more values than there are now.
            field.reader.resume(0);
        }
        check_state.held = check_state.field.as_mut().is_some_and(ConditionField::holds);
    }

    fn wait(&self) {
        let thread = locked(&self.writing).thread.take();
        if let Some(thread) = thread {
            // It has nothing that panics.
            let _ = thread.join();
        }
    }
}

/// Returns the thread's next task and the number of replaced ones before it.
/// `None` if the thread ends.
fn next(writing: &Mutex<Writing>) -> Option<(Task, u64)> {
    let mut writing = locked(writing);
    let next = writing.next.take();
    writing.is_at_work = next.is_some();
    Some((next?, std::mem::take(&mut writing.left_out)))
}

/// Locks a mutex, also a poisoned one.
/// The guarded data stays intact when another thread panics while it holds the lock.
fn locked(writing: &Mutex<Writing>) -> MutexGuard<'_, Writing> {
    writing.lock().unwrap_or_else(PoisonError::into_inner)
}
