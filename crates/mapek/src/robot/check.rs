//! Checks of a robot by itself; the loader checks the rest.

use slate_module::blackboard::interface::Value;
use slate_module::blackboard::nearest_names;
use slate_module::role;
use slate_module::{Description, Direction, PortDescription, parse_duration};
use slate_sorted::SortedMap;

use super::content::{AttachedLink, GateEntry, Place, RobotContent, RobotModule, RobotProgram};
use super::error::{RobotError, RobotErrors, RobotProblem};
use super::toml::number;

/// Reads the whole content; all errors in the order of the program.
pub fn check(content: &RobotProgram) -> Result<(), RobotErrors> {
    let mut errors = Vec::new();
    let mut names = SortedMap::new();
    for robot in &content.robots {
        let mut problems = FoundProblems { robot, found: Vec::new() };
        problems.name(&robot.name, robot.place);
        problems.once(&mut names, &robot.name, robot.place);
        problems.modules();
        problems.links();
        problems.gates();
        errors.extend(problems.found);
    }
    kinds(content, &mut errors);
    errors.sort_by_key(|error| (error.place.file(), error.place.line(), error.place.column()));
    if errors.is_empty() { Ok(()) } else { Err(RobotErrors(errors)) }
}

/// Checks that each kind has one code.
fn kinds(content: &RobotProgram, errors: &mut Vec<RobotError>) {
    let mut codes: SortedMap<&str, &RobotModule> = SortedMap::new();
    for robot in &content.robots {
        for module in &robot.modules {
            let first = *codes.entry(module.kind.name()).or_insert(module);
            if first.code != module.code {
                let (name, other) = (module.name.clone(), first.name.clone());
                let problem = RobotProblem::SameKind { name, other, kind: module.kind.name().into() };
                errors.push(RobotError { robot: robot.name.clone(), problem, place: module.place });
            }
        }
    }
}

struct FoundProblems<'a> {
    robot: &'a RobotContent,
    found: Vec<RobotError>,
}

impl<'a> FoundProblems<'a> {
    fn add(&mut self, place: Place, problem: RobotProblem) {
        self.found.push(RobotError { robot: self.robot.name.clone(), problem, place });
    }

    fn name(&mut self, name: &str, place: Place) {
        if name.is_empty() || !name.chars().all(|c| c.is_ascii_alphanumeric() || c == '_' || c == '-') {
            self.add(place, RobotProblem::Name { name: name.into() });
        }
    }

    fn once(&mut self, taken: &mut SortedMap<&'a str, Place>, name: &'a str, place: Place) {
        match taken.get(name) {
            Some(first) => {
                self.add(place, RobotProblem::SameName { name: name.into(), line: first.line() });
            }
            None => {
                taken.insert(name, place);
            }
        }
    }

    fn modules(&mut self) {
        let (mut names, mut parts) = (SortedMap::new(), SortedMap::<_, &RobotModule>::new());
        for module in &self.robot.modules {
            self.name(&module.name, module.place);
            self.once(&mut names, &module.name, module.place);
            if let Some(part) = module.part {
                match parts.get(part) {
                    Some(first) => self.second(part, first, module),
                    None => {
                        parts.insert(part, module);
                    }
                }
            }
            self.params(module);
            match module.description() {
                Ok(description) => self.inputs(module, &description),
                Err(_) if module.is_configured() => {}
                Err(reason) => {
                    self.add(module.place, RobotProblem::Refused { module: module.name.clone(), reason });
                }
            }
        }
        let sends = |module: &&RobotModule| {
            let description = module.description();
            description.is_ok_and(|description| {
                let acts = [role::PLAN, role::REFLEX];
                let port = |port: &PortDescription| {
                    port.direction == Direction::Outbox && acts.contains(&port.role.as_str())
                };
                description.ports.iter().any(port)
            })
        };
        if !parts.contains_key("Execute")
            && let Some(module) = self.robot.modules.iter().find(sends)
        {
            self.add(module.place, RobotProblem::NoExecute { block: module.name.clone() });
        }
    }

    fn second(&mut self, part: &'static str, first: &RobotModule, module: &RobotModule) {
        let (line, second) = (first.place.line(), module.name.clone());
        self.add(module.place, RobotProblem::Second { part, first: first.name.clone(), line, second });
    }

    fn params(&mut self, module: &RobotModule) {
        for parameter in &module.settings.parameters {
            let Some(value) = module.settings.params.get(&parameter.name).and_then(Value::as_f64) else {
                continue;
            };
            let (low, high) = parameter.range.unwrap_or((f64::MIN, f64::MAX));
            if !(low..=high).contains(&value) {
                let problem = RobotProblem::Parameter {
                    module: module.name.clone(),
                    parameter: parameter.name.clone(),
                    value: number(value),
                    low: number(low),
                    high: number(high),
                };
                self.add(module.place, problem);
            }
        }
    }

    fn inputs(&mut self, module: &RobotModule, description: &Description) {
        for (name, interface, _) in &module.settings.inputs {
            let port = self.port(module, description, name, module.place);
            if let Some(port) = port.filter(|port| port.descriptor.hash != interface.hash) {
                let (expected, found) = (port.descriptor.name, interface.name);
                let port = format!("{}/{name}", module.name);
                self.add(module.place, RobotProblem::InputType { port, expected, found });
            }
        }
    }

