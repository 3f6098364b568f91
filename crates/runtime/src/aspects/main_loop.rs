//! The aspect [`MainLoop`]: a module's policy in the place where the loop asks.

use std::sync::{Arc, Mutex, PoisonError, TryLockError};

use slate_module::ModuleKind;
use slate_module::aspect::{LoopPlace, MainLoop, PolicyTable};
use slate_module::table::Bytes;

use super::{HostService, Means};
use crate::main_loop::{LoopPolicy, Place};

/// Where the loop finds the policy of a module; empty while no module has the loop.
#[derive(Debug, Default)]
pub(crate) struct PolicyPlace(Mutex<Option<Taken>>);

#[derive(Debug)]
struct Taken {
    table: PolicyTable,
    module: Arc<str>,
}

// SAFETY: a policy is `Send`, as the module's side demands, and called under the lock alone.
unsafe impl Send for Taken {}

impl Drop for Taken {
    fn drop(&mut self) {
        // SAFETY: the policy ends once, and its module ends it before its code goes.
        unsafe { (self.table.end)(self.table.owner) }
    }
}

impl PolicyPlace {
    fn set(&self, taken: Option<Taken>) {
        let mut place = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        let old = std::mem::replace(&mut *place, taken);
        drop(place);
        // The module's code runs here, which must not happen under the lock.
        drop(old);
    }

    fn is_of(&self, module: &str) -> bool {
        let place = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        place.as_ref().is_some_and(|taken| *taken.module == *module)
    }

    fn give_back(&self, module: &str) {
        if self.is_of(module) {
            self.set(None);
        }
    }
}

/// What the loop asks: the policy of the place, if there is one, and else the order of the stages.
#[derive(Debug)]
pub(crate) struct PlacePolicy {
    place: Arc<PolicyPlace>,
    /// The names of the stages, as a module sees them.
    names: Vec<Bytes>,
}

// SAFETY: the names point to the loop's own, and are only looked at during a call that lends those.
unsafe impl Send for PlacePolicy {}

impl PlacePolicy {
    pub fn new(place: Arc<PolicyPlace>) -> Self {
        Self { place, names: Vec::new() }
    }
}

impl LoopPolicy for PlacePolicy {
    fn next(&mut self, place: &Place<'_>) -> Option<usize> {
        let in_order = place.after.map_or(0, |after| after + 1);
        let in_order = (in_order < place.stages.len()).then_some(in_order);
        let mut taken = match self.place.0.try_lock() {
            Ok(taken) => taken,
            Err(TryLockError::Poisoned(error)) => error.into_inner(),
            // It is just taken or given back.
            Err(TryLockError::WouldBlock) => return in_order,
        };
        let Some(policy) = &*taken else { return in_order };
        self.names.clear();
        self.names.extend(place.stages.iter().map(|name| Bytes::of(name)));
        let seen = LoopPlace {
            stages: self.names.as_ptr(),
            stage_count: self.names.len(),
            after: place.after.and_then(|after| i32::try_from(after).ok()).unwrap_or(-1),
            reserved: 0,
            now: place.now,
            cycle: place.cycle,
        };
        // SAFETY: the policy is there as long as the lock is held, and the place lives during the call.
        let next = unsafe { (policy.table.next)(policy.table.owner, &raw const seen) };
        if next == PANICKED {
            *taken = None;
            return in_order;
        }
        usize::try_from(next).ok()
    }
}

/// What a policy returns after a panic.
const PANICKED: i32 = -2;

struct Service {
    table: MainLoop,
    place: Arc<PolicyPlace>,
    module: Arc<str>,
    /// What this tick asks for: the loop with a policy, or no longer.
    asked: Option<Option<Taken>>,
}

// SAFETY: the table's context is the service itself, which is used by whoever runs the module alone.
unsafe impl Send for Service {}

pub(super) fn make(means: &Means, module: &Arc<str>) -> Box<dyn HostService> {
    let mut service = Box::new(Service {
        table: MainLoop { context: std::ptr::null_mut(), take, give_back, has },
        place: Arc::clone(&means.policy),
        module: Arc::clone(module),
        asked: None,
    });
    service.table.context = (&raw mut *service).cast();
    service
}

impl HostService for Service {
    fn table(&self) -> *const u8 {
        (&raw const self.table).cast()
    }

    fn commit(&mut self, _: u64, _: Option<&mut crate::digest::Digest>) {
        match self.asked.take() {
            Some(Some(taken)) => self.place.set(Some(taken)),
            Some(None) => self.place.give_back(&self.module),
            None => {}
        }
    }

    fn abandon(&mut self) {
        self.asked = None;
        self.place.give_back(&self.module);
    }

    fn begin(&mut self, _: &ModuleKind) {
        self.abandon();
    }

    fn end(&mut self) {
        self.abandon();
    }
}

impl Drop for Service {
    fn drop(&mut self) {
        self.abandon();
    }
}

unsafe extern "C" fn take(context: *mut (), table: PolicyTable) {
    // SAFETY: the context is the service, which the module's tick uses alone.
    let service = unsafe { &mut *context.cast::<Service>() };
    service.asked = Some(Some(Taken { table, module: Arc::clone(&service.module) }));
}

unsafe extern "C" fn give_back(context: *mut ()) {
    // SAFETY: as for `take`.
    unsafe { &mut *context.cast::<Service>() }.asked = Some(None);
}

unsafe extern "C" fn has(context: *mut ()) -> i32 {
    // SAFETY: as for `take`.
    let service = unsafe { &*context.cast::<Service>() };
    service.place.is_of(&service.module).into()
}
