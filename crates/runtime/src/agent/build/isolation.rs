//! Resources of isolated modules: shared memory and the start of processes.

use std::io;
use std::sync::Arc;
use std::time::Duration;

use slate_blackboard::channel::ValueMemory;
use slate_blackboard::interface::Interface;
use slate_module::Trigger;

use super::ModuleBuilder;
use slate_composition::{BuildPlan, LinkEnd, LinkSource, has_enough_memory};
use slate_engine::isolation::{Arena, Isolation, ModuleProcess, Supervisor};
use slate_engine::runner::Supervised;

/// Duration of a step, in deadlines, after which it counts as not returning.
const DEADLINES: u64 = 10;

/// Builder of the resources of isolated modules.
pub(super) struct IsolationBuilder<'b, 'a, 's> {
    plan: BuildPlan<'a, 's>,
    builder: &'b mut ModuleBuilder<'a, 's>,
}

impl<'b, 'a, 's> IsolationBuilder<'b, 'a, 's> {
    pub fn new(builder: &'b mut ModuleBuilder<'a, 's>) -> Self {
        Self { plan: builder.plan, builder }
    }

    /// Returns the memory of a property's values.
    /// It is shared memory if an isolated module writes or reads the property.
    pub fn memory(&mut self, m: usize, target: LinkSource) -> Option<Arc<dyn ValueMemory>> {
        let writer = match target {
            LinkSource::Port(writer, _) => Some(writer),
            LinkSource::Command(_)
            | LinkSource::Gate(_)
            | LinkSource::Absent(_)
            | LinkSource::Implied(..)
            | LinkSource::Remote(_)
            | LinkSource::Host(_)
            | LinkSource::Played(_) => None,
        };
        let writer =
            writer.filter(|writer| self.plan.is_isolated(*writer)).map(|writer| self.plan.name(writer));
        let read = self.plan.readers(target).any(|resolved| self.plan.is_isolated(resolved.port.0));
        let arena = match writer {
            Some(writer) => self.builder.resources.arenas.own(writer),
            None if read => self.builder.resources.arenas.host(),
            None => return None,
        };
        self.arena(m, arena).map(|arena| arena as _)
    }

    /// Returns the memory for the values of an input without a link.
    pub fn setting_memory(&mut self, m: usize) -> Option<Arc<dyn ValueMemory>> {
        if !self.plan.is_isolated(m) {
            return None;
        }
        let arena = self.builder.resources.arenas.host();
        self.arena(m, arena).map(|arena| arena as _)
    }

    fn arena(&mut self, m: usize, arena: io::Result<Arc<Arena>>) -> Option<Arc<Arena>> {
        let error = match arena {
            Ok(arena) => return Some(arena),
            Err(error) => error,
        };
        let module = self.plan.surveyed(m).module;
        let message = format!("`{}` can't get shared memory: {error}", module.name.value);
        let help = "raise the limit of address space (`ulimit -v`), or take `isolated = true` out";
        self.builder.diagnostics.add(module.isolated.span, message, help);
        None
    }

    /// Returns the supervision of an isolated module.
    /// `None` for other modules, or after a complaint.
    pub fn supervised(&mut self, m: usize) -> Option<Supervised> {
        if !self.plan.is_isolated(m) {
            return None;
        }
        let arena = self.builder.resources.arenas.own(self.plan.name(m));
        let own = self.arena(m, arena)?;
        let arena = self.builder.resources.arenas.host();
        let mut readable = vec![self.arena(m, arena)?];
        let links = self.plan.survey.links.iter().filter(|resolved| resolved.port.0 == m);
        let mut writers: Vec<usize> = links
            .filter_map(|resolved| match (resolved.port.1, resolved.target) {
                (LinkEnd::Port(_), LinkSource::Port(writer, _)) if writer != m => Some(writer),
                _ => None,
            })
            .filter(|writer| self.plan.is_isolated(*writer))
            .collect();
        writers.sort_unstable();
        writers.dedup();
        for writer in writers {
            let arena = self.builder.resources.arenas.own(self.plan.name(writer));
            readable.push(self.arena(m, arena)?);
        }
        let surveyed = self.plan.surveyed(m);
        if !has_enough_memory(surveyed, &mut self.builder.diagnostics) {
            return None;
        }
        let (wanted, lockstep) = (surveyed.module.isolation, self.builder.resources.lockstep);
        let hang = self.plan.configuration.hang().value;
        let tick_timeout = match surveyed.deadline {
            // The result of a lockstep run does not depend on the machine's speed.
            Some(deadline) if !lockstep => hang.min(deadline.saturating_mul(DEADLINES)),
            _ => hang,
        };
        let isolation = Isolation {
            name: surveyed.setup.name.clone(),
            program: self.builder.resources.arenas.program.clone(),
            memory: wanted.memory,
            tick_timeout: Duration::from_nanos(tick_timeout),
            call_timeout: Duration::from_nanos(hang),
            own,
            readable,
            ports: surveyed.description.ports.clone(),
            params_size: surveyed.description.params.size,
            process_record: Default::default(),
        };
        let is_turn_signaled = !lockstep && surveyed.trigger == Trigger::Stage;
        let process = self.builder.implied_writer(
            m,
            "process",
            "The process that it runs in.",
            ModuleProcess::DESCRIPTOR,
        )?;
        Some(Supervised {
            isolation: Arc::new(isolation),
            supervisor: Supervisor::default(),
            rearm: wanted.rearm,
            is_turn_signaled,
            process,
            restarts: 0,
            written: 0,
        })
    }
}
