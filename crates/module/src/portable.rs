//! Portable descriptions of modules: CBOR or JSON, without pointers.
//! They cross the boundary of a library.  CBOR comes from Rust, JSON from a C author's hand. The host makes interfaces
//! of its own from it, so nothing of the library stays behind.

use std::collections::BTreeMap;
use std::sync::{Mutex, PoisonError};

use serde::{Deserialize, Serialize};
use slate_blackboard::interface::{
    Constant, Descriptor, Enumeration, Field, Kind, Primitive, Value, schema_hash,
};

use crate::service_hash::service_hash;
use crate::{
    Description, Direction, Hardware, Parameter, PortDescription, Refusal, Stage, Trigger, decode, encode,
};

/// [`Description`] without pointers; omitted fields have their defaults.
#[derive(Debug, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct PortableDescription {
    stage: Stage,
    #[serde(default)]
    ports: Vec<PortablePort>,
    #[serde(default)]
    params: Option<PortableInterface>,
    #[serde(default)]
    parameters: Vec<PortableParameter>,
    #[serde(default)]
    trigger: Option<Trigger>,
    #[serde(default)]
    deadline: Option<u64>,
    #[serde(default)]
    unique: String,
    #[serde(default)]
    describes_hardware: bool,
    #[serde(default)]
    hardware: Vec<Hardware>,
}

#[derive(Debug, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct PortablePort {
    name: String,
    #[serde(default)]
    doc: String,
    direction: Direction,
    interface: PortableInterface,
    #[serde(default)]
    required: bool,
    #[serde(default)]
    role: String,
    #[serde(default)]
    stale_after: Option<u64>,
    #[serde(default)]
    safe: Option<Vec<u8>>,
    #[serde(default)]
    capacity: Option<usize>,
    #[serde(default)]
    window: Option<usize>,
}

#[derive(Debug, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct PortableParameter {
    name: String,
    default: Value,
    #[serde(default)]
    range: Option<(f64, f64)>,
    #[serde(default)]
    follows: Vec<String>,
}

#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct PortableInterface {
    name: String,
    #[serde(default)]
    doc: String,
    #[serde(default)]
    ros: String,
    fields: Vec<PortableField>,
    /// Schema hash that the author's code expects; it is checked.
    #[serde(default)]
    hash: Option<u64>,
    /// Size and alignment of the table of a service; only services have one.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    table: Option<(usize, usize)>,
}

#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct PortableField {
    name: String,
    #[serde(default)]
    doc: String,
    #[serde(default)]
    unit: String,
    kind: PortableKind,
}

#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
enum PortableKind {
    Enumeration {
        name: String,
        carrier: Box<PortableKind>,
        constants: Vec<(String, i64, String)>,
    },
    Text(usize),
    Optional(Box<PortableKind>),
    Array(Box<PortableKind>, usize),
    Sequence(Box<PortableKind>, usize),
    Nested(PortableInterface),
    Tail(Box<PortableKind>),
    /// Primitive type, by its name alone.
    #[serde(untagged)]
    Primitive(Primitive),
}

/// Encodes a description as CBOR.
pub(crate) fn encode_description(description: &Description) -> Result<Vec<u8>, Refusal> {
    encode(&PortableDescription {
        stage: description.stage,
        ports: description.ports.iter().map(portable_port).collect(),
        params: Some(portable_interface(description.params)),
        parameters: description
            .parameters
            .iter()
            .map(|parameter| PortableParameter {
                name: parameter.name.clone(),
                default: parameter.default.clone(),
                range: parameter.range,
                follows: parameter.follows.clone(),
            })
            .collect(),
        trigger: Some(description.trigger.clone()),
        deadline: description.deadline,
        unique: description.unique.clone(),
        describes_hardware: description.describes_hardware,
        hardware: description.hardware.clone(),
    })
}

/// Encodes an interface as CBOR, for [`decode_interface`].
///
/// # Errors
/// When a name in it can't be encoded.
pub fn encode_interface(descriptor: &Descriptor) -> Result<Vec<u8>, Refusal> {
    encode(&portable_interface(descriptor))
}

/// Decodes an interface from CBOR, as one that belongs to this program.
///
/// # Errors
/// When it can't be read, or can't be laid out as it says.
pub fn decode_interface(bytes: &[u8]) -> Result<&'static Descriptor, Refusal> {
    intern(&decode(bytes)?)
}

