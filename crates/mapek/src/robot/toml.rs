//! Configuration of a robot.

use std::fmt::Write;

use slate_module::blackboard::interface::Value;
use slate_module::role;
use slate_module::{Direction, PortDescription};

use super::content::{AttachedLink, GateEntry, Place, RobotContent, RobotModule, RobotProgram, Source};

/// Widest line of a table that is written in one line, characters.
const WIDTH: usize = 100;

/// Writes the whole configuration, on request with the lines of the program.
pub fn print(content: &RobotProgram, with_places: bool) -> String {
    let mut text = content.world.trim_end().to_owned();
    let place = |place: Place| match with_places {
        true => format!("  # {}:{}", place.file(), place.line()),
        false => String::new(),
    };
    for robot in &content.robots {
        let modules = robot.modules.iter().map(|module| (entry(module), module.place));
        section(&mut text, &format!("robots.{}.modules", robot.name), modules, &place);
        let links = robot.links.iter().filter(|link| !is_determined(robot, link));
        section(
            &mut text,
            &format!("robots.{}.links", robot.name),
            links.map(|link| (line(link), link.place)),
            &place,
        );
        robot.gates.iter().for_each(|gate| write_gate(&mut text, robot, gate, &place(gate.place)));
    }
    text.trim_start().to_owned()
}

fn section(
    text: &mut String,
    name: &str,
    lines: impl Iterator<Item = (String, Place)>,
    place: &impl Fn(Place) -> String,
) {
    let mut lines = lines.peekable();
    if lines.peek().is_none() {
        return;
    }
    header(text, name, "");
    lines.for_each(|(line, at)| put(text, &format!("{line}{}", place(at))));
}

fn header(text: &mut String, name: &str, place: &str) {
    put(text, &format!("{}[{name}]{place}", if text.is_empty() { "" } else { "\n" }));
}

fn put(text: &mut String, line: &str) {
    if !text.is_empty() && !text.ends_with('\n') {
        text.push('\n');
    }
    text.push_str(line);
    text.push('\n');
}

/// Formats a module as a line: `planner = { kind = "go_to_origin_planner" }`.
fn entry(module: &RobotModule) -> String {
    let mut fields = Vec::new();
    if module.kind.name() != module.name {
        fields.push(("kind".to_owned(), Value::Text(module.kind.name().into())));
    }
    let changed = module.changed_params();
    if !changed.is_empty() {
        let params = changed.into_iter().map(|(name, value)| (name.to_owned(), value.clone()));
        fields.push(("params".into(), Value::Table(params.collect())));
    }
    if !module.settings.inputs.is_empty() {
        let inputs = module.settings.inputs.iter().map(|(port, _, value)| (port.clone(), value.clone()));
        fields.push(("inputs".into(), Value::Table(inputs.collect())));
    }
    fields.extend(module.settings.others.iter().map(|(name, value)| ((*name).to_owned(), value.clone())));
    format!("{} = {}", key(&module.name), inline(&Value::Table(fields)))
}

fn line(link: &AttachedLink) -> String {
    let port = format!("{}/{}", link.module, link.port);
    let mut source = link.source.url().map_or(Value::Bool(false), Value::Text);
    if link.is_previous {
        source = Value::Table(vec![("from".into(), source), ("previous".into(), Value::Bool(true))]);
    }
    format!("{} = {}", key(&port), inline(&source))
}

/// Returns true if the port's role and type determine an attachment.
/// It then has one possible source in the robot.
fn is_determined(robot: &RobotContent, link: &AttachedLink) -> bool {
    let Source::Block { module: source, port: output } = &link.source else { return false };
    let ports = |module: &RobotModule| module.description().map_or(Vec::new(), |it| it.ports);
    let reader = robot
        .module(&link.module)
        .and_then(|module| ports(module).into_iter().find(|port: &PortDescription| port.name == link.port));
    let Some(reader) = reader.filter(|port| !port.role.is_empty()) else { return false };
    let fits = |port: &PortDescription| {
        let is_alike = match port.direction {
            Direction::Output => port.role == reader.role,
            Direction::Input => port.role == role::HANDED_ON && reader.role == role::PERCEPT,
            _ => false,
        };
        is_alike && port.descriptor.hash == reader.descriptor.hash
    };
    let others = robot.modules.iter().filter(|module| module.name != link.module);
    let found: Vec<_> = others
        .flat_map(|module| {
            let fitting = ports(module).into_iter().filter(fits);
            fitting.map(|port| (module.name.clone(), port.name)).collect::<Vec<_>>()
        })
        .collect();
    matches!(&found[..], [(module, port)] if module == source && port == output)
}

