//! What configuration asks for, checked against what the plugins offer; nothing is made here.

use std::collections::BTreeMap;

use slate_blackboard::interface::Value;
use slate_blackboard::nearest_names;
use slate_module::{Description, Direction, ModuleKind, Plugin, PortDescription, Setup, Stage, Trigger};

use super::order::{CycleFound, levels};
use super::parameters;
use crate::configuration::{Configuration, Diagnostic, Link, Module, Span};

/// Ports that every module has beside its own.
pub(super) const RESERVED: [&str; 4] = ["params", "enabled", "state", "timing"];

/// A module that will be made.
pub(super) struct Surveyed<'a> {
    pub module: &'a Module,
    pub kind: ModuleKind,
    pub description: Description,
    pub stage: Stage,
    pub trigger: Trigger,
    pub deadline: Option<u64>,
    pub params: Vec<u8>,
    pub section: Option<Value>,
    /// Values of unlinked inputs, by port.
    pub inputs: BTreeMap<usize, Vec<u8>>,
}

/// A link between two ports.
#[derive(Clone, Copy, Debug)]
pub(super) struct Joint<'a> {
    pub link: &'a Link,
    /// The module and the port that the link belongs to: an input or an outbox.
    pub port: (usize, Wire),
    /// The module and the port that it leads to.
    pub target: Target,
}

/// What a link ends at in its own module.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Wire {
    Port(usize),
    Enabled,
}

/// What a link leads to.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Target {
    /// A port of a module.
    Port(usize, usize),
    /// The command of an actuator that passed its gate.
    Command(usize),
}

/// Everything that will be made.
pub(super) struct Survey<'a> {
    pub modules: Vec<Surveyed<'a>>,
    pub joints: Vec<Joint<'a>>,
    /// Per stage, levels of modules.
    pub order: Vec<Vec<Vec<usize>>>,
}

/// Collects complaints.
pub(super) struct Complaints<'a> {
    configuration: &'a Configuration,
    pub diagnostics: Vec<Diagnostic>,
}

impl<'a> Complaints<'a> {
    pub fn new(configuration: &'a Configuration) -> Self {
        Self { configuration, diagnostics: Vec::new() }
    }

    pub fn add(&mut self, span: Span, message: impl Into<String>, help: impl Into<String>) {
        let help: String = help.into();
        self.diagnostics.push(self.configuration.diagnostic(span, message, Some(help)));
    }
}

/// Words for "did you mean".
fn suggest<'n>(name: &str, names: impl Iterator<Item = &'n str> + Clone) -> String {
    let near = nearest_names(name, names.clone());
    if near.is_empty() {
        format!("there are: {}", names.collect::<Vec<_>>().join(", "))
    } else {
        format!("did you mean {}?", near.join(" or "))
    }
}

pub(super) fn survey<'a>(
    configuration: &'a Configuration,
    plugins: &[Plugin],
    complaints: &mut Complaints<'a>,
) -> Survey<'a> {
    let mut modules = Vec::new();
    for module in configuration.modules() {
        if let Some(surveyed) = survey_module(configuration, module, plugins, complaints) {
            modules.push(surveyed);
        }
    }
    check_unique(&modules, complaints);
    check_time_source(configuration, complaints);
    // Links can only be judged when every module is known.
    if modules.len() < configuration.modules().len() {
        return Survey { modules, joints: Vec::new(), order: Vec::new() };
    }
    let joints = survey_links(configuration, &modules, complaints);
    let order = survey_order(configuration, &modules, &joints, complaints);
    Survey { modules, joints, order }
}

