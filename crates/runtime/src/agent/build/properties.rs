//! Properties of a module, made before it runs.

use std::sync::Arc;

use slate_blackboard::channel::Budget;
use slate_blackboard::interface::Descriptor;
use slate_blackboard::message::Mailbox;
use slate_blackboard::{Access, BoardError, Placement, Property, Store};
use slate_module::{Direction, Interface, PortDescription};

use super::{BuildMoment, Failed, ModuleBuilder};
use crate::aspects::followed;
use slate_composition::parameters::enabled_descriptor;
use slate_composition::{BuildPlan, Implied, LinkEnd, LinkSource, PlannedPort, SPARE_READERS};
use slate_engine::runner::{ModuleState, ModuleTiming};
use slate_engine::timing::TimingHistogram;

/// Properties that every module's runner writes.
fn implied_properties() -> [(Implied, &'static str, &'static Descriptor); 3] {
    [
        (Implied::State, "State of the module.", ModuleState::DESCRIPTOR),
        (Implied::Timing, "Duration of the module's ticks.", ModuleTiming::DESCRIPTOR),
        (Implied::Histogram, "Histogram of the durations of its ticks.", TimingHistogram::DESCRIPTOR),
    ]
}

/// Builder of the modules' properties.
pub(super) struct PropertyBuilder<'b, 'a, 's> {
    plan: BuildPlan<'a, 's>,
    builder: &'b mut ModuleBuilder<'a, 's>,
}

impl<'b, 'a, 's> PropertyBuilder<'b, 'a, 's> {
    pub fn new(builder: &'b mut ModuleBuilder<'a, 's>) -> Self {
        Self { plan: builder.plan, builder }
    }

    /// Makes all properties of a module, and those of absent modules it links to.
    pub fn of_module(&mut self, m: usize) -> Result<(), Failed> {
        self.played(m)?;
        for (p, port) in self.plan.surveyed(m).description.ports.iter().enumerate() {
            let path = self.plan.port_path(m, p);
            match PlannedPort::of(self.plan, m, p) {
                PlannedPort::Output => self.output_property(m, LinkSource::Port(m, p), &path, port)?,
                PlannedPort::Messages => self.mailbox(m, &path, port)?,
                PlannedPort::Alias(source) => {
                    self.alias(m, &path, source)?;
                    self.absent(m, source, port)?;
                }
                PlannedPort::Converted => self.converted(m, LinkEnd::Port(p), &path)?,
                PlannedPort::Setting => self.setting(m, &path, p)?,
                PlannedPort::Sent(inbox) => self.absent(m, inbox, port)?,
                PlannedPort::Nothing => {}
            }
        }
        self.implied(m)
    }

    /// Prepares the property or alias at the path of a port whose links change.
    pub fn relinked(&mut self, m: usize, link_end: LinkEnd) -> Result<(), Failed> {
        let plan = self.plan;
        let target = plan.link(m, link_end).map(|resolved| resolved.target);
        let is_converted = plan.is_converted(m, link_end);
        let name = plan.name(m);
        let (path, port) = match link_end {
            LinkEnd::Port(p) => {
                let port = plan.port(m, p);
                (format!("{name}/{}", port.name), Some((p, port)))
            }
            LinkEnd::Enabled => (format!("{name}/enabled"), None),
            // They stand there always.
            LinkEnd::Params => return Ok(()),
        };
        match (&port, target) {
            (Some((_, port)), Some(target)) => self.absent(m, target, port)?,
            (None, Some(target)) => self.absent_switch(m, target)?,
            (_, None) => {}
        }
        if port.as_ref().is_some_and(|(_, port)| port.direction == Direction::Outbox) {
            return Ok(());
        }
        if is_converted
            && self.builder.property(&path).is_some_and(|property| property.access() == Access::Output)
        {
            self.builder.kept.insert((m, link_end));
            return Ok(());
        }
        let placement = match (target, port) {
            (Some(target), _) => Placement::Alias { path, target: plan.target_path(target) },
            (None, _) if is_converted => Placement::Property(self.new_converted(m, link_end)?),
            (None, Some((p, _))) => Placement::Property(self.new_setting(m, &path, p)?),
            (None, None) => Placement::Property(self.new_switch(m)?),
        };
        self.builder.placements.push(placement);
        Ok(())
    }

    /// Makes the source of a link if its module does not exist yet.
    fn absent(&mut self, m: usize, target: LinkSource, port: &PortDescription) -> Result<(), Failed> {
        if matches!(target, LinkSource::Remote(_)) && port.direction == Direction::Outbox {
            // Messages wait there for transmission to the other agent.
            return self.mailbox(m, &self.plan.target_path(target), port);
        }
        let LinkSource::Absent(absent) = target else { return Ok(()) };
        let path = self.plan.survey.absent[absent].path.clone();
        if port.direction == Direction::Outbox {
            self.mailbox(m, &path, port)
        } else {
            self.output_property(m, target, &path, port)
        }
    }

