//! The agent's side of the socket.

use std::collections::BTreeMap;
use std::io::{BufReader, ErrorKind, Write};
use std::net::Shutdown;
use std::os::fd::OwnedFd;
use std::os::unix::net::{UnixListener, UnixStream};
use std::path::Path;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};
use std::thread::{Builder, JoinHandle};
use std::time::{Duration, Instant};

use rustix::event::{PollFd, PollFlags, Timespec, poll};
use serde::Serialize;

use super::desk::{self, Desk, refusal};
use super::elsewhere;
use super::line::{self, Line};
use super::own::make_own;
use super::place::Place;
use super::protocol::{Answer, Call, Greeting, LINE_LIMIT, Refusal, VERSION};
use super::visit::Visit;
use crate::Agent;
use crate::stop_line::StopLine;

/// How many tools may be connected; for one more, the one that was silent for the longest is let go.
const GUESTS: usize = WORKING + 8;

/// How many of them may be at work with what can take long. The other places are for what never does: a stop above all.
const WORKING: usize = 32;

/// How long a change waits for the one before it; less than tools wait for an answer.
const TURN: Duration = Duration::from_secs(50);

/// How often who waits looks whether its tool is still there.
const LOOK: Duration = Duration::from_millis(100);

/// How long an agent that ends waits for tools that record to ask how it goes.
const HEARING: Duration = Duration::from_secs(1);

/// How long a tool may take to receive an answer.
const PATIENCE: Duration = Duration::from_secs(5);

/// Why an agent has no socket.
#[derive(Debug, thiserror::Error, miette::Diagnostic)]
#[error("the agent can't be reached by tools: {0}")]
#[diagnostic(help("let XDG_RUNTIME_DIR be a short path of a folder that is yours alone"))]
pub struct OpenError(#[from] std::io::Error);

/// The socket of an agent, there as long as this lives. Tools are served by threads of their own, so the agent never
/// waits for one, nor one for another.
pub struct Server {
    /// Goes first, as its socket lies beside that of the place.
    _stop_line: StopLine,
    place: Place,
    hall: Arc<Hall>,
    /// The listening socket.
    listener: UnixStream,
    door: Option<JoinHandle<()>>,
}

impl std::fmt::Debug for Server {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Server").field("socket", &self.place.socket).finish_non_exhaustive()
    }
}

/// What the threads share.
struct Hall {
    desk: Desk,
    name: String,
    closed: AtomicBool,
    guests: Mutex<Guests>,
    /// What is being changed by a tool, and notice of its end.
    change: Mutex<Option<&'static str>>,
    changed: Condvar,
}

#[derive(Default)]
struct Guests {
    present: BTreeMap<u64, Guest>,
    /// Counts guests and calls.
    count: u64,
}

struct Guest {
    stream: UnixStream,
    /// The count at its last call.
    last: u64,
    /// Whether it is at work.
    busy: bool,
    /// Whether that may take long.
    works: bool,
    /// Whether it records a trace, and so is not let go for its silence.
    records: bool,
}

impl Server {
    /// Opens the socket of an agent. When an agent of that name runs already, it is reached by a name with a number,
    /// such as `exp1-2`.
    ///
    /// # Errors
    /// When the socket can't be made, or there is no thread left.
    pub fn open(agent: &Agent) -> Result<Self, OpenError> {
        let (place, listener) = Place::take(agent.board().agent())?;
        let composer = agent.composer();
        let stop_line = StopLine::open(&place.socket, move |reason| composer.stop_actuators(reason))?;
        let hall = Arc::new(Hall {
            desk: Desk::new(agent),
            name: place.name.clone(),
            closed: AtomicBool::new(false),
            guests: Mutex::default(),
            change: Mutex::default(),
            changed: Condvar::new(),
        });
        let handle = UnixStream::from(OwnedFd::from(listener.try_clone()?));
        let shared = Arc::clone(&hall);
        let door = Builder::new().name("remote".into()).spawn(move || receive(&listener, &shared))?;
        Ok(Self { _stop_line: stop_line, place, hall, listener: handle, door: Some(door) })
    }

    /// The name under which the agent is reached.
    pub fn name(&self) -> &str {
        &self.place.name
    }

    /// Where the socket is.
    pub fn socket(&self) -> &Path {
        &self.place.socket
    }
}

impl Drop for Server {
    fn drop(&mut self) {
        self.hall.closed.store(true, Ordering::Release);
        // Linux ends the waiting so; elsewhere a last guest does.
        if self.listener.shutdown(Shutdown::Both).is_err() {
            let _ = UnixStream::connect(&self.place.socket);
        }
        if let Some(door) = self.door.take() {
            // It has nothing that panics.
            let _ = door.join();
        }
        // Traces are ended: for tools that ask how theirs goes at once, so that they hear of it, and then for the others.
        self.hall.wait_for_traces(HEARING);
        // A call under way ends by itself.
        self.hall.guests().present.values().for_each(Guest::let_go);
        self.hall.wait_for_traces(PATIENCE);
    }
}

