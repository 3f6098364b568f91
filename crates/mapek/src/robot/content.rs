use std::any::TypeId;
use std::panic::Location;

use slate_module::blackboard::interface::{Descriptor, Value};
use slate_module::{Description, Direction, ModuleKind, Parameter, Plugin, PortDescription, Setup};

use super::Gate;

/// Line of a program.
pub type Place = &'static Location<'static>;

/// Robots of an agent, and their surroundings.
#[derive(Clone, Debug, Default)]
pub struct RobotProgram {
    /// Robots, at least one.
    pub robots: Vec<RobotContent>,
    pub world: String,
    pub plugins: Vec<Plugin>,
}

#[derive(Clone, Debug)]
pub struct RobotContent {
    pub name: String,
    pub modules: Vec<RobotModule>,
    pub links: Vec<AttachedLink>,
    pub gates: Vec<GateEntry>,
    pub place: Place,
}

#[derive(Clone, Debug)]
pub struct RobotModule {
    pub name: String,
    /// Part of which a robot has one, such as `Plan`.
    pub part: Option<&'static str>,
    pub kind: ModuleKind,
    /// The type of its code, as kinds of one name may differ.
    pub code: TypeId,
    pub settings: ModuleSettings,
    pub place: Place,
}

#[derive(Clone, Debug)]
pub struct ModuleSettings {
    pub parameters: Vec<Parameter>,
    /// Table of all parameters, or `Null`.
    pub params: Value,
    /// Port, interface and value.
    pub inputs: Vec<(String, &'static Descriptor, Value)>,
    pub others: Vec<(&'static str, Value)>,
}

impl Default for ModuleSettings {
    fn default() -> Self {
        Self { parameters: Vec::new(), params: Value::Null, inputs: Vec::new(), others: Vec::new() }
    }
}

/// A port and its source, or the inbox and its sender.
#[derive(Clone, Debug)]
pub struct AttachedLink {
    pub module: String,
    pub port: String,
    pub source: Source,
    /// Set if the link reads the value of the previous cycle.
    pub is_previous: bool,
    /// Name and kind of the block that was named with its type.
    pub expected: Option<(String, &'static str)>,
    pub place: Place,
}

#[derive(Clone, Debug)]
pub enum Source {
    /// A URL, relative to the robot or absolute.
    Url(String),
    /// A port of a block that was attached.
    Block { module: String, port: &'static str },
    /// No source.
    None,
}

#[derive(Clone, Debug)]
pub struct GateEntry {
    pub name: String,
    pub gate: Gate,
    /// Module whose commands it takes.
    pub commander: String,
    pub place: Place,
}

impl AttachedLink {
    pub fn new(module: &str, port: &str, source: Source, place: Place) -> Self {
        Self { module: module.into(), port: port.into(), source, is_previous: false, expected: None, place }
    }
}

impl Source {
    /// Returns the source in the form of a configuration.
    pub fn url(&self) -> Option<String> {
        match self {
            Self::Url(url) => Some(url.clone()),
            Self::Block { module, port } => Some(format!("{module}/{port}")),
            Self::None => None,
        }
    }
}

impl RobotModule {
    /// Returns the ports and parameters.
    /// The error is the reason if the block refuses to be set up without its configuration.
    pub fn description(&self) -> Result<Description, String> {
        let setup = Setup { name: &self.name, seed: 0, period: 20_000_000, section: None, params: None };
        self.kind.describe(&setup).map_err(|refusal| refusal.0)
    }

    /// Returns true if the ports depend on a table of the configuration.
    pub fn is_configured(&self) -> bool {
        !self.kind.section().is_empty()
    }

    /// Parameters that differ from their default.
    pub fn changed_params(&self) -> Vec<(&str, &Value)> {
        let changed = |parameter: &'_ &Parameter| {
            self.settings.params.get(&parameter.name).is_some_and(|value| *value != parameter.default)
        };
        let of = |parameter: &'_ Parameter| {
            let Value::Table(entries) = &self.settings.params else { return None };
            let (name, value) = entries.iter().find(|(name, _)| *name == parameter.name)?;
            Some((name.as_str(), value))
        };
        self.settings.parameters.iter().filter(changed).filter_map(of).collect()
    }
}

impl RobotContent {
    pub fn new(name: &str, place: Place) -> Self {
        Self { name: name.into(), modules: Vec::new(), links: Vec::new(), gates: Vec::new(), place }
    }

    /// Returns the ports by which the commander of a gate sends its command.
    pub fn command_ports(&self, entry: &GateEntry) -> Vec<String> {
        let commands = |port: &PortDescription| {
            port.direction == Direction::Command && port.descriptor.hash == entry.gate.interface.hash
        };
        let description = self.module(&entry.commander).and_then(|module| module.description().ok());
        let ports = description.map(|description| description.ports).unwrap_or_default();
        ports.into_iter().filter(commands).map(|port| port.name).collect()
    }

    pub fn module(&self, name: &str) -> Option<&RobotModule> {
        self.modules.iter().find(|module| module.name == name)
    }
}

impl RobotProgram {
    pub fn plugins(&self, name: &str, others: &[Plugin]) -> Vec<Plugin> {
        let mut kinds: Vec<ModuleKind> = Vec::new();
        for module in self.robots.iter().flat_map(|robot| &robot.modules) {
            let is_known = |kind: &ModuleKind| kind.name() == module.kind.name();
            let brought = self.plugins.iter().chain(others).flat_map(Plugin::kinds).any(is_known);
            if !brought && !kinds.iter().any(is_known) {
                kinds.push(module.kind.clone());
            }
        }
        let own = (!kinds.is_empty()).then(|| Plugin::new(name, kinds));
        self.plugins.iter().cloned().chain(own).collect()
    }
}
