//! Other links for modules that go on.

use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;

use slate_blackboard::wake::Wake;
use slate_blackboard::{Access, Placement};
use slate_module::Direction;

use super::{Builder, Failed, Ground, Made};
use crate::configuration::{Configuration, Diagnostic};
use crate::runner::Wiring;
use slate_composition::{Complaints, Survey, Wire};

/// What modules go on with; nothing is changed before it is exchanged.
pub(in crate::agent) struct Rewiring {
    /// By module.
    pub wirings: BTreeMap<String, Wiring>,
    /// Whom outputs wake, by their paths.
    pub wakes: BTreeMap<String, Vec<Arc<Wake>>>,
    pub placements: Vec<Placement>,
    /// Which parameters tools must not set any more, by module.
    pub reserved: BTreeMap<String, Vec<(String, String)>>,
}

/// Makes other readers for the ports that are listed, by module, and finds whom the outputs at those paths wake.
pub(in crate::agent) fn rewire(
    configuration: &Configuration,
    survey: &Survey<'_>,
    ground: &mut Ground,
    changed: &BTreeMap<usize, BTreeSet<Wire>>,
    paths: &BTreeSet<String>,
    made: Made,
) -> Result<Rewiring, Vec<Diagnostic>> {
    let complaints = Complaints::new(configuration);
    let mut builder = Builder {
        configuration,
        survey,
        ground,
        complaints,
        placements: Vec::new(),
        kept: BTreeSet::new(),
        made,
    };
    let mut wirings = BTreeMap::new();
    for (m, wires) in changed {
        // What is wrong was complained about.
        let _ = wires.iter().try_for_each(|wire| builder.place(*m, *wire));
    }
    if builder.complaints.diagnostics.is_empty() {
        for (m, wires) in changed {
            match builder.wiring(*m, &|wire| !wires.contains(&wire)) {
                Some(wiring) => drop(wirings.insert(builder.name(*m).to_owned(), wiring)),
                None if builder.complaints.diagnostics.is_empty() => {
                    let span = builder.surveyed(*m).module.name.span;
                    let message = format!("`{}` can't get its handles", builder.name(*m));
                    builder.complaints.add(span, message, "load its plugin anew");
                }
                None => {}
            }
        }
    }
    let parameters = changed.iter().filter(|(_, wires)| wires.contains(&Wire::Params)).map(|(m, _)| *m);
    let reserved = parameters.map(|m| (builder.name(m).to_owned(), builder.reserved(m))).collect();
    let wakes = paths.iter().map(|path| (path.clone(), builder.wakes(path))).collect();
    let Builder { complaints, placements, .. } = builder;
    if complaints.diagnostics.is_empty() {
        Ok(Rewiring { wirings, wakes, placements, reserved })
    } else {
        Err(complaints.diagnostics)
    }
}

impl Builder<'_, '_> {
    /// What is to stand at the path of a port whose links are other ones.
    fn place(&mut self, m: usize, wire: Wire) -> Result<(), Failed> {
        let target = self.joint(m, wire).map(|joint| joint.target);
        let is_converted = self.conversions(m, wire).next().is_some();
        let name = self.name(m);
        let (path, port) = match wire {
            Wire::Port(p) => {
                let port = self.port(m, p).clone();
                (format!("{name}/{}", port.name), Some((p, port)))
            }
            Wire::Enabled => (format!("{name}/enabled"), None),
            // They stand there always.
            Wire::Params => return Ok(()),
        };
        match (&port, target) {
            (Some((_, port)), Some(target)) => self.absent(m, target, port)?,
            (None, Some(target)) => self.absent_switch(m, target)?,
            (_, None) => {}
        }
        if port.as_ref().is_some_and(|(_, port)| port.direction == Direction::Outbox) {
            return Ok(());
        }
        if is_converted && self.property(&path).is_some_and(|property| property.access() == Access::Output) {
            self.kept.insert((m, wire));
            return Ok(());
        }
        let placement = match (target, port) {
            (Some(target), _) => Placement::Alias { path, target: self.target_path(target) },
            (None, _) if is_converted => Placement::Property(self.new_converted(m, wire)?),
            (None, Some((p, _))) => Placement::Property(self.new_setting(m, &path, p)?),
            (None, None) => Placement::Property(self.new_switch(m)?),
        };
        self.placements.push(placement);
        Ok(())
    }
}
