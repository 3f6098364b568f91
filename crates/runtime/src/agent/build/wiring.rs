//! Sources and destinations of a module's ports.

use std::sync::Arc;

use slate_blackboard::channel::{Latest, Policy, Start};
use slate_blackboard::commit::CommitWord;
use slate_blackboard::message::Sender;
use slate_blackboard::{Carrier, Property};
use slate_module::Direction;
use slate_sorted::SortedMap;

use super::resources::ModuleSignals;
use super::{ModuleBuilder, new_writer};
use slate_composition::link::{FieldPlace, Program};
use slate_composition::{
    BuildPlan, Implied, LinkConversion, LinkEnd, LinkSource, ResolvedLink, shallow_source,
};
use slate_configuration::LinkPolicy;
use slate_engine::runner::{
    AlignedMemory, Conversion, ConversionWiring, ConvertedSource, Group, Health, InputPort, OutboxWiring,
    QueueWiring, SourceWiring, Wiring,
};

/// Source that a module reads.
struct LinkedRead<'s, 'a> {
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

impl LinkedRead<'_, '_> {
    /// Returns the sort key of the source.
    /// Sources with one writer are adjacent, with inputs and converted sources each in their order.
    fn place(&self) -> (bool, Option<&str>, bool, LinkEnd, usize) {
        let (is_source, link_end, ordinal) = match &self.end {
            ReadEnd::Input(p) => (false, LinkEnd::Port(*p), 0),
            ReadEnd::Source(resolved, _, ordinal) => (true, resolved.port.1, *ordinal),
        };
        (self.early, self.writer.as_deref(), is_source, link_end, ordinal)
    }

    /// Returns true if the source switches the module.
    fn is_switch(&self) -> bool {
        matches!(self.end, ReadEnd::Source(resolved, ..) if resolved.port.1 == LinkEnd::Enabled)
    }
}

/// Makes the readers and senders of a module.
/// Unchanged ports keep theirs.
pub(super) struct WiringBuilder<'b, 'a, 's> {
    plan: BuildPlan<'a, 's>,
    builder: &'b mut ModuleBuilder<'a, 's>,
    module: usize,
    stays: &'b dyn Fn(LinkEnd) -> bool,
}

