//! Guest code that decides for the loop: the next stage, or the time.

use std::any::Any;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::Arc;

use slate_module::Level;

use super::{Core, LoopLog, Seat, SharedLoop, WatchedModule};
use crate::clock::monotonic;

/// Guest code, with the module to which it belongs.
pub(super) struct Guest<T: ?Sized> {
    /// Name in the log.
    pub name: &'static str,
    /// Module of the guest, if any; calls are then watched like its steps.
    pub seat: Option<Arc<Seat>>,
    pub code: Box<T>,
}

impl<T: ?Sized> Guest<T> {
    /// Returns true if its module is no longer among `watched`.
    pub fn is_removed(&self, watched: &[WatchedModule]) -> bool {
        let is_there =
            |seat| watched.iter().any(|watch| watch.stage.is_some() && Arc::ptr_eq(&watch.seat, seat));
        self.seat.as_ref().is_some_and(|seat| !is_there(seat))
    }

    /// Returns true while a given-up thread is in its code.
    pub fn is_late(&self) -> bool {
        self.seat.as_ref().is_some_and(|seat| seat.is_late())
    }

    /// Returns the guest to be kept until it has returned.
    pub fn into_late(self) -> LateGuest
    where
        Self: Send + 'static,
    {
        LateGuest { seat: self.seat.clone(), guest: Box::new(self) }
    }
}

/// Result of a call of a guest.
pub(super) enum GuestResult<R> {
    /// Answer.
    Answer(R),
    /// No guest, or none that answers now.
    Unavailable,
    /// Late guest: it did not return in time, and another thread has the loop.
    Lost,
}

/// Role of a guest: its slot in the core.
pub(super) trait Role {
    type Code: ?Sized;
    fn guest(core: &mut Core) -> &mut Option<Guest<Self::Code>>;

    /// Removes a guest that did not return; returns its name.
    fn remove_late(core: &mut Core) -> &'static str
    where
        Guest<Self::Code>: Send + 'static,
    {
        let Some(guest) = Self::guest(core).take() else { return "" };
        let name = guest.name;
        core.late_guests.push(guest.into_late());
        name
    }
}

/// Removes a guest that panicked or returned an invalid result.
pub(super) fn remove_guest<R: Role>(core: &mut Core, log: &LoopLog, reason: &str) {
    if let Some(guest) = R::guest(core).take() {
        log.write(Level::Error, &format!("{} {reason}; it was removed, and the default holds", guest.name));
    }
}

/// Guest that did not return.
/// Its thread is in it as long as its seat is late.
pub(super) struct LateGuest {
    seat: Option<Arc<Seat>>,
    #[allow(dead_code, reason = "it is kept, not used")]
    guest: Box<dyn Any + Send>,
}

impl LateGuest {
    /// Returns true once the guest has returned and can be dropped.
    pub fn has_returned(&self) -> bool {
        self.seat.as_ref().is_some_and(|seat| !seat.is_late())
    }
}

/// Removal of a guest that did not return, by the thread that takes the loop over.
/// Returns the guest's name.
pub(super) type GuestRemoval = fn(&mut Core) -> &'static str;

/// Calls a guest.
/// The caller holds the loop's token and no reference to the core, and does not access the loop after [`GuestResult::Lost`].
pub(super) fn call_guest<R: Role, A>(
    shared: &SharedLoop,
    call: impl FnOnce(&mut R::Code) -> A,
) -> GuestResult<A>
where
    Guest<R::Code>: Send + 'static,
{
    let (code, seat) = {
        // SAFETY: the caller holds the token; the reference ends before the call, which may lose it.
        let core = unsafe { shared.core() };
        let Some(guest) = R::guest(core) else { return GuestResult::Unavailable };
        let seat = guest.seat.as_ref().map(Arc::as_ptr);
        let code: *mut R::Code = &raw mut *guest.code;
        core.position.pending_removal = Some(R::remove_late as GuestRemoval);
        (code, seat)
    };
    // SAFETY: the guest owns a share of the seat, and is not dropped while it is asked, also not when it is put away.
    let seat = seat.map(|seat| unsafe { &*seat });
    if let Some(seat) = seat {
        if !seat.is_idle() && !seat.reclaim() {
            // SAFETY: as above; no call was made.
            unsafe { shared.core() }.position.pending_removal = None;
            return GuestResult::Unavailable;
        }
        seat.begin_call(false, monotonic());
    }
    // SAFETY: only the holder of the token uses the guest, and it is not dropped before the call returns.
    let answer = catch_unwind(AssertUnwindSafe(|| call(unsafe { &mut *code })));
    if seat.is_some_and(|seat| !seat.end(0)) {
        return GuestResult::Lost;
    }
    // SAFETY: the call was not given up, so this thread still holds the token.
    let core = unsafe { shared.core() };
    core.position.pending_removal = None;
    match answer {
        Ok(answer) => GuestResult::Answer(answer),
        Err(_) => {
            remove_guest::<R>(core, &shared.log(), "panicked");
            GuestResult::Unavailable
        }
    }
}