    /// Makes the source of a link that switches a module, if its module is absent.
    fn absent_switch(&mut self, m: usize, target: LinkSource) -> Result<(), Failed> {
        let LinkSource::Absent(absent) = target else { return Ok(()) };
        let path = self.plan.survey.absent[absent].path.clone();
        if self.builder.existing(m, &path, enabled_descriptor())?.is_none() {
            let (depth, budget) = self.plan.demand(target, &path);
            let store = Store { capacity: 0, depth, budget };
            let (doc, descriptor) = ("Switch of the module.", enabled_descriptor());
            let added =
                self.builder.resources.board.add_channel(&path, doc, descriptor, store, Access::Output);
            self.builder.added(m, added)?;
        }
        Ok(())
    }

    /// Makes the replayed properties of the module, as deep as its readers need.
    fn played(&mut self, m: usize) -> Result<(), Failed> {
        let survey = self.plan.survey;
        for resolved in survey.links.iter().filter(|resolved| resolved.port.0 == m) {
            let LinkSource::Played(index) = resolved.target else { continue };
            let played = &survey.played[index];
            if let (LinkEnd::Port(port), true) = (resolved.port.1, played.is_mailbox) {
                self.mailbox(m, &played.path, &survey.modules[m].description.ports[port])?;
                continue;
            }
            if self.builder.existing(m, &played.path, played.descriptor)?.is_none() {
                let (depth, budget) = self.plan.demand(resolved.target, &played.path);
                let added = played.add(&self.builder.resources.board, depth, budget);
                self.builder.added(m, added)?;
            }
        }
        Ok(())
    }

    /// Makes the property that an output writes; a reader may have made it before.
    fn output_property(
        &mut self,
        m: usize,
        target: LinkSource,
        path: &str,
        port: &PortDescription,
    ) -> Result<(), Failed> {
        if let Some(existing) = self.builder.existing(m, path, port.descriptor)? {
            existing.set_part(self.plan.part(target));
            return Ok(());
        }
        let (depth, budget) = self.plan.demand(target, path);
        let store = followed(port.descriptor, Store { capacity: port.capacity, depth, budget });
        let memory = self.builder.isolation().memory(m, target);
        let board = &self.builder.resources.board;
        let added = board.add_channel_in(path, &port.doc, port.descriptor, store, Access::Output, memory);
        self.builder.added(m, added)?.set_part(self.plan.part(target));
        Ok(())
    }

    fn mailbox(&mut self, m: usize, path: &str, port: &PortDescription) -> Result<(), Failed> {
        let part = slate_composition::inbox_part(port);
        if let Some(existing) = self.builder.existing(m, path, port.descriptor)? {
            existing.set_part(part);
            return Ok(());
        }
        let senders = self.plan.links_to(path).count() as u16 + SPARE_READERS;
        let mailbox = Mailbox::new(port.descriptor.shape(0), senders, port.window as u16 * 2);
        let added = self.builder.resources.board.add_mailbox(path, &port.doc, port.descriptor, mailbox);
        self.builder.added(m, added)?.set_part(part);
        Ok(())
    }

    fn alias(&mut self, m: usize, path: &str, target: LinkSource) -> Result<(), Failed> {
        let target = self.plan.target_path(target);
        let added = self.builder.resources.board.add_alias(path, &target);
        self.builder.added(m, added)
    }

    fn converted(&mut self, m: usize, link_end: LinkEnd, path: &str) -> Result<(), Failed> {
        if self.builder.property(path).is_some() {
            let error = BoardError::Exists { url: format!("/{path}") };
            return self.builder.added(m, Err(error));
        }
        let property = self.new_converted(m, link_end)?;
        self.builder.resources.board.place(vec![Placement::Property(property)]);
        Ok(())
    }

    /// Makes the property of a port that links fill; it is not on the board yet.
    fn new_converted(&mut self, m: usize, link_end: LinkEnd) -> Result<Arc<Property>, Failed> {
        let (port, descriptor, capacity, doc) = match link_end {
            LinkEnd::Port(p) => {
                let port = self.plan.port(m, p);
                (LinkSource::Port(m, p), port.descriptor, port.capacity, port.doc.clone())
            }
            LinkEnd::Enabled | LinkEnd::Params => {
                let doc = String::from("Switch of the module.");
                (LinkSource::Implied(m, Implied::Enabled), enabled_descriptor(), 0, doc)
            }
        };
        let path = self.plan.target_path(port);
        let (_, budget) = self.plan.demand(port, &path);
        let budget = Budget { latest: budget.latest + 1, ..budget };
        let store = Store { capacity, depth: 1, budget };
        let memory = self.builder.isolation().setting_memory(m);
        let made =
            self.builder.resources.board.new_channel(&path, &doc, descriptor, store, Access::Output, memory);
        self.made(m, made)
    }

