//! The properties of a module, before it runs.

use std::sync::Arc;

use slate_blackboard::channel::Budget;
use slate_blackboard::interface::Descriptor;
use slate_blackboard::message::Mailbox;
use slate_blackboard::{Access, Property, Store};
use slate_module::{Direction, PortDescription};

use super::{Builder, Failed, SPARE_READERS};
use crate::agent::parameters::enabled_descriptor;
use crate::agent::survey::{Target, Wire};
use crate::aspects::followed;

impl Builder<'_, '_> {
    pub(super) fn properties(&mut self, m: usize) -> Result<(), Failed> {
        let ports = self.surveyed(m).description.ports.clone();
        for (p, port) in ports.iter().enumerate() {
            let path = format!("{}/{}", self.name(m), port.name);
            match port.direction {
                Direction::Output | Direction::Debug | Direction::Command => {
                    self.output_property(m, Target::Port(m, p), &path, port)?;
                }
                Direction::Inbox => self.mailbox(m, &path, port)?,
                Direction::Input | Direction::Queue => match self.joint(m, Wire::Port(p)) {
                    Some(joint) => {
                        let target = joint.target;
                        self.alias(m, &path, target)?;
                        if let Target::Absent(absent) = target {
                            let path = self.survey.absent[absent].path.clone();
                            self.output_property(m, target, &path, port)?;
                        }
                    }
                    None => {
                        let value = self.surveyed(m).inputs.get(&p).cloned();
                        self.setting(m, &path, port, value.as_deref())?;
                    }
                },
                Direction::Aspect | Direction::Provider => {}
                Direction::Outbox => {
                    if let Some(Target::Absent(absent)) =
                        self.joint(m, Wire::Port(p)).map(|joint| joint.target)
                    {
                        let path = self.survey.absent[absent].path.clone();
                        self.mailbox(m, &path, port)?;
                    }
                }
            }
        }
        self.implied(m)
    }

    /// The property that an output writes. Who reads it may have come first.
    fn output_property(
        &mut self,
        m: usize,
        target: Target,
        path: &str,
        port: &PortDescription,
    ) -> Result<(), Failed> {
        if self.standing(m, path, port.descriptor)?.is_some() {
            return Ok(());
        }
        let (depth, budget) = self.demand(target, path);
        let store = followed(port.descriptor, Store { capacity: port.capacity, depth, budget });
        let memory = self.memory(m, target);
        let board = &self.ground.board;
        let added = board.add_channel_in(path, &port.doc, port.descriptor, store, Access::Output, memory);
        self.added(m, added).map(drop)
    }

    fn mailbox(&mut self, m: usize, path: &str, port: &PortDescription) -> Result<(), Failed> {
        if self.standing(m, path, port.descriptor)?.is_some() {
            return Ok(());
        }
        let senders = self.links_to(path).count() as u16 + SPARE_READERS;
        let mailbox = Mailbox::new(port.descriptor.shape(0), senders, port.window as u16 * 2);
        let added = self.ground.board.add_mailbox(path, &port.doc, port.descriptor, mailbox);
        self.added(m, added).map(drop)
    }

    fn alias(&mut self, m: usize, path: &str, target: Target) -> Result<(), Failed> {
        let target = self.target_path(target);
        let added = self.ground.board.add_alias(path, &target);
        self.added(m, added)
    }

    /// Parameters and `enabled`.
    fn implied(&mut self, m: usize) -> Result<(), Failed> {
        let name = self.name(m);
        let (descriptor, params) = (self.surveyed(m).description.params, self.surveyed(m).params.clone());
        let path = format!("{name}/params");
        let property = self.host_property(m, &path, "Parameters of the module.", descriptor)?;
        self.set_first(&property, Some(&params));
        let path = format!("{name}/enabled");
        if let Some(target) = self.joint(m, Wire::Enabled).map(|joint| joint.target) {
            if let Target::Absent(absent) = target {
                let path = self.survey.absent[absent].path.clone();
                if self.standing(m, &path, enabled_descriptor())?.is_none() {
                    let (depth, budget) = self.demand(target, &path);
                    let store = Store { capacity: 0, depth, budget };
                    let (doc, descriptor) = ("Whether a module runs.", enabled_descriptor());
                    let added = self.ground.board.add_channel(&path, doc, descriptor, store, Access::Output);
                    self.added(m, added)?;
                }
            }
            return self.alias(m, &path, target);
        }
        let property = self.host_property(m, &path, "Whether the module runs.", enabled_descriptor())?;
        self.set_first(&property, Some(&[self.surveyed(m).module.enabled.value.into()]));
        Ok(())
    }

    /// A property that the host sets.
    fn host_property(
        &mut self,
        m: usize,
        path: &str,
        doc: &str,
        descriptor: &'static Descriptor,
    ) -> Result<Arc<Property>, Failed> {
        let budget = Budget { latest: 1 + SPARE_READERS, queues: 1, window: 1 };
        let store = Store { capacity: 0, depth: 1, budget };
        let added = self.ground.board.add_channel(path, doc, descriptor, store, Access::Setting);
        self.added(m, added)
    }

    fn setting(
        &mut self,
        m: usize,
        path: &str,
        port: &PortDescription,
        value: Option<&[u8]>,
    ) -> Result<(), Failed> {
        let budget = Budget { latest: 1 + SPARE_READERS, queues: 1, window: port.window as u16 };
        let depth = if port.direction == Direction::Queue { port.window * 2 } else { 1 };
        let store = Store { capacity: port.capacity, depth, budget };
        let memory = self.setting_memory(m);
        let board = &self.ground.board;
        let added = board.add_channel_in(path, &port.doc, port.descriptor, store, Access::Setting, memory);
        let property = self.added(m, added)?;
        self.set_first(&property, value);
        Ok(())
    }

    /// The first value of a setting: what it was when its module was here last and is wanted back, else that of the
    /// configuration.
    fn set_first(&self, property: &Property, value: Option<&[u8]>) {
        let kept = self.ground.kept.get(property.path());
        let kept = kept.filter(|kept| kept.schema == property.descriptor().hash);
        let first = kept.map(|kept| (kept.bytes.as_slice(), kept.time)).or(value.map(|bytes| (bytes, 0)));
        if let Some((bytes, time)) = first {
            // A setting has a writer of the host, and nobody holds it up.
            let _ = property.set_bytes(bytes, time);
        }
    }
}
