//! Configuration that changes while the agent runs.

mod checks;
mod comments;
mod covered;
mod edit;
mod handlers;
mod home;
mod location;
mod overwrite;
mod proposal;
mod save;
mod senders;
mod session;
mod watch;
mod write;

use std::fmt;
use std::path::Path;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use super::change::Change;
use super::compare::{differences, same};
use super::described::read_all;
use super::files::Files;
use super::path::{self, Prefix};
use super::read::{Main, ReadOutcome, ReadRequest, read};
use super::set::{Written, first_equals, parse_set};
use super::source::{Origin, SettingSource, SourceKind, Sources};
use super::value::Value;
use super::{Configuration, Diagnostic, Options, Report, Setting, problems::Problems, report};
use crate::error_code::Message;
use checks::{Checks, Validator};
use handlers::Handlers;
pub use handlers::Subscription;
pub use proposal::Proposal;
use proposal::ProposalFiles;
pub use save::SaveTo;
use session::ChangeSession;
use slate_sorted::SortedSet;
pub use watch::{Edit, Watch};

/// Configuration of a running agent, with the changes made at run time.
/// The settings of the files and the command line are below these changes, which are called the session.
///
/// A change is first a [`Proposal`], which is read and checked like a configuration at the start; so either all of
/// it is valid, or nothing happens. Users of a part of the settings [subscribe](Self::subscribe) to it,
/// [`save`](Self::save) writes the session into the files, and [`watch`](Self::watch) takes over files that were
/// edited. Clones are handles of the same database.
///
/// ```
/// use slate_configuration::{Database, Options};
///
/// let text = "[modules.follower]\nparams = { gain = 1.2, speed = 0.5 }";
/// let database = Database::from_text("exp1.toml", text, Options::default())?;
/// let _subscription = database.subscribe("modules.follower.params", |_, changes| {
///     for change in changes {
///         println!("{} is {:?} now", change.path, change.after);
///     }
/// })?;
/// database.set(&[("modules.follower.params.gain", "2.5"), ("modules.follower.params.speed", "0.8")])?;
/// assert_eq!(database.get("modules.follower.params.gain")?[0].value.as_f64(), Some(2.5));
/// assert!(database.set(&[("modules.folower.params.gain", "1.0")]).is_err());
/// assert_eq!(database.diff().len(), 2);
/// # Ok::<(), slate_configuration::Report>(())
/// ```
#[derive(Clone)]
pub struct Database {
    shared: Arc<SharedDatabase>,
}

struct SharedDatabase {
    main: Main,
    options: Options,
    state: Mutex<DatabaseState>,
    /// Lock during a change of the state, also while a file is written.
    /// It is taken before `state`.
    turn: Mutex<()>,
    checks: Checks,
    handlers: Arc<Handlers>,
}

#[derive(Clone)]
struct DatabaseState {
    configuration: Arc<Configuration>,
    session: ChangeSession,
    /// Files as they were read.
    files: Files,
    /// Changes of files that wait for the next start.
    waiting: Vec<Change>,
    /// Edits of settings that were changed at run time.
    covered: Vec<Change>,
    /// Number of changes of the state.
    /// A proposal compares it to detect that it was overtaken.
    generation: u64,
}

/// Setting that differs from the files.
#[derive(Clone, Debug)]
pub struct Difference {
    /// Path, as `--set` takes it.
    pub path: String,
    /// Value of the files or the built-in defaults, if any.
    pub file: Option<Value>,
    /// Present value; `None` if another setting replaced it.
    /// An example is `on` in place of `every`.
    pub present: Option<Value>,
    /// Origin of the present value.
    pub origin: Option<Origin>,
}

/// Splits `path=value` as `--set` does, and checks that both can be read.
///
/// # Errors
/// The part that can't be read, with a caret.
pub fn parse_change(text: &str) -> Result<(String, String), Report> {
    let mut problems = Problems::default();
    let split = parse_set(text, None, 0, &mut problems).and_then(|_| first_equals(text));
    split.map(|equals| (text[..equals].trim().into(), text[equals + 1..].trim().into())).ok_or_else(|| {
        let sources = Sources(vec![SettingSource::setting(SourceKind::Change, text)]);
        report(&sources, problems)
    })
}

impl Database {
    /// Reads a file and all its layers.
    ///
    /// # Errors
    /// All errors in any of them.
    pub fn open(path: impl AsRef<Path>, options: Options) -> Result<Self, Report> {
        Self::new(Main::File(path.as_ref().to_owned()), options)
    }

    /// Reads a text as a file of that name.
    /// Changes of its settings can be saved to a host's file only.
    ///
    /// # Errors
    /// All errors in any of the layers.
    pub fn from_text(name: &str, text: &str, options: Options) -> Result<Self, Report> {
        Self::new(Main::Text { name: name.into(), text: text.into() }, options)
    }

    /// Reads a text as [`from_text`](Self::from_text), with a session of changes.
    /// Changes at the paths of `over` or below are excluded.
    pub(super) fn with_changes(
        name: &str,
        text: &str,
        options: Options,
        (changes, over): (&[String], &[Vec<String>]),
    ) -> Result<Self, Report> {
        let main = Main::Text { name: name.into(), text: text.into() };
        let mut session = ChangeSession::default();
        for table in changes.iter().filter_map(|change| super::set::flat(change)) {
            session.add(&table);
        }
        session.0.retain(|change| !over.iter().any(|path| change.path.starts_with(path)));
        let texts = session.texts();
        let written: Vec<_> = texts.iter().map(|text| Written { text, equals: None }).collect();
        let request = ReadRequest { changes: &written, ..ReadRequest::new(&main, &options) };
        let ReadOutcome { result, files, .. } = read(&request, Files::default());
        Ok(Self::beginning(main, options, (result?, session, files)))
    }

