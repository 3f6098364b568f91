//! Sources and destinations of a module's ports.

use std::collections::BTreeMap;
use std::sync::Arc;

use slate_blackboard::channel::{Latest, Policy, Start};
use slate_blackboard::commit::CommitWord;
use slate_blackboard::message::Sender;
use slate_blackboard::{Carrier, Property};
use slate_module::Direction;

use super::resources::ModuleSignals;
use super::{ModuleBuilder, new_writer};
use slate_composition::link::{FieldPlace, Program};
use slate_composition::{BuildPlan, Implied, LinkConversion, LinkSource, ResolvedLink, Wire, shallow_source};
use slate_configuration::LinkPolicy;
use slate_engine::runner::{
    AlignedMemory, Conversion, ConversionWiring, ConvertedSource, Group, Health, InputPort, OutboxWiring,
    QueueWiring, SourceWiring, Wiring,
};

/// Source that a module reads.
struct WiredRead<'s, 'a> {
    early: bool,
    writer: Option<String>,
    property: Arc<Property>,
    end: ReadEnd<'s, 'a>,
}

/// Reader of a source in a module: an input, or a link that converts.
enum ReadEnd<'s, 'a> {
    Input(usize),
    Source(&'s ResolvedLink<'a>, Arc<Program>, usize),
}

impl WiredRead<'_, '_> {
    /// Returns the sort key of the source.
    /// Sources with one writer are adjacent, with inputs and converted sources each in their order.
    fn place(&self) -> (bool, Option<&str>, bool, Wire, usize) {
        let (is_source, wire, ordinal) = match &self.end {
            ReadEnd::Input(p) => (false, Wire::Port(*p), 0),
            ReadEnd::Source(joint, _, ordinal) => (true, joint.port.1, *ordinal),
        };
        (self.early, self.writer.as_deref(), is_source, wire, ordinal)
    }

    /// Returns true if the source switches the module.
    fn is_switch(&self) -> bool {
        matches!(self.end, ReadEnd::Source(joint, ..) if joint.port.1 == Wire::Enabled)
    }
}

/// Makes the readers and senders of a module.
/// Unchanged ports keep theirs.
pub(super) struct WiringBuilder<'b, 'a, 's> {
    plan: BuildPlan<'a, 's>,
    builder: &'b mut ModuleBuilder<'a, 's>,
    module: usize,
    stays: &'b dyn Fn(Wire) -> bool,
}

impl<'b, 'a, 's> WiringBuilder<'b, 'a, 's> {
    pub fn new(
        builder: &'b mut ModuleBuilder<'a, 's>,
        module: usize,
        stays: &'b dyn Fn(Wire) -> bool,
    ) -> Self {
        Self { plan: builder.plan, builder, module, stays }
    }

    /// Makes the whole wiring; `None` after a complaint, or without a free handle.
    pub fn wiring(mut self) -> Option<Wiring> {
        let m = self.module;
        let mut wiring = Wiring::default();
        self.read(&mut wiring)?;
        for (p, port) in self.plan.surveyed(m).description.ports.iter().enumerate() {
            match port.direction {
                Direction::Queue => wiring.queues.push(self.queue(p)?),
                Direction::Outbox if !(self.stays)(Wire::Port(p)) => {
                    wiring.outboxes.push(self.outbox(p)?);
                }
                _ => {}
            }
        }
        if !(self.stays)(Wire::Enabled) {
            let is_switched = self.plan.joints(m, Wire::Enabled).next().is_some();
            wiring.switch = Some((self.builder.switch(m)?, is_switched));
        }
        Some(wiring)
    }