fn survey_module<'a>(
    configuration: &'a Configuration,
    module: &'a Module,
    plugins: &[Plugin],
    complaints: &mut Complaints<'a>,
) -> Option<Surveyed<'a>> {
    let mut kinds = plugins.iter().flat_map(Plugin::kinds);
    let Some(kind) = kinds.find(|kind| kind.name() == module.plugin.value) else {
        let help =
            suggest(&module.plugin.value, plugins.iter().flat_map(Plugin::kinds).map(ModuleKind::name));
        complaints.add(
            module.plugin.span,
            format!("no plugin brings a module `{}`", module.plugin.value),
            help,
        );
        return None;
    };
    let setup = |section| Setup {
        name: &module.name.value,
        seed: configuration.seed().value,
        period: configuration.period().value,
        section,
    };
    // The description says which section the module wants, and may itself depend on that section.
    let first = kind.section();
    let section = if first.is_empty() { None } else { configuration.table(first).map(Value::from) };
    let description = match kind.describe(&setup(section.as_ref())) {
        Ok(description) => description,
        Err(refusal) => {
            complaints.add(
                module.name.span,
                format!("{}: {refusal}", module.name.value),
                "see the module's documentation",
            );
            return None;
        }
    };
    if let Some(port) = description.ports.iter().find(|port| RESERVED.contains(&port.name.as_str())) {
        let message =
            format!("module type `{}` names a port `{}`, which every module has", kind.name(), port.name);
        complaints.add(module.plugin.span, message, "rename the port");
        return None;
    }
    let before = complaints.diagnostics.len();
    let params = parameters::bytes(&description, &module.params, complaints);
    let mut inputs = BTreeMap::new();
    for (name, entry) in module.inputs.iter() {
        let port =
            description.ports.iter().position(|port| port.name == name && port.direction == Direction::Input);
        match port {
            Some(port) => {
                let descriptor = description.ports[port].descriptor;
                if let Some(bytes) = parameters::value_bytes(descriptor, &entry.value, complaints) {
                    inputs.insert(port, bytes);
                }
            }
            None => {
                let names = description.ports.iter().filter(|port| port.direction == Direction::Input);
                let help = suggest(name, names.map(|port| port.name.as_str()));
                complaints.add(entry.key, format!("`{}` has no input `{name}`", module.name.value), help);
            }
        }
    }
    if complaints.diagnostics.len() > before {
        return None;
    }
    let stage = module.stage.as_ref().map_or(description.stage, |stage| stage.value);
    let trigger =
        module.trigger.as_ref().map_or_else(|| description.trigger.clone(), |trigger| trigger.value.clone());
    if let Trigger::On { ports, .. } = &trigger
        && let Some(missing) =
            ports.iter().find(|name| !description.ports.iter().any(|port| port.name == **name))
    {
        let span = module.trigger.as_ref().map_or(module.name.span, |trigger| trigger.span);
        let help = suggest(missing, description.ports.iter().map(|port| port.name.as_str()));
        complaints.add(
            span,
            format!("`{}` is to run on `{missing}`, which is none of its ports", module.name.value),
            help,
        );
        return None;
    }
    let deadline = module.deadline.as_ref().map(|deadline| deadline.value).or(description.deadline);
    Some(Surveyed {
        module,
        kind: kind.clone(),
        description,
        stage,
        trigger,
        deadline,
        params,
        section,
        inputs,
    })
}

/// The time source is one of the modules.
fn check_time_source(configuration: &Configuration, complaints: &mut Complaints<'_>) {
    let Some(source) = configuration.time_source() else { return };
    let names = configuration.modules().iter().map(|module| module.name.value.as_str());
    if !names.clone().any(|name| name == source.value) {
        complaints.add(
            source.span,
            format!("no module `{}` to be the time source", source.value),
            suggest(&source.value, names),
        );
    }
}

/// The robot that a module belongs to.
pub(super) fn scope(name: &str) -> &str {
    name.rsplit_once('/').map_or("", |(scope, _)| scope)
}

/// One Plan, one Execute, one Knowledge per robot (RoCS, 5.1).
fn check_unique(modules: &[Surveyed<'_>], complaints: &mut Complaints<'_>) {
    let mut seen: BTreeMap<(&str, &str), &str> = BTreeMap::new();
    for surveyed in modules {
        let name = surveyed.module.name.value.as_str();
        let part = surveyed.description.unique.as_str();
        if part.is_empty() {
            continue;
        }
        if let Some(first) = seen.insert((scope(name), part), name) {
            let message = format!("a robot has one {part}, and `{first}` is it already");
            complaints.add(
                surveyed.module.name.span,
                message,
                format!("remove `{name}` or put it into another robot"),
            );
        }
    }
}

fn survey_links<'a>(
    configuration: &'a Configuration,
    modules: &[Surveyed<'a>],
    complaints: &mut Complaints<'a>,
) -> Vec<Joint<'a>> {
    let mut joints: Vec<Joint<'a>> = Vec::new();
    for link in configuration.links() {
        if let Some(agent) = link.from.value.agent().filter(|agent| *agent != configuration.agent_name()) {
            let message = format!("`{}` belongs to agent `{agent}`", link.from.value);
            complaints.add(
                link.from.span,
                message,
                format!("this agent is `{}`; links join its own ports", configuration.agent_name()),
            );
            continue;
        }
        let from = link.from.value.path_in("");
        let Some(port) = find_own_port(modules, link, complaints) else { continue };
        let Some(target) = find_target(configuration, modules, link, &from, complaints) else { continue };
        let joint = Joint { link, port, target };
        if check_joint(configuration, modules, &joint, &from, complaints) {
            joints.push(joint);
        }
    }
    joints
}

