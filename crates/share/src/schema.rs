//! Interfaces of other agents: memory limits, and differences to local ones.

use std::collections::BTreeSet;
use std::sync::{Mutex, PoisonError};

use slate_blackboard::interface::{Descriptor, Field, Kind};
use slate_module::{Refusal, decode_interface};

/// Memory limit for interfaces from other agents, bytes.
/// Descriptors stay for as long as the process, as values and readers refer to them.
const MAX_MEMORY: usize = 8 << 20;

/// Largest encoded interface, bytes.
const MAX_INTERFACE_SIZE: usize = 256 << 10;

/// Received interfaces, each counted once, and their total size, bytes.
static KNOWN_INTERFACES: Mutex<(BTreeSet<Vec<u8>>, usize)> = Mutex::new((BTreeSet::new(), 0));

/// Decodes an interface that another agent has described.
///
/// # Errors
/// When it can't be read, or other agents have brought too many.
pub fn interface(bytes: &[u8]) -> Result<&'static Descriptor, Refusal> {
    if bytes.len() > MAX_INTERFACE_SIZE {
        return Err(Refusal(format!(
            "its interface takes {} bytes, more than {MAX_INTERFACE_SIZE}",
            bytes.len()
        )));
    }
    {
        let mut known = KNOWN_INTERFACES.lock().unwrap_or_else(PoisonError::into_inner);
        let (all, taken) = &mut *known;
        if !all.contains(bytes) {
            if *taken + bytes.len() > MAX_MEMORY {
                return Err(Refusal(format!(
                    "other agents have brought more than {MAX_MEMORY} bytes of interfaces; restart this agent to forget \
                     them"
                )));
            }
            *taken += bytes.len();
            all.insert(bytes.to_vec());
        }
    }
    decode_interface(bytes)
}

/// Describes the first difference of two interfaces; `None` for equal schemas.
pub fn difference(here: &Descriptor, there: &Descriptor) -> Option<String> {
    if here.hash == there.hash {
        return None;
    }
    if here.name != there.name {
        return Some(format!("here it is {}, there {}", here.name, there.name));
    }
    let found = first_difference(here, there, "");
    Some(found.unwrap_or_else(|| format!("{} has another schema there", here.name)))
}

fn first_difference(here: &Descriptor, there: &Descriptor, prefix: &str) -> Option<String> {
    let count = here.fields.len().max(there.fields.len());
    (0..count).find_map(|i| match (here.fields.get(i), there.fields.get(i)) {
        (Some(own), Some(other)) => field_difference(own, other, prefix),
        (Some(own), None) => {
            Some(format!("{} has `{prefix}{}` ({}) only here", here.name, own.name, describe(own)))
        }
        (None, Some(other)) => {
            Some(format!("{} has `{prefix}{}` ({}) only there", here.name, other.name, describe(other)))
        }
        (None, None) => None,
    })
}

fn field_difference(here: &Field, there: &Field, prefix: &str) -> Option<String> {
    let path = format!("{prefix}{}", here.name);
    if here.name != there.name {
        return Some(format!("a field is `{path}` here and `{prefix}{}` there", there.name));
    }
    if here.unit != there.unit || here.kind.describe() != there.kind.describe() {
        return Some(format!("`{path}` is {} here and {} there", describe(here), describe(there)));
    }
    kind_difference(&here.kind, &there.kind, &path)
}

/// Returns the first difference inside types of the same name.
fn kind_difference(here: &Kind, there: &Kind, path: &str) -> Option<String> {
    match (here, there) {
        (Kind::Nested(own), Kind::Nested(other)) if own.hash != other.hash => {
            first_difference(own, other, &format!("{path}/"))
        }
        (Kind::Enumeration(own), Kind::Enumeration(other)) => {
            let carriers = (own.carrier.describe(), other.carrier.describe());
            let values =
                own.constants.iter().zip(other.constants).find(|(own, other)| own.value != other.value);
            if carriers.0 != carriers.1 {
                Some(format!("`{path}` is carried by {} here and by {} there", carriers.0, carriers.1))
            } else if own.name != other.name {
                Some(format!("`{path}` is {} here and {} there", own.name, other.name))
            } else {
                values.map(|(own, other)| {
                    format!("`{path}`: {} is {} here and {} there", own.name, own.value, other.value)
                })
            }
        }
        (Kind::Optional(own), Kind::Optional(other))
        | (Kind::Array(own, _), Kind::Array(other, _))
        | (Kind::Sequence(own, _), Kind::Sequence(other, _))
        | (Kind::Tail(own), Kind::Tail(other)) => kind_difference(own, other, path),
        _ => None,
    }
}

fn describe(field: &Field) -> String {
    let unit = if field.unit.is_empty() { "without unit".into() } else { format!("in {}", field.unit) };
    format!("{} {unit}", field.kind.describe())
}
