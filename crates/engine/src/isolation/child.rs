//! Process that runs one module for its host.

use std::ffi::CString;
use std::io::{self, IoSliceMut};
use std::mem::MaybeUninit;
use std::os::fd::{AsFd, OwnedFd};
use std::os::unix::net::UnixStream;
use std::ptr::NonNull;
use std::sync::atomic::{AtomicBool, Ordering};

use rustix::net::{RecvAncillaryBuffer, RecvAncillaryMessage, RecvFlags, recvmsg};
use rustix::process::{Resource, Rlimit, Signal, getrlimit, set_parent_process_death_signal, setrlimit};
use slate_module::table::{DONE, PANICKED, REFUSED};
use slate_module::{Frame, Host, ModuleKind, Plugin, Refusal, Setup, decode, encode};

use super::arena::map;
use super::python::PythonSource;
use super::wire::{Begin, Code, InstanceRequest, KindText, Topic, build, check_build, receive, send};
use crate::library;

/// First argument of a process that runs a module.
pub(super) const CHILD_ARGUMENT: &str = "--slate-isolated-module";

/// More arenas than this are not passed on; values in others are copied.
pub(super) const ARENA_LIMIT: usize = 64;

static IS_ENTERED: AtomicBool = AtomicBool::new(false);

/// Returns true if this program can be started again to run a module.
pub(super) fn is_entered() -> bool {
    IS_ENTERED.load(Ordering::Relaxed)
}

/// Enables a program to run modules in child processes of the same program.
/// Started as a child, it runs the module and never returns. Call it first in `main`, with the plugins that are linked
/// in.
///
/// ```no_run
/// use slate_engine::isolation;
///
/// fn main() {
///     let plugins = []; // those that the agent is loaded with
///     isolation::enter(&plugins);
///     // load and run the agent
/// }
/// ```
pub fn enter(plugins: &[Plugin]) {
    IS_ENTERED.store(true, Ordering::Relaxed);
    if std::env::args_os().nth(1).is_some_and(|argument| argument == CHILD_ARGUMENT) {
        let code =
            match run_child("the program of its process", close_inherited, |code| open_code(code, plugins)) {
                Ok(()) => 0,
                // The host has ended, or says why this process does.
                Err(_) => 1,
            };
        std::process::exit(code);
    }
}

/// Opens the code of this program or of a library; returns its kinds.
fn open_code(code: &Code, plugins: &[Plugin]) -> Result<Vec<ModuleKind>, Refusal> {
    match code {
        Code::Linked => Ok(plugins.iter().flat_map(Plugin::kinds).cloned().collect()),
        Code::Library(file) => {
            Ok(library::open_in_place(file).map_err(|error| Refusal(error.to_string()))?.kinds().to_vec())
        }
        Code::Python(source) => Err(Refusal(format!("{} needs an interpreter", source.file.display()))),
    }
}

/// Runs a module in Python for the host that has started this interpreter.
/// `open` opens the source and returns its kinds. The standard input is the socket to the host.
///
/// # Errors
/// The host has ended, or no host has started this process.
pub fn serve_python(open: impl Fn(&PythonSource) -> Result<Vec<ModuleKind>, Refusal>) -> io::Result<()> {
    // The interpreter has opened files by itself; the launcher leaves none of the host's.
    run_child(
        "the package slate-robotics",
        |_| {},
        |code| match code {
            Code::Python(source) => open(source),
            Code::Linked | Code::Library(_) => Err("an interpreter runs modules of Python only".into()),
        },
    )
}

/// Serves the host; `what` names this program if the host is of another version.
fn run_child(
    what: &str,
    prepare: impl Fn(&UnixStream),
    open: impl Fn(&Code) -> Result<Vec<ModuleKind>, Refusal>,
) -> io::Result<()> {
    // A module in an endless loop would not notice that its host is gone.
    set_parent_process_death_signal(Some(Signal::KILL))?;
    let stream = UnixStream::from(io::stdin().as_fd().try_clone_to_owned()?);
    rustix::stdio::dup2_stdin(std::fs::File::open("/dev/null")?)?;
    prepare(&stream);
    let files = receive_files(&stream)?;
    let mut body = Vec::new();
    // Nothing that depends on the version was read yet.
    let (Topic::Build, _) = receive(&stream, &mut body)? else {
        return Err(io::ErrorKind::InvalidData.into());
    };
    let checked = check_build(&body, &build(), what);
    let is_refused = checked.is_err();
    answer(&stream, checked.map(|()| Vec::new()))?;
    if is_refused {
        return Ok(());
    }
    let begin: Begin = match receive(&stream, &mut body)? {
        (Topic::Begin, _) => decode(&body).map_err(|refusal| io::Error::other(refusal.0))?,
        _ => return Err(io::ErrorKind::InvalidData.into()),
    };
    let started = start(&begin, files, open);
    let kinds = match &started {
        Ok((kinds, addresses)) => {
            let addresses: Vec<u64> = addresses.iter().map(|base| base.as_ptr() as u64).collect();
            answer(&stream, encode(&addresses))?;
            kinds
        }
        Err(refusal) => return answer(&stream, Err(refusal.clone())),
    };
    Module { stream, kinds, running: None }.serve(&mut body)
}

