//! Services that modules use: those of the host, and those that modules provide.

use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use slate_blackboard::wake::Wake;
use slate_module::ModuleKind;
use slate_module::aspect::ProviderTable;

use crate::aligned_memory::AlignedMemory;
use crate::digest::Digest;
use slate_composition::own::PortName;

/// Service of the host for one module: a table of calls over an object of its own.
pub trait HostService: Send {
    /// Returns the table, whose address is constant as long as the service lives.
    fn table(&self) -> *const u8;

    /// Begins with the code of the module, or continues with other code.
    fn begin(&mut self, _: &ModuleKind) {}

    /// Prepares a tick.
    fn prepare(&mut self, _: u64) {}

    /// Commits a successful tick: its requests take effect now.
    fn commit(&mut self, _: u64, _: Option<&mut Digest>) {}

    /// Abandons a failed tick: its requests are dropped.
    fn abandon(&mut self) {}

    /// Releases the module's claims on the robot while it is off or late.
    /// Its tick may hang in a call of the service meanwhile.
    fn release(&self, _: u64) {}

    /// Ends the module's instance; after a panic another one follows.
    fn end(&mut self) {}
}

/// Slot of a service; empty while it is not provided.
#[derive(Debug, Default)]
pub struct ServiceSlot {
    /// Number of changes, so that a tick detects with one load that there was none.
    version: AtomicU64,
    current: Mutex<ServiceState>,
    /// Wakes the threads of those that need it.
    wakes: Mutex<Vec<Arc<Wake>>>,
}

#[derive(Debug, Default)]
struct ServiceState {
    service: Option<Arc<ProvidedService>>,
    /// True while the service is withheld.
    is_suspended: bool,
}

/// Provided service.
#[derive(Debug)]
struct ProvidedService {
    table: AlignedMemory,
    owner: *mut (),
    end: unsafe extern "C" fn(*mut ()),
    /// Kind of the provider, which keeps the code of the calls loaded.
    #[allow(dead_code, reason = "it is kept, not used")]
    kind: ModuleKind,
}

// SAFETY: the owner is `Send`, as the provider's port demands; the table may be used from any thread, as its service
// promises.
unsafe impl Send for ProvidedService {}
// SAFETY: as above.
unsafe impl Sync for ProvidedService {}

impl Drop for ProvidedService {
    fn drop(&mut self) {
        // SAFETY: the call belongs to this owner and is made once, while the library is kept.
        unsafe { (self.end)(self.owner) }
    }
}

impl ServiceSlot {
    fn set(&self, service: Option<Arc<ProvidedService>>) {
        // The code of another library may run when the old one is dropped, which must not happen under the lock.
        drop(self.change(|current| std::mem::replace(&mut current.service, service)));
    }

    /// Withholds the service from its users, or restores it.
    /// A user in a tick keeps it until the next one. No code of the provider runs here.
    pub fn suspend(&self, is_suspended: bool) {
        self.change(|current| current.is_suspended = is_suspended);
    }

    fn change<R>(&self, change: impl FnOnce(&mut ServiceState) -> R) -> R {
        let mut current = self.current();
        let result = change(&mut current);
        self.version.fetch_add(1, Ordering::Release);
        drop(current);
        self.wakes().iter().for_each(|wake| wake.notify(1));
        result
    }

    fn current(&self) -> MutexGuard<'_, ServiceState> {
        self.current.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn wakes(&self) -> MutexGuard<'_, Vec<Arc<Wake>>> {
        self.wakes.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Ends the service; a user in a tick keeps it until the next one.
    pub fn withdraw(&self) {
        if self.is_provided() {
            self.set(None);
        }
    }

    fn is_provided(&self) -> bool {
        self.current().service.is_some()
    }
}

/// Port through which a module uses a service of another one.
pub struct AspectPort {
    /// Slot in the frame.
    pub slot: usize,
    /// Name.
    pub name: PortName,
    service_slot: Arc<ServiceSlot>,
    last_version: u64,
    in_use: Option<Arc<ProvidedService>>,
}

impl AspectPort {
    /// Returns a port that uses the service in this slot; changes wake its thread.
    pub fn new(slot: usize, name: &str, service_slot: Arc<ServiceSlot>, wake: &Arc<Wake>) -> Self {
        let mut wakes = service_slot.wakes();
        if !wakes.iter().any(|other| Arc::ptr_eq(other, wake)) {
            wakes.push(Arc::clone(wake));
        }
        drop(wakes);
        Self { slot, name: PortName::new(name), service_slot, last_version: 0, in_use: None }
    }

    /// Returns the table of the service, while it is provided.
    pub fn table(&mut self) -> Option<*const u8> {
        let version = self.service_slot.version.load(Ordering::Acquire);
        if version != self.last_version {
            // A change in progress is seen before the next tick.
            if let Ok(current) = self.service_slot.current.try_lock() {
                let service = if current.is_suspended { &None } else { &current.service };
                self.in_use.clone_from(service);
                self.last_version = version;
            }
        }
        self.in_use.as_ref().map(|in_use| in_use.table.as_ptr())
    }
}

/// Port through which a module provides a service.
pub struct ProviderPort {
    /// Slot in the frame.
    pub slot: usize,
    state: Box<ProviderState>,
}

struct ProviderState {
    table: ProviderTable,
    service_slot: Arc<ServiceSlot>,
    kind: ModuleKind,
}

impl ProviderPort {
    /// Returns a port through which the module provides the service in `service_slot`.
    pub fn new(slot: usize, service_slot: Arc<ServiceSlot>, kind: ModuleKind) -> Self {
        // A service of a module that never returned is not called any more; its code may run in it forever.
        std::mem::forget(service_slot.change(std::mem::take).service);
        let table = ProviderTable { context: std::ptr::null_mut(), provide, withdraw };
        let mut state = Box::new(ProviderState { table, service_slot, kind });
        state.table.context = (&raw mut *state).cast();
        Self { slot, state }
    }

    /// Returns the table to which the module's port points.
    pub fn table(&self) -> *const ProviderTable {
        &raw const self.state.table
    }

    /// Returns true while the service is provided.
    pub fn is_provided(&self) -> bool {
        self.state.service_slot.is_provided()
    }

    /// Withholds the service from its users while the module is late, or restores it.
    pub fn suspend(&self, is_suspended: bool) {
        self.state.service_slot.suspend(is_suspended);
    }

    /// Ends the service of an instance that has ended; `kind` comes next.
    pub fn withdraw(&mut self, kind: &ModuleKind) {
        self.state.service_slot.withdraw();
        self.state.kind = kind.clone();
    }
}

impl Drop for ProviderPort {
    fn drop(&mut self) {
        self.state.service_slot.withdraw();
    }
}

unsafe extern "C" fn provide(
    context: *mut (),
    table: *const u8,
    size: usize,
    owner: *mut (),
    end: unsafe extern "C" fn(*mut ()),
) {
    // SAFETY: the context is the `ProviderState` of the port, which lives as long as the module's runner.
    let state = unsafe { &*context.cast::<ProviderState>() };
    let mut memory = AlignedMemory::zeroed(size);
    // SAFETY: the module passes a table of that size.
    unsafe { memory.as_mut_ptr().copy_from_nonoverlapping(table, size) };
    state.service_slot.set(Some(Arc::new(ProvidedService {
        table: memory,
        owner,
        end,
        kind: state.kind.clone(),
    })));
}

unsafe extern "C" fn withdraw(context: *mut ()) {
    // SAFETY: as for `provide`.
    unsafe { &*context.cast::<ProviderState>() }.service_slot.withdraw();
}