/// Decodes a description from CBOR or JSON.
/// Its interfaces belong to this program.
pub(crate) fn decode_description(bytes: &[u8]) -> Result<Description, Refusal> {
    let first = bytes.iter().find(|byte| !byte.is_ascii_whitespace());
    let portable: PortableDescription = match first {
        Some(b'{') => serde_json::from_slice(bytes).map_err(|error| {
            Refusal(format!("its description, as one line of JSON, can't be read: {error}"))
        })?,
        _ => decode(bytes).map_err(|error| Refusal(format!("its description can't be read: {error}")))?,
    };
    portable.try_into()
}

fn portable_port(port: &PortDescription) -> PortablePort {
    PortablePort {
        name: port.name.clone(),
        doc: port.doc.clone(),
        direction: port.direction,
        interface: PortableInterface {
            table: is_service(port.direction).then_some((port.descriptor.size, port.descriptor.align)),
            ..portable_interface(port.descriptor)
        },
        required: port.required,
        role: port.role.clone(),
        stale_after: port.stale_after,
        safe: port.safe.clone(),
        capacity: Some(port.capacity),
        window: Some(port.window),
    }
}

fn portable_interface(descriptor: &Descriptor) -> PortableInterface {
    let field = |field: &Field| PortableField {
        name: field.name.into(),
        doc: field.doc.into(),
        unit: field.unit.into(),
        kind: portable_kind(&field.kind),
    };
    PortableInterface {
        name: descriptor.name.into(),
        doc: descriptor.doc.into(),
        ros: descriptor.ros.into(),
        fields: descriptor.fields.iter().map(field).collect(),
        hash: Some(descriptor.hash),
        table: None,
    }
}

/// Returns true for the direction of a service.
fn is_service(direction: Direction) -> bool {
    matches!(direction, Direction::Aspect | Direction::Provider)
}

fn portable_kind(kind: &Kind) -> PortableKind {
    let item = |kind: &Kind| Box::new(portable_kind(kind));
    match kind {
        Kind::Primitive(primitive) => PortableKind::Primitive(*primitive),
        Kind::Enumeration(enumeration) => PortableKind::Enumeration {
            name: enumeration.name.into(),
            carrier: item(&enumeration.carrier),
            constants: enumeration
                .constants
                .iter()
                .map(|constant| (constant.name.into(), constant.value, constant.doc.into()))
                .collect(),
        },
        Kind::Text(capacity) => PortableKind::Text(*capacity),
        Kind::Optional(kind) => PortableKind::Optional(item(kind)),
        Kind::Array(kind, length) => PortableKind::Array(item(kind), *length),
        Kind::Sequence(kind, capacity) => PortableKind::Sequence(item(kind), *capacity),
        Kind::Nested(descriptor) => PortableKind::Nested(portable_interface(descriptor)),
        Kind::Tail(kind) => PortableKind::Tail(item(kind)),
    }
}

impl TryFrom<PortableDescription> for Description {
    type Error = Refusal;

    fn try_from(portable: PortableDescription) -> Result<Self, Refusal> {
        let nothing = || PortableInterface {
            name: "Nothing".into(),
            doc: "No value.".into(),
            ros: "std_msgs/msg/Empty".into(),
            fields: Vec::new(),
            hash: None,
            table: None,
        };
        let params = intern(&portable.params.unwrap_or_else(nothing))?;
        for (i, port) in portable.ports.iter().enumerate() {
            if !port.name.split('/').all(is_name) {
                return Err(format!("`{}` can't name a port: {NAME_RULE}", port.name).into());
            }
            if portable.ports[..i].iter().any(|other| other.name == port.name) {
                return Err(format!("it has two ports `{}`", port.name).into());
            }
        }
        portable.parameters.iter().try_for_each(|parameter| check_parameter(params, parameter))?;
        Ok(Self {
            ports: portable.ports.into_iter().map(port).collect::<Result<_, _>>()?,
            params,
            parameters: portable
                .parameters
                .into_iter()
                .map(|parameter| Parameter {
                    name: parameter.name,
                    default: parameter.default,
                    range: parameter.range,
                    follows: parameter.follows,
                })
                .collect(),
            stage: portable.stage,
            trigger: portable.trigger.unwrap_or(Trigger::Stage),
            deadline: portable.deadline,
            unique: portable.unique,
            describes_hardware: portable.describes_hardware,
            hardware: portable.hardware,
        })
    }
}