    /// Returns the source of a link, and the name of the module that writes it.
    fn source(&self, target: LinkSource) -> Option<(Arc<Property>, Option<String>)> {
        let (plan, survey) = (self.plan, self.plan.survey);
        let property = self.builder.property(&plan.target_path(target))?;
        let writer = match target {
            LinkSource::Port(module, port) if plan.port(module, port).direction != Direction::Input => {
                Some(plan.name(module).into())
            }
            LinkSource::Absent(absent) => Some(survey.absent[absent].module.clone()),
            // Whether its values come is known like the condition of a module.
            LinkSource::Remote(remote) => Some(survey.remote[remote].path.to_string()),
            LinkSource::Played(played) => survey.played[played].module.clone(),
            LinkSource::Port(..)
            | LinkSource::Command(_)
            | LinkSource::Gate(_)
            | LinkSource::Implied(..)
            | LinkSource::Host(_) => None,
        };
        Some((property, writer))
    }

    /// Returns true if a link's source is pinned at the start of a cycle.
    /// A module with a thread of its own has no such links.
    fn is_early(&self, joint: &ResolvedLink<'_>) -> bool {
        joint.delayed && !self.builder.resources.has_own_thread(self.plan.surveyed(self.module))
    }

    /// Makes the readers of inputs and converting links, grouped by writer.
    fn read(&mut self, wiring: &mut Wiring) -> Option<()> {
        let mut reads = self.inputs()?;
        reads.append(&mut self.sources(&mut wiring.conversions)?);
        reads.sort_by(|a, b| a.place().cmp(&b.place()));
        let mut last: Option<(bool, Option<String>)> = None;
        for read in reads {
            let signals = read.writer.as_deref().map(|writer| self.builder.resources.signals(writer));
            let same = read.writer.is_some() && last.as_ref() == Some(&(read.early, read.writer.clone()));
            // A switch is looked at while nothing else of the module is.
            let is_switch = read.is_switch();
            if !same && !is_switch {
                begin_group(wiring, read.early, signals.as_ref());
                last = Some((read.early, read.writer.clone()));
            }
            let (early, health) = (read.early, signals.map(|signals| signals.health));
            match &read.end {
                ReadEnd::Input(p) => wiring.inputs.push(self.input(*p, &read, health)?),
                ReadEnd::Source(joint, program, ordinal) => {
                    let source = self.converted_source(joint, program, &read.property, health)?;
                    let (wire, ordinal) = (joint.port.1, *ordinal);
                    wiring.sources.push(SourceWiring { wire, source, ordinal });
                }
            }
            if !is_switch {
                extend_group(wiring, early);
            }
        }
        Some(())
    }

    /// Returns the sources of the inputs.
    fn inputs(&self) -> Option<Vec<WiredRead<'s, 'a>>> {
        let m = self.module;
        let ports = self.plan.surveyed(m).description.ports.iter().enumerate();
        let inputs = ports.filter(|(_, port)| port.direction == Direction::Input).map(|(p, _)| {
            let ((property, writer), early) = match self.plan.joint(m, Wire::Port(p)) {
                Some(joint) => (self.source(joint.target)?, self.is_early(joint)),
                None => ((self.builder.own_property(m, p)?, None), false),
            };
            Some(WiredRead { early, writer, property, end: ReadEnd::Input(p) })
        });
        inputs.collect()
    }

    /// Returns the sources of converting links, and the ports that they fill.
    fn sources(&mut self, conversions: &mut Vec<ConversionWiring>) -> Option<Vec<WiredRead<'s, 'a>>> {
        let (m, survey) = (self.module, self.plan.survey);
        let mut reads = Vec::new();
        let mut ordinals: BTreeMap<Wire, usize> = BTreeMap::new();
        for joint in survey.joints.iter().filter(|joint| joint.port.0 == m && !joint.is_plain()) {
            let wire = joint.port.1;
            if !ordinals.contains_key(&wire) {
                let conversion = if (self.stays)(wire) {
                    ConversionWiring::Same(wire)
                } else {
                    ConversionWiring::New(self.conversion(wire)?)
                };
                conversions.push(conversion);
            }
            let ordinal = ordinals.entry(wire).or_default();
            // Else it waits for what is not there yet.
            if let Some(program) = self.program(joint) {
                let (property, writer) = self.source(joint.target)?;
                let early = self.is_early(joint);
                let end = ReadEnd::Source(joint, program, *ordinal);
                reads.push(WiredRead { early, writer, property, end });
                *ordinal += 1;
            }
        }
        Some(reads)
    }

