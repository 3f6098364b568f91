//! The properties of all modules, before any of them runs.

use std::sync::Arc;

use slate_blackboard::channel::Budget;
use slate_blackboard::message::Mailbox;
use slate_blackboard::{Access, Property, Store};
use slate_module::{Direction, PortDescription};

use super::{Builder, Failed, PortProperties, SPARE_READERS};
use crate::agent::parameters::enabled_descriptor;
use crate::agent::survey::{Surveyed, Target, Wire};

impl<'a> Builder<'a, '_> {
    pub(super) fn properties(&mut self) -> Result<PortProperties, Failed> {
        let mut result = Vec::new();
        for (m, surveyed) in self.survey.modules.iter().enumerate() {
            let mut ports = Vec::new();
            for (p, port) in surveyed.description.ports.iter().enumerate() {
                let path = format!("{}/{}", surveyed.module.name.value, port.name);
                let property = match port.direction {
                    Direction::Output | Direction::Debug | Direction::Command => {
                        let (depth, budget) = self.demand(Target::Port(m, p));
                        let added = self.board.add_channel(
                            &path,
                            &port.doc,
                            port.descriptor,
                            Store { capacity: port.capacity, depth, budget },
                            Access::Output,
                        );
                        Some(self.added(m, added)?)
                    }
                    Direction::Inbox => {
                        let senders = self.readers(Target::Port(m, p)).count() as u16 + SPARE_READERS;
                        let mailbox = Mailbox::new(port.descriptor.shape(0), senders, port.window as u16 * 2);
                        let added = self.board.add_mailbox(&path, &port.doc, port.descriptor, mailbox);
                        Some(self.added(m, added)?)
                    }
                    Direction::Input | Direction::Queue => match self.joint(m, Wire::Port(p)) {
                        Some(joint) => {
                            let target = self.target_path(joint.target);
                            let added = self.board.add_alias(&path, &target);
                            self.added(m, added)?;
                            None
                        }
                        None => Some(self.setting(m, &path, &port.doc, port, surveyed.inputs.get(&p))?),
                    },
                    Direction::Outbox => None,
                };
                ports.push(property);
            }
            self.implied(m, surveyed)?;
            result.push(ports);
        }
        Ok(result)
    }

    /// Parameters and `enabled`.
    fn implied(&mut self, m: usize, surveyed: &Surveyed<'a>) -> Result<(), Failed> {
        let name = &surveyed.module.name.value;
        let budget = Budget { latest: 1 + SPARE_READERS, queues: 1, window: 1 };
        let params = surveyed.description.params;
        let added = self.board.add_channel(
            &format!("{name}/params"),
            "Parameters of the module.",
            params,
            Store { capacity: 0, depth: 1, budget },
            Access::Setting,
        );
        let property = self.added(m, added)?;
        set_bytes(&property, &surveyed.params);
        let path = format!("{name}/enabled");
        if let Some(joint) = self.joint(m, Wire::Enabled) {
            let target = self.target_path(joint.target);
            let added = self.board.add_alias(&path, &target);
            return self.added(m, added);
        }
        let added = self.board.add_channel(
            &path,
            "Whether the module runs.",
            enabled_descriptor(),
            Store { capacity: 0, depth: 1, budget },
            Access::Setting,
        );
        let property = self.added(m, added)?;
        set_bytes(&property, &[surveyed.module.enabled.value.into()]);
        Ok(())
    }

    fn setting(
        &mut self,
        m: usize,
        path: &str,
        doc: &str,
        port: &PortDescription,
        value: Option<&Vec<u8>>,
    ) -> Result<Arc<Property>, Failed> {
        let budget = Budget { latest: 1 + SPARE_READERS, queues: 1, window: port.window as u16 };
        let depth = if port.direction == Direction::Queue { port.window * 2 } else { 1 };
        let added = self.board.add_channel(
            path,
            doc,
            port.descriptor,
            Store { capacity: port.capacity, depth, budget },
            Access::Setting,
        );
        let property = self.added(m, added)?;
        if let Some(bytes) = value {
            set_bytes(&property, bytes);
        }
        Ok(property)
    }
}

/// The first value of a setting.
fn set_bytes(property: &Property, bytes: &[u8]) {
    // A setting has a writer of the host, and nobody holds it up.
    let _ = property.set_bytes(bytes, 0);
}
