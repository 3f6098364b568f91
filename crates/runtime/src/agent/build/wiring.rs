//! What the ports of a module read and send to.

use std::collections::BTreeMap;
use std::fmt::Display;
use std::sync::Arc;

use slate_blackboard::channel::{Latest, Policy, Start};
use slate_blackboard::commit::CommitWord;
use slate_blackboard::{Carrier, Property};
use slate_module::{Direction, PortDescription, Trigger};

use super::Builder;
use super::new_writer;
use crate::configuration::LinkPolicy;
use crate::runner::{
    Conversion, ConversionWiring, ConvertedSource, Group, InputPort, Memory, OutboxWiring, QueueWiring,
    SourceWiring, Wiring,
};
use slate_composition::link::{FieldPlace, Program};
use slate_composition::{Joint, Target, Way, Wire};
use slate_configuration::Mistake;

/// Something that a module reads.
struct Read<'s, 'a> {
    early: bool,
    writer: Option<String>,
    property: Arc<Property>,
    what: What<'s, 'a>,
}

enum What<'s, 'a> {
    Input(usize, &'s PortDescription),
    Source(&'s Joint<'a>, Arc<Program>, usize),
}

impl Read<'_, '_> {
    /// Those that one module writes stand together, inputs and sources each in their order.
    fn place(&self) -> (bool, Option<&str>, bool, Wire, usize) {
        let (is_source, wire, ordinal) = match &self.what {
            What::Input(p, _) => (false, Wire::Port(*p), 0),
            What::Source(joint, _, ordinal) => (true, joint.port.1, *ordinal),
        };
        (self.early, self.writer.as_deref(), is_source, wire, ordinal)
    }
}

impl Builder<'_, '_> {
    /// The readers and senders of a module; ports that stay as they are go on with theirs.
    pub(super) fn wiring(&mut self, m: usize, stays: &dyn Fn(Wire) -> bool) -> Option<Wiring> {
        let mut wiring = Wiring::default();
        self.read(m, &mut wiring, stays)?;
        let survey = self.survey;
        for (p, port) in survey.modules[m].description.ports.iter().enumerate() {
            match port.direction {
                Direction::Queue => wiring.queues.push(self.queue(m, p, stays(Wire::Port(p)))?),
                Direction::Outbox if !stays(Wire::Port(p)) => wiring.outboxes.push(self.outbox_wiring(m, p)?),
                _ => {}
            }
        }
        if !stays(Wire::Enabled) {
            let is_switched = self.joints(m, Wire::Enabled).next().is_some();
            wiring.switch = Some((self.switch(m)?, is_switched));
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

    /// What a link leads to, and the name of the module that writes it.
    fn source(&self, target: Target) -> Option<(Arc<Property>, Option<String>)> {
        let property = self.property(&self.target_path(target))?;
        let writer = match target {
            Target::Port(module, port) if self.port(module, port).direction != Direction::Input => {
                Some(self.name(module).into())
            }
            Target::Absent(absent) => Some(self.survey.absent[absent].module.clone()),
            // Whether its values come is known like the condition of a module.
            Target::Remote(remote) => Some(self.survey.remote[remote].path.to_string()),
            Target::Played(played) => self.survey.played[played].module.clone(),
            Target::Port(..) | Target::Command(_) | Target::Implied(..) | Target::Host(_) => None,
        };
        Some((property, writer))
    }

    /// Whether what a link leads to is pinned when a cycle begins, of which a module with a thread of its own knows
    /// nothing.
    fn is_early(&self, m: usize, joint: &Joint<'_>) -> bool {
        let surveyed = self.surveyed(m);
        joint.delayed && !self.ground.has_own_thread(surveyed)
    }

    /// The inputs and the sources of what is converted, in groups of those that one module writes.
    fn read(&mut self, m: usize, wiring: &mut Wiring, stays: &dyn Fn(Wire) -> bool) -> Option<()> {
        let survey = self.survey;
        let ports = &survey.modules[m].description.ports;
        let mut reads = Vec::new();
        for (p, port) in ports.iter().enumerate().filter(|(_, port)| port.direction == Direction::Input) {
            let ((property, writer), early) = match self.joint(m, Wire::Port(p)) {
                Some(joint) => (self.source(joint.target)?, self.is_early(m, joint)),
                None => ((self.own_property(m, p)?, None), false),
            };
            reads.push(Read { early, writer, property, what: What::Input(p, port) });
        }
        let mut ordinals: BTreeMap<Wire, usize> = BTreeMap::new();
        for joint in survey.joints.iter().filter(|joint| joint.port.0 == m && !joint.is_plain()) {
            let wire = joint.port.1;
            if !ordinals.contains_key(&wire) {
                let conversion = if stays(wire) {
                    ConversionWiring::Same(wire)
                } else {
                    ConversionWiring::New(self.conversion(m, wire)?)
                };
                wiring.conversions.push(conversion);
            }
            let ordinal = ordinals.entry(wire).or_default();
            // Else it waits for what is not there yet.
            if let Some(program) = self.program(joint) {
                let (property, writer) = self.source(joint.target)?;
                let early = self.is_early(m, joint);
                reads.push(Read { early, writer, property, what: What::Source(joint, program, *ordinal) });
                *ordinal += 1;
            }
        }
        reads.sort_by(|a, b| a.place().cmp(&b.place()));
        let mut last: Option<(bool, Option<String>)> = None;
        for Read { early, writer, property, what } in reads {
            let post = writer.as_deref().map(|writer| self.ground.post(writer));
            let (first, first_source) = (wiring.inputs.len() as u32, wiring.sources.len() as u32);
            let groups = if early { &mut wiring.early } else { &mut wiring.groups };
            let same = writer.is_some() && last.as_ref() == Some(&(early, writer.clone()));
            // A switch is looked at while nothing else of the module is.
            let is_switch = matches!(what, What::Source(joint, ..) if joint.port.1 == Wire::Enabled);
            if !same && !is_switch {
                let word = post.as_ref().map_or_else(CommitWord::new, |post| post.commit.clone());
                groups.push(Group { word, first, end: first, first_source, end_source: first_source });
                last = Some((early, writer));
            }
            match what {
                What::Input(p, port) => {
                    let wire = Wire::Port(p);
                    let reader = if stays(wire) || self.keeps_own(m, wire) {
                        None
                    } else {
                        let reader = property.channel()?.latest();
                        Some(self.granted(m, wire, &property, reader)?)
                    };
                    let stale = self.joint(m, wire).and_then(|joint| joint.link.stale.as_ref());
                    let is_converted = self.conversions(m, wire).next().is_some();
                    let path = format!("{}/{}", self.name(m), port.name);
                    let triggers = self.triggers(m, p) && !is_converted;
                    let port = InputPort {
                        slot: p as u32,
                        stale_after: match stale {
                            Some(stale) => Some(stale.value),
                            // As old as its sources, which are looked at one by one.
                            None if is_converted => None,
                            None => port.stale_after,
                        },
                        triggers,
                        wakes: triggers && !early,
                        is_early: early,
                        writer: post.map(|post| post.health),
                        seen: (0, 0),
                        missed: 0,
                        age: Arc::clone(self.ground.ages.entry(path).or_default()),
                    };
                    wiring.inputs.push((port, reader));
                }
                What::Source(joint, program, ordinal) => {
                    let wire = joint.port.1;
                    let stale = match wire {
                        Wire::Port(p) => self.port(m, p).stale_after,
                        Wire::Enabled | Wire::Params => None,
                    };
                    let source = if stays(wire) {
                        None
                    } else {
                        let reader = property.channel()?.latest();
                        let reader = self.granted(m, wire, &property, reader)?;
                        let source = ConvertedSource {
                            reader: 0,
                            program,
                            filter: joint.filter.clone(),
                            writer: post.map(|post| post.health),
                            stale_after: joint.link.stale.as_ref().map(|stale| stale.value).or(stale),
                            seen: (0, 0),
                            time: None,
                            is_missing: false,
                        };
                        Some((reader, source))
                    };
                    wiring.sources.push(SourceWiring { wire, source, ordinal });
                }
            }
            let groups = if early { &mut wiring.early } else { &mut wiring.groups };
            if let Some(group) = groups.last_mut().filter(|_| !is_switch) {
                group.end = wiring.inputs.len() as u32;
                group.end_source = wiring.sources.len() as u32;
            }
        }
        Some(())
    }

    /// How a link converts; nothing while what it leads to is not there.
    fn program(&self, joint: &Joint<'_>) -> Option<Arc<Program>> {
        match &joint.way {
            Way::Plain => None,
            Way::Converted(program) => Some(Arc::clone(program)),
            // It may be on the board by now; it is linked anew when it is known to be there.
            Way::Pending(_) if matches!(joint.target, Target::Remote(_)) => None,
            Way::Pending(place) => {
                let property = self.property(&self.target_path(joint.target))?;
                // What does not fit is said when the plugin is loaded.
                let source = FieldPlace::find(property.descriptor(), &joint.from).ok()?;
                Program::new(&source, place).ok().map(Arc::new)
            }
        }
    }

    /// Whether a port goes on with a property of its own that links fill.
    fn keeps_own(&self, m: usize, wire: Wire) -> bool {
        self.conversions(m, wire).next().is_some() && self.kept.contains(&(m, wire))
    }

    fn conversion(&mut self, m: usize, wire: Wire) -> Option<Conversion> {
        let survey = self.survey;
        let surveyed = &survey.modules[m];
        let (path, value, triggers) = match wire {
            Wire::Port(p) => {
                let port = self.port(m, p);
                let value = surveyed.inputs.get(&p).cloned().unwrap_or_else(|| vec![0; port.descriptor.size]);
                (format!("{}/{}", self.name(m), port.name), value, self.triggers(m, p))
            }
            Wire::Enabled => {
                (format!("{}/enabled", self.name(m)), vec![surveyed.module.enabled.value.into()], false)
            }
            Wire::Params => (format!("{}/params", self.name(m)), surveyed.params.clone(), false),
        };
        let property = self.property(&path)?;
        let shape = property.channel()?.shape();
        let items = value.len().saturating_sub(shape.size).checked_div(shape.item).unwrap_or(0);
        let is_set = match wire {
            Wire::Port(p) => surveyed.inputs.contains_key(&p),
            Wire::Enabled => true,
            Wire::Params => false,
        };
        let writer = if wire == Wire::Params || self.kept.contains(&(m, wire)) {
            None
        } else {
            let mut writer = new_writer(&property)?;
            if is_set {
                // Nobody reads it yet.
                let _ = writer.write(&value, items, self.made.time());
            }
            Some(writer)
        };
        let mut memory = Memory::zeroed(value.len());
        memory.bytes_mut(value.len()).copy_from_slice(&value);
        let is_pending = self.conversions(m, wire).any(|joint| self.program(joint).is_none());
        Some(Conversion {
            wire,
            property,
            writer,
            is_set,
            value: memory,
            bytes: value.len(),
            items,
            sources: Vec::new(),
            reader: 0,
            triggers,
            is_pending,
            unwritten: false,
        })
    }

    fn queue(&mut self, m: usize, p: usize, stays: bool) -> Option<QueueWiring> {
        let (wire, port) = (Wire::Port(p), self.port(m, p).clone());
        let joint = self.joint(m, wire).cloned();
        let link = joint.as_ref().map(|joint| joint.link);
        let window =
            link.and_then(|link| link.window.as_ref()).map_or(port.window, |window| window.value.into());
        let reader = if stays {
            None
        } else {
            let property = match &joint {
                Some(joint) => self.source(joint.target)?.0,
                None => self.own_property(m, p)?,
            };
            let policy = match link.and_then(|link| link.policy.as_ref()).map(|policy| policy.value) {
                Some(LinkPolicy::Evict) => Policy::Evict,
                Some(LinkPolicy::Skip) | None => Policy::Skip,
            };
            let channel = property.channel()?;
            let enough = channel.keeps_enough(window);
            let target = joint.as_ref().map(|joint| joint.target);
            if !enough && target.and_then(|target| self.writing(target)).is_none() {
                let span = link.map_or(self.surveyed(m).module.name.span, |link| link.from.span);
                let message = Mistake::Ends.of(format!(
                    "`/{}` keeps {} values, and `{}/{}` takes up to {window} at once, which needs {}",
                    property.path(),
                    channel.depth(),
                    self.name(m),
                    port.name,
                    window * 2
                ));
                let help = "link it to an output of a module, or write the link into the file and start the agent again: \
                            a property keeps as many values as the queues need that are linked then";
                self.complaints.add(span, message, help);
                return None;
            }
            let reader = match target {
                // It is only looked whether it could be linked: it gets a deeper channel before it is.
                Some(target) if !enough => {
                    let (depth, budget) = self.demand(target, property.path());
                    let deeper = channel.deeper(depth, budget);
                    deeper.and_then(|writer| writer.queue(policy, Start::Next))
                }
                _ => channel.queue(policy, Start::Next),
            };
            Some(self.granted(m, wire, &property, reader)?)
        };
        let path = format!("{}/{}", self.name(m), port.name);
        let farewell = format!(
            "`{}` fell behind and reads no more, as its link says: unlink and link it to let it read again",
            port.name
        );
        let gauge = Arc::clone(self.ground.gauges.entry(path).or_default());
        Some(QueueWiring {
            gauge,
            farewell: farewell.into(),
            slot: p,
            triggers: self.triggers(m, p),
            reader,
            window: window.max(16),
            is_early: joint.as_ref().is_some_and(|joint| self.is_early(m, joint)),
            filter: joint.and_then(|joint| joint.filter),
        })
    }

    fn outbox_wiring(&mut self, m: usize, p: usize) -> Option<OutboxWiring> {
        let target = self.joint(m, Wire::Port(p)).map(|joint| joint.target);
        let Some(target @ (Target::Port(..) | Target::Absent(_) | Target::Remote(_) | Target::Played(_))) =
            target
        else {
            return Some(OutboxWiring { slot: p, sender: None, wake: None });
        };
        let property = self.property(&self.target_path(target))?;
        let Carrier::Mailbox(mailbox) = property.carrier() else { return None };
        let name = format!("{}/{}", self.name(m), self.port(m, p).name);
        let sender = self.granted(m, Wire::Port(p), &property, mailbox.sender_of(&name))?;
        let receiver = match target {
            Target::Port(module, _) => self.name(module).to_owned(),
            Target::Absent(absent) => self.survey.absent[absent].module.clone(),
            Target::Remote(_) => {
                let wake = Some(Arc::clone(&self.ground.sharing_wake));
                return Some(OutboxWiring { slot: p, sender: Some(sender), wake });
            }
            // Who plays looks for messages after each cycle.
            Target::Played(_) => return Some(OutboxWiring { slot: p, sender: Some(sender), wake: None }),
            Target::Command(_) | Target::Implied(..) | Target::Host(_) => return None,
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
        let link = self.joints(m, wire).next().map(|joint| joint.link.from.span);
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
