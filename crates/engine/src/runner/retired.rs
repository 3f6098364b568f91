//! End of instances: code that does not return from it delays no other module.

use std::sync::Arc;
use std::sync::mpsc::channel;
use std::time::Duration;

use slate_module::{Description, Frame, Level, ModuleKind, Refusal};

use super::OwnSetup;
use crate::background::thread_name;
use crate::clock::Clock;
use crate::log::Logger;

/// Timeout of lifecycle calls, and the logger of its expiry.
#[derive(Clone)]
pub struct CallTimeout {
    /// Name of the module.
    pub module: Arc<str>,
    /// None for a module whose calls end by themselves, as its process is ended.
    pub limit: Option<Duration>,
    /// Logger of an expired timeout.
    pub logger: Arc<Logger>,
    /// Agent's time.
    pub clock: Arc<Clock>,
}

/// Factor of the timeout of `describe` and `create`: a module may load data there.
const CREATE_TIMEOUT_FACTOR: u32 = 10;

/// Describes a kind in a thread, with `CREATE_TIMEOUT_FACTOR` times `hang`.
/// A kind that is linked in is the program's own code, and has no timeout.
///
/// # Errors
/// The module's refusal, or that the call does not return.
pub fn describe(kind: &ModuleKind, setup: &OwnSetup, hang: Duration) -> Result<Description, Refusal> {
    if kind.library().is_none() {
        return setup.with(|setup| kind.describe(setup));
    }
    let (name, limit) = (thread_name(&setup.name), hang * CREATE_TIMEOUT_FACTOR);
    let (kind, setup) = (kind.clone(), setup.clone());
    match run_with_timeout(name, limit, move || setup.with(|setup| kind.describe(setup))) {
        Ok(described) => described,
        Err(failure) => {
            Err(format!("{}; its library stays open", failure.describe("describe", limit)).into())
        }
    }
}

/// Does the `create` of a module in a thread, with a timeout.
/// It is `CREATE_TIMEOUT_FACTOR` times `hang`.
///
/// # Errors
/// The module's refusal, or that the call does not return.
pub fn within_create_timeout<R: Send + 'static>(
    module: &str,
    hang: Duration,
    create: impl FnOnce() -> Result<R, Refusal> + Send + 'static,
) -> Result<R, Refusal> {
    let limit = hang * CREATE_TIMEOUT_FACTOR;
    match run_with_timeout(thread_name(module), limit, create) {
        Ok(made) => made,
        Err(CallFailure::Late) => Err(late_create(limit)),
        Err(failure) => Err(failure.describe("create", limit).into()),
    }
}

fn late_create(limit: Duration) -> Refusal {
    Refusal(format!("its create has not returned within {} ms", limit.as_millis()))
}

/// Reason why a call has no result.
enum CallFailure {
    Late,
    NoThread(std::io::Error),
}

impl CallFailure {
    fn describe(&self, call: &str, limit: Duration) -> String {
        match self {
            Self::Late => format!("has not returned from its {call} within {} ms", limit.as_millis()),
            Self::NoThread(error) => format!("can't make its {call}: {error}"),
        }
    }
}

/// Does `work` in a thread, which keeps all that `work` has, and waits for it.
fn run_with_timeout<R: Send + 'static>(
    thread: String,
    limit: Duration,
    work: impl FnOnce() -> R + Send + 'static,
) -> Result<R, CallFailure> {
    let (sender, receiver) = channel();
    let thread = std::thread::Builder::new().name(thread).spawn(move || {
        // Sending fails after the timeout; the result is dropped here then.
        let _ = sender.send(work());
    });
    thread.map_err(CallFailure::NoThread)?;
    receiver.recv_timeout(limit).map_err(|_| CallFailure::Late)
}

impl CallTimeout {
    /// Makes an instance, in a thread that is waited for longer than for other calls.
    ///
    /// # Errors
    /// The module's refusal, or that the call does not return.
    pub fn create(&self, kind: &ModuleKind, setup: &OwnSetup, params: &[u8]) -> Result<*mut (), Refusal> {
        let Some(limit) = self.limit.map(|limit| limit * CREATE_TIMEOUT_FACTOR) else {
            return setup.with(|setup| kind.create(setup, params));
        };
        let (kind, setup, params) = (kind.clone(), setup.clone(), params.to_vec());
        let timeout = Self { limit: Some(limit), ..self.clone() };
        let instance = timeout.wait("create", move || {
            let instance = setup.with(|setup| kind.create(setup, &params))?;
            // One that comes too late ends with this.
            Ok::<_, Refusal>(OwnedInstance { kind, instance })
        });
        let mut owned = instance.ok_or_else(|| late_create(limit))??;
        Ok(std::mem::replace(&mut owned.instance, std::ptr::null_mut()))
    }

    /// Logs an error at the end of an instance.
    fn log_end(&self, ended: Result<(), Refusal>) {
        if let Err(refusal) = ended {
            let text = format!("{} has ended, but {refusal}", self.module);
            self.logger.log(self.clock.now(), Level::Error, &text);
        }
    }

