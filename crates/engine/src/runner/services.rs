use slate_composition::own::PortName;
use slate_module::{Flags, ModuleKind};

use super::Slots;
use crate::digest::Digest;
use crate::service::{AspectPort, HostService, ProviderPort};

/// Services that a module uses and provides.
#[derive(Default)]
pub struct ModuleServices {
    /// Services of other modules.
    pub aspects: Vec<AspectPort>,
    /// Services for other modules.
    pub providers: Vec<ProviderPort>,
    /// Services of the host.
    pub host: Vec<Box<dyn HostService>>,
}

impl ModuleServices {
    /// Returns true if the module uses services of others or of the host.
    pub fn are_needed(&self) -> bool {
        !self.host.is_empty() || !self.aspects.is_empty()
    }

    /// Returns the first required service of another module that is not provided.
    pub fn missing(&mut self, slots: &mut Slots) -> Option<PortName> {
        let mut missing = None;
        for aspect in &mut self.aspects {
            match aspect.table() {
                Some(table) => slots[aspect.slot].data = table.cast_mut(),
                None => missing = missing.or(Some(aspect.name)),
            }
        }
        missing
    }

    /// Prepares a step.
    pub fn prepare(&mut self, slots: &Slots, now: u64) {
        for provider in &self.providers {
            slots[provider.slot].flags.set(if provider.is_provided() { Flags::SET } else { 0 });
        }
        self.host.iter_mut().for_each(|service| service.prepare(now));
    }

    /// Commits a successful step.
    pub fn commit(&mut self, now: u64, mut digest: Option<&mut Digest>) {
        for service in &mut self.host {
            service.commit(now, digest.as_deref_mut());
        }
    }

    /// Abandons a failed step: its requests are dropped.
    pub fn abandon(&mut self) {
        self.host.iter_mut().for_each(|service| service.abandon());
    }

    /// Releases the module's claims on the robot while it is off or late.
    pub fn release(&self, now: u64) {
        self.host.iter().for_each(|service| service.release(now));
    }

    /// Begins with the code of the module, or continues with other code.
    pub fn begin(&mut self, kind: &ModuleKind) {
        self.host.iter_mut().for_each(|service| service.begin(kind));
    }

    /// Ends the module's instance.
    pub fn end(&mut self) {
        self.host.iter_mut().for_each(|service| service.end());
    }

    /// Ends the services that it provides; `kind` comes next.
    pub fn withdraw(&mut self, kind: &ModuleKind) {
        self.providers.iter_mut().for_each(|provider| provider.withdraw(kind));
    }

    /// Withholds its provided services while it is late, or restores them.
    pub fn suspend(&self, is_suspended: bool) {
        self.providers.iter().for_each(|provider| provider.suspend(is_suspended));
    }
}
