//! A configuration that changes while the agent runs.

mod comments;
mod covered;
mod edit;
mod handlers;
mod home;
mod overwrite;
mod proposal;
mod replace;
mod save;
mod senders;
mod session;
mod waiting;
mod watch;
mod write;

use std::collections::BTreeSet;
use std::fmt;
use std::path::Path;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use super::agents::read_all;
use super::compare::{differences, same};
use super::files::Files;
use super::path::{self, Prefix};
use super::read::{Main, Read, Request, read};
use super::set::{Written, first_equals, parse_set};
use super::source::{Origin, Source, SourceKind, Sources};
use super::value::Value;
use super::{Configuration, Diagnostic, Options, Report, Setting, problems::Problems, report};
use crate::mistake::Message;
use handlers::Handlers;
pub use handlers::Subscription;
pub use proposal::{Change, Proposal};
use proposal::{Texts, Validator};
pub use save::SaveTo;
use session::Session;
use waiting::Patience;
pub use watch::{Edit, Watch};

/// The configuration of an agent while it runs: what the files and the command line say, and above them the changes
/// made since, which are called the session.
///
/// A change is first a [`Proposal`], which is read and checked like a configuration at the start; so either all of
/// it is good, or nothing happens. Whoever cares for a part of the settings [subscribes](Self::subscribe) to it,
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
    shared: Arc<Shared>,
}

struct Shared {
    main: Main,
    options: Options,
    state: Mutex<State>,
    /// Held by whoever changes the state, also while a file is written; taken before `state`.
    turn: Mutex<()>,
    validators: Mutex<Vec<Arc<Validator>>>,
    patience: Mutex<Vec<Arc<Patience>>>,
    handlers: Handlers,
}

#[derive(Clone)]
struct State {
    configuration: Arc<Configuration>,
    session: Session,
    /// The files as they were read.
    files: Files,
    /// What they say and only the next start can have.
    waiting: Vec<Change>,
    /// What they were edited to where something else was set at run time.
    covered: Vec<Change>,
    /// Counts the changes of the state, so that a proposal can tell whether it was overtaken.
    generation: u64,
}

/// A setting that is not what the files say.
#[derive(Clone, Debug)]
pub struct Difference {
    /// Its path, as `--set` takes it.
    pub path: String,
    /// What the files (or the built-in defaults) say, if they do.
    pub file: Option<Value>,
    /// What holds; nothing if another setting took its place, such as `on` that of `every`.
    pub present: Option<Value>,
    /// Where that comes from.
    pub origin: Option<Origin>,
}

/// Splits `path=value` as `--set` does, and checks that both can be read.
///
/// # Errors
/// What can't be read, with a caret.
pub fn parse_change(text: &str) -> Result<(String, String), Report> {
    let mut problems = Problems::default();
    let split = parse_set(text, None, 0, &mut problems).and_then(|_| first_equals(text));
    split.map(|equals| (text[..equals].trim().into(), text[equals + 1..].trim().into())).ok_or_else(|| {
        let sources = Sources(vec![Source::setting(SourceKind::Change, text)]);
        report(&sources, problems)
    })
}

impl Database {
    /// Reads a file and all its layers.
    ///
    /// # Errors
    /// Everything that is wrong with any of them.
    pub fn open(path: impl AsRef<Path>, options: Options) -> Result<Self, Report> {
        Self::new(Main::File(path.as_ref().to_owned()), options)
    }

    /// Reads a text as if it were a file of that name; changes of what it says can't be saved but to a host's file.
    ///
    /// # Errors
    /// Everything that is wrong with any of the layers.
    pub fn from_text(name: &str, text: &str, options: Options) -> Result<Self, Report> {
        Self::new(Main::Text { name: name.into(), text: text.into() }, options)
    }

    /// As [`from_text`](Self::from_text), with a session of those changes, but for those that are at paths of `over` or below.
    pub(super) fn with_changes(
        name: &str,
        text: &str,
        options: Options,
        (changes, over): (&[String], &[Vec<String>]),
    ) -> Result<Self, Report> {
        let main = Main::Text { name: name.into(), text: text.into() };
        let mut session = Session::default();
        for table in changes.iter().filter_map(|change| super::set::flat(change)) {
            session.add(&table);
        }
        session.0.retain(|change| !over.iter().any(|path| change.path.starts_with(path)));
        let texts = session.texts();
        let written: Vec<_> = texts.iter().map(|text| Written { text, equals: None }).collect();
        let request = Request { changes: &written, ..Request::new(&main, &options) };
        let Read { result, files, .. } = read(&request, Files::default());
        Ok(Self::beginning(main, options, (result?, session, files)))
    }

    fn new(main: Main, options: Options) -> Result<Self, Report> {
        let Read { result, files, .. } = read_all(&main, &options);
        Ok(Self::beginning(main, options, (result?, Session::default(), files)))
    }

    fn beginning(
        main: Main,
        options: Options,
        (configuration, session, files): (Configuration, Session, Files),
    ) -> Self {
        let state = State {
            configuration: Arc::new(configuration),
            session,
            files,
            waiting: Vec::new(),
            covered: Vec::new(),
            generation: 0,
        };
        let shared = Shared {
            main,
            options,
            state: Mutex::new(state),
            turn: Mutex::default(),
            validators: Mutex::default(),
            patience: Mutex::default(),
            handlers: Handlers::default(),
        };
        Self { shared: Arc::new(shared) }
    }

    /// The configuration that holds.
    pub fn current(&self) -> Arc<Configuration> {
        Arc::clone(&lock(&self.shared.state).configuration)
    }

    /// The settings at a path and below it, in the order of their paths; an empty path is everything, and
    /// `robots.r2` all that belongs to that robot.
    ///
    /// # Errors
    /// The path is none.
    pub fn get(&self, path: &str) -> Result<Vec<Setting>, Report> {
        self.current().settings(path)
    }

    /// What holds and is not what the files say, in the order of the paths: what the command line sets, and what was
    /// changed since and not saved.
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

    /// Makes changes at once, each a path and a value as `--set` takes them: [`propose`](Self::propose) and
    /// [commit](Proposal::commit), again if somebody else was faster.
    ///
    /// # Errors
    /// Everything that is wrong with any of them; then none is made.
    pub fn set(&self, changes: &[(impl AsRef<str>, impl AsRef<str>)]) -> Result<Vec<Change>, Report> {
        loop {
            if let Some(changes) = self.propose(changes)?.apply() {
                return Ok(changes);
            }
        }
    }

    fn state(&self) -> State {
        lock(&self.shared.state).clone()
    }
}

impl fmt::Debug for Database {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Database").field("main", &self.shared.main).finish_non_exhaustive()
    }
}

/// No invariant spans two steps under one of these locks, so a panic in between leaves nothing broken.
fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

fn refusal(message: impl Into<Message>, help: impl Into<String>) -> Report {
    Diagnostic::without_place(message, Some(help.into())).into()
}
