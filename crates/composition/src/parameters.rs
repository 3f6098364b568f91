//! Conversion of configuration values to the bytes of an interface.

use slate_blackboard::interface::{self, Descriptor, Interface, edit};
use slate_module::{Bool, Description};

use crate::diagnostic_collector::DiagnosticCollector;
use slate_configuration::{Configuration, ErrorCode, Module, Spanned, Table, Value};

/// Switch of a module.
#[slate_module::interface]
pub struct Enabled {
    /// State of the switch; true if the module runs.
    pub value: Bool,
}

/// Returns the interface of `enabled`.
pub fn enabled_descriptor() -> &'static Descriptor {
    Enabled::DESCRIPTOR
}

/// Returns a complete value of an interface; omitted fields are zero.
pub fn value_bytes(
    descriptor: &'static Descriptor,
    value: &Spanned<Value>,
    collector: &mut DiagnosticCollector<'_>,
) -> Option<Vec<u8>> {
    let tail = match descriptor.fields.last().map(|field| (field.name, &field.kind)) {
        Some((name, interface::Kind::Tail(_))) => value
            .value
            .as_table()
            .and_then(|table| table.get(name))
            .and_then(|list| list.value.as_list())
            .map_or(0, <[_]>::len),
        _ => 0,
    };
    let shape = descriptor.shape(tail);
    let mut bytes = vec![0; shape.bytes(shape.capacity)];
    match edit(descriptor, &mut bytes, 0, "", &interface::Value::from(&value.value)) {
        Ok(_) => Some(bytes),
        Err(error) => {
            collector.add(
                value.span,
                error.to_string(),
                format!("{} is {}", descriptor.name, fields(descriptor)),
            );
            None
        }
    }
}

fn fields(descriptor: &Descriptor) -> String {
    let fields: Vec<_> =
        descriptor.fields.iter().map(|field| format!("{}: {}", field.name, field.kind.describe())).collect();
    format!("{{ {} }}", fields.join(", "))
}

/// Parameter, and the setting that it follows.
pub type FollowedSetting<'a> = (String, &'a Spanned<Value>);

/// Returns the settings that a module's parameters follow, by parameter.
/// Parameters that the configuration sets are left out.
pub fn followed<'a>(
    configuration: &'a Configuration,
    module: &Module,
    description: &Description,
) -> Vec<FollowedSetting<'a>> {
    let robot = module.name.value.rsplit_once('/').map_or("", |(robot, _)| robot);
    let open = description.parameters.iter().filter(|parameter| module.params.get(&parameter.name).is_none());
    let followed = open.filter_map(|parameter| {
        let settings = parameter.follows.iter().map(|path| path.replace("{robot}", robot));
        // Empty text is that of no setting.
        let is_said = |value: &&Spanned<Value>| value.value.as_str() != Some("");
        let value = settings.filter_map(|path| configuration.value(&path)).find(is_said)?;
        Some((parameter.name.clone(), value))
    });
    followed.collect()
}

/// Returns the parameters of a module as bytes of their interface.
/// Precedence, lowest first: defaults, followed settings, the module's own configuration.
pub fn bytes(
    description: &Description,
    table: &Table,
    followed: &[FollowedSetting<'_>],
    collector: &mut DiagnosticCollector<'_>,
) -> Vec<u8> {
    let descriptor = description.params;
    let mut bytes = vec![0; descriptor.size];
    for parameter in &description.parameters {
        // The default comes from a value of the interface itself.
        let _ = edit(descriptor, &mut bytes, 0, &parameter.name, &parameter.default);
    }
    let own = table.iter().map(|(name, entry)| (name, entry.key, &entry.value));
    let followed = followed.iter().map(|(name, value)| (name.as_str(), value.span, *value));
    for (name, key, entry) in followed.chain(own) {
        let Some(parameter) = description.parameters.iter().find(|parameter| parameter.name == name) else {
            let names = description.parameters.iter().map(|parameter| parameter.name.as_str());
            let near = slate_blackboard::nearest_names(name, names.clone());
            let help = match (near.first(), description.parameters.is_empty()) {
                (_, true) => "this module has no parameters".to_owned(),
                (Some(near), _) => format!("did you mean `{near}`?"),
                (None, _) => format!("available: {}", names.collect::<Vec<_>>().join(", ")),
            };
            collector.add(key, ErrorCode::Parameter.of(format!("no parameter `{name}`")), help);
            continue;
        };
        let value = interface::Value::from(&entry.value);
        if let (Some((low, high)), Some(number)) = (parameter.range, value.as_f64())
            && !(low..=high).contains(&number)
        {
            let message = ErrorCode::Value.of(format!("`{name}` is {number}, outside {low} to {high}"));
            collector.add(
                entry.span,
                message,
                format!("choose a value from {low} to {high}; the default is {}", parameter.default),
            );
            continue;
        }
        let is_infinite = |value: &interface::Value| value.as_f64().is_some_and(|number| !number.is_finite());
        if is_infinite(&value) && parameter.range.is_none() && !is_infinite(&parameter.default) {
            let message = ErrorCode::Value.of(format!("`{name}` is not a finite number"));
            let help = format!("choose another one; the default is {}", parameter.default);
            collector.add(entry.span, message, help);
            continue;
        }
        if let Some(field) = descriptor.field(name)
            && let interface::Kind::Sequence(item, _) = &field.kind
        {
            // Items of the default with the same place are no default of these.
            bytes[field.offset..field.offset + field.kind.size()].fill(0);
            if let interface::Kind::Nested(item) = item
                && refuse_gaps(name, &entry.value, item, collector)
            {
                continue;
            }
        }
        if let Err(error) = edit(descriptor, &mut bytes, 0, name, &value) {
            let unit = descriptor.field(name).map_or("", |field| field.unit);
            let help = if unit.is_empty() {
                String::from("see the module's parameters")
            } else {
                format!("its unit is {unit}")
            };
            collector.add(entry.span, ErrorCode::Value.of(error.to_string()), help);
        }
    }
    bytes
}

/// Reports items of a list that lack a field; returns whether there are any.
fn refuse_gaps(
    name: &str,
    value: &Value,
    item: &Descriptor,
    collector: &mut DiagnosticCollector<'_>,
) -> bool {
    let before = collector.diagnostics.len();
    for (number, one) in value.as_list().into_iter().flatten().enumerate() {
        let Some(table) = one.value.as_table() else { continue };
        let is_wanted = |kind: &interface::Kind| !matches!(kind, interface::Kind::Optional(_));
        for field in item.fields.iter().filter(|field| is_wanted(&field.kind)) {
            if table.get(field.name).is_none() {
                let message = format!("`{name}.{number}` has no `{}`", field.name);
                let unknown = table.iter().map(|(key, _)| key).filter(|key| item.field(key).is_none());
                let misspelt = unknown.filter(|key| {
                    slate_blackboard::nearest_names(key, std::iter::once(field.name)).len() == 1
                });
                let instead =
                    misspelt.take(1).map(|key| format!("did you mean `{}`, not `{key}`? ", field.name));
                let help = format!("{}write all fields of it: {}", instead.collect::<String>(), fields(item));
                collector.add(one.span, ErrorCode::Value.of(message), help);
            }
        }
    }
    collector.diagnostics.len() > before
}