fn receive(listener: &UnixListener, hall: &Arc<Hall>) {
    loop {
        let accepted = listener.accept();
        if hall.is_closed() {
            return;
        }
        match accepted {
            Ok((stream, _)) => welcome(stream, hall),
            // No file handle is left, for example; it may be otherwise in a while.
            Err(_) => std::thread::sleep(Duration::from_millis(100)),
        }
    }
}

fn welcome(mut stream: UnixStream, hall: &Arc<Hall>) {
    // A stream without this could hold up its own thread only.
    let _ = stream.set_write_timeout(Some(PATIENCE));
    let Ok(clone) = stream.try_clone() else { return };
    let Some(number) = hall.guests().admit(clone) else {
        let answer = Answer::Error(too_many());
        let _ = send(&mut stream, &answer);
        return;
    };
    let shared = Arc::clone(hall);
    let serving = Builder::new().name("remote tool".into()).spawn(move || {
        let mut visit = Visit::default();
        // A tool that is gone misses nothing.
        let _ = serve(stream, &shared, number, &mut visit);
        visit.leave(shared.is_closed());
        shared.guests().present.remove(&number);
    });
    if serving.is_err() {
        hall.guests().present.remove(&number);
    }
}

fn serve(mut stream: UnixStream, hall: &Hall, number: u64, visit: &mut Visit) -> std::io::Result<()> {
    match send(&mut stream, &Greeting { slate: VERSION, agent: hall.name.clone() }) {
        // Whoever has gone since may have said something before, such as that all shall stop.
        Err(error) if error.kind() == ErrorKind::BrokenPipe => {}
        sent => sent?,
    }
    let mut reader = BufReader::new(stream.try_clone()?);
    loop {
        let answer = match line::read(&mut reader, LINE_LIMIT)? {
            Line::End => return Ok(()),
            Line::TooLong => Answer::Error(refusal(
                format!("the line is longer than {LINE_LIMIT} bytes"),
                "send less at once",
            )),
            Line::Whole(line) => {
                let answer = hall.answer(&line, &stream, number, visit);
                hall.guests().end(number, visit.trace.is_under_way());
                match answer {
                    Some(answer) => answer,
                    None => return Ok(()),
                }
            }
        };
        send(&mut stream, &answer)?;
        hall.guests().answered(number, visit.trace.is_under_way());
    }
}

fn answered(made: Result<serde_json::Value, Refusal>) -> Answer {
    made.map_or_else(Answer::Error, Answer::Result)
}

fn send(stream: &mut UnixStream, value: &impl Serialize) -> std::io::Result<()> {
    let mut text = serde_json::to_vec(value)?;
    text.push(b'\n');
    stream.write_all(&text)
}

/// Whether the tool at the other end is gone; one that only says no more still waits for its answer.
fn is_gone(stream: &UnixStream) -> bool {
    let mut polled = [PollFd::new(stream, PollFlags::empty())];
    poll(&mut polled, Some(&Timespec { tv_sec: 0, tv_nsec: 0 })).is_ok_and(|count| count > 0)
}

impl Hall {
    /// The answer to a line; nothing when the tool is gone before it is its turn.
    fn answer(&self, line: &[u8], stream: &UnixStream, number: u64, visit: &mut Visit) -> Option<Answer> {
        let mut call = match desk::read(line) {
            Ok(call) => call,
            Err(refusal) => return Some(Answer::Error(refusal)),
        };
        if self.name != self.desk.composer().board().agent() {
            make_own(&mut call, &self.name);
        }
        let manner = Manner::of(&call);
        if !self.guests().begin(number, manner != Manner::Prompt) {
            return Some(Answer::Error(too_many()));
        }
        if self.is_closed() {
            visit.trace.finish();
        }
        let Manner::Change(name) = manner else { return Some(answered(self.desk.make_for(visit, call))) };
        match self.turn(name, stream)? {
            Ok(_turn) => Some(answered(self.desk.make_for(visit, call))),
            Err(refusal) => Some(Answer::Error(refusal)),
        }
    }

    fn is_closed(&self) -> bool {
        self.closed.load(Ordering::Acquire)
    }

    /// Waits until no tool records.
    #[allow(clippy::disallowed_methods, reason = "tools wait on the wall clock")]
    fn wait_for_traces(&self, limit: Duration) {
        let start = Instant::now();
        while self.guests().present.values().any(|guest| guest.records) && start.elapsed() < limit {
            std::thread::sleep(Duration::from_millis(5));
        }
    }