fn check_parameter(params: &Descriptor, parameter: &PortableParameter) -> Result<(), Refusal> {
    let name = &parameter.name;
    if params.field(name).is_none() {
        return Err(format!("its parameter `{name}` is not a field of {}", params.name).into());
    }
    match (parameter.default.as_f64(), parameter.range) {
        (Some(default), Some((low, high))) if !(low..=high).contains(&default) => {
            Err(format!("the default of its parameter `{name}` is {default}, outside {low} to {high}").into())
        }
        _ => Ok(()),
    }
}

/// Returns true if the text can stand between two slashes of a URL.
fn is_name(text: &str) -> bool {
    !text.is_empty() && text.bytes().all(|byte| byte.is_ascii_alphanumeric() || byte == b'_' || byte == b'-')
}

const NAME_RULE: &str = "a name is letters, digits, `_` and `-`";

/// More than any module can mean.
const WINDOW_LIMIT: usize = 4096;

fn port(port: PortablePort) -> Result<PortDescription, Refusal> {
    if is_service(port.direction) != port.interface.table.is_some() {
        let (name, direction) = (port.name, port.direction.name());
        return Err(format!(
            "`{name}` goes the way {direction}: a service has the size and alignment of its `table`, and nothing else \
             has; build it with this version of slate-module"
        )
        .into());
    }
    let descriptor = intern(&port.interface)?;
    if port.safe.as_ref().is_some_and(|safe| safe.len() != descriptor.size) {
        return Err(format!("the safe value of `{}` is not {} bytes long", port.name, descriptor.size).into());
    }
    if port.required && port.direction != Direction::Input {
        return Err(format!(
            "`{}` is required and goes the way {}: only an Input can be required",
            port.name,
            port.direction.name()
        )
        .into());
    }
    let window = port.window.unwrap_or(16);
    if !(1..=WINDOW_LIMIT).contains(&window) {
        return Err(format!("the window of `{}` is {window}, not 1 to {WINDOW_LIMIT}", port.name).into());
    }
    let usual = if descriptor.tail().is_some() { 1024 } else { 0 };
    Ok(PortDescription {
        name: port.name,
        doc: port.doc,
        direction: port.direction,
        descriptor,
        required: port.required,
        role: port.role,
        stale_after: port.stale_after,
        safe: port.safe,
        capacity: port.capacity.unwrap_or(usual),
        window,
    })
}

/// Interfaces made so far, each once.
/// They are never freed, as values and readers refer to them.
static INTERNED: Mutex<BTreeMap<PortableInterface, &'static Descriptor>> = Mutex::new(BTreeMap::new());

fn intern(interface: &PortableInterface) -> Result<&'static Descriptor, Refusal> {
    if let Some(known) = INTERNED.lock().unwrap_or_else(PoisonError::into_inner).get(interface) {
        return Ok(known);
    }
    let made = Box::leak(Box::new(descriptor(interface)?));
    let mut all = INTERNED.lock().unwrap_or_else(PoisonError::into_inner);
    Ok(all.entry(interface.clone()).or_insert(made))
}

fn leak(text: &str) -> &'static str {
    if text.is_empty() { "" } else { Box::leak(text.into()) }
}

