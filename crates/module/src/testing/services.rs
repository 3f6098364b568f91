//! Services in a fixture.

use std::rc::Rc;

use super::Fixture;
use crate::aspect::{ProviderTable, Service};
use crate::{Direction, Module};

/// Substitute of the host behind a provider's port.
pub(super) struct Provision {
    table: ProviderTable,
    provided: Option<Rc<Provided>>,
}

/// Provided service with its owner.
pub(super) struct Provided {
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
        (*context.cast::<Provision>()).provided.replace(Rc::new(Provided { table: words, owner, end }))
    };
    drop(old);
}

unsafe extern "C" fn withdraw(context: *mut ()) {
    // SAFETY: as for `provide`.
    drop(unsafe { (*context.cast::<Provision>()).provided.take() });
}

impl<M: Module> Fixture<M> {
    /// Provides a service that the module needs, from its next tick on.
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
        memory.provided = None;
    }

    /// Provides the service of another fixture's module, from the next tick on.
    /// It stays valid here also when that module withdraws it.
    ///
    /// # Panics
    /// When a module has no such port, it is one of another service, or nothing is provided there.
    pub fn provide_from<S: Service>(&mut self, port: &str, provider: &Fixture<impl Module>, offered: &str) {
        let index = self.service::<S>(port, Direction::Aspect, "needs");
        let Some(provided) = provider.provided_at::<S>(offered) else { absent(offered, S::DESCRIPTOR.name) };
        let memory = &mut self.memory[index];
        memory.words.clone_from(&provided.table);
        memory.is_provided = true;
        memory.provided = Some(Rc::clone(provided));
    }

    /// Returns the service that the module provides at a port.
    /// `None` before it provides one, or after it has withdrawn it.
    ///
    /// # Panics
    /// When the module has no such port, or it provides another service.
    pub fn provided<S: Service>(&self, port: &str) -> Option<&S> {
        // SAFETY: the port has provided a service of this type, which its owner keeps until a later tick.
        self.provided_at::<S>(port).map(|provided| unsafe { &*provided.table.as_ptr().cast::<S>() })
    }

    fn provided_at<S: Service>(&self, port: &str) -> Option<&Rc<Provided>> {
        let memory = &self.memory[self.service::<S>(port, Direction::Provider, "provides")];
        memory.provider.as_ref()?.provided.as_ref()
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
fn absent(port: &str, service: &str) -> ! {
    panic!("port `{port}` provides no {service}: tick its fixture until it does")
}

#[allow(clippy::panic, reason = "a test's error ends the test")]
fn not_provided(port: &str, service: &str) -> ! {
    panic!("port `{port}` needs {service}: call `fixture.provide(\"{port}\", ...)` before the tick")
}
