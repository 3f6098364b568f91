use std::io;
use std::os::fd::{BorrowedFd, OwnedFd, RawFd};
use std::os::unix::net::UnixStream;
use std::os::unix::process::CommandExt;
use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::sync::mpsc::{Receiver, SyncSender, channel, sync_channel};
use std::sync::{Mutex, PoisonError};

use rustix::io::{FdFlags, fcntl_setfd};

use super::child::{CHILD_ARGUMENT, is_entered};
use super::python;
use super::wire::Code;

struct LaunchRequest {
    command: Command,
    /// True if the process can't close inherited files of the host itself.
    closes_files: bool,
    answer: SyncSender<io::Result<Child>>,
}

/// Requests to the thread that starts all processes.
/// It lives as long as the program: the system takes its end for the end of the host, and a module's thread may end
/// before the module. A forked process has a thread of its own, as it has none of its parent's.
static LAUNCHER: Mutex<Option<(u32, std::sync::mpsc::Sender<LaunchRequest>)>> = Mutex::new(None);

/// Returns the command that starts `program`, or this one again, to run a module.
fn program_command(program: Option<&Path>) -> io::Result<Command> {
    if program.is_none() && !is_entered() {
        return Err(io::Error::other(
            "this program's `main` does not call `slate_runtime::isolation::enter` first",
        ));
    }
    // This is the program as it runs, also when its file was replaced meanwhile.
    let mut command = Command::new(program.unwrap_or("/proc/self/exe".as_ref()));
    command.arg(CHILD_ARGUMENT);
    Ok(command)
}

/// Starts `program`, this one again, or an interpreter, to run a module.
/// Its standard input is the socket to it.
pub(super) fn launch(program: Option<&Path>, code: &Code) -> io::Result<(Child, UnixStream)> {
    let mut command = match code {
        Code::Python(_) => python::command(),
        Code::Linked | Code::Library(_) => program_command(program)?,
    };
    let (stream, theirs) = UnixStream::pair()?;
    command.stdin(Stdio::from(OwnedFd::from(theirs)));
    // The host decides when its modules end, not an interrupt from the keyboard.
    command.process_group(0);
    let (answer, receiver) = sync_channel(1);
    let request = LaunchRequest { command, closes_files: matches!(code, Code::Python(_)), answer };
    let mut launcher = LAUNCHER.lock().unwrap_or_else(PoisonError::into_inner);
    let process = std::process::id();
    if launcher.as_ref().is_none_or(|(owner, _)| *owner != process) {
        let (requests, served) = channel();
        std::thread::Builder::new().name("launcher".into()).spawn(move || serve(&served))?;
        *launcher = Some((process, requests));
    }
    let is_sent = launcher.as_ref().is_some_and(|(_, launcher)| launcher.send(request).is_ok());
    drop(launcher);
    match (is_sent, receiver.recv()) {
        (true, Ok(child)) => Ok((child?, stream)),
        _ => Err(io::Error::other("the thread that starts processes has ended")),
    }
}

fn serve(requests: &Receiver<LaunchRequest>) {
    for LaunchRequest { mut command, closes_files, answer } in requests {
        if closes_files {
            close_files(&mut command);
        }
        // The requester waits for it.
        let _ = answer.send(command.spawn());
    }
}

/// Keeps open files of the host's libraries from a process.
/// The process can't close them itself: an interpreter opens own ones before it runs any code of Slate.
fn close_files(command: &mut Command) {
    let Ok(entries) = std::fs::read_dir("/proc/self/fd") else { return };
    let names: Vec<_> = entries.flatten().map(|entry| entry.file_name()).collect();
    let numbers = names.iter().filter_map(|name| name.to_str()?.parse().ok());
    let files: Vec<RawFd> = numbers.filter(|number| *number > 2).collect();
    let close = move || {
        for file in &files {
            // SAFETY: it is a number of a file only; it fails for one that was closed meanwhile.
            let _ = fcntl_setfd(unsafe { BorrowedFd::borrow_raw(*file) }, FdFlags::CLOEXEC);
        }
        Ok(())
    };
    // SAFETY: it makes system calls only, and allocates nothing.
    unsafe { command.pre_exec(close) };
}