    /// Makes an input, with a reader unless it keeps its own.
    fn input(
        &mut self,
        p: usize,
        read: &WiredRead<'_, '_>,
        writer: Option<Arc<Health>>,
    ) -> Option<(InputPort, Option<Latest>)> {
        let (m, wire, port) = (self.module, Wire::Port(p), self.plan.port(self.module, p));
        let reader = if (self.stays)(wire) || self.keeps_own(wire) {
            None
        } else {
            let reader = read.property.channel()?.latest();
            Some(self.builder.granted(m, wire, &read.property, reader)?)
        };
        let stale = self.plan.joint(m, wire).and_then(|joint| joint.link.stale.as_ref());
        let is_converted = self.plan.is_converted(m, wire);
        let triggers = self.plan.triggers(m, p) && !is_converted;
        let path = self.plan.port_path(m, p);
        let port = InputPort {
            slot: p as u32,
            stale_after: match stale {
                Some(stale) => Some(stale.value),
                // As old as its sources, which are looked at one by one.
                None if is_converted => None,
                None => port.stale_after,
            },
            triggers,
            wakes: triggers && !read.early,
            is_previous: read.early,
            is_written: is_converted
                || self.plan.joint(m, wire).is_some_and(|joint| self.is_written(joint.target)),
            writer,
            seen: (0, 0),
            missed: 0,
            age: Arc::clone(self.builder.resources.ages.entry(path).or_default()),
        };
        Some((port, reader))
    }

    /// Returns true if a link's source has a writer.
    /// Configuration and manual changes do not count.
    fn is_written(&self, target: LinkSource) -> bool {
        match target {
            LinkSource::Port(module, port) => {
                self.plan.port(module, port).direction != Direction::Input
                    || self.plan.is_converted(module, Wire::Port(port))
            }
            LinkSource::Implied(module, Implied::Params) => self.plan.is_converted(module, Wire::Params),
            LinkSource::Implied(module, Implied::Enabled) => {
                self.plan.joints(module, Wire::Enabled).next().is_some()
            }
            _ => true,
        }
    }

    /// Makes a source of a port that links fill, unless it keeps its own.
    fn converted_source(
        &mut self,
        joint: &ResolvedLink<'_>,
        program: &Arc<Program>,
        property: &Property,
        writer: Option<Arc<Health>>,
    ) -> Option<Option<(Latest, ConvertedSource)>> {
        let (m, wire) = (self.module, joint.port.1);
        if (self.stays)(wire) {
            return Some(None);
        }
        let stale = match wire {
            Wire::Port(p) => self.plan.port(m, p).stale_after,
            Wire::Enabled | Wire::Params => None,
        };
        let reader = property.channel()?.latest();
        let reader = self.builder.granted(m, wire, property, reader)?;
        let source = ConvertedSource {
            reader: 0,
            program: Arc::clone(program),
            filter: joint.filter.clone(),
            writer,
            stale_after: joint.link.stale.as_ref().map(|stale| stale.value).or(stale),
            seen: (0, 0),
            time: None,
            is_missing: false,
        };
        Some(Some((reader, source)))
    }