    fn port<'d>(
        &mut self,
        module: &RobotModule,
        description: &'d Description,
        name: &str,
        place: Place,
    ) -> Option<&'d PortDescription> {
        let port = description.ports.iter().find(|port| port.name == name);
        if port.is_none() {
            let near = nearest(name, description.ports.iter().map(|port| port.name.as_str()));
            let module = module.name.clone();
            self.add(place, RobotProblem::UnknownPort { module, port: name.into(), near });
        }
        port
    }

    /// Returns the module of that name, which must exist.
    fn module(&mut self, name: &str, place: Place) -> Option<&'a RobotModule> {
        let module = self.robot.module(name);
        if module.is_none() {
            let near = nearest(name, self.robot.modules.iter().map(|module| module.name.as_str()));
            self.add(place, RobotProblem::UnknownModule { name: name.into(), near });
        }
        module
    }

    fn links(&mut self) {
        let mut sources: SortedMap<(&str, &str), &AttachedLink> = SortedMap::new();
        for link in &self.robot.links {
            if let Some((name, kind)) = &link.expected {
                let Some(module) = self.module(name, link.place) else { continue };
                if module.kind.name() != *kind {
                    let (name, found) = (name.clone(), module.kind.name().into());
                    self.add(link.place, RobotProblem::OtherKind { name, found, expected: kind });
                    continue;
                }
            }
            let Some(module) = self.module(&link.module, link.place) else { continue };
            if let Ok(description) = module.description() {
                self.port(module, &description, &link.port, link.place);
            }
            self.source(link);
            let Some(first) = sources.insert((&link.module, &link.port), link) else { continue };
            let url = |link: &AttachedLink| link.source.url().unwrap_or_else(|| "nothing".into());
            let port = format!("{}/{}", link.module, link.port);
            let (line, first, second) = (first.place.line(), url(first), url(link));
            self.add(link.place, RobotProblem::TwoSources { port, first, line, second });
        }
    }

    /// Checks that a source in this robot exists.
    /// Its property is checked when the robot is loaded.
    fn source(&mut self, link: &AttachedLink) {
        let Some(url) = link.source.url() else { return };
        let name = url.split('/').next().unwrap_or_default();
        let is_elsewhere =
            name.is_empty() || name.contains(':') || self.robot.gates.iter().any(|gate| gate.name == name);
        if !is_elsewhere {
            self.module(name, link.place);
        }
    }

    fn gates(&mut self) {
        let mut names = SortedMap::new();
        for entry in &self.robot.gates {
            self.name(&entry.name, entry.place);
            self.once(&mut names, &entry.name, entry.place);
            if let Some(module) = self.robot.module(&entry.name) {
                let line = module.place.line();
                self.add(entry.place, RobotProblem::SameName { name: entry.name.clone(), line });
            }
            let count = self.robot.command_ports(entry).len();
            if count != 1 {
                let (gate, module) = (entry.name.clone(), entry.commander.clone());
                let interface = entry.gate.interface.name;
                self.add(entry.place, RobotProblem::Commands { gate, module, count, interface });
            }
            if let Some(text) = &entry.gate.time_to_live
                && parse_duration(text).is_none()
            {
                self.add(entry.place, RobotProblem::Duration { text: text.clone() });
            }
            self.limits(entry);
        }
    }

    fn limits(&mut self, entry: &GateEntry) {
        let GateEntry { name, gate, place, .. } = entry;
        for (field, [low, high]) in &gate.limits {
            let Some(safe) = self.field(entry, field) else { continue };
            if !(*low..=*high).contains(&safe) {
                let problem = RobotProblem::Limits {
                    gate: name.clone(),
                    field: field.clone(),
                    low: number(*low),
                    high: number(*high),
                    safe: number(safe),
                };
                self.add(place, problem);
            }
        }
        for (field, limit) in &gate.rate_limits {
            if self.field(entry, field).is_some() && (limit.is_nan() || *limit <= 0.0) {
                self.add(place, RobotProblem::RateLimit { gate: name.clone(), field: field.clone() });
            }
        }
    }

    /// Returns the safe value of a field that is a number.
    fn field(&mut self, entry: &GateEntry, field: &str) -> Option<f64> {
        let Value::Table(fields) = &entry.gate.safe else { return None };
        let number = entry.gate.safe.get(field).and_then(Value::as_f64);
        if number.is_none() {
            let near = nearest(field, fields.iter().map(|(name, _)| name.as_str()));
            let (gate, interface) = (entry.name.clone(), entry.gate.interface.name);
            self.add(entry.place, RobotProblem::Field { gate, interface, field: field.into(), near });
        }
        number
    }
}

/// Returns the most similar names, or a few of them if none is similar.
fn nearest<'n>(name: &str, names: impl Iterator<Item = &'n str> + Clone) -> Vec<String> {
    match nearest_names(name, names.clone()) {
        near if near.is_empty() => names.take(5).map(str::to_owned).collect(),
        near => near,
    }
}