/// Computes the layout of an interface as the compiler does.
/// Fields in order, each at its alignment, a tail behind all of them.
fn descriptor(interface: &PortableInterface) -> Result<Descriptor, Refusal> {
    let name = &interface.name;
    let mut fields = Vec::new();
    let (mut size, mut align) = (0_usize, 1);
    for (i, field) in interface.fields.iter().enumerate() {
        let wrong = |reason: &str| Refusal(format!("field `{}` of {name}: {reason}", field.name));
        let kind = kind(&field.kind)?;
        if !is_name(&field.name) {
            return Err(wrong(NAME_RULE));
        }
        if interface.fields[..i].iter().any(|other| other.name == field.name) {
            return Err(wrong("another field has the same name; rename one of them"));
        }
        if matches!(kind, Kind::Tail(_)) && i + 1 < interface.fields.len() {
            return Err(wrong("only the last field may be a tail"));
        }
        align = align.max(kind.align());
        // No size is near the end of the numbers.
        size = size.next_multiple_of(if matches!(kind, Kind::Tail(_)) { align } else { kind.align() });
        let own = Field {
            name: leak(&field.name),
            doc: leak(&field.doc),
            unit: leak(&field.unit),
            offset: size,
            kind,
        };
        size = size
            .checked_add(kind.size())
            .filter(|size| *size <= SIZE_LIMIT)
            .ok_or_else(|| wrong("too large: expected at most 256 MiB, or a tail"))?;
        fields.push(own);
    }
    size = size.next_multiple_of(align);
    let mut hash = schema_hash(name, &fields);
    if let Some(table) = interface.table {
        (size, align) = table;
        hash = service_hash(name, size, align);
        if !fields.is_empty() || !align.is_power_of_two() || !size.is_multiple_of(align) || size > SIZE_LIMIT
        {
            return Err(
                format!("the table of {name} can't have {size} bytes aligned to {align}, or fields").into()
            );
        }
    }
    let fields: &'static [Field] = Box::leak(fields.into_boxed_slice());
    if let Some(claimed) = interface.hash.filter(|claimed| *claimed != hash) {
        return Err(format!(
            "{name} has schema {claimed:016x} in the library, but its fields make {hash:016x}: it was built with \
             another version of slate-module"
        )
        .into());
    }
    let (doc, ros) = (leak(&interface.doc), leak(&interface.ros));
    Ok(Descriptor { name: leak(name), doc, ros, fields, size, align, hash })
}

/// Maximum size of a value, bytes; a big payload is a tail.
const SIZE_LIMIT: usize = 1 << 28;

fn kind(portable: &PortableKind) -> Result<Kind, Refusal> {
    let item = |kind_of: &PortableKind| -> Result<&'static Kind, Refusal> {
        let made = kind(kind_of)?;
        if matches!(made, Kind::Tail(_)) || matches!(made, Kind::Nested(nested) if nested.tail().is_some()) {
            return Err("a tail can't be inside another type".into());
        }
        if made.size() == 0 {
            // Any number of them would take no memory, but time.
            return Err("there are items of no size".into());
        }
        Ok(Box::leak(Box::new(made)))
    };
    let counted = |kind: Kind, item: &Kind, count: usize| {
        // The size of what does not fit is not a number.
        let fits = item.size().checked_mul(count).is_some_and(|size| size <= SIZE_LIMIT);
        if fits && kind.size().is_multiple_of(kind.align()) {
            Ok(kind)
        } else {
            Err(Refusal("a type is too large or would need padding".into()))
        }
    };
    Ok(match portable {
        PortableKind::Primitive(primitive) => Kind::Primitive(*primitive),
        PortableKind::Enumeration { name, carrier, constants } => {
            let carrier = match kind(carrier)? {
                integer @ Kind::Primitive(primitive) if primitive.integers().is_some() => integer,
                _ => return Err(format!("the enumeration {name} is carried by no integer").into()),
            };
            let constants = constants
                .iter()
                .map(|(name, value, doc)| Constant { name: leak(name), value: *value, doc: leak(doc) })
                .collect::<Vec<_>>();
            let constants = Box::leak(constants.into_boxed_slice());
            Kind::Enumeration(Box::leak(Box::new(Enumeration { name: leak(name), carrier, constants })))
        }
        PortableKind::Text(capacity) => {
            if !capacity.is_multiple_of(4) || *capacity > SIZE_LIMIT {
                return Err("the capacity of a text is a multiple of 4 bytes".into());
            }
            Kind::Text(*capacity)
        }
        PortableKind::Optional(of) => {
            let of = item(of)?;
            counted(Kind::Optional(of), of, 1)?
        }
        PortableKind::Array(of, length) => {
            let of = item(of)?;
            counted(Kind::Array(of, *length), of, *length)?
        }
        PortableKind::Sequence(of, capacity) => {
            let of = item(of)?;
            counted(Kind::Sequence(of, *capacity), of, *capacity)?
        }
        PortableKind::Nested(interface) => {
            let nested = intern(interface)?;
            if nested.tail().is_some() {
                return Err(format!("{} has a tail, so it can't be inside another type", nested.name).into());
            }
            Kind::Nested(nested)
        }
        PortableKind::Tail(of) => Kind::Tail(item(of)?),
    })
}

