//! Interfaces that become messages: the well-known interfaces, and two with all that an interface can have.

use slate_interfaces::{FactHead, Position, Sighting};
use slate_module::blackboard::interface::{
    CanonicalForm, Constant, Descriptor, Enumeration, Field, Interface, Kind, schema_hash,
};
use slate_module::{Bool, Optional, Sequence, Text, interface};

/// How it goes.
#[interface]
pub enum Gait {
    /// Feet are always on the ground.
    Walk,
    /// They are not.
    Run,
}

/// The battery of a robot.
#[interface(ros = "sensor_msgs/msg/BatteryState")]
pub struct Battery {
    /// Under load.
    #[unit("V")]
    pub voltage: f64,
}

/// A field of every kind.
#[interface]
pub struct Everything {
    /// Of 64 bits.
    pub unsigned: u64,
    pub signed: i64,
    pub double: f64,
    pub maybe: Optional<f64>,
    pub places: Sequence<Position, 3>,
    pub nested: Sighting,
    pub perhaps: Sequence<Optional<u64>, 2>,
    pub word: u32,
    pub whole: i32,
    pub single: f32,
    pub text: Text<12>,
    pub texts: [Text<4>; 2],
    pub grid: [[u16; 3]; 2],
    pub short: i16,
    pub half: u16,
    pub tiny: i8,
    pub byte: u8,
    pub flag: Bool,
    pub gait: Gait,
    pub gaits: [Gait; 4],
    pub flags: [Bool; 4],
    /// Items with a text in them.
    pub tail: [FactHead],
}

/// Names that ROS would not have, lists without room, and messages without fields.
pub static ODD: Descriptor = Descriptor {
    name: "odd_one!",
    doc: "Two\nlines. [not a unit] # MSG: a/B\n===",
    ros: "",
    fields: ODD_FIELDS,
    size: 64,
    align: 8,
    hash: schema_hash("odd_one!", ODD_FIELDS),
};

const A_NOTHING: Kind = Kind::Nested(&NOTHING);

const ODD_FIELDS: &[Field] = &[
    odd("Camel-Case", 0, Kind::U32),
    odd("camel_case", 4, Kind::F32),
    odd("1st__try_", 8, Kind::I16),
    odd("from", 10, Kind::Enumeration(&LEVEL)),
    odd("_", 11, Kind::Bool),
    odd("memory", 12, Kind::Text(0)),
    odd("nothing", 16, Kind::Nested(&NOTHING)),
    odd("nothings", 16, Kind::Sequence(&A_NOTHING, 2)),
    odd("none", 24, Kind::Array(&Kind::F64, 0)),
    odd("no_room", 24, Kind::Sequence(&Kind::F64, 0)),
    odd("twice", 32, Kind::Optional(&Kind::Optional(&Kind::U32))),
    odd("lists", 52, Kind::Array(&Kind::Array(&Kind::Array(&Kind::U8, 2), 1), 6)),
];

static NOTHING: Descriptor = Descriptor {
    name: "Nothing",
    doc: "",
    ros: "",
    fields: &[],
    size: 0,
    align: 1,
    hash: schema_hash("Nothing", &[]),
};

static LEVEL: Enumeration = Enumeration {
    name: "Level",
    carrier: Kind::I8,
    constants: &[
        Constant { name: "__low", value: -1, doc: "" },
        Constant { name: "LOW", value: 1, doc: "Not the same." },
        Constant { name: "TOO_LARGE", value: 200, doc: "" },
    ],
};

const fn odd(name: &'static str, offset: usize, kind: Kind) -> Field {
    Field { name, doc: "", unit: "%", offset, kind }
}

/// All of them.
pub fn all() -> Vec<&'static Descriptor> {
    let others = [Battery::DESCRIPTOR, Everything::DESCRIPTOR, <()>::DESCRIPTOR, &ODD];
    slate_interfaces::ALL.iter().copied().chain(others).collect()
}

/// A value made of that many tail items and bytes that a seed gives, without padding.
pub fn value(descriptor: &Descriptor, tail: usize, seed: u64) -> Vec<u8> {
    let size = descriptor.size + descriptor.tail().map_or(0, |item| item.size() * tail);
    let mut state = seed;
    let mut next = || {
        // SplitMix64.
        state = state.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mixed = (state ^ (state >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        (mixed ^ (mixed >> 27)) as u8
    };
    without_padding(descriptor, tail, (0..size).map(|_| next()).collect())
}

/// That value as all but its writer see it: zeros where no field is.
pub fn without_padding(descriptor: &Descriptor, tail: usize, mut bytes: Vec<u8>) -> Vec<u8> {
    // No number of ones is changed, so that zeros are left of padding alone.
    let mut fields = vec![1; bytes.len()];
    CanonicalForm::new(descriptor).canonicalize(&mut fields, tail);
    bytes.iter_mut().zip(fields).for_each(|(byte, field)| *byte *= field);
    bytes
}
