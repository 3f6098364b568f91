//! What the ports of a module read and send to.

use std::fmt::Display;
use std::sync::Arc;

use slate_blackboard::channel::{Latest, Policy, QueueReader, Start};
use slate_blackboard::commit::CommitWord;
use slate_blackboard::{Carrier, Property};
use slate_module::{Direction, Trigger};

use super::Builder;
use crate::agent::survey::{Target, Wire};
use crate::runner::{Group, InputPort, OutboxWiring, QueueWiring, Wiring};

impl Builder<'_, '_> {
    /// The readers and senders of a module; ports that stay as they are go on with theirs.
    pub(super) fn wiring(&mut self, m: usize, stays: &dyn Fn(Wire) -> bool) -> Option<Wiring> {
        let mut wiring = Wiring::default();
        self.inputs(m, &mut wiring, stays)?;
        let survey = self.survey;
        for (p, port) in survey.modules[m].description.ports.iter().enumerate() {
            match port.direction {
                Direction::Queue => {
                    let reader = if stays(Wire::Port(p)) { None } else { Some(self.queue(m, p)?) };
                    let (triggers, window) = (self.triggers(m, p), port.window.max(16));
                    wiring.queues.push(QueueWiring { slot: p, triggers, reader, window });
                }
                Direction::Outbox if !stays(Wire::Port(p)) => wiring.outboxes.push(self.outbox_wiring(m, p)?),
                _ => {}
            }
        }
        if !stays(Wire::Enabled) {
            wiring.switch = Some((self.switch(m)?, self.joint(m, Wire::Enabled).is_some()));
        }
        Some(wiring)
    }

    /// Whether news at a port make the module run.
    pub(super) fn triggers(&self, m: usize, p: usize) -> bool {
        let surveyed = self.surveyed(m);
        match &surveyed.trigger {
            Trigger::On { ports, .. } => ports.contains(&surveyed.description.ports[p].name),
            Trigger::Stage | Trigger::Every(_) => false,
        }
    }

    /// A reader of what switches a module.
    pub(super) fn switch(&mut self, m: usize) -> Option<Latest> {
        let path = match self.joint(m, Wire::Enabled).map(|joint| joint.target) {
            Some(target) => self.target_path(target),
            None => format!("{}/enabled", self.name(m)),
        };
        let property = self.property(&path)?;
        let reader = property.channel()?.latest();
        self.granted(m, Wire::Enabled, &property, reader)
    }

    /// The property of a port of its own.
    pub(super) fn own_property(&self, m: usize, p: usize) -> Option<Arc<Property>> {
        self.property(&format!("{}/{}", self.name(m), self.port(m, p).name))
    }

    /// The property that an input reads, and the name of the module that writes it.
    fn source(&self, m: usize, p: usize) -> Option<(Arc<Property>, Option<String>)> {
        match self.joint(m, Wire::Port(p)).map(|joint| joint.target) {
            Some(Target::Port(module, port)) => {
                Some((self.own_property(module, port)?, Some(self.name(module).into())))
            }
            Some(Target::Absent(absent)) => {
                let absent = &self.survey.absent[absent];
                Some((self.property(&absent.path)?, Some(absent.module.clone())))
            }
            Some(target @ Target::Command(_)) => Some((self.property(&self.target_path(target))?, None)),
            None => Some((self.own_property(m, p)?, None)),
        }
    }

    fn inputs(&mut self, m: usize, wiring: &mut Wiring, stays: &dyn Fn(Wire) -> bool) -> Option<()> {
        let survey = self.survey;
        let ports = &survey.modules[m].description.ports;
        let mut sources = Vec::new();
        for (p, port) in ports.iter().enumerate().filter(|(_, port)| port.direction == Direction::Input) {
            let (property, writer) = self.source(m, p)?;
            sources.push((writer, p, port, property));
        }
        // Inputs of one writer stand together, so that they can be pinned in one go.
        sources.sort_by(|(a, p, ..), (b, q, ..)| (a, p).cmp(&(b, q)));
        let mut last: Option<String> = None;
        for (writer, p, port, property) in sources {
            let reader = if stays(Wire::Port(p)) {
                None
            } else {
                let reader = property.channel()?.latest();
                Some(self.granted(m, Wire::Port(p), &property, reader)?)
            };
            let link = self.joint(m, Wire::Port(p)).map(|joint| joint.link);
            let stale = link.and_then(|link| link.stale.as_ref()).map(|stale| stale.value);
            let at = wiring.inputs.len();
            let post = writer.as_deref().map(|writer| self.ground.post(writer));
            match (&writer, &last) {
                (Some(writer), Some(before)) if writer == before => {
                    if let Some(group) = wiring.groups.last_mut() {
                        group.end = at + 1;
                    }
                }
                _ => {
                    let word = post.as_ref().map_or_else(CommitWord::new, |post| post.commit.clone());
                    wiring.groups.push(Group { word, first: at, end: at + 1 });
                }
            }
            last = writer;
            let port = InputPort {
                slot: p,
                stale_after: stale.or(port.stale_after),
                triggers: self.triggers(m, p),
                writer: post.map(|post| post.health),
                seen: (0, 0),
                missed: 0,
            };
            wiring.inputs.push((port, reader));
        }
        Some(())
    }

    fn queue(&mut self, m: usize, p: usize) -> Option<QueueReader> {
        let property = self.source(m, p)?.0;
        let channel = property.channel()?;
        self.granted(m, Wire::Port(p), &property, channel.queue(Policy::Skip, Start::Next))
    }

    fn outbox_wiring(&mut self, m: usize, p: usize) -> Option<OutboxWiring> {
        let target = self.joint(m, Wire::Port(p)).map(|joint| joint.target);
        let Some(target @ (Target::Port(..) | Target::Absent(_))) = target else {
            return Some(OutboxWiring { slot: p, sender: None, wake: None });
        };
        let property = self.property(&self.target_path(target))?;
        let Carrier::Mailbox(mailbox) = property.carrier() else { return None };
        let sender = self.granted(m, Wire::Port(p), &property, mailbox.sender())?;
        let receiver = match target {
            Target::Port(module, _) => self.name(module).to_owned(),
            Target::Absent(absent) => self.survey.absent[absent].module.clone(),
            Target::Command(_) => return None,
        };
        Some(OutboxWiring { slot: p, sender: Some(sender), wake: self.wake_of(&receiver) })
    }

    /// A handle; without one, says at the link that leads there why.
    fn granted<T>(
        &mut self,
        m: usize,
        wire: Wire,
        property: &Property,
        result: Result<T, impl Display>,
    ) -> Option<T> {
        let error = match result {
            Ok(handle) => return Some(handle),
            Err(error) => error,
        };
        let link = self.joint(m, wire).map(|joint| joint.link.from.span);
        let span = link.unwrap_or(self.surveyed(m).module.name.span);
        let help = "write the link into the file and start the agent again: a property is made for the readers that \
                    links name then, and some more";
        self.complaints.add(
            span,
            format!("`/{}` can't take one more reader: {error}", property.path()),
            help,
        );
        None
    }
}