impl<'b, 'a, 's> WiringBuilder<'b, 'a, 's> {
    pub fn new(
        builder: &'b mut ModuleBuilder<'a, 's>,
        module: usize,
        stays: &'b dyn Fn(LinkEnd) -> bool,
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
                Direction::Outbox if !(self.stays)(LinkEnd::Port(p)) => {
                    wiring.outboxes.push(self.outbox(p)?);
                }
                _ => {}
            }
        }
        if !(self.stays)(LinkEnd::Enabled) {
            let is_switched = self.plan.links(m, LinkEnd::Enabled).next().is_some();
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
    fn is_early(&self, resolved: &ResolvedLink<'_>) -> bool {
        resolved.delayed && !self.builder.resources.has_own_thread(self.plan.surveyed(self.module))
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
                ReadEnd::Source(resolved, program, ordinal) => {
                    let source = self.converted_source(resolved, program, &read.property, health)?;
                    let (link_end, ordinal) = (resolved.port.1, *ordinal);
                    wiring.sources.push(SourceWiring { link_end, source, ordinal });
                }
            }
            if !is_switch {
                extend_group(wiring, early);
            }
        }
        Some(())
    }

    /// Returns the sources of the inputs.
    fn inputs(&self) -> Option<Vec<LinkedRead<'s, 'a>>> {
        let m = self.module;
        let ports = self.plan.surveyed(m).description.ports.iter().enumerate();
        let inputs = ports.filter(|(_, port)| port.direction == Direction::Input).map(|(p, _)| {
            let ((property, writer), early) = match self.plan.link(m, LinkEnd::Port(p)) {
                Some(resolved) => (self.source(resolved.target)?, self.is_early(resolved)),
                None => ((self.builder.own_property(m, p)?, None), false),
            };
            Some(LinkedRead { early, writer, property, end: ReadEnd::Input(p) })
        });
        inputs.collect()
    }

    /// Returns the sources of converting links, and the ports that they fill.
    fn sources(&mut self, conversions: &mut Vec<ConversionWiring>) -> Option<Vec<LinkedRead<'s, 'a>>> {
        let (m, survey) = (self.module, self.plan.survey);
        let mut reads = Vec::new();
        let mut ordinals: SortedMap<LinkEnd, usize> = SortedMap::new();
        for resolved in survey.links.iter().filter(|resolved| resolved.port.0 == m && !resolved.is_plain()) {
            let link_end = resolved.port.1;
            if !ordinals.contains_key(&link_end) {
                let conversion = if (self.stays)(link_end) {
                    ConversionWiring::Same(link_end)
                } else {
                    ConversionWiring::New(self.conversion(link_end)?)
                };
                conversions.push(conversion);
            }
            let ordinal = ordinals.entry(link_end).or_default();
            // Else it waits for what is not there yet.
            if let Some(program) = self.program(resolved) {
                let (property, writer) = self.source(resolved.target)?;
                let early = self.is_early(resolved);
                let end = ReadEnd::Source(resolved, program, *ordinal);
                reads.push(LinkedRead { early, writer, property, end });
                *ordinal += 1;
            }
        }
        Some(reads)
    }

    /// Makes an input, with a reader unless it keeps its own.
    fn input(
        &mut self,
        p: usize,
        read: &LinkedRead<'_, '_>,
        writer: Option<Arc<Health>>,
    ) -> Option<(InputPort, Option<Latest>)> {
        let (m, link_end, port) = (self.module, LinkEnd::Port(p), self.plan.port(self.module, p));
        let reader = if (self.stays)(link_end) || self.keeps_own(link_end) {
            None
        } else {
            let reader = read.property.channel()?.latest();
            Some(self.builder.granted(m, link_end, &read.property, reader)?)
        };
        let stale = self.plan.link(m, link_end).and_then(|resolved| resolved.link.stale.as_ref());
        let is_converted = self.plan.is_converted(m, link_end);
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
                || self.plan.link(m, link_end).is_some_and(|resolved| self.is_written(resolved.target)),
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
                    || self.plan.is_converted(module, LinkEnd::Port(port))
            }
            LinkSource::Implied(module, Implied::Params) => self.plan.is_converted(module, LinkEnd::Params),
            LinkSource::Implied(module, Implied::Enabled) => {
                self.plan.links(module, LinkEnd::Enabled).next().is_some()
            }
            _ => true,
        }
    }

    /// Makes a source of a port that links fill, unless it keeps its own.
    fn converted_source(
        &mut self,
        resolved: &ResolvedLink<'_>,
        program: &Arc<Program>,
        property: &Property,
        writer: Option<Arc<Health>>,
    ) -> Option<Option<(Latest, ConvertedSource)>> {
        let (m, link_end) = (self.module, resolved.port.1);
        if (self.stays)(link_end) {
            return Some(None);
        }
        let stale = match link_end {
            LinkEnd::Port(p) => self.plan.port(m, p).stale_after,
            LinkEnd::Enabled | LinkEnd::Params => None,
        };
        let reader = property.channel()?.latest();
        let reader = self.builder.granted(m, link_end, property, reader)?;
        let source = ConvertedSource {
            reader: 0,
            program: Arc::clone(program),
            filter: resolved.filter.clone(),
            writer,
            stale_after: resolved.link.stale.as_ref().map(|stale| stale.value).or(stale),
            seen: (0, 0),
            time: None,
            is_missing: false,
        };
        Some(Some((reader, source)))
    }

    /// Returns the conversion of a link; `None` while its source does not exist.
    fn program(&self, resolved: &ResolvedLink<'_>) -> Option<Arc<Program>> {
        match &resolved.conversion {
            LinkConversion::Plain => None,
            LinkConversion::Converted(program) => Some(Arc::clone(program)),
            // It may be on the board by now; it is linked anew when it is known to be there.
            LinkConversion::Pending(_) if matches!(resolved.target, LinkSource::Remote(_)) => None,
            LinkConversion::Pending(place) => {
                let property = self.builder.property(&self.plan.target_path(resolved.target))?;
                // A mismatch is reported when the plugin is loaded.
                let source = FieldPlace::find(property.descriptor(), &resolved.from).ok()?;
                Program::new(&source, place).ok().map(Arc::new)
            }
        }
    }

    /// Returns true if a port keeps its own property, which links fill.
    fn keeps_own(&self, link_end: LinkEnd) -> bool {
        self.plan.is_converted(self.module, link_end) && self.builder.kept.contains(&(self.module, link_end))
    }

    fn conversion(&mut self, link_end: LinkEnd) -> Option<Conversion> {
        let m = self.module;
        let surveyed = self.plan.surveyed(m);
        let (path, value, triggers) = match link_end {
            LinkEnd::Port(p) => {
                let port = self.plan.port(m, p);
                let value = surveyed.inputs.get(&p).cloned().unwrap_or_else(|| vec![0; port.descriptor.size]);
                (format!("{}/{}", self.plan.name(m), port.name), value, self.plan.triggers(m, p))
            }
            LinkEnd::Enabled => {
                (format!("{}/enabled", self.plan.name(m)), vec![surveyed.module.enabled.value.into()], false)
            }
            LinkEnd::Params => (format!("{}/params", self.plan.name(m)), surveyed.params.clone(), false),
        };
        let property = self.builder.property(&path)?;
        let shape = property.channel()?.shape();
        let items = value.len().saturating_sub(shape.size).checked_div(shape.item).unwrap_or(0);
        let is_set = match link_end {
            LinkEnd::Port(p) => surveyed.inputs.contains_key(&p),
            LinkEnd::Enabled => true,
            LinkEnd::Params => false,
        };
        let writer = if link_end == LinkEnd::Params || self.builder.kept.contains(&(m, link_end)) {
            None
        } else {
            let mut writer = new_writer(&property)?;
            if is_set {
                // It has no reader yet.
                let _ = writer.write(&value, items, self.builder.made.time());
            }
            Some(writer)
        };
        let mut memory = AlignedMemory::zeroed(value.len());
        memory.bytes_mut(value.len()).copy_from_slice(&value);
        let mut links = self.plan.links(m, link_end).filter(|resolved| !resolved.is_plain());
        let is_pending = links.any(|resolved| self.program(resolved).is_none());
        Some(Conversion {
            link_end,
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
        let (m, link_end) = (self.module, LinkEnd::Port(p));
        let port = self.plan.port(m, p);
        let resolved = self.plan.link(m, link_end);
        let link = resolved.map(|resolved| resolved.link);
        let window =
            link.and_then(|link| link.window.as_ref()).map_or(port.window, |window| window.value.into());
        let reader = if (self.stays)(link_end) {
            None
        } else {
            let property = match resolved {
                Some(resolved) => self.source(resolved.target)?.0,
                None => self.builder.own_property(m, p)?,
            };
            let policy = match link.and_then(|link| link.policy.as_ref()).map(|policy| policy.value) {
                Some(LinkPolicy::Evict) => Policy::Evict,
                Some(LinkPolicy::Skip) | None => Policy::Skip,
            };
            let channel = property.channel()?;
            let enough = channel.keeps_enough(window);
            let target = resolved.map(|resolved| resolved.target);
            if !enough && target.and_then(|target| self.plan.writing(target)).is_none() {
                let span = link.map_or(self.plan.surveyed(m).module.name.span, |link| link.from.span);
                let port = self.plan.port_path(m, p);
                let (message, help) = shallow_source(property.path(), channel.depth(), &port, window);
                self.builder.diagnostics.add(span, message, help);
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
            Some(self.builder.granted(m, link_end, &property, reader)?)
        };
        let path = self.plan.port_path(m, p);
        let eviction_message = format!(
            "`{}` fell behind and was evicted, by its link's policy: unlink and link it to read again",
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
            is_previous: resolved.is_some_and(|resolved| self.is_early(resolved)),
            filter: resolved.and_then(|resolved| resolved.filter.clone()),
        })
    }

    fn outbox(&mut self, p: usize) -> Option<OutboxWiring> {
        let m = self.module;
        let target = self.plan.link(m, LinkEnd::Port(p)).map(|resolved| resolved.target);
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
        let sender = self.builder.granted(m, LinkEnd::Port(p), &property, mailbox.sender_of(&name))?;
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
        self.builder.granted(m, LinkEnd::Port(p), &property, mailbox.sender_of(&path))
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
