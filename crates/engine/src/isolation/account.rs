use std::fs::File;
use std::net::Shutdown;
use std::os::unix::fs::FileExt;
use std::os::unix::net::UnixStream;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use slate_module::{Text, interface};

/// The process of an isolated module: `/module/process`, written when it begins and ends, and once a second of the
/// agent's time. No part of what a run can repeat.
#[interface]
pub struct ModuleProcess {
    /// Memory that it has in use.
    #[unit("B")]
    pub memory: u64,
    /// The system's number of it; 0 while there is none.
    pub id: u32,
    /// How often it was started anew.
    pub restarts: u32,
    /// How the last one ended that ended by itself, or was ended because it did not return; empty before that.
    pub last_end: Text<124>,
}

/// What is known of the processes of a module.
#[derive(Debug, Default)]
pub struct Account(Mutex<AccountState>);

#[derive(Debug, Default)]
struct AccountState {
    id: u32,
    /// Where the system says how much memory it uses.
    sizes: Option<File>,
    last_end: String,
    /// The host's end of the connection to it.
    stream: Option<Arc<UnixStream>>,
}

impl Account {
    fn locked(&self) -> MutexGuard<'_, AccountState> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// A process has begun, with this connection to it.
    pub fn began(&self, id: u32, stream: Arc<UnixStream>) {
        let mut inner = self.locked();
        inner.id = id;
        inner.stream = Some(stream);
        // Without it, its memory is shown as nothing.
        inner.sizes = File::open(format!("/proc/{id}/statm")).ok();
    }

    /// The process of that number has ended; `fault` says how, if it was one.
    pub fn ended(&self, id: u32, fault: Option<&str>) {
        let mut inner = self.locked();
        if inner.id == id {
            inner.id = 0;
            inner.sizes = None;
            inner.stream = None;
        }
        if let Some(fault) = fault {
            fault.clone_into(&mut inner.last_end);
        }
    }

    /// Ends the connection to it: a call that waits for it returns, and the process is ended.
    pub fn disconnect(&self) {
        if let Some(stream) = &self.locked().stream {
            // It fails when the process has just ended.
            let _ = stream.shutdown(Shutdown::Both);
        }
    }

    /// How the last one ended by its own fault, in words; empty when none has.
    pub fn last_end(&self) -> String {
        self.locked().last_end.clone()
    }

    /// As others see it. Allocates nothing.
    pub fn process(&self, restarts: u32) -> ModuleProcess {
        let inner = self.locked();
        ModuleProcess {
            memory: inner.sizes.as_ref().and_then(memory).unwrap_or(0),
            id: inner.id,
            restarts,
            last_end: Text::new(&inner.last_end),
        }
    }
}

/// Bytes of memory that a process has in use.
fn memory(sizes: &File) -> Option<u64> {
    let mut text = [0; 128];
    let length = sizes.read_at(&mut text, 0).ok()?;
    let pages: u64 = std::str::from_utf8(&text[..length]).ok()?.split(' ').nth(1)?.parse().ok()?;
    Some(pages * rustix::param::page_size() as u64)
}
