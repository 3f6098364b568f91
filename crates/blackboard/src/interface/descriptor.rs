use crate::Shape;

/// Names, types, offsets, units and documentation of an interface.
#[derive(Debug)]
pub struct Descriptor {
    /// Name of the interface, such as `Pose2`.
    pub name: &'static str,
    /// What a value means.
    pub doc: &'static str,
    /// The matching ROS 2 message, such as `geometry_msgs/msg/Pose2D`; empty where there is none.
    pub ros: &'static str,
    /// The fields in the order of their offsets; a tail comes last.
    pub fields: &'static [Field],
    /// Bytes of a value, without its tail.
    pub size: usize,
    /// Alignment in bytes.
    pub align: usize,
    /// Identifies the schema: over names, types, offsets and units, but not over documentation.
    pub hash: u64,
}

/// One field of an interface.
#[derive(Debug)]
pub struct Field {
    /// Name as in the source.
    pub name: &'static str,
    /// What it means.
    pub doc: &'static str,
    /// Unit, such as `m` or `rad/s`; empty for none.
    pub unit: &'static str,
    /// Bytes from the beginning of the value.
    pub offset: usize,
    /// Its type.
    pub kind: Kind,
}

/// The type of a field.
#[derive(Clone, Copy, Debug)]
pub enum Kind {
    /// Truth value, one byte; everything but 0 is true.
    Bool,
    /// Unsigned, 8 bits.
    U8,
    /// Unsigned, 16 bits.
    U16,
    /// Unsigned, 32 bits.
    U32,
    /// Unsigned, 64 bits.
    U64,
    /// Signed, 8 bits.
    I8,
    /// Signed, 16 bits.
    I16,
    /// Signed, 32 bits.
    I32,
    /// Signed, 64 bits.
    I64,
    /// IEEE 754, 32 bits.
    F32,
    /// IEEE 754, 64 bits.
    F64,
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
    /// As many items as the value has: the last field, its capacity set by configuration.
    Tail(&'static Kind),
}

/// An integer type with named constants; values without a name are valid too.
#[derive(Debug)]
pub struct Enumeration {
    /// Name of the type.
    pub name: &'static str,
    /// The integer that carries it.
    pub carrier: Kind,
    /// The named values.
    pub constants: &'static [Constant],
}

/// A named value of an [`Enumeration`].
#[derive(Debug)]
pub struct Constant {
    /// Name as in the source, such as `DELIBERATIVE`.
    pub name: &'static str,
    /// The value.
    pub value: i64,
    /// What it means.
    pub doc: &'static str,
}

impl Kind {
    /// Bytes that one value takes; 0 for a tail.
    pub const fn size(&self) -> usize {
        match self {
            Self::Bool | Self::U8 | Self::I8 => 1,
            Self::U16 | Self::I16 => 2,
            Self::U32 | Self::I32 | Self::F32 => 4,
            Self::U64 | Self::I64 | Self::F64 => 8,
            Self::Enumeration(enumeration) => enumeration.carrier.size(),
            Self::Text(capacity) => 4 + *capacity,
            Self::Optional(item) => 8 + item.size(),
            Self::Array(item, length) => item.size() * *length,
            Self::Sequence(item, capacity) => 8 + item.size() * *capacity,
            Self::Nested(descriptor) => descriptor.size,
            Self::Tail(_) => 0,
        }
    }

    /// Alignment in bytes.
    pub const fn align(&self) -> usize {
        match self {
            Self::Bool | Self::U8 | Self::I8 => 1,
            Self::U16 | Self::I16 => 2,
            Self::U32 | Self::I32 | Self::F32 | Self::Text(_) => 4,
            Self::U64 | Self::I64 | Self::F64 => 8,
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

    /// What a reader of a message calls it: `f64`, `text of at most 32 bytes`, `Pose2`.
    pub fn describe(&self) -> String {
        match self {
            Self::Bool => "bool".into(),
            Self::U8 => "u8".into(),
            Self::U16 => "u16".into(),
            Self::U32 => "u32".into(),
            Self::U64 => "u64".into(),
            Self::I8 => "i8".into(),
            Self::I16 => "i16".into(),
            Self::I32 => "i32".into(),
            Self::I64 => "i64".into(),
            Self::F32 => "f32".into(),
            Self::F64 => "f64".into(),
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
    /// The memory of a value whose tail has room for `capacity` items; without a tail `capacity` is ignored.
    pub fn shape(&self, capacity: usize) -> Shape {
        let item = self.tail().map_or(0, Kind::size);
        Shape { size: self.size, align: self.align, item, capacity: if item == 0 { 0 } else { capacity } }
    }

    /// The type of the tail's items, for an interface with a tail.
    pub fn tail(&self) -> Option<&'static Kind> {
        match self.fields.last()?.kind {
            Kind::Tail(item) => Some(item),
            _ => None,
        }
    }

    /// The field of that name.
    pub fn field(&self, name: &str) -> Option<&'static Field> {
        self.fields.iter().find(|field| field.name == name)
    }
}
