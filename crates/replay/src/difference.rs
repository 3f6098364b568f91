use std::fmt;

use slate_blackboard::interface::{Descriptor, Value, View};

use slate_ros_messages as ros;

/// The first thing in which two runs differ.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Difference {
    /// The agent's time, nanoseconds.
    pub time: u64,
    /// The property.
    pub url: String,
    /// The field; empty when it is about the value as a whole.
    pub field: String,
    /// Recorded value.
    pub recorded: String,
    /// Value of the repeated run.
    pub replayed: String,
}

impl fmt::Display for Difference {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { time, url, field, recorded, replayed } = self;
        let slash = if field.is_empty() { "" } else { "/" };
        let seconds = *time as f64 * 1e-9;
        write!(
            f,
            "first difference at {seconds:.3} s: {url}{slash}{field}: recorded {recorded}, replayed {replayed}"
        )
    }
}

/// Returns the first field in which two messages differ, and its two values.
pub(super) fn field(descriptor: &'static Descriptor, recorded: &[u8], replayed: &[u8]) -> [String; 3] {
    let read = |message: &[u8]| {
        let bytes = ros::decode(descriptor, message).map_err(|error| error.to_string())?;
        let item = descriptor.tail().map_or(0, |kind| kind.size());
        let items = bytes.len().saturating_sub(descriptor.size).checked_div(item).unwrap_or(0);
        let view = View::new(descriptor, &bytes, items);
        view.map(|view| view.value()).ok_or_else(|| "too few bytes".to_owned())
    };
    let text = |value: Result<Value, String>| match value {
        Ok(value) => shown(&value),
        Err(error) => format!("no value ({error})"),
    };
    match (read(recorded), read(replayed)) {
        (Ok(one), Ok(other)) => {
            let unseen = "bytes that no field shows";
            let found = first(&one, &other, String::new());
            found.unwrap_or_else(|| [String::new(), unseen.into(), format!("other {unseen}")])
        }
        (one, other) => [String::new(), text(one), text(other)],
    }
}

fn first(one: &Value, other: &Value, path: String) -> Option<[String; 3]> {
    let below = |name: &str| if path.is_empty() { name.to_owned() } else { format!("{path}/{name}") };
    match (one, other) {
        (Value::Table(ours), Value::Table(theirs)) if ours.len() == theirs.len() => {
            ours.iter().zip(theirs).find_map(|((name, ours), (_, theirs))| first(ours, theirs, below(name)))
        }
        (Value::List(ours), Value::List(theirs)) if ours.len() == theirs.len() => ours
            .iter()
            .zip(theirs)
            .enumerate()
            .find_map(|(index, (ours, theirs))| first(ours, theirs, below(&index.to_string()))),
        (Value::List(ours), Value::List(theirs)) => {
            Some([path, format!("{} items", ours.len()), format!("{} items", theirs.len())])
        }
        // NaN equals itself here.
        (Value::Float(ours), Value::Float(theirs)) if ours.to_bits() == theirs.to_bits() => None,
        (Value::Float(_), Value::Float(_)) => Some([path, shown(one), shown(other)]),
        _ if one == other => None,
        _ => Some([path, shown(one), shown(other)]),
    }
}

fn shown(value: &Value) -> String {
    match value {
        Value::Null => "nothing".into(),
        Value::Float(number) => format!("{number:?}"),
        Value::Text(text) => format!("{text:?}"),
        other => serde_json::to_string(other).unwrap_or_else(|_| other.describe().into()),
    }
}
