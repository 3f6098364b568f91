use super::Primitive;
use crate::Shape;

/// Names, types, offsets, units and documentation of an interface.
#[derive(Debug, PartialEq, Eq)]
pub struct Descriptor {
    /// Name of the interface, such as `Pose2`.
    pub name: &'static str,
    /// Documentation of the values.
    pub doc: &'static str,
    /// The matching ROS 2 message, such as `geometry_msgs/msg/Pose2D`.
    /// Empty without one.
    pub ros: &'static str,
    /// The fields in the order of their offsets; a tail comes last.
    pub fields: &'static [Field],
    /// Bytes of a value, without its tail.
    pub size: usize,
    /// Alignment in bytes.
    pub align: usize,
    /// Hash of the schema: over names, types, offsets and units.
    /// Documentation is not part of it.
    pub hash: u64,
}

/// One field of an interface.
#[derive(Debug, PartialEq, Eq)]
pub struct Field {
    /// Name as in the source.
    pub name: &'static str,
    /// Documentation of the field.
    pub doc: &'static str,
    /// Unit, such as `m` or `rad/s`; empty for none.
    pub unit: &'static str,
    /// Bytes from the beginning of the value.
    pub offset: usize,
    /// Type of the field.
    pub kind: Kind,
}

/// The type of a field.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    /// A number or truth value.
    Primitive(Primitive),
    /// An integer with named constants.
    Enumeration(&'static Enumeration),
    /// UTF-8 of at most that many bytes, after a 32-bit length.
    Text(usize),
    /// A flag and a value.
    Optional(&'static Kind),
    /// A fixed number of items.
    Array(&'static Kind, usize),
    /// At most that many items, after a 32-bit length and 32 reserved bits.
    Sequence(&'static Kind, usize),
    /// Another interface without a tail.
    Nested(&'static Descriptor),
    /// Tail: the last field, with a number of items that depends on the value.
    /// Its capacity is set by configuration.
    Tail(&'static Kind),
}

/// An integer type with named constants; values without a name are valid too.
#[derive(Debug, PartialEq, Eq)]
pub struct Enumeration {
    /// Name of the type.
    pub name: &'static str,
    /// The integer that carries it.
    pub carrier: Kind,
    /// The named values.
    pub constants: &'static [Constant],
}

/// A named value of an [`Enumeration`].
#[derive(Debug, PartialEq, Eq)]
pub struct Constant {
    /// Name as in the source, such as `DELIBERATIVE`.
    pub name: &'static str,
    /// The value.
    pub value: i64,
    /// Documentation of the constant.
    pub doc: &'static str,
}

/// Primitive types by their own names, for expressions and patterns.
#[allow(missing_docs, non_upper_case_globals, reason = "named and documented as in `Primitive`")]
impl Kind {
    pub const Bool: Self = Self::Primitive(Primitive::Bool);
    pub const U8: Self = Self::Primitive(Primitive::U8);
    pub const U16: Self = Self::Primitive(Primitive::U16);
    pub const U32: Self = Self::Primitive(Primitive::U32);
    pub const U64: Self = Self::Primitive(Primitive::U64);
    pub const I8: Self = Self::Primitive(Primitive::I8);
    pub const I16: Self = Self::Primitive(Primitive::I16);
    pub const I32: Self = Self::Primitive(Primitive::I32);
    pub const I64: Self = Self::Primitive(Primitive::I64);
    pub const F32: Self = Self::Primitive(Primitive::F32);
    pub const F64: Self = Self::Primitive(Primitive::F64);
}

impl Kind {
    /// Returns the size of one value, bytes; 0 for a tail.
    pub const fn size(&self) -> usize {
        match self {
            Self::Primitive(primitive) => primitive.size(),
            Self::Enumeration(enumeration) => enumeration.carrier.size(),
            Self::Text(capacity) => 4 + *capacity,
            Self::Optional(item) => 8 + item.size(),
            Self::Array(item, length) => item.size() * *length,
            Self::Sequence(item, capacity) => 8 + item.size() * *capacity,
            Self::Nested(descriptor) => descriptor.size,
            Self::Tail(_) => 0,
        }
    }

    /// Returns the alignment, bytes.
    pub const fn align(&self) -> usize {
        match self {
            Self::Primitive(primitive) => primitive.size(),
            Self::Text(_) => 4,
            Self::Enumeration(enumeration) => enumeration.carrier.align(),
            // After a 32-bit length or flag.
            Self::Optional(item) | Self::Sequence(item, _) => {
                if item.align() > 4 {
                    item.align()
                } else {
                    4
                }
            }
            Self::Array(item, _) | Self::Tail(item) => item.align(),
            Self::Nested(descriptor) => descriptor.align,
        }
    }

    /// Returns the name in messages: `f64`, `text of at most 32 bytes`, `Pose2`.
    pub fn describe(&self) -> String {
        match self {
            Self::Primitive(primitive) => primitive.name().into(),
            Self::Enumeration(enumeration) => {
                let names: Vec<_> = enumeration.constants.iter().map(|constant| constant.name).collect();
                format!("one of {}", names.join(", "))
            }
            Self::Text(capacity) => format!("text of at most {capacity} bytes"),
            Self::Optional(item) => format!("{} or nothing", item.describe()),
            Self::Array(item, length) => format!("{length} x {}", item.describe()),
            Self::Sequence(item, capacity) => format!("at most {capacity} x {}", item.describe()),
            Self::Nested(descriptor) => descriptor.name.into(),
            Self::Tail(item) => format!("list of {}", item.describe()),
        }
    }
}

impl Descriptor {
    /// Returns the layout of a value whose tail has room for `capacity` items.
    /// Without a tail `capacity` is ignored.
    pub fn shape(&self, capacity: usize) -> Shape {
        let item = self.tail().map_or(0, Kind::size);
        Shape { size: self.size, align: self.align, item, capacity: if item == 0 { 0 } else { capacity } }
    }

    /// Returns the type of the tail's items, for an interface with a tail.
    pub fn tail(&self) -> Option<&'static Kind> {
        match self.fields.last()?.kind {
            Kind::Tail(item) => Some(item),
            _ => None,
        }
    }

    /// Returns the field of that name.
    pub fn field(&self, name: &str) -> Option<&'static Field> {
        self.fields.iter().find(|field| field.name == name)
    }
}