    fn new(main: Main, options: Options) -> Result<Self, Report> {
        let ReadOutcome { result, files, .. } = read_all(&main, &options);
        Ok(Self::beginning(main, options, (result?, ChangeSession::default(), files)))
    }

    fn beginning(
        main: Main,
        options: Options,
        (configuration, session, files): (Configuration, ChangeSession, Files),
    ) -> Self {
        let state = DatabaseState {
            configuration: Arc::new(configuration),
            session,
            files,
            waiting: Vec::new(),
            covered: Vec::new(),
            generation: 0,
        };
        let shared = SharedDatabase {
            main,
            options,
            state: Mutex::new(state),
            turn: Mutex::default(),
            checks: Checks::default(),
            handlers: Arc::default(),
        };
        Self { shared: Arc::new(shared) }
    }

    /// Present configuration.
    pub fn current(&self) -> Arc<Configuration> {
        Arc::clone(&lock(&self.shared.state).configuration)
    }

    /// Returns the settings at a path and below it, in the order of their paths.
    /// An empty path selects all, and `robots.r2` all that belongs to that robot.
    ///
    /// # Errors
    /// The path is invalid.
    pub fn get(&self, path: &str) -> Result<Vec<Setting>, Report> {
        self.current().settings(path)
    }

    /// Returns the present settings that differ from the files.
    /// They are in the order of the paths, and come from the command line or from unsaved changes.
    pub fn diff(&self) -> Vec<Difference> {
        let configuration = self.current();
        let pairs = differences(&configuration.files, &configuration.merged);
        let difference = pairs.into_iter().map(|(path, file, present)| Difference {
            path: path::render(&path),
            file: file.map(|file| file.value.clone()),
            present: present.map(|present| present.value.clone()),
            origin: present.map(|present| configuration.origin_of(present.span)),
        });
        difference.collect()
    }

    /// Makes changes at once, each a path and a value as of `--set`.
    /// It [proposes](Self::propose) and [commits](Proposal::commit) them, again if another thread was faster.
    ///
    /// # Errors
    /// All errors in any of them; then none is made.
    pub fn set(&self, changes: &[(impl AsRef<str>, impl AsRef<str>)]) -> Result<Vec<Change>, Report> {
        loop {
            if let Some(changes) = self.propose(changes)?.apply() {
                return Ok(changes);
            }
        }
    }

    /// Changes of edited files that wait for the next start.
    /// `before` holds until then, `after` from there on.
    pub fn waiting(&self) -> Vec<Change> {
        lock(&self.shared.state).waiting.clone()
    }

    /// Edits of settings that were changed at run time.
    /// `before` holds, `after` is in the files. Setting one again, or reverting it, removes it from this list.
    pub fn covered(&self) -> Vec<Change> {
        lock(&self.shared.state).covered.clone()
    }

    /// Adds a check of proposals, such as of the parameters of modules.
    /// A change that a check objects to is refused. The thread that proposes calls the checks, in the order in which
    /// they were added.
    pub fn validate_with(&self, validator: Box<Validator>) {
        self.shared.checks.add_validator(validator.into());
    }

    /// Adds a check for changes of an edited file that wait for the next start.
    /// It returns their indices in the list. These settings keep their values, and the rest of the edit takes effect. A
    /// change by [`set`](Self::set) does not wait: it holds at once or is refused.
    pub fn wait_with(
        &self,
        check: impl Fn(&Configuration, &[Change]) -> SortedSet<usize> + Send + Sync + 'static,
    ) {
        self.shared.checks.add_restart_check(Arc::new(check));
    }

    /// Adds a handler that is called after each commit with changes below a path.
    /// It receives these changes in the order of their paths; an empty path selects all, and `robots.r2` all that
    /// belongs to that robot.
    ///
    /// Handlers are called one after the other, in the order of their subscription, by the thread that commits (see
    /// [`Proposal::commit`]). A handler may read the database, change it, and subscribe; one that panics stops
    /// no other. No handler is called any more once its subscription is dropped, but a call under way ends.
    ///
    /// # Errors
    /// The path is invalid.
    pub fn subscribe(
        &self,
        path: &str,
        handler: impl FnMut(&Database, &[Change]) + Send + 'static,
    ) -> Result<Subscription, Report> {
        let prefix = Prefix::parse(path, self.current().described_as())?;
        Ok(self.shared.handlers.subscribe(prefix, handler))
    }

    /// Reads edited files of the configuration again, within a second.
    /// Included files are watched too.
    ///
    /// A thread polls their paths, so it doesn't matter how an editor replaces them. It calls `handler` with the
    /// effects of an edit, or with its errors; then nothing changes, and the next edit is tried. Changes made at
    /// run time stay on top.
    ///
    /// # Errors
    /// No more threads can be started.
    pub fn watch(&self, handler: impl FnMut(Result<Edit, Report>) + Send + 'static) -> Result<Watch, Report> {
        Watch::begin(self.clone(), handler)
    }

    fn state(&self) -> DatabaseState {
        lock(&self.shared.state).clone()
    }
}

impl fmt::Debug for Database {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Database").field("main", &self.shared.main).finish_non_exhaustive()
    }
}

/// Locks a mutex, also a poisoned one.
/// No invariant spans two steps under one of these locks, so a panic in between leaves nothing broken.
fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

fn refusal(message: impl Into<Message>, help: impl Into<String>) -> Report {
    Diagnostic::without_place(message, Some(help.into())).into()
}