fn write_gate(text: &mut String, robot: &RobotContent, entry: &GateEntry, place: &str) {
    let GateEntry { name, gate, commander, .. } = entry;
    let table = format!("robots.{}.actuators.{}", robot.name, key(name));
    header(text, &table, place);
    let own = robot.command_ports(entry).into_iter().map(|port| format!("{commander}/{port}"));
    let mut commands: Vec<_> = own.chain(gate.commanders.iter().cloned()).map(Value::Text).collect();
    match &mut commands[..] {
        [one] => put(text, &format!("command = {}", inline(one))),
        _ => put(text, &format!("commands = {}", inline(&Value::List(commands)))),
    }
    let pair = |[low, high]: &[f64; 2]| Value::List(vec![Value::Float(*low), Value::Float(*high)]);
    let limits = gate.limits.iter().map(|(field, range)| (field.clone(), pair(range))).collect();
    let rates = gate.rate_limits.iter().map(|(field, limit)| (field.clone(), Value::Float(*limit)));
    let parts = [
        ("limits", Value::Table(limits)),
        ("rate_limits", Value::Table(rates.collect())),
        ("time_to_live", gate.time_to_live.clone().map_or(Value::Null, Value::Text)),
        ("safe", gate.safe.clone()),
    ];
    let mut wide = Vec::new();
    for (part, value) in parts {
        let line = format!("{part} = {}", inline(&value));
        match value {
            Value::Null => {}
            Value::Table(fields) if fields.is_empty() => {}
            Value::Table(fields) if line.len() > WIDTH => wide.push((part, fields)),
            _ => put(text, &line),
        }
    }
    // Tables of their own come behind the other keys.
    for (part, fields) in wide {
        put(text, &format!("[{table}.{part}]"));
        fields.iter().for_each(|(field, value)| put(text, &format!("{} = {}", key(field), inline(value))));
    }
}

/// Formats a number for TOML.
pub fn number(number: f64) -> String {
    format!("{number:?}")
}

/// Returns a key, in quotes if TOML requires them.
fn key(name: &str) -> String {
    let is_bare = |c: char| c.is_ascii_alphanumeric() || c == '_' || c == '-';
    if !name.is_empty() && name.chars().all(is_bare) { name.into() } else { quoted(name) }
}

fn quoted(text: &str) -> String {
    let mut quoted = String::from('"');
    for c in text.chars() {
        match c {
            '"' | '\\' => quoted.extend(['\\', c]),
            c if c.is_control() => {
                // A string takes what is written.
                let _ = write!(quoted, "\\u{:04X}", u32::from(c));
            }
            c => quoted.push(c),
        }
    }
    quoted.push('"');
    quoted
}

/// Formats a value in one line.
fn inline(value: &Value) -> String {
    match value {
        // TOML has no value for nothing; optional fields are left out of their table.
        Value::Null => "[]".into(),
        Value::Bool(flag) => flag.to_string(),
        Value::Integer(whole) => whole.to_string(),
        Value::Float(float) => number(*float),
        Value::Text(text) => quoted(text),
        Value::List(items) => {
            format!("[{}]", items.iter().map(inline).collect::<Vec<_>>().join(", "))
        }
        Value::Table(fields) => {
            let fields = fields.iter().filter(|(_, value)| *value != Value::Null);
            let fields: Vec<_> =
                fields.map(|(name, value)| format!("{} = {}", key(name), inline(value))).collect();
            if fields.is_empty() { "{}".into() } else { format!("{{ {} }}", fields.join(", ")) }
        }
    }
}
