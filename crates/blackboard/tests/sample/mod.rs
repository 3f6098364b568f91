//! An interface with a field of every kind, as the `#[interface]` macro would describe it.

use slate_blackboard::interface::{Constant, Descriptor, Enumeration, Field, Kind, schema_hash};

/// Bytes of a [`SAMPLE`] without its tail.
pub const SIZE: usize = 120;

pub static POINT: Descriptor = Descriptor {
    name: "Point",
    doc: "A point.",
    ros: "",
    fields: POINT_FIELDS,
    size: 8,
    align: 4,
    hash: schema_hash("Point", POINT_FIELDS),
};

const POINT_FIELDS: &[Field] =
    &[field("x", "m", 0, Kind::F32), field("y", "", 4, Kind::I16), field("z", "", 6, Kind::I16)];

pub static MODE: Enumeration = Enumeration {
    name: "Mode",
    carrier: Kind::U8,
    constants: &[
        Constant { name: "SLOW", value: 0, doc: "Walks." },
        Constant { name: "FAST", value: 1, doc: "Runs." },
    ],
};

pub static SAMPLE: Descriptor = Descriptor {
    name: "Sample",
    doc: "A field of every kind.",
    ros: "",
    fields: FIELDS,
    size: SIZE,
    align: 8,
    hash: schema_hash("Sample", FIELDS),
};

const A_POINT: Kind = Kind::Nested(&POINT);

pub const FIELDS: &[Field] = &[
    field("flag", "", 0, Kind::Bool),
    field("small", "", 1, Kind::U8),
    field("signed", "", 2, Kind::I16),
    field("count", "", 4, Kind::U32),
    field("big", "", 8, Kind::U64),
    field("long", "ns", 16, Kind::I64),
    field("wide", "m", 24, Kind::F64),
    field("narrow", "m/s", 32, Kind::F32),
    field("mode", "", 36, Kind::Enumeration(&MODE)),
    field("spare", "", 37, Kind::Array(&Kind::U8, 3)),
    field("name", "", 40, Kind::Text(12)),
    field("maybe", "", 56, Kind::Optional(&Kind::F64)),
    field("point", "", 72, Kind::Nested(&POINT)),
    field("points", "", 80, Kind::Sequence(&A_POINT, 3)),
    field("pair", "", 112, Kind::Array(&Kind::I32, 2)),
    field("tail", "", 120, Kind::Tail(&Kind::U16)),
];

const fn field(name: &'static str, unit: &'static str, offset: usize, kind: Kind) -> Field {
    Field { name, doc: "", unit, offset, kind }
}
