//! Part of a configuration whose other modules are replaced by a recording.

use slate_blackboard::interface::Descriptor;
use slate_blackboard::{Url, is_within, nearest_names};
use slate_module::{Description, Direction, Plugin};
use slate_sorted::{SortedMap, SortedSet};
use toml_edit::Key;

use super::descriptions;
use super::service_stub::{ServiceStub, service_stubs, unneeded};
use crate::sharing::RemotePath;
use slate_configuration::{Configuration, Link, Setting};

/// Part of a configuration of which only some modules run.
#[derive(Clone, Debug, Default)]
pub struct Excerpt {
    /// The configuration, for [`configuration`](crate::recording::configuration).
    pub text: String,
    /// Properties that modules are linked to and that were never written.
    /// Each has its path, interface, and room in the tail.
    pub silent: Vec<(String, &'static Descriptor, usize)>,
    /// Paths of properties and fields that the modules read.
    /// They are recorded, or were never written.
    pub reads: SortedSet<String>,
    /// Inputs of replaced modules whose names other modules read by.
    /// Each comes with its readers among the remaining modules, and the field that they read.
    pub aliases: SortedMap<String, Vec<(String, String)>>,
    /// Inboxes without a sender among the remaining modules.
    /// Their recorded messages are sent again.
    pub inboxes: SortedSet<String>,
    /// Outboxes of the modules, each with its destination.
    pub outboxes: SortedMap<String, String>,
    /// Mailboxes of replaced modules that remaining modules send to.
    /// Their messages are recorded with the senders.
    pub deaf: SortedMap<String, &'static Descriptor>,
    /// Additional modules that replace the providers of services.
    /// They provide them to the remaining modules.
    pub service_stubs: SortedSet<String>,
    /// Those of `reads` that were written only while a tool watched them.
    pub watched: SortedSet<String>,
    /// Inputs and services of the recorded run that the modules lack, in words.
    pub misses: Vec<String>,
}

/// Reduces a configuration to some modules.
/// Their links to other modules lead to the `recorded` properties, at the original paths. Gates stay if one of the
/// modules commands them. `has_messages` is true for inboxes with all messages recorded, and `knows_senders` for those
/// with the sender of each.
///
/// # Errors
/// Names that are not modules, and modules that can't run alone.
pub fn excerpt(
    configuration: &Configuration,
    plugins: &[Plugin],
    modules: &SortedSet<String>,
    recorded: &SortedSet<String>,
    has_messages: impl Fn(&str) -> bool,
    knows_senders: impl Fn(&str) -> bool,
) -> Result<Excerpt, String> {
    let names: Vec<&str> = configuration.modules().iter().map(|module| module.name.value.as_str()).collect();
    for module in modules {
        if !names.contains(&module.as_str()) {
            let near = nearest_names(module, names.iter().copied());
            let near = if near.is_empty() { &names.join("`, `") } else { &near.join("` or `") };
            return Err(format!("the recorded agent has no module `{module}`: is `{near}` meant?"));
        }
        if configuration.time_source().is_some_and(|source| source.value == *module) {
            return Err(format!(
                "`{module}` sets the time of the recorded agent, which is that of the recording now: leave it out"
            ));
        }
    }
    let mut cutter = Cutter {
        configuration,
        names,
        modules,
        recorded,
        has_messages: &has_messages,
        knows_senders: &knows_senders,
        descriptions: descriptions(plugins, configuration),
        result: Excerpt::default(),
    };
    let service_stubs = service_stubs(plugins, &cutter.descriptions, modules)?;
    cutter.result.misses = unneeded(&cutter.descriptions, modules);
    cutter.cut(service_stubs);
    Ok(cutter.result)
}

struct Cutter<'a> {
    configuration: &'a Configuration,
    names: Vec<&'a str>,
    modules: &'a SortedSet<String>,
    recorded: &'a SortedSet<String>,
    has_messages: &'a dyn Fn(&str) -> bool,
    knows_senders: &'a dyn Fn(&str) -> bool,
    descriptions: SortedMap<String, Description>,
    result: Excerpt,
}

