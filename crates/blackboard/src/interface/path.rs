use super::decode::{length, read};
use super::{Descriptor, Kind, Value};
use crate::nearest::nearest_names;

fn no_field(interface: &str, field: &str, known: &str) -> String {
    if field.is_empty() {
        return format!("no field of {interface} is named; it has {known}");
    }
    format!("{interface} has no field `{field}`; it has {known}")
}

/// Error of reading or writing a field.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum AccessError {
    /// The interface has no such field.
    #[error("{}", no_field(.interface, .field, .known))]
    UnknownField {
        /// The interface that was searched.
        interface: String,
        /// The requested name.
        field: String,
        /// The existing names.
        known: String,
    },
    /// The given value has another type.
    #[error("`{field}` is {expected}, not {found}")]
    WrongType {
        /// Path of the field.
        field: String,
        /// Expected type.
        expected: String,
        /// Given value.
        found: String,
    },
    /// The field can't hold that value exactly.
    #[error("`{field}` is {expected} and can't hold {found} exactly")]
    NotExact {
        /// Path of the field.
        field: String,
        /// Expected type.
        expected: String,
        /// Given value.
        found: String,
    },
}

/// Place inside an interface: the part of a URL after the property.
#[derive(Clone, Debug)]
pub struct FieldPath {
    kind: Kind,
    offset: usize,
    /// Length prefixes on the way: (offset, capacity, index).
    /// The length must cover the index.
    guards: Vec<(usize, usize, usize)>,
    tail_index: Option<usize>,
}

impl FieldPath {
    /// Returns the type of the field.
    pub fn kind(&self) -> &Kind {
        &self.kind
    }

    /// Returns the offset from the beginning of the value, bytes.
    pub fn offset(&self) -> usize {
        self.offset
    }

    pub(super) fn read(&self, bytes: &[u8], items: usize) -> Option<Value> {
        let covered =
            self.guards.iter().all(|(offset, capacity, index)| *index < length(&bytes[*offset..], *capacity));
        let in_tail = self.tail_index.is_none_or(|index| index < items);
        (covered && in_tail).then(|| read(&self.kind, &bytes[self.offset..], items))
    }
}

/// Returns the names of all fields, the most similar ones first.
fn fields(descriptor: &Descriptor, meant: &str) -> String {
    let names = || descriptor.fields.iter().map(|field| field.name);
    let near = nearest_names(meant, names());
    let others = names().filter(|name| !near.iter().any(|near| near == name));
    near.iter().map(String::as_str).chain(others).collect::<Vec<_>>().join(", ")
}

/// Finds `path` (`position/x`, `ranges/3`) in an interface.
///
/// # Errors
/// [`AccessError::UnknownField`] with the existing names.
pub fn find(descriptor: &Descriptor, path: &str) -> Result<FieldPath, AccessError> {
    let mut found: Option<FieldPath> = None;
    let mut current = Some(descriptor);
    for name in path.split('/') {
        let unknown = |interface: &str, known: String| AccessError::UnknownField {
            interface: interface.into(),
            field: name.into(),
            known,
        };
        let location = match (current.take(), found.take()) {
            (Some(descriptor), before) => {
                let field = descriptor
                    .fields
                    .iter()
                    .find(|field| field.name == name)
                    .ok_or_else(|| unknown(descriptor.name, fields(descriptor, name)))?;
                let (base, guards, tail_index) =
                    before.map_or((0, vec![], None), |p| (p.offset, p.guards, p.tail_index));
                FieldPath { kind: field.kind, offset: base + field.offset, guards, tail_index }
            }
            (None, Some(mut location)) => {
                let index = name.parse::<usize>();
                let missing = || unknown(&location.kind.describe(), "indices from 0".into());
                match (location.kind, index) {
                    (Kind::Array(item, count), Ok(i)) if i < count => {
                        location.offset += i * item.size();
                        location.kind = *item;
                    }
                    (Kind::Sequence(item, capacity), Ok(i)) if i < capacity => {
                        location.guards.push((location.offset, capacity, i));
                        location.offset += 8 + i * item.size();
                        location.kind = *item;
                    }
                    (Kind::Tail(item), Ok(i)) => {
                        location.tail_index = Some(i);
                        // The index is the caller's, and may be beyond any memory.
                        let end =
                            i.checked_mul(item.size()).and_then(|bytes| bytes.checked_add(location.offset));
                        location.offset = end.ok_or_else(missing)?;
                        location.kind = *item;
                    }
                    _ => return Err(missing()),
                }
                location
            }
            (None, None) => return Err(unknown("value", "no fields".into())),
        };
        if let Kind::Nested(inner) = location.kind {
            current = Some(inner);
        }
        found = Some(location);
    }
    found.ok_or_else(|| AccessError::UnknownField {
        interface: descriptor.name.into(),
        field: path.into(),
        known: "its fields".into(),
    })
}
