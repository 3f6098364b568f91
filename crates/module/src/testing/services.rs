//! Services in a fixture.

use super::Fixture;
use crate::aspect::{ProviderTable, Service};
use crate::{Direction, Module};

/// Substitute of the host behind a provider's port.
pub(super) struct Provision {
    table: ProviderTable,
    provided: Option<Provided>,
}

struct Provided {
    table: Vec<u128>,
    owner: *mut (),
    end: unsafe extern "C" fn(*mut ()),
}

impl Drop for Provided {
    fn drop(&mut self) {
        // SAFETY: the call belongs to this owner and is made once.
        unsafe { (self.end)(self.owner) }
    }
}

impl Provision {
    pub fn new() -> Box<Self> {
        let table = ProviderTable { context: std::ptr::null_mut(), provide, withdraw };
        Box::new(Self { table, provided: None })
    }

    /// Returns the table to which the port points.
    pub fn table(&mut self) -> *mut u8 {
        self.table.context = std::ptr::from_mut(self).cast();
        // The calls change what lies beside the table, so the pointer must be one to all of it.
        self.table.context.cast::<u8>().wrapping_add(std::mem::offset_of!(Self, table))
    }

    pub fn is_provided(&self) -> bool {
        self.provided.is_some()
    }
}

unsafe extern "C" fn provide(
    context: *mut (),
    table: *const u8,
    size: usize,
    owner: *mut (),
    end: unsafe extern "C" fn(*mut ()),
) {
    let mut words = vec![0_u128; size.div_ceil(16).max(1)];
    // SAFETY: the module passes a table of that size; the context is a provision, which waits for its tick.
    let old = unsafe {
        words.as_mut_ptr().cast::<u8>().copy_from_nonoverlapping(table, size);
        (*context.cast::<Provision>()).provided.replace(Provided { table: words, owner, end })
    };
    drop(old);
}

unsafe extern "C" fn withdraw(context: *mut ()) {
    // SAFETY: as for `provide`.
    drop(unsafe { (*context.cast::<Provision>()).provided.take() });
}

impl<M: Module> Fixture<M> {
    /// Provides a service that the module needs, from its next tick on.
    /// The data of the service's context must live as long as the fixture uses it.
    ///
    /// # Panics
    /// When the module has no such port, or it needs another service.
    pub fn provide<S: Service>(&mut self, port: &str, service: S) {
        let index = self.service::<S>(port, Direction::Aspect, "needs");
        let memory = &mut self.memory[index];
        memory.words = vec![0; size_of::<S>().div_ceil(16).max(1)];
        // SAFETY: the memory has room for it.
        unsafe { memory.words.as_mut_ptr().cast::<S>().write(service) };
        memory.is_provided = true;
    }

    /// Returns the service that the module provides at a port.
    /// `None` before it provides one, or after it has withdrawn it. The service must not be used after that, nor after
    /// the fixture.
    ///
    /// # Panics
    /// When the module has no such port, or it provides another service.
    pub fn provided<S: Service>(&self, port: &str) -> Option<S> {
        let memory = &self.memory[self.service::<S>(port, Direction::Provider, "provides")];
        let provided = memory.provider.as_ref()?.provided.as_ref()?;
        // SAFETY: the port has provided a service of this type.
        Some(unsafe { provided.table.as_ptr().cast::<S>().read() })
    }

    fn service<S: Service>(&self, port: &str, direction: Direction, verb: &str) -> usize {
        let index = self.index(port);
        let found = &self.description.ports[index];
        assert_eq!(found.direction, direction, "port `{port}` is no {direction:?}");
        assert_eq!(
            S::DESCRIPTOR.hash,
            found.descriptor.hash,
            "port `{port}` {verb} {}, not {}",
            found.descriptor.name,
            S::DESCRIPTOR.name
        );
        index
    }

    /// Checks that every service that the module needs is provided.
    /// An agent would not let it run otherwise.
    pub(super) fn check_services(&self) {
        let mut ports = self.description.ports.iter().zip(&self.memory);
        let missing = ports.find(|(port, memory)| port.direction == Direction::Aspect && !memory.is_provided);
        if let Some((port, _)) = missing {
            not_provided(&port.name, port.descriptor.name);
        }
    }
}

#[allow(clippy::panic, reason = "a test's error ends the test")]
fn not_provided(port: &str, service: &str) -> ! {
    panic!("port `{port}` needs {service}: call `fixture.provide(\"{port}\", ...)` before the tick")
}
