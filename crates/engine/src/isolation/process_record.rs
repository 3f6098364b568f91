use std::fs::File;
use std::net::Shutdown;
use std::os::unix::fs::FileExt;
use std::os::unix::net::UnixStream;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use slate_composition::own::ModuleProcess;
use slate_module::Text;

/// Account of the processes of a module: id, memory and last failure.
#[derive(Debug, Default)]
pub struct ProcessRecord(Mutex<ProcessRecordState>);

#[derive(Debug, Default)]
struct ProcessRecordState {
    id: u32,
    /// File of `/proc` with the memory in use.
    sizes: Option<File>,
    last_end: String,
    /// Host's end of the connection to it.
    stream: Option<Arc<UnixStream>>,
    /// The same for a process that opens its code, maybe beside the one that runs.
    launched: Option<Arc<UnixStream>>,
}

impl ProcessRecord {
    fn locked(&self) -> MutexGuard<'_, ProcessRecordState> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Records the connection to a process that opens its code; `None` once it has.
    pub fn record_launch(&self, stream: Option<Arc<UnixStream>>) {
        self.locked().launched = stream;
    }

    /// Records the begin of a process, with the connection to it.
    pub fn record_start(&self, id: u32, stream: Arc<UnixStream>) {
        let mut inner = self.locked();
        inner.id = id;
        inner.stream = Some(stream);
        // Without it, its memory is shown as nothing.
        inner.sizes = File::open(format!("/proc/{id}/statm")).ok();
    }

    /// Records the end of a process; `fault` describes a failure.
    pub fn record_exit(&self, id: u32, fault: Option<&str>) {
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

    /// Acts as [`disconnect`](Self::disconnect) for a process that opens its code.
    pub fn disconnect_launched(&self) {
        if let Some(stream) = &self.locked().launched {
            // As in `disconnect`.
            let _ = stream.shutdown(Shutdown::Both);
        }
    }

    /// Closes the connection, which ends the process; a waiting call returns.
    pub fn disconnect(&self) {
        if let Some(stream) = &self.locked().stream {
            // It fails when the process has just ended.
            let _ = stream.shutdown(Shutdown::Both);
        }
    }

    /// Returns a description of the last failure; empty if none.
    pub fn last_end(&self) -> String {
        self.locked().last_end.clone()
    }

    /// Returns the published state of the process. Allocates nothing.
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