/// The module whose name begins the path, and the rest of the path: the longest name wins.
fn split_module<'p>(modules: &[Surveyed<'_>], path: &'p str) -> Option<(usize, &'p str)> {
    let mut end = path.len();
    while let Some(slash) = path[..end].rfind('/') {
        if let Some(index) = modules.iter().position(|surveyed| surveyed.module.name.value == path[..slash]) {
            return Some((index, &path[slash + 1..]));
        }
        end = slash;
    }
    None
}

fn find_own_port<'a>(
    modules: &[Surveyed<'a>],
    link: &Link,
    complaints: &mut Complaints<'a>,
) -> Option<(usize, Wire)> {
    let to = &link.to.value;
    let Some((module, name)) = split_module(modules, to) else {
        let help = suggest(to, modules.iter().map(|surveyed| surveyed.module.name.value.as_str()));
        complaints.add(link.to.span, format!("no module owns `{to}`"), help);
        return None;
    };
    if name == "enabled" {
        return Some((module, Wire::Enabled));
    }
    let ports = &modules[module].description.ports;
    let linkable = |port: &&PortDescription| {
        matches!(port.direction, Direction::Input | Direction::Queue | Direction::Outbox)
    };
    match ports.iter().position(|port| port.name == name) {
        Some(port) if linkable(&&ports[port]) => Some((module, Wire::Port(port))),
        Some(port) if ports[port].direction == Direction::Inbox => {
            let help = "link each sender's outbox to it: \"sender/outbox\" = \"receiver/inbox\"";
            complaints.add(
                link.to.span,
                format!("`{to}` is an inbox, which any number of senders may share"),
                help,
            );
            None
        }
        Some(_) => {
            let help = "a link names the input first: \"reader/input\" = \"writer/output\"";
            complaints.add(link.to.span, format!("`{to}` is an output"), help);
            None
        }
        None => {
            let help = suggest(name, ports.iter().filter(linkable).map(|port| port.name.as_str()));
            complaints.add(
                link.to.span,
                format!("`{}` has no port `{name}`", modules[module].module.name.value),
                help,
            );
            None
        }
    }
}

fn find_target<'a>(
    configuration: &Configuration,
    modules: &[Surveyed<'a>],
    link: &Link,
    from: &str,
    complaints: &mut Complaints<'a>,
) -> Option<Target> {
    let command = configuration.actuators().iter().position(|actuator| {
        from.strip_prefix(actuator.name.value.as_str()).is_some_and(|rest| rest == "/command")
    });
    if let Some(actuator) = command {
        return Some(Target::Command(actuator));
    }
    let Some((module, name)) = split_module(modules, from) else {
        let actuators = configuration.actuators().iter().map(|actuator| actuator.name.value.as_str());
        let names: Vec<_> =
            modules.iter().map(|surveyed| surveyed.module.name.value.as_str()).chain(actuators).collect();
        let help = suggest(from, names.iter().copied());
        complaints.add(link.from.span, format!("nothing is called `/{from}`"), help);
        return None;
    };
    let ports = &modules[module].description.ports;
    let source = |port: &&PortDescription| {
        !matches!(port.direction, Direction::Input | Direction::Queue | Direction::Outbox)
    };
    if ports.iter().any(|port| port.name == name && port.direction == Direction::Command) {
        let help = "link to the command that passed its gate: `<actuator>/command`";
        complaints.add(link.from.span, format!("`/{from}` is a command that has not passed its gate"), help);
        return None;
    }
    match ports.iter().position(|port| port.name == name) {
        Some(port) if source(&&ports[port]) => Some(Target::Port(module, port)),
        Some(_) => {
            complaints.add(
                link.from.span,
                format!("`/{from}` is itself an input"),
                "link to the output that it reads",
            );
            None
        }
        None => {
            let help = suggest(name, ports.iter().filter(source).map(|port| port.name.as_str()));
            complaints.add(
                link.from.span,
                format!("`{}` has no output `{name}`", modules[module].module.name.value),
                help,
            );
            None
        }
    }
}