#[cfg(test)]
#[allow(clippy::unwrap_used, reason = "a test that fails panics")]
mod tests {
    use super::*;

    #[test]
    fn services_alone_have_tables() {
        let with = |direction: &str, table: &str| {
            let json = format!(
                r#"{{"stage":"Think","ports":[{{"name":"light","direction":"{direction}",
                    "interface":{{"name":"light_meter 1","fields":[]{table}}}}}]}}"#
            );
            decode_description(json.as_bytes()).map(|description| description.ports[0].descriptor.hash)
        };
        assert_eq!(with("Aspect", r#","table":[16,8]"#).unwrap(), service_hash("light_meter 1", 16, 8));
        assert!(with("Aspect", "").unwrap_err().0.contains("a service has the size"));
        assert!(with("Output", r#","table":[16,8]"#).unwrap_err().0.contains("nothing else has"));
        assert!(with("Aspect", r#","table":[16,3]"#).unwrap_err().0.contains("aligned to 3"));
        assert!(with("Aspect", r#","table":[16,0]"#).unwrap_err().0.contains("aligned to 0"));
    }

    #[test]
    fn defaults_out_of_range_are_refused() {
        let with = |default: f64| {
            let json = format!(
                r#"{{"stage":"Think","params":{{"name":"Own","fields":[{{"name":"gain","kind":"f64"}}]}},
                    "parameters":[{{"name":"gain","default":{default},"range":[0.0,10.0]}}]}}"#
            );
            decode_description(json.as_bytes()).map(|_| ()).map_err(|refusal| refusal.0)
        };
        assert_eq!(with(10.0), Ok(()));
        assert!(with(20.0).unwrap_err().contains("`gain` is 20, outside 0 to 10"));
    }

    #[test]
    fn the_description_of_the_book_is_read_as_it_says() {
        let book = include_str!("../../../book/src/09-plugins.md");
        let json = book.split_once("```json\n").and_then(|(_, rest)| rest.split_once("```")).unwrap().0;
        let description = decode_description(json.as_bytes()).unwrap();
        assert_eq!(description.stage, Stage::SensorProcess);
        assert_eq!(description.deadline, Some(5_000_000));
        assert_eq!(
            description.trigger,
            Trigger::On { ports: vec!["input".into()], timeout: Some(1_000_000_000) }
        );
        let [input, mean] = &description.ports[..] else { unreachable!() };
        assert_eq!((input.direction, input.stale_after), (Direction::Input, Some(200_000_000)));
        assert_eq!((input.required, mean.required), (true, false));
        assert_eq!((mean.descriptor.size, mean.descriptor.fields[0].unit), (8, "ticks"));
        assert_eq!(description.parameters[0].range, Some((0.0, 1.0)));
        for kind in [
            r#"{"array":["f64",3]}"#,
            r#"{"text":32}"#,
            r#"{"sequence":["f64",8]}"#,
            r#"{"optional":"f64"}"#,
            r#"{"tail":"f64"}"#,
        ] {
            serde_json::from_str::<PortableKind>(kind).unwrap();
        }
    }

    #[test]
    fn types_that_no_memory_holds_are_refused() {
        let refusal = |kind: &str| {
            let text = format!(r#"{{"name":"Huge","fields":[{{"name":"many","kind":{kind}}}]}}"#);
            let portable: PortableInterface = serde_json::from_str(&text).unwrap();
            decode_interface(&encode(&portable).unwrap()).unwrap_err().to_string()
        };
        for kind in [
            format!(r#"{{"array":["u64",{}]}}"#, 1_u64 << 61),
            format!(r#"{{"sequence":["u64",{}]}}"#, u64::MAX),
            format!(r#"{{"array":[{{"array":["u64",{}]}},4]}}"#, 1 << 26),
        ] {
            assert!(refusal(&kind).contains("too large"), "{}", refusal(&kind));
        }
        let nothing = r#"{"nested":{"name":"Nothing","fields":[]}}"#;
        for kind in [format!(r#"{{"array":[{nothing},1000000]}}"#), format!(r#"{{"tail":{nothing}}}"#)] {
            assert!(refusal(&kind).contains("no size"), "{}", refusal(&kind));
        }
    }
}