    /// Makes the parameters, `enabled` and the runner's properties.
    /// Other modules may be linked to all of them.
    fn implied(&mut self, m: usize) -> Result<(), Failed> {
        let name = self.plan.name(m);
        for (implied, doc, descriptor) in implied_properties() {
            let path = format!("{name}/{}", implied.name());
            if self.builder.existing(m, &path, descriptor)?.is_none() {
                let (depth, budget) = self.plan.demand(LinkSource::Implied(m, implied), &path);
                let store = Store { capacity: 0, depth, budget };
                let added =
                    self.builder.resources.board.add_channel(&path, doc, descriptor, store, Access::Output);
                self.builder.added(m, added)?;
            }
        }
        let (descriptor, params) =
            (self.plan.surveyed(m).description.params, self.plan.surveyed(m).params.clone());
        let path = format!("{name}/params");
        let (doc, store) = ("Parameters of the module.", self.setting_store(m, Implied::Params, &path));
        let added = self.builder.resources.board.add_channel(&path, doc, descriptor, store, Access::Setting);
        let property = self.builder.added(m, added)?;
        self.set_first(&property, Some(&params));
        property.reserve(self.plan.reserved(m));
        let path = format!("{name}/enabled");
        if let Some(target) = self.plan.link(m, LinkEnd::Enabled).map(|resolved| resolved.target) {
            self.absent_switch(m, target)?;
            return self.alias(m, &path, target);
        }
        if self.plan.is_converted(m, LinkEnd::Enabled) {
            return self.converted(m, LinkEnd::Enabled, &path);
        }
        let property = self.new_switch(m)?;
        self.builder.resources.board.place(vec![Placement::Property(property)]);
        Ok(())
    }

    /// Makes the property `enabled` of a module that no link switches.
    /// It is not on the board yet.
    fn new_switch(&mut self, m: usize) -> Result<Arc<Property>, Failed> {
        let path = format!("{}/enabled", self.plan.name(m));
        let store = self.setting_store(m, Implied::Enabled, &path);
        let (doc, descriptor) = ("Switch of the module.", enabled_descriptor());
        let made =
            self.builder.resources.board.new_channel(&path, doc, descriptor, store, Access::Setting, None);
        let property = self.made(m, made)?;
        self.set_first(&property, Some(&[self.plan.surveyed(m).module.enabled.value.into()]));
        Ok(property)
    }

    /// Returns the store of a setting, with an additional reader for the module.
    fn setting_store(&self, m: usize, implied: Implied, path: &str) -> Store {
        let (depth, budget) = self.plan.demand(LinkSource::Implied(m, implied), path);
        Store { capacity: 0, depth, budget: Budget { latest: budget.latest + 1, ..budget } }
    }

    fn setting(&mut self, m: usize, path: &str, p: usize) -> Result<(), Failed> {
        if self.builder.property(path).is_some() {
            let error = BoardError::Exists { url: format!("/{path}") };
            return self.builder.added(m, Err(error));
        }
        let property = self.new_setting(m, path, p)?;
        self.builder.resources.board.place(vec![Placement::Property(property)]);
        Ok(())
    }

    /// Makes the property of an input without a link; it is not on the board yet.
    fn new_setting(&mut self, m: usize, path: &str, p: usize) -> Result<Arc<Property>, Failed> {
        let port = self.plan.port(m, p);
        let value = self.plan.surveyed(m).inputs.get(&p).cloned();
        let budget = Budget { latest: 1 + SPARE_READERS, queues: 1, window: port.window as u16 };
        let depth = if port.direction == Direction::Queue { port.window * 2 } else { 1 };
        let store = Store { capacity: port.capacity, depth, budget };
        let memory = self.builder.isolation().setting_memory(m);
        let board = &self.builder.resources.board;
        let made = board.new_channel(path, &port.doc, port.descriptor, store, Access::Setting, memory);
        let property = self.made(m, made)?;
        self.set_first(&property, value.as_deref());
        Ok(property)
    }

    /// Completes a new property: recorders see it unless it is a trial.
    fn made(&mut self, m: usize, made: Result<Arc<Property>, BoardError>) -> Result<Arc<Property>, Failed> {
        let property = self.builder.added(m, made)?;
        if self.builder.made != BuildMoment::OnTrial {
            self.builder.resources.board.tap(&property);
        }
        Ok(property)
    }

    /// Sets the first value of a setting.
    /// It is the value that its module had before it left, if that is kept, else that of the configuration.
    fn set_first(&self, property: &Property, value: Option<&[u8]>) {
        let kept = self.builder.resources.kept.get(property.path());
        let kept = kept.filter(|kept| kept.schema == property.descriptor().hash);
        let first = kept
            .map(|kept| (kept.bytes.as_slice(), kept.time))
            .or(value.map(|bytes| (bytes, self.builder.made.time())));
        if let Some((bytes, time)) = first {
            // The host writes a setting, and no reader blocks it.
            let _ = property.set_bytes(bytes, time);
        }
    }
}