/// New end of a remaining module's link.
enum NewEnd {
    /// Path of the new end.
    Path(String),
    /// No end any more.
    Nothing,
}

impl Cutter<'_> {
    fn cut(&mut self, service_stubs: Vec<ServiceStub>) {
        let mut lines = vec![format!("agent.name = {}", quoted(self.configuration.agent_name()))];
        for link in self.configuration.links() {
            let (own, far) = self.ends(link);
            if self.stays(&own) {
                lines.extend(self.link(link, own, far));
            }
        }
        for link in self.configuration.external_links() {
            let input = &link.path.value;
            if link.fills(input) && self.stays(input) {
                // Received values are set again, and no link is inferred for their inputs.
                lines.push(format!("links.{} = false", quoted(input)));
            }
        }
        for setting in self.configuration.settings("").unwrap_or_default() {
            let Ok(keys) = Key::parse(&setting.path) else { continue };
            let path: Vec<&str> = keys.iter().map(Key::get).collect();
            lines.extend(self.line(&setting, &path));
        }
        for module in self.configuration.modules() {
            let name = &module.name.value;
            if self.modules.contains(name) {
                lines.push(format!("modules.{}.kind = {}", quoted(name), quoted(&module.kind.value)));
                self.find_messages(name);
            }
        }
        service_stubs.into_iter().for_each(|own| self.add(own, &mut lines));
        lines.push(String::new());
        self.result.text = lines.join("\n");
    }

    /// Adds a module that replaces another one.
    fn add(&mut self, own: ServiceStub, lines: &mut Vec<String>) {
        let ServiceStub { name, kind, provider, inputs } = own;
        lines.push(format!("modules.{}.kind = {}", quoted(&name), quoted(&kind)));
        for port in inputs {
            let (input, path) = (format!("{name}/{}", port.name), format!("{provider}/{}", port.name));
            lines.push(format!("links.{} = {}", quoted(&input), quoted(&format!("/{path}"))));
            self.result.reads.insert(path.clone());
            if port.direction == Direction::Debug {
                self.result.watched.insert(path.clone());
            }
            if !self.is_recorded(&path) && !self.result.silent.iter().any(|(silent, ..)| *silent == path) {
                self.result.silent.push((path, port.descriptor, port.capacity));
            }
        }
        self.result.service_stubs.insert(name);
    }

    /// Returns the line of a setting, if it remains.
    fn line(&self, setting: &Setting, path: &[&str]) -> Option<String> {
        let whole = || Some(format!("{} = {}", setting.path, setting.value));
        match path {
            ["agent", "name"] | ["time" | "mission" | "report" | "share" | "snapshot" | "agents", ..] => None,
            ["plugins", ..] if self.modules.is_empty() => None,
            // The type is said below, also when nothing else is.
            ["modules", _] | ["modules", _, "kind"] => None,
            ["modules", name, ..] => self.modules.contains(*name).then(whole).flatten(),
            // They are said apart.
            ["links", ..] => None,
            ["actuators", name, rest @ ..] => {
                let (commands, modules) = self.commanders(name)?;
                match rest {
                    ["command"] => {
                        let line =
                            || format!("actuators.{}.commands = [{}]", quoted(name), commands.join(", "));
                        (!commands.is_empty()).then(line)
                    }
                    ["commands", command] => {
                        let url = Url::parse(command).ok();
                        url.filter(|url| self.stays(&url.path_in(""))).and_then(|_| whole())
                    }
                    ["modules", ..] => {
                        Some(format!("actuators.{}.modules = [{}]", quoted(name), modules.join(", ")))
                    }
                    _ => whole(),
                }
            }
            _ => whole(),
        }
    }

    /// Returns the remaining commanders of an actuator, if any.
    /// These are command ports and modules.
    fn commanders(&self, actuator: &str) -> Option<(Vec<String>, Vec<String>)> {
        let mut actuators = self.configuration.actuators().iter();
        let actuator = actuators.find(|own| own.name.value == actuator)?;
        let commands = actuator.commands.iter().map(|url| url.value.path_in(""));
        let commands: Vec<_> =
            commands.filter(|path| self.stays(path)).map(|path| quoted(&format!("/{path}"))).collect();
        let modules =
            actuator.modules.iter().map(|name| &name.value).filter(|name| self.modules.contains(*name));
        let modules: Vec<_> = modules.map(|name| quoted(name)).collect();
        (!commands.is_empty() || !modules.is_empty()).then_some((commands, modules))
    }

    /// Returns the module at the start of a path, by the longest name.
    fn owner(&self, path: &str) -> Option<&str> {
        let owns = |name: &&&str| path.strip_prefix(**name).is_some_and(|rest| rest.starts_with('/'));
        self.names.iter().filter(owns).max_by_key(|name| name.len()).copied()
    }

    fn stays(&self, path: &str) -> bool {
        self.owner(path).is_some_and(|owner| self.modules.contains(owner))
    }

    /// Returns the port of a path, if it is known.
    fn port(&self, path: &str) -> Option<(&Description, usize)> {
        let owner = self.owner(path)?;
        let description = self.descriptions.get(owner)?;
        let rest = path.get(owner.len() + 1..)?;
        let ports = description.ports.iter().enumerate().filter(|(_, port)| is_within(rest, &port.name));
        let (port, _) = ports.max_by_key(|(_, port)| port.name.len())?;
        Some((description, port))
    }

    /// Returns the port that a link belongs to, and the other end.
    /// A link between mailboxes belongs to its outbox.
    fn ends(&self, link: &Link) -> (String, Url) {
        let (to, from) = (&link.to.value, link.from.value.path_in(""));
        let is = |path: &str, direction| {
            self.port(path).is_some_and(|(own, port)| own.ports[port].direction == direction)
        };
        match link.destination() {
            Some(inbox)
                if inbox.agent().is_some() || is(to, Direction::Inbox) || is(&from, Direction::Outbox) =>
            {
                (from, inbox)
            }
            _ => (to.clone(), link.from.value.clone()),
        }
    }

    /// Returns the line of a remaining module's link.
    fn link(&mut self, link: &Link, own: String, far: Url) -> Option<String> {
        let sends = own != link.to.value;
        let NewEnd::Path(far) = self.source(&own, &far) else {
            // Types and roles find nothing else for it.
            return (!sends).then(|| format!("links.{} = false", quoted(&own)));
        };
        let (to, from) =
            if sends { (far.trim_start_matches('/'), own.as_str()) } else { (own.as_str(), far.as_str()) };
        let options = self.configuration.link_options(link);
        // Others are about the way to another agent.
        let is_here = |(name, _): &&(String, String)| {
            !["carrier", "mode", "rate", "interval", "compression"].contains(&name.as_str())
        };
        let mut options: Vec<_> =
            options.iter().filter(is_here).map(|(name, value)| format!("{name} = {value}")).collect();
        if sends {
            let options =
                if options.is_empty() { "true".to_owned() } else { format!("{{ {} }}", options.join(", ")) };
            return Some(format!("links.{}.{} = {options}", quoted(to), quoted(&format!("/{from}"))));
        }
        options.insert(0, format!("from = {}", quoted(from)));
        Some(format!("links.{} = {{ {} }}", quoted(to), options.join(", ")))
    }

    fn source(&mut self, to: &str, far: &Url) -> NewEnd {
        let own = self.configuration.agent_name();
        let path = far.path_in("");
        let other = far.agent().filter(|agent| *agent != own);
        let mut path = match other {
            Some(agent) => RemotePath { agent: agent.into(), path }.mirror_path(),
            None => path,
        };
        // An input is another name of what it is linked to.
        for _ in 0..self.configuration.links().len() {
            if self.stays(&path) || self.is_recorded(&path) {
                break;
            }
            let mut links = self.configuration.links().iter();
            // Messages end in their inbox.
            let fills = |link: &&Link| is_within(&path, &link.to.value) && self.ends(link).0 == link.to.value;
            let Some(next) = links.find(fills) else { break };
            let field = path[next.to.value.len()..].to_owned();
            let readers = self.result.aliases.entry(next.to.value.clone()).or_default();
            readers.push((to.to_owned(), field.clone()));
            path = format!("{}{field}", next.from.value.path_in(""));
        }
        let sends = self.port(to).is_some_and(|(own, port)| own.ports[port].direction == Direction::Outbox);
        if sends {
            self.result.outboxes.insert(to.to_owned(), path.clone());
        }
        let is_host = ["loop", "log"].iter().any(|host| is_within(&path, host));
        let is_gate = |actuator: &slate_configuration::Actuator| {
            is_within(&path, &actuator.name.value) && self.commanders(&actuator.name.value).is_some()
        };
        let is_there = is_host || self.stays(&path) || self.configuration.actuators().iter().any(is_gate);
        if !is_there && self.is_recorded(&path) {
            self.result.reads.insert(path.clone());
        }
        if is_there || self.is_recorded(&path) {
            return NewEnd::Path(format!("/{path}"));
        }
        if sends {
            let all_stay = self.senders(&path).iter().all(|sender| self.modules.contains(*sender));
            let is_known = (all_stay || (self.knows_senders)(&path)) && (self.has_messages)(&path);
            let interface = self.port(to).map(|(own, port)| own.ports[port].descriptor);
            return match interface.filter(|_| is_known) {
                Some(interface) => {
                    self.result.deaf.insert(path.clone(), interface);
                    NewEnd::Path(format!("/{path}"))
                }
                // It has no receiver.
                None => NewEnd::Nothing,
            };
        }
        let mut gates = self.configuration.actuators().iter().map(|actuator| actuator.name.value.as_str());
        let was_there =
            other.is_some() || self.owner(&path).is_some() || gates.any(|gate| is_within(&path, gate));
        if !was_there {
            // Loading reports where that is written, and what there is.
            return NewEnd::Path(format!("/{path}"));
        }
        let Some((description, port)) = self.port(&path) else {
            self.result.misses.push(format!("{to} reads /{path}, of which nothing is recorded"));
            return NewEnd::Nothing;
        };
        let port = &description.ports[port];
        let owner = self.owner(&path).unwrap_or_default();
        let silent = (format!("{owner}/{}", port.name), port.descriptor, port.capacity);
        self.result.reads.insert(path.clone());
        if !self.result.silent.iter().any(|(path, ..)| *path == silent.0) {
            self.result.silent.push(silent);
        }
        NewEnd::Path(format!("/{path}"))
    }

    fn is_recorded(&self, path: &str) -> bool {
        self.recorded.iter().any(|recorded| is_within(path, recorded))
    }

    /// Returns the modules that send to a mailbox.
    fn senders(&self, path: &str) -> SortedSet<&str> {
        let ends = self.configuration.links().iter().map(|link| self.ends(link));
        let senders: Vec<_> = ends.filter(|(_, far)| far.path_in("") == path).map(|(own, _)| own).collect();
        senders.iter().filter_map(|own| self.owner(own)).collect()
    }

    /// Finds the inboxes of a module to replay, and the messages that it misses.
    fn find_messages(&mut self, module: &str) {
        let Some(description) = self.descriptions.get(module) else { return };
        let inboxes = description.ports.iter().filter(|port| port.direction == Direction::Inbox);
        let paths: Vec<_> = inboxes.map(|inbox| format!("{module}/{}", inbox.name)).collect();
        for path in paths {
            let senders = self.senders(&path);
            let (stay, go): (Vec<_>, Vec<_>) =
                senders.into_iter().partition(|sender| self.modules.contains(*sender));
            let miss = match ((self.has_messages)(&path), &stay[..], &go[..]) {
                (true, [], _) => {
                    self.result.inboxes.insert(path);
                    continue;
                }
                (_, _, []) => continue,
                (true, stay, go) => format!(
                    "{path} takes messages of {}, which run, and of {}, which do not: let all of them run, or none",
                    stay.join(" and "),
                    go.join(" and ")
                ),
                (false, _, go) => {
                    format!(
                        "{path} takes messages of {}, which this recording does not have",
                        go.join(" and ")
                    )
                }
            };
            self.result.misses.push(miss);
        }
    }
}

fn quoted(text: &str) -> String {
    toml_edit::Value::from(text).to_string()
}