    /// Returns the conversion of a link; `None` while its source does not exist.
    fn program(&self, joint: &ResolvedLink<'_>) -> Option<Arc<Program>> {
        match &joint.conversion {
            LinkConversion::Plain => None,
            LinkConversion::Converted(program) => Some(Arc::clone(program)),
            // It may be on the board by now; it is linked anew when it is known to be there.
            LinkConversion::Pending(_) if matches!(joint.target, LinkSource::Remote(_)) => None,
            LinkConversion::Pending(place) => {
                let property = self.builder.property(&self.plan.target_path(joint.target))?;
                // What does not fit is said when the plugin is loaded.
                let source = FieldPlace::find(property.descriptor(), &joint.from).ok()?;
                Program::new(&source, place).ok().map(Arc::new)
            }
        }
    }

    /// Returns true if a port keeps its own property, which links fill.
    fn keeps_own(&self, wire: Wire) -> bool {
        self.plan.is_converted(self.module, wire) && self.builder.kept.contains(&(self.module, wire))
    }

    fn conversion(&mut self, wire: Wire) -> Option<Conversion> {
        let m = self.module;
        let surveyed = self.plan.surveyed(m);
        let (path, value, triggers) = match wire {
            Wire::Port(p) => {
                let port = self.plan.port(m, p);
                let value = surveyed.inputs.get(&p).cloned().unwrap_or_else(|| vec![0; port.descriptor.size]);
                (format!("{}/{}", self.plan.name(m), port.name), value, self.plan.triggers(m, p))
            }
            Wire::Enabled => {
                (format!("{}/enabled", self.plan.name(m)), vec![surveyed.module.enabled.value.into()], false)
            }
            Wire::Params => (format!("{}/params", self.plan.name(m)), surveyed.params.clone(), false),
        };
        let property = self.builder.property(&path)?;
        let shape = property.channel()?.shape();
        let items = value.len().saturating_sub(shape.size).checked_div(shape.item).unwrap_or(0);
        let is_set = match wire {
            Wire::Port(p) => surveyed.inputs.contains_key(&p),
            Wire::Enabled => true,
            Wire::Params => false,
        };
        let writer = if wire == Wire::Params || self.builder.kept.contains(&(m, wire)) {
            None
        } else {
            let mut writer = new_writer(&property)?;
            if is_set {
                // Nobody reads it yet.
                let _ = writer.write(&value, items, self.builder.made.time());
            }
            Some(writer)
        };
        let mut memory = AlignedMemory::zeroed(value.len());
        memory.bytes_mut(value.len()).copy_from_slice(&value);
        let mut joints = self.plan.joints(m, wire).filter(|joint| !joint.is_plain());
        let is_pending = joints.any(|joint| self.program(joint).is_none());
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

    fn queue(&mut self, p: usize) -> Option<QueueWiring> {
        let (m, wire) = (self.module, Wire::Port(p));
        let port = self.plan.port(m, p);
        let joint = self.plan.joint(m, wire);
        let link = joint.map(|joint| joint.link);
        let window =
            link.and_then(|link| link.window.as_ref()).map_or(port.window, |window| window.value.into());
        let reader = if (self.stays)(wire) {
            None
        } else {
            let property = match joint {
                Some(joint) => self.source(joint.target)?.0,
                None => self.builder.own_property(m, p)?,
            };
            let policy = match link.and_then(|link| link.policy.as_ref()).map(|policy| policy.value) {
                Some(LinkPolicy::Evict) => Policy::Evict,
                Some(LinkPolicy::Skip) | None => Policy::Skip,
            };
            let channel = property.channel()?;
            let enough = channel.keeps_enough(window);
            let target = joint.map(|joint| joint.target);
            if !enough && target.and_then(|target| self.plan.writing(target)).is_none() {
                let span = link.map_or(self.plan.surveyed(m).module.name.span, |link| link.from.span);
                let port = self.plan.port_path(m, p);
                let (message, help) = shallow_source(property.path(), channel.depth(), &port, window);
                self.builder.complaints.add(span, message, help);
                return None;
            }
            let reader = match target {
                // It is only looked whether it could be linked: it gets a deeper channel before it is.
                Some(target) if !enough => {
                    let (depth, budget) = self.plan.demand(target, property.path());
                    let deeper = channel.deeper(depth, budget);
                    deeper.and_then(|writer| writer.queue(policy, Start::Next))
                }
                _ => channel.queue(policy, Start::Next),
            };
            Some(self.builder.granted(m, wire, &property, reader)?)
        };
        let path = self.plan.port_path(m, p);
        let eviction_message = format!(
            "`{}` fell behind and reads no more, as its link says: unlink and link it to let it read again",
            port.name
        );
        let gauge = Arc::clone(self.builder.resources.gauges.entry(path).or_default());
        Some(QueueWiring {
            gauge,
            eviction_message: eviction_message.into(),
            slot: p,
            triggers: self.plan.triggers(m, p),
            reader,
            window: window.max(16),
            is_previous: joint.is_some_and(|joint| self.is_early(joint)),
            filter: joint.and_then(|joint| joint.filter.clone()),
        })
    }

    fn outbox(&mut self, p: usize) -> Option<OutboxWiring> {
        let m = self.module;
        let target = self.plan.joint(m, Wire::Port(p)).map(|joint| joint.target);
        let Some(
            target @ (LinkSource::Port(..)
            | LinkSource::Absent(_)
            | LinkSource::Remote(_)
            | LinkSource::Played(_)),
        ) = target
        else {
            return Some(OutboxWiring { slot: p, sender: self.outgoing(p), wake: None });
        };
        let property = self.builder.property(&self.plan.target_path(target))?;
        let Carrier::Mailbox(mailbox) = property.carrier() else { return None };
        let name = self.plan.port_path(m, p);
        let sender = self.builder.granted(m, Wire::Port(p), &property, mailbox.sender_of(&name))?;
        let receiver = match target {
            LinkSource::Port(module, _) => self.plan.name(module).to_owned(),
            LinkSource::Absent(absent) => self.plan.survey.absent[absent].module.clone(),
            LinkSource::Remote(_) => {
                let wake = Some(Arc::clone(&self.builder.resources.sharing_wake));
                return Some(OutboxWiring { slot: p, sender: Some(sender), wake });
            }
            // A playback takes messages after each cycle.
            LinkSource::Played(_) => return Some(OutboxWiring { slot: p, sender: Some(sender), wake: None }),
            LinkSource::Command(_) | LinkSource::Gate(_) | LinkSource::Implied(..) | LinkSource::Host(_) => {
                return None;
            }
        };
        Some(OutboxWiring { slot: p, sender: Some(sender), wake: self.builder.wake_of(&receiver) })
    }

    /// Returns the sender of an outbox without a link, for a bridge.
    /// The bridge polls for the messages.
    fn outgoing(&mut self, p: usize) -> Option<Sender> {
        let m = self.module;
        let path = self.plan.port_path(m, p);
        let property = self.builder.property(&path).filter(|_| self.plan.configuration.is_outgoing(&path))?;
        let Carrier::Mailbox(mailbox) = property.carrier() else { return None };
        self.builder.granted(m, Wire::Port(p), &property, mailbox.sender_of(&path))
    }
}

/// Begins a group of sources with one writer.
fn begin_group(wiring: &mut Wiring, early: bool, signals: Option<&ModuleSignals>) {
    let (first, first_source) = (wiring.inputs.len() as u32, wiring.sources.len() as u32);
    let word = signals.map_or_else(CommitWord::new, |signals| signals.commit.clone());
    let groups = if early { &mut wiring.previous_groups } else { &mut wiring.groups };
    groups.push(Group { word, first, end: first, first_source, end_source: first_source });
}

/// Extends the last group by the source that was added last.
fn extend_group(wiring: &mut Wiring, early: bool) {
    let groups = if early { &mut wiring.previous_groups } else { &mut wiring.groups };
    if let Some(group) = groups.last_mut() {
        group.end = wiring.inputs.len() as u32;
        group.end_source = wiring.sources.len() as u32;
    }
}