/// Types, roles and directions of both ends.
fn check_joint<'a>(
    configuration: &Configuration,
    modules: &[Surveyed<'a>],
    joint: &Joint<'_>,
    from: &str,
    complaints: &mut Complaints<'a>,
) -> bool {
    let (to, link) = (&joint.link.to.value, joint.link);
    let (module, Wire::Port(port)) = joint.port else {
        let fits = matches!(joint.target, Target::Port(m, p)
            if modules[m].description.ports[p].descriptor.hash == parameters::enabled_descriptor().hash);
        if !fits {
            complaints.add(
                link.from.span,
                format!("`{to}` takes an Enabled"),
                "link it to an output of that interface",
            );
        }
        return fits;
    };
    let own = &modules[module].description.ports[port];
    let Target::Port(target_module, target_port) = joint.target else {
        // The actuator's interface is that of its commanders, which is checked with the actuator.
        return own.direction == Direction::Input || {
            complaints.add(
                link.to.span,
                format!("`{to}` can't take an actuator's command"),
                "link a plain input to it",
            );
            false
        };
    };
    let target = &modules[target_module].description.ports[target_port];
    let messages = (own.direction == Direction::Outbox, target.direction == Direction::Inbox);
    if messages.0 != messages.1 {
        let (message, help) = if messages.0 {
            (format!("`{to}` sends messages, but `/{from}` is a value"), "link an outbox to an inbox")
        } else {
            (format!("`/{from}` receives messages, but `{to}` reads a value"), "link an input to an output")
        };
        complaints.add(link.from.span, message, help);
        return false;
    }
    if own.descriptor.hash != target.descriptor.hash {
        let message = if own.descriptor.name == target.descriptor.name {
            format!("`{to}` and `/{from}` are different versions of {}", own.descriptor.name)
        } else {
            format!("`{to}` is {} but `/{from}` is {}", own.descriptor.name, target.descriptor.name)
        };
        complaints.add(link.from.span, message, "both ends of a link carry the same interface");
        return false;
    }
    if own.role != target.role {
        let name = |role: &str| if role.is_empty() { "plain".to_owned() } else { format!("a {role}") };
        let message = format!("`{to}` is {} but `/{from}` is {}", name(&own.role), name(&target.role));
        let help = "only Monitor -> Analyze -> Plan -> Execute can be attached, and reflexes to Execute";
        complaints.add(link.from.span, message, help);
        return false;
    }
    let _ = configuration;
    true
}

/// The modules that write what a link leads to.
fn writers(configuration: &Configuration, modules: &[Surveyed<'_>], target: Target) -> Vec<usize> {
    match target {
        Target::Port(module, _) => vec![module],
        Target::Command(actuator) => {
            let commands = &configuration.actuators()[actuator].commands;
            let paths = commands.iter().map(|url| url.value.path_in(""));
            paths.filter_map(|path| split_module(modules, &path).map(|(module, _)| module)).collect()
        }
    }
}

fn survey_order(
    configuration: &Configuration,
    modules: &[Surveyed<'_>],
    joints: &[Joint<'_>],
    complaints: &mut Complaints<'_>,
) -> Vec<Vec<Vec<usize>>> {
    let mut order = Vec::new();
    for stage in Stage::ALL {
        let members: Vec<usize> =
            (0..modules.len()).filter(|module| modules[*module].stage == stage).collect();
        let place = |module: usize| members.iter().position(|member| *member == module);
        let mut edges = Vec::new();
        for joint in joints {
            let Some(own) = place(joint.port.0) else { continue };
            let sends = matches!(joint.port.1, Wire::Port(port)
                if modules[joint.port.0].description.ports[port].direction == Direction::Outbox);
            // A writer comes before its reader and a sender before the receiver, unless last cycle's value is meant.
            let own_first = joint.link.previous != sends;
            for target in writers(configuration, modules, joint.target).into_iter().filter_map(place) {
                // What a module gets from itself, or from the gate that it commands, is always from before its tick.
                let unordered = sends || joint.link.previous || matches!(joint.target, Target::Command(_));
                if own != target || !unordered {
                    edges.push(if own_first { (own, target) } else { (target, own) });
                }
            }
        }
        match levels(members.len(), &edges) {
            Ok(sorted) => order.push(
                sorted.into_iter().map(|level| level.into_iter().map(|i| members[i]).collect()).collect(),
            ),
            Err(CycleFound(circle)) => {
                let names: Vec<_> =
                    circle.iter().map(|i| modules[members[*i]].module.name.value.as_str()).collect();
                let first = joints.iter().find(|joint| {
                    place(joint.port.0).is_some_and(|own| circle.contains(&own))
                        && writers(configuration, modules, joint.target)
                            .into_iter()
                            .any(|target| place(target).is_some_and(|at| circle.contains(&at)))
                });
                let message = format!(
                    "in stage {}, {} -> {} read each other in a circle",
                    stage.name(),
                    names.join(" -> "),
                    names.first().copied().unwrap_or_default()
                );
                let help = "mark one of the links `previous = true`, or move a module to another stage";
                match first {
                    Some(joint) => complaints.add(joint.link.from.span, message, help),
                    None => complaints.add(modules[members[circle[0]]].module.name.span, message, help),
                }
                order.push(Vec::new());
            }
        }
    }
    order
}