/// Descriptors that a library of the host has left open.
#[allow(unsafe_code, reason = "closing files that this process did not open")]
fn close_inherited(stream: &UnixStream) {
    use std::os::fd::AsRawFd;
    let Ok(entries) = std::fs::read_dir("/proc/self/fd") else { return };
    let names: Vec<_> = entries.flatten().map(|entry| entry.file_name()).collect();
    let numbers = names.iter().filter_map(|name| name.to_str()?.parse().ok());
    for number in numbers.filter(|number: &i32| *number > 2 && *number != stream.as_raw_fd()) {
        if std::fs::symlink_metadata(format!("/proc/self/fd/{number}")).is_err() {
            // That of the folder itself.
            continue;
        }
        // SAFETY: the program calls this first in `main`, so it has opened nothing but its stream.
        unsafe { rustix::io::close(number) };
    }
}

/// Receives the files of the arenas, which come with the first byte.
fn receive_files(stream: &UnixStream) -> io::Result<Vec<OwnedFd>> {
    let mut space = [MaybeUninit::uninit(); rustix::cmsg_space!(ScmRights(ARENA_LIMIT))];
    let mut control = RecvAncillaryBuffer::new(&mut space);
    let mut byte = [0];
    let received = recvmsg(stream, &mut [IoSliceMut::new(&mut byte)], &mut control, RecvFlags::CMSG_CLOEXEC)?;
    if received.bytes == 0 {
        return Err(io::ErrorKind::UnexpectedEof.into());
    }
    let messages = control.drain().filter_map(|message| match message {
        RecvAncillaryMessage::ScmRights(files) => Some(files),
        _ => None,
    });
    Ok(messages.flatten().collect())
}

type ChildResources = (Vec<ModuleKind>, Vec<NonNull<u8>>);

/// Maps the arenas, opens the code, and then limits the memory.
fn start(
    begin: &Begin,
    files: Vec<OwnedFd>,
    open: impl Fn(&Code) -> Result<Vec<ModuleKind>, Refusal>,
) -> Result<ChildResources, Refusal> {
    let failed = |what: &str, error: io::Error| Refusal(format!("its process can't {what}: {error}"));
    let title: Vec<u8> = begin.name.bytes().filter(|byte| *byte != 0).take(15).collect();
    if let Ok(title) = CString::new(title) {
        // Only for lists of processes.
        let _ = rustix::thread::set_name(&title);
    }
    // When memory runs out, this is what can be done without.
    let _ = std::fs::write("/proc/self/oom_score_adj", "1000");
    // A dump takes long, and hides the end of the process until it is written.
    let none = Rlimit { current: Some(0), maximum: getrlimit(Resource::Core).maximum };
    setrlimit(Resource::Core, none).map_err(|error| failed("limit its core dumps", error.into()))?;
    if files.len() != begin.arenas.len() {
        return Err(format!("its process got {} of {} arenas", files.len(), begin.arenas.len()).into());
    }
    let mapped = files.iter().zip(&begin.arenas);
    let mapped = mapped.map(|(file, writable)| map(file.as_fd(), begin.arena_length, *writable));
    let addresses = mapped.collect::<Result<_, _>>().map_err(|error| failed("map shared memory", error))?;
    let kinds = open(&begin.code)?;
    if begin.memory > 0 {
        // Memory mapped until now, such as arenas, is not the module's.
        let used = address_space().map_err(|error| failed("read its size", error))?;
        let maximum = getrlimit(Resource::As).maximum;
        let limit = Rlimit { current: Some(used + begin.memory), maximum };
        setrlimit(Resource::As, limit).map_err(|error| failed("limit its memory", error.into()))?;
    }
    Ok((kinds, addresses))
}

/// Bytes of address space that this process uses.
fn address_space() -> io::Result<u64> {
    let text = std::fs::read_to_string("/proc/self/statm")?;
    let pages = text.split(' ').next().and_then(|pages| pages.parse::<u64>().ok());
    Ok(pages.ok_or(io::ErrorKind::InvalidData)? * rustix::param::page_size() as u64)
}

