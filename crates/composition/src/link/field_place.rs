use slate_blackboard::interface::{Descriptor, Kind};
use slate_blackboard::nearest_names;

/// A field of an interface, or the whole of it.
#[derive(Clone, Debug)]
pub struct FieldPlace {
    pub(super) kind: Kind,
    pub(super) unit: &'static str,
    pub(super) offset: usize,
    /// Lengths on the path: offset of each, and the index that it must exceed.
    pub(super) guards: Vec<(usize, usize)>,
    /// Index of an item of the tail.
    pub(super) tail: Option<usize>,
}

/// A missing field.
#[derive(Debug, PartialEq, Eq)]
pub struct NoField {
    /// Description of the error.
    pub message: String,
    /// Help for the user.
    pub help: String,
}

impl FieldPlace {
    /// Finds the field at a path such as `pose/x` or `ranges/3`.
    /// An empty path selects the whole value.
    pub fn find(descriptor: &'static Descriptor, path: &str) -> Result<Self, NoField> {
        let kind = Kind::Nested(descriptor);
        let mut place = Self { kind, unit: "", offset: 0, guards: Vec::new(), tail: None };
        for name in path.split('/').filter(|name| !name.is_empty()) {
            place = place.select_field(name)?;
        }
        Ok(place)
    }

    fn select_field(mut self, name: &str) -> Result<Self, NoField> {
        let missing = |count: String| NoField {
            message: format!("unknown item `{name}`"),
            help: format!("it has {count}, counted from 0"),
        };
        let index = name.parse::<usize>().ok();
        let (kind, offset) = match self.kind {
            Kind::Nested(descriptor) => {
                let Some(field) = descriptor.field(name) else {
                    let names = || descriptor.fields.iter().map(|field| field.name);
                    let near = nearest_names(name, names());
                    let help = match near.is_empty() {
                        true => format!("it has {}", names().collect::<Vec<_>>().join(", ")),
                        false => format!("did you mean {}?", near.join(" or ")),
                    };
                    return Err(NoField {
                        message: format!("{} has no field `{name}`", descriptor.name),
                        help,
                    });
                };
                self.unit = field.unit;
                (field.kind, field.offset)
            }
            Kind::Array(item, count) => match index.filter(|index| *index < count) {
                Some(index) => (*item, index * item.size()),
                None => return Err(missing(format!("{count} items"))),
            },
            Kind::Sequence(item, capacity) => match index.filter(|index| *index < capacity) {
                Some(index) => {
                    self.guards.push((self.offset, index));
                    (*item, 8 + index * item.size())
                }
                None => return Err(missing(format!("at most {capacity} items"))),
            },
            Kind::Tail(item) => {
                // An offset beyond all memory is never reached.
                match index.and_then(|index| {
                    Some((index, index.checked_mul(item.size())?.checked_add(self.offset)?))
                }) {
                    Some((index, end)) => {
                        self.tail = Some(index);
                        (*item, end - self.offset)
                    }
                    None => return Err(missing("items".into())),
                }
            }
            other => {
                let message = format!("{} has no field `{name}`", other.describe());
                return Err(NoField { message, help: "leave out the rest".into() });
            }
        };
        (self.kind, self.offset) = (kind, self.offset + offset);
        Ok(self)
    }

    /// Returns type and unit for messages.
    pub fn describe(&self) -> String {
        match self.unit {
            "" => self.kind.describe(),
            unit => format!("{} in {unit}", self.kind.describe()),
        }
    }

    /// Returns whether a value contains the field.
    /// Sequences of the value may be shorter than their capacity.
    pub(super) fn is_in(&self, bytes: &[u8], items: usize) -> bool {
        let length = |at: usize| {
            bytes.get(at..at + 4).map_or(0, |bytes| {
                let mut length = [0; 4];
                length.copy_from_slice(bytes);
                u32::from_ne_bytes(length) as usize
            })
        };
        self.guards.iter().all(|(at, index)| *index < length(*at))
            && self.tail.is_none_or(|index| index < items)
    }

    /// Returns whether the field is an item of a sequence that may be too short for it.
    pub fn may_be_missing(&self) -> bool {
        !self.guards.is_empty() || self.tail.is_some()
    }
}
