//! Callback code that decides for the loop: the next stage, or the time.

use std::any::Any;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::Arc;

use slate_module::Level;

use super::{Core, LoopLog, RunnerCell, SharedLoop, WatchedModule};
use crate::clock::monotonic;

/// Callback code, with the module to which it belongs.
pub(super) struct Callback<T: ?Sized> {
    /// Name in the log.
    pub name: &'static str,
    /// Module of the callback, if any; calls are then watched like its steps.
    pub cell: Option<Arc<RunnerCell>>,
    pub code: Box<T>,
}

impl<T: ?Sized> Callback<T> {
    /// Returns true if its module is no longer among `watched`.
    pub fn is_removed(&self, watched: &[WatchedModule]) -> bool {
        let is_there =
            |cell| watched.iter().any(|watch| watch.stage.is_some() && Arc::ptr_eq(&watch.cell, cell));
        self.cell.as_ref().is_some_and(|cell| !is_there(cell))
    }

    /// Returns true while a given-up thread is in its code.
    pub fn is_late(&self) -> bool {
        self.cell.as_ref().is_some_and(|cell| cell.is_late())
    }

    /// Returns the callback to be kept until it has returned.
    pub fn into_late(self) -> LateCallback
    where
        Self: Send + 'static,
    {
        LateCallback { cell: self.cell.clone(), callback: Box::new(self) }
    }
}

/// Result of a call of a callback.
pub(super) enum CallbackResult<R> {
    /// Answer.
    Answer(R),
    /// No callback, or none that answers now.
    Unavailable,
    /// Late callback: it did not return in time, and another thread has the loop.
    Lost,
}

/// Role of a callback: its slot in the core.
pub(super) trait Role {
    type Code: ?Sized;
    fn callback(core: &mut Core) -> &mut Option<Callback<Self::Code>>;

    /// Removes a callback that did not return; returns its name.
    fn remove_late(core: &mut Core) -> &'static str
    where
        Callback<Self::Code>: Send + 'static,
    {
        let Some(callback) = Self::callback(core).take() else { return "" };
        let name = callback.name;
        core.late_callbacks.push(callback.into_late());
        name
    }
}

/// Removes a callback that panicked or returned an invalid result.
pub(super) fn remove_callback<R: Role>(core: &mut Core, log: &LoopLog, reason: &str) {
    if let Some(callback) = R::callback(core).take() {
        log.write(
            Level::Error,
            &format!("{} {reason}; it was removed, and the default holds", callback.name),
        );
    }
}

/// Callback that did not return.
/// Its thread is in it as long as its cell is late.
pub(super) struct LateCallback {
    cell: Option<Arc<RunnerCell>>,
    #[allow(dead_code, reason = "it is kept, not used")]
    callback: Box<dyn Any + Send>,
}

impl LateCallback {
    /// Returns true once the callback has returned and can be dropped.
    pub fn has_returned(&self) -> bool {
        self.cell.as_ref().is_some_and(|cell| !cell.is_late())
    }
}

/// Removal of a late callback, by the thread that takes the loop over.
/// Returns the callback's name.
pub(super) type CallbackRemoval = fn(&mut Core) -> &'static str;

/// Calls a callback.
/// The caller holds the loop's token and no reference to the core, and does not access the loop after [`CallbackResult::Lost`].
pub(super) fn invoke_callback<R: Role, A>(
    shared: &SharedLoop,
    call: impl FnOnce(&mut R::Code) -> A,
) -> CallbackResult<A>
where
    Callback<R::Code>: Send + 'static,
{
    let (code, cell) = {
        // SAFETY: the caller holds the token; the reference ends before the call, which may lose it.
        let core = unsafe { shared.core() };
        let Some(callback) = R::callback(core) else { return CallbackResult::Unavailable };
        let cell = callback.cell.as_ref().map(Arc::as_ptr);
        let code: *mut R::Code = &raw mut *callback.code;
        core.position.pending_removal = Some(R::remove_late as CallbackRemoval);
        (code, cell)
    };
    // SAFETY: the callback owns a share of the cell, and is not dropped during the call, also not when it is put away.
    let cell = cell.map(|cell| unsafe { &*cell });
    if let Some(cell) = cell {
        if !cell.is_idle() && !cell.reclaim() {
            // SAFETY: as above; no call was made.
            unsafe { shared.core() }.position.pending_removal = None;
            return CallbackResult::Unavailable;
        }
        cell.begin_call(false, monotonic());
    }
    // SAFETY: only the holder of the token uses the callback, and it is not dropped before the call returns.
    let answer = catch_unwind(AssertUnwindSafe(|| call(unsafe { &mut *code })));
    if cell.is_some_and(|cell| !cell.end(0)) {
        return CallbackResult::Lost;
    }
    // SAFETY: the call was not given up, so this thread still holds the token.
    let core = unsafe { shared.core() };
    core.position.pending_removal = None;
    match answer {
        Ok(answer) => CallbackResult::Answer(answer),
        Err(_) => {
            remove_callback::<R>(core, &shared.log(), "panicked");
            CallbackResult::Unavailable
        }
    }
}