fn answer(stream: &UnixStream, result: Result<Vec<u8>, Refusal>) -> io::Result<()> {
    match result {
        Ok(body) => send(stream, Topic::Answer, DONE, &body),
        Err(refusal) => send(stream, Topic::Answer, REFUSED, refusal.0.as_bytes()),
    }
}

struct Module<'k> {
    stream: UnixStream,
    kinds: &'k [ModuleKind],
    running: Option<Running>,
}

/// Running instance.
struct Running {
    kind: ModuleKind,
    instance: *mut (),
    frame: *const Frame,
}

impl Module<'_> {
    /// Serves the host's requests until one ends it or the host has ended.
    fn serve(mut self, body: &mut Vec<u8>) -> io::Result<()> {
        loop {
            let (topic, _) = receive(&self.stream, body)?;
            if topic == Topic::Tick {
                let code = self.tick();
                send(&self.stream, Topic::Answer, code, &[])?;
                continue;
            }
            let result = self.call(topic, body);
            answer(&self.stream, result)?;
            if topic == Topic::Destroy {
                return Ok(());
            }
        }
    }

    fn call(&mut self, topic: Topic, body: &[u8]) -> Result<Vec<u8>, Refusal> {
        match topic {
            Topic::Kinds => {
                let text = |kind: &ModuleKind| KindText {
                    name: kind.name().into(),
                    doc: kind.doc().into(),
                    section: kind.section().into(),
                };
                return encode(&self.kinds.iter().map(text).collect::<Vec<_>>());
            }
            Topic::Describe => {
                let request: InstanceRequest = decode(body)?;
                // A value of parameters has bytes.
                let params = Some(request.params.as_slice()).filter(|params| !params.is_empty());
                let setup = Setup { params, ..request.setup() };
                return self.kind(&request.kind)?.describe_portable(&setup);
            }
            Topic::Create => {
                let request: InstanceRequest = decode(body)?;
                let kind = self.kind(&request.kind)?.clone();
                let instance = kind.create(&request.setup(), &request.params)?;
                let frame = request.frame as *const Frame;
                self.running = Some(Running { kind, instance, frame });
                return Ok(Vec::new());
            }
            _ => {}
        }
        let Some(running) = &self.running else {
            return Err(format!("its process has no instance; expected Create before {topic:?}").into());
        };
        // SAFETY: the kind made the instance, which this thread alone uses, and it ends once: then it is forgotten.
        unsafe {
            match topic {
                Topic::Save => running.kind.save(running.instance),
                Topic::Restore => running.kind.restore(running.instance, body).map(|()| Vec::new()),
                Topic::MayUnload => running.kind.may_unload(running.instance).map(|()| Vec::new()),
                Topic::Destroy => {
                    let ended = running.kind.destroy(running.instance);
                    self.running = None;
                    ended.map(|()| Vec::new())
                }
                _ => Err(format!(
                    "its process can't answer {topic:?}; expected Save, Restore, MayUnload or Destroy. \
                     Please report this as a defect of Slate"
                )
                .into()),
            }
        }
    }

    fn kind(&self, name: &str) -> Result<&ModuleKind, Refusal> {
        let found = self.kinds.iter().find(|kind| kind.name() == name);
        found.ok_or_else(|| {
            let known: Vec<_> = self.kinds.iter().map(ModuleKind::name).collect();
            format!("its process has no module type `{name}`, only {}", known.join(", ")).into()
        })
    }

    fn tick(&self) -> i32 {
        let Some(running) = &self.running else { return PANICKED };
        let host = Host { context: (&raw const self.stream).cast(), log: forward_log };
        // SAFETY: the host has filled the frame, and waits. It is not of this process, so only this copy is lent; the
        // kind made the instance.
        unsafe {
            let shared = &*running.frame;
            let frame = Frame {
                ports: shared.ports,
                port_count: shared.port_count,
                params: shared.params,
                params_size: shared.params_size,
                params_version: shared.params_version,
                now: shared.now,
                elapsed: shared.elapsed,
                number: shared.number,
                random: shared.random,
                host: &raw const host,
            };
            (running.kind.table().tick)(running.instance, &raw const frame)
        }
    }
}

/// Passes a line of the log on at once, as it may be the last.
unsafe extern "C" fn forward_log(context: *const (), level: u32, text: *const u8, length: usize) {
    // SAFETY: the context is the stream of the module that ticks; the text lives during the call.
    let (stream, text) =
        unsafe { (&*context.cast::<UnixStream>(), std::slice::from_raw_parts(text, length)) };
    // Without a host no process receives it.
    let _ = send(stream, Topic::Log, level as i32, text);
}