    /// Waits until no other tool changes the agent; nothing when this one is gone meanwhile.
    #[allow(clippy::disallowed_methods, reason = "tools wait on the wall clock")]
    fn turn(&self, name: &'static str, stream: &UnixStream) -> Option<Result<Turn<'_>, Refusal>> {
        let start = Instant::now();
        let mut change = self.change.lock().unwrap_or_else(PoisonError::into_inner);
        while let Some(other) = *change {
            if is_gone(stream) {
                return None;
            }
            if start.elapsed() > TURN {
                let message = format!("another tool's `{other}` has not ended within {} s", TURN.as_secs());
                return Some(Err(refusal(message, "see the log for the module that it waits for")));
            }
            let waited = self.changed.wait_timeout(change, LOOK);
            change = waited.unwrap_or_else(PoisonError::into_inner).0;
        }
        *change = Some(name);
        Some(Ok(Turn(self)))
    }

    fn guests(&self) -> MutexGuard<'_, Guests> {
        self.guests.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

/// The right to change the agent; others wait until it is dropped.
struct Turn<'h>(&'h Hall);

impl Drop for Turn<'_> {
    fn drop(&mut self) {
        *self.0.change.lock().unwrap_or_else(PoisonError::into_inner) = None;
        self.0.changed.notify_one();
    }
}

/// How a call is answered.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Manner {
    /// At once, as it runs no module's code and waits for nobody who does.
    Prompt,
    /// It may take a while.
    Slow,
    /// It may run modules' code, and one such call is made at a time.
    Change(&'static str),
}

impl Manner {
    fn of(call: &Call) -> Self {
        match call {
            // Another agent is waited for, and no module of this one.
            Call::Read { url } if elsewhere::split(url).is_some() => Self::Slow,
            Call::SnapshotRemote { .. } | Call::MessageSend { .. } => Self::Slow,
            Call::Stop { .. }
            | Call::Reset {}
            | Call::Arm { .. }
            | Call::Read { .. }
            | Call::ReadHistory { .. } => Self::Prompt,
            Call::PluginList {} | Call::ModuleList {} => Self::Prompt,
            // They wait for the file at most, and a recording that goes on is never refused for who else is at work.
            Call::TraceProgress {} | Call::TraceEnd {} => Self::Prompt,
            // Who drives waits for nobody.
            Call::ControlsTake { .. }
            | Call::ControlsCommand { .. }
            | Call::ControlsRelease {}
            | Call::ControlsLeave {}
            | Call::ControlsList {} => Self::Prompt,
            Call::PluginLoad { .. } => Self::Change("plugin/load"),
            Call::PluginUnload { .. } => Self::Change("plugin/unload"),
            Call::PluginReload { .. } => Self::Change("plugin/reload"),
            Call::PluginShadow { .. } => Self::Change("plugin/shadow"),
            Call::PluginEndShadow { .. } => Self::Change("plugin/end_shadow"),
            Call::PluginPromote { .. } => Self::Change("plugin/promote"),
            Call::ModuleEnable { .. } => Self::Change("module/enable"),
            Call::ModuleDisable { .. } => Self::Change("module/disable"),
            Call::Link { .. } => Self::Change("link"),
            Call::Unlink { .. } => Self::Change("unlink"),
            Call::LinkList {} => Self::Change("link/list"),
            Call::ConfigSet { .. } => Self::Change("config/set"),
            Call::PropertySet { .. } => Self::Change("property/set"),
            Call::ConfigSave { .. } => Self::Change("config/save"),
            Call::SnapshotSave { .. } => Self::Change("snapshot/save"),
            Call::SnapshotLoad { .. } => Self::Change("snapshot/load"),
            _ => Self::Slow,
        }
    }
}

fn too_many() -> Refusal {
    refusal("too many tools are at work with this agent", "try again later")
}

impl Guests {
    /// Makes room and gives the guest a number; nothing when all are at work.
    fn admit(&mut self, stream: UnixStream) -> Option<u64> {
        if self.present.len() >= GUESTS {
            let silent = self.present.iter().filter(|(_, guest)| !guest.busy && !guest.records);
            let number = *silent.min_by_key(|(_, guest)| guest.last)?.0;
            self.present.remove(&number)?.let_go();
        }
        self.count += 1;
        self.present.insert(
            self.count,
            Guest { stream, last: self.count, busy: false, works: false, records: false },
        );
        Some(self.count)
    }

    /// Notes a call; false when it may take long, and as many of those as may be are under way.
    fn begin(&mut self, number: u64, works: bool) -> bool {
        self.count += 1;
        let others = self.present.iter().filter(|(other, _)| **other != number);
        if works && others.filter(|(_, guest)| guest.works || guest.records).count() >= WORKING {
            return false;
        }
        if let Some(guest) = self.present.get_mut(&number) {
            (guest.last, guest.busy, guest.works) = (self.count, true, works);
        }
        true
    }

    /// Notes the end of a call, and whether the guest records from then on.
    fn end(&mut self, number: u64, records: bool) {
        if let Some(guest) = self.present.get_mut(&number) {
            (guest.busy, guest.works) = (false, false);
            guest.records |= records;
        }
    }

    /// Notes that the guest has its answer, after which it may record no more.
    fn answered(&mut self, number: u64, records: bool) {
        if let Some(guest) = self.present.get_mut(&number) {
            guest.records = records;
        }
    }
}

impl Guest {
    fn let_go(&self) {
        // Its thread then reads an end.
        let _ = self.stream.shutdown(Shutdown::Both);
    }
}
