//! Mapping from the members of a struct to the fields of an interface.

use std::sync::Arc;

use slate_blackboard::interface::{Descriptor, Kind, Primitive};

use crate::idl::{IdlKind, IdlStruct};

/// Type on the wire with the offsets of its parts in a value.
/// Parts that the interface lacks have none.
#[derive(Debug)]
pub enum TypeMap {
    Number {
        wire: Primitive,
        memory: Option<Primitive>,
        is_enumeration: bool,
    },
    Text {
        bound: Option<usize>,
        capacity: Option<usize>,
    },
    /// Members with their offsets.
    Struct {
        own: Arc<IdlStruct>,
        members: Vec<(usize, TypeMap)>,
    },
    List {
        item: Box<TypeMap>,
        count: WireCount,
        memory: Option<MemoryList>,
    },
}

/// Number of a list's items on the wire.
#[derive(Clone, Copy, Debug)]
pub enum WireCount {
    Fixed(usize),
    /// Their number is before them, at most that.
    Counted(Option<usize>),
}

/// List in a value.
#[derive(Clone, Copy, Debug)]
pub struct MemoryList {
    pub kind: MemoryListKind,
    /// Bytes of an item.
    pub size: usize,
}

#[derive(Clone, Copy, Debug)]
pub enum MemoryListKind {
    Array,
    /// Sequence with this capacity, items.
    Sequence(usize),
    Tail,
}

/// Pairs a struct with an interface, by names.
pub struct StructMapper<'a> {
    pub own: &'a Arc<IdlStruct>,
    pub descriptor: &'static Descriptor,
    /// Fields that the struct lacks.
    pub missing: Vec<String>,
    /// Fields that both have.
    pub common: usize,
}

impl StructMapper<'_> {
    /// Returns the map of the struct and the interface as a whole.
    ///
    /// # Errors
    /// A member and the field of its name have types that don't fit, in words.
    pub fn map(&mut self) -> Result<TypeMap, String> {
        self.structure(self.own, Some(self.descriptor), "")
    }

    fn structure(
        &mut self,
        own: &Arc<IdlStruct>,
        descriptor: Option<&'static Descriptor>,
        path: &str,
    ) -> Result<TypeMap, String> {
        let fields = descriptor.map_or(&[][..], |descriptor| descriptor.fields);
        let members = own.members.iter().map(|member| {
            let field = fields.iter().find(|field| field.name == member.name);
            let path = joined(path, &member.name);
            let map = self.kind(&member.kind, field.map(|field| field.kind), &path)?;
            self.common += usize::from(field.is_some());
            Ok((field.map_or(0, |field| field.offset), map))
        });
        let members = members.collect::<Result<_, String>>()?;
        let is_missing = |name: &str| !is_padding(name) && !own.members.iter().any(|own| own.name == name);
        let missing = fields.iter().filter(|field| is_missing(field.name));
        self.missing.extend(missing.map(|field| joined(path, field.name)));
        Ok(TypeMap::Struct { own: Arc::clone(own), members })
    }

    fn kind(&mut self, wire: &IdlKind, memory: Option<Kind>, path: &str) -> Result<TypeMap, String> {
        match (wire, memory) {
            (IdlKind::Primitive(wire), memory) if fits(*wire, memory) => Ok(number(*wire, memory, false)),
            (IdlKind::Enumeration(own), memory) if fits(own.carrier, memory) => {
                Ok(number(own.carrier, memory, true))
            }
            (IdlKind::Text(bound), None) => Ok(TypeMap::Text { bound: *bound, capacity: None }),
            (IdlKind::Text(bound), Some(Kind::Text(capacity))) => {
                Ok(TypeMap::Text { bound: *bound, capacity: Some(capacity) })
            }
            (IdlKind::Struct(own), None) => self.structure(own, None, path),
            (IdlKind::Struct(own), Some(Kind::Nested(descriptor))) => {
                self.structure(own, Some(descriptor), path)
            }
            (IdlKind::Array(item, count), None) => self.list(item, WireCount::Fixed(*count), None, path),
            (IdlKind::Array(item, count), Some(Kind::Array(own, size))) if *count == size => {
                self.list(item, WireCount::Fixed(*count), Some((*own, MemoryListKind::Array)), path)
            }
            (IdlKind::Sequence(item, bound), None) => self.list(item, WireCount::Counted(*bound), None, path),
            (IdlKind::Sequence(item, bound), Some(Kind::Sequence(own, room))) => {
                let memory = Some((*own, MemoryListKind::Sequence(room)));
                self.list(item, WireCount::Counted(*bound), memory, path)
            }
            (IdlKind::Sequence(item, bound), Some(Kind::Tail(own))) => {
                self.list(item, WireCount::Counted(*bound), Some((*own, MemoryListKind::Tail)), path)
            }
            (_, memory) => {
                let found = memory.map_or_else(String::new, |kind| kind.describe());
                let IdlStruct { name, place, .. } = &**self.own;
                let interface = self.descriptor.name;
                Err(format!(
                    "`{path}` is {} in {name} ({place}), and {found} in {interface}",
                    wire.describe()
                ))
            }
        }
    }

    fn list(
        &mut self,
        item: &IdlKind,
        count: WireCount,
        memory: Option<(Kind, MemoryListKind)>,
        path: &str,
    ) -> Result<TypeMap, String> {
        let item = Box::new(self.kind(item, memory.map(|(kind, _)| kind), path)?);
        let memory = memory.map(|(item, kind)| MemoryList { kind, size: item.size() });
        Ok(TypeMap::List { item, count, memory })
    }
}

fn joined(path: &str, name: &str) -> String {
    if path.is_empty() { name.into() } else { format!("{path}.{name}") }
}

/// Returns whether a field is padding of the layout.
fn is_padding(name: &str) -> bool {
    let number = name.strip_prefix("reserved").or_else(|| name.strip_prefix("padding_"));
    number.is_some_and(|number| number.bytes().all(|letter| letter.is_ascii_digit()))
}

fn primitive(kind: &Kind) -> Option<Primitive> {
    match kind {
        Kind::Primitive(primitive) => Some(*primitive),
        Kind::Enumeration(enumeration) => primitive(&enumeration.carrier),
        _ => None,
    }
}

/// Returns whether a number converts to another.
/// Truth values, integers and floats convert each among themselves.
fn fits(wire: Primitive, memory: Option<Kind>) -> bool {
    let Some(memory) = memory else { return true };
    let class = |kind: Primitive| (kind == Primitive::Bool, kind.integers().is_some());
    primitive(&memory).is_some_and(|memory| class(memory) == class(wire))
}

fn number(wire: Primitive, memory: Option<Kind>, is_enumeration: bool) -> TypeMap {
    TypeMap::Number { wire, memory: memory.and_then(|kind| primitive(&kind)), is_enumeration }
}
