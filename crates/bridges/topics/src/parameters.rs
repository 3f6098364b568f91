//! Parameters of modules as those of a node.

use serde_json::{Value as Json, json};
use slate_blackboard::interface::{Descriptor, Kind, Primitive, Value};
use slate_runtime::Composer;

/// Types of parameters, as `rcl_interfaces/msg/ParameterType` numbers them.
const NOT_SET: u8 = 0;
const BOOL: u8 = 1;
const INTEGER: u8 = 2;
const DOUBLE: u8 = 3;
const STRING: u8 = 4;
/// Lists of those have these numbers more; lists of bytes have 5.
const LIST_OFFSET: u8 = 5;

/// Fields of `ParameterValue`, by type.
const VALUE_FIELDS: [&str; 10] = [
    "",
    "bool_value",
    "integer_value",
    "double_value",
    "string_value",
    "byte_array_value",
    "bool_array_value",
    "integer_array_value",
    "double_array_value",
    "string_array_value",
];

/// Parameter of a module.
#[derive(Clone, Debug, PartialEq)]
pub struct NodeParameter {
    /// Name in ROS, such as `planner.speed`.
    pub name: String,
    /// Module.
    pub module: String,
    /// Names of its fields, from the parameters of the module on.
    pub fields: Vec<String>,
    /// Present value.
    pub value: Value,
    /// Type number as in `rcl_interfaces`.
    pub kind: u8,
    doc: String,
    range: Option<(f64, f64)>,
}

/// Parameters of an agent, with their present values.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ParameterTable(pub Vec<NodeParameter>);

impl ParameterTable {
    /// Returns the parameters of all modules, by name.
    pub fn new(composer: &Composer) -> Self {
        let mut all = Vec::new();
        for module in composer.modules() {
            let name = &module.name;
            let Some((property, _)) = composer.board().get(&format!("{name}/params")) else { continue };
            let Ok(Some((value, _))) = composer.board().read(&format!("{name}/params")) else { continue };
            let mut own = Vec::new();
            add(&mut own, property.descriptor(), &value, name, &[]);
            let ranges = composer.parameters(name);
            for parameter in &mut own {
                let range = ranges.iter().find(|range| [range.name.as_str()] == parameter.fields[..]);
                parameter.range = range.and_then(|range| range.range);
            }
            all.extend(own);
        }
        all.sort_by(|one, other| one.name.cmp(&other.name));
        Self(all)
    }

    /// Returns the parameter with that name in ROS.
    pub fn get(&self, name: &str) -> Option<&NodeParameter> {
        self.0.iter().find(|own| own.name == name)
    }
}

fn add(all: &mut Vec<NodeParameter>, of: &'static Descriptor, value: &Value, module: &str, outer: &[String]) {
    for field in of.fields {
        let Some(value) = value.get(field.name) else { continue };
        let fields: Vec<_> = outer.iter().cloned().chain([field.name.to_owned()]).collect();
        if let Kind::Nested(inner) = field.kind {
            add(all, inner, value, module, &fields);
            continue;
        }
        let kind = kind(&field.kind);
        if kind == NOT_SET {
            continue;
        }
        let unit = if field.unit.is_empty() { String::new() } else { format!(" [{}]", field.unit) };
        all.push(NodeParameter {
            name: format!("{}.{}", module.replace('/', "."), fields.join(".")),
            module: module.to_owned(),
            fields,
            value: value.clone(),
            kind,
            doc: format!("{}{unit}", field.doc.trim()),
            range: None,
        });
    }
}

/// Returns the ROS type number of a parameter's kind; `NOT_SET` without one.
fn kind(of: &Kind) -> u8 {
    match of {
        Kind::Text(_) | Kind::Enumeration(_) => STRING,
        Kind::Optional(item) => kind(item),
        Kind::Array(item, _) | Kind::Sequence(item, _) | Kind::Tail(item) => match kind(item) {
            single @ BOOL..=STRING => single + LIST_OFFSET,
            _ => NOT_SET,
        },
        Kind::Primitive(Primitive::Bool) => BOOL,
        Kind::Primitive(Primitive::F32 | Primitive::F64) => DOUBLE,
        Kind::Primitive(_) => INTEGER,
        Kind::Nested(_) => NOT_SET,
    }
}

impl NodeParameter {
    /// Returns whether its numbers may have fractions.
    pub fn is_floating(&self) -> bool {
        [DOUBLE, DOUBLE + LIST_OFFSET].contains(&self.kind)
    }

    /// Returns the path of the setting.
    pub fn path(&self) -> String {
        format!("{}/params/{}", self.module, self.fields.join("/"))
    }

    /// Returns the path of the setting in the configuration.
    pub fn setting(&self) -> String {
        let names: Vec<_> = self.fields.iter().map(|field| format!("{field:?}")).collect();
        format!("modules.{:?}.params.{}", self.module, names.join("."))
    }

    /// Returns it as `rcl_interfaces/msg/ParameterValue`.
    pub fn message(&self) -> Json {
        if self.value == Value::Null {
            return json!({ "type": NOT_SET });
        }
        let value = serde_json::to_value(&self.value).unwrap_or_default();
        // JSON has no infinities and no NaN: they become null.
        json!({ "type": self.kind, VALUE_FIELDS[usize::from(self.kind)]: value })
    }

    /// Returns it as `rcl_interfaces/msg/ParameterDescriptor`.
    pub fn describe(&self, is_settable: bool) -> Json {
        let mut descriptor = json!({
            "name": self.name,
            "type": self.kind,
            "description": self.doc,
            "read_only": !is_settable,
        });
        match self.range {
            Some((from, to)) if self.kind == INTEGER => {
                let range = json!([{ "from_value": from as i64, "to_value": to as i64 }]);
                descriptor["integer_range"] = range;
            }
            Some((from, to)) if from.is_finite() && to.is_finite() => {
                descriptor["floating_point_range"] = json!([{ "from_value": from, "to_value": to }]);
            }
            _ => {}
        }
        descriptor
    }
}

/// Returns the value of a `rcl_interfaces/msg/ParameterValue`.
///
/// # Errors
/// In words, when it has none.
pub fn value_of(message: &Json) -> Result<Json, String> {
    let kind = message["type"].as_u64().unwrap_or_default() as usize;
    let field = VALUE_FIELDS.get(kind).filter(|field| !field.is_empty());
    let field = field.ok_or("a parameter of a module can't be taken away")?;
    match &message[*field] {
        Json::Null => Err("a parameter is a finite number".into()),
        value => Ok(value.clone()),
    }
}