    /// Does `work` in a thread of its own, and waits for it; `None` after the timeout.
    /// The thread keeps all that `work` has, the library too.
    fn wait<R: Send + 'static>(&self, call: &str, work: impl FnOnce() -> R + Send + 'static) -> Option<R> {
        let Some(limit) = self.limit else { return Some(work()) };
        let failure = match run_with_timeout(thread_name(&self.module), limit, work) {
            Ok(result) => return Some(result),
            Err(failure) => failure.describe(call, limit),
        };
        let text = format!("{} {failure}; the host waits no longer, and its library stays open", self.module);
        self.logger.log(self.clock.now(), Level::Error, &text);
        None
    }
}

/// Instance that ends on drop; null if it has ended.
struct OwnedInstance {
    kind: ModuleKind,
    instance: *mut (),
}

// SAFETY: instances are `Send`, and this one has no other user.
unsafe impl Send for OwnedInstance {}

impl OwnedInstance {
    /// Ends the instance.
    ///
    /// # Errors
    /// An error at its end; it has ended all the same.
    fn end(&mut self) -> Result<(), Refusal> {
        let instance = std::mem::replace(&mut self.instance, std::ptr::null_mut());
        if instance.is_null() {
            return Ok(());
        }
        // SAFETY: the kind made this instance, and it is unused.
        unsafe { self.kind.destroy(instance) }
    }
}

impl Drop for OwnedInstance {
    fn drop(&mut self) {
        // No logger is left to report it.
        let _ = self.end();
    }
}

/// Instance that is no longer used, with its code.
/// On drop it ends in a thread, with the timeout after which a module hangs.
pub struct Retired {
    owned: OwnedInstance,
    timeout: CallTimeout,
}

impl Retired {
    /// Returns an unused instance for its end; null if it has ended.
    pub fn new(kind: ModuleKind, instance: *mut (), timeout: CallTimeout) -> Self {
        Self { owned: OwnedInstance { kind, instance }, timeout }
    }

    /// Returns the code, and the instance, which lives as long as this.
    pub fn parts(&self) -> (&ModuleKind, *mut ()) {
        (&self.owned.kind, self.owned.instance)
    }

    /// Makes a step.
    ///
    /// # Safety
    /// The frame was filled for this instance.
    pub unsafe fn tick(&mut self, frame: *const Frame) -> i32 {
        // SAFETY: passed on to the caller.
        unsafe { (self.owned.kind.table().tick)(self.owned.instance, frame) }
    }

    /// Restores a saved state in the instance.
    ///
    /// # Errors
    /// A state that doesn't fit.
    pub fn restore(&self, state: &[u8]) -> Result<(), Refusal> {
        // SAFETY: the kind made this instance, and it has no other user.
        unsafe { self.owned.kind.restore(self.owned.instance, state) }
    }

    /// Saves the last state of the instance, and ends it.
    ///
    /// # Errors
    /// A state that can't be saved, or that the call does not return.
    pub fn save(mut self) -> Result<Vec<u8>, String> {
        let owned = self.take();
        if owned.instance.is_null() {
            return Err("it had failed".into());
        }
        let saved = self.timeout.wait("save", move || {
            // SAFETY: as above.
            let state = unsafe { owned.kind.save(owned.instance) };
            (state, owned)
        });
        let (state, owned) = saved.ok_or("its save has not returned")?;
        self.owned = owned;
        state.map_err(|refusal| refusal.0)
    }

    /// Restores a saved state, in a thread with the timeout of its end.
    /// The instance is null afterwards if the call has not returned.
    ///
    /// # Errors
    /// A state that doesn't fit, or that the call does not return.
    pub fn restored(mut self, state: Vec<u8>) -> (Self, Result<(), String>) {
        let owned = self.take();
        let restored = self.timeout.wait("restore", move || {
            // SAFETY: as above.
            let result = unsafe { owned.kind.restore(owned.instance, &state) };
            (result, owned)
        });
        let result = match restored {
            Some((result, owned)) => {
                self.owned = owned;
                result.map_err(|refusal| refusal.0)
            }
            None => Err("its restore has not returned".into()),
        };
        (self, result)
    }

    /// Takes the instance out.
    pub fn into_parts(mut self) -> (ModuleKind, *mut ()) {
        let instance = std::mem::replace(&mut self.owned.instance, std::ptr::null_mut());
        (self.owned.kind.clone(), instance)
    }

    /// Ends the instance here and now, however long it takes.
    pub fn end_without_timeout(mut self) {
        let ended = self.take().end();
        self.timeout.log_end(ended);
    }

    fn take(&mut self) -> OwnedInstance {
        let instance = std::mem::replace(&mut self.owned.instance, std::ptr::null_mut());
        OwnedInstance { kind: self.owned.kind.clone(), instance }
    }
}

impl Drop for Retired {
    fn drop(&mut self) {
        let mut owned = self.take();
        if !owned.instance.is_null() {
            let ended = self.timeout.wait("end", move || owned.end());
            self.timeout.log_end(ended.unwrap_or(Ok(())));
        }
    }
}
