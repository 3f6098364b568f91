use super::{Field, Kind, Primitive};

const fn byte(hash: u64, byte: u8) -> u64 {
    (hash ^ byte as u64).wrapping_mul(0x0100_0000_01b3)
}

const fn number(mut hash: u64, number: u64) -> u64 {
    let bytes = number.to_le_bytes();
    let mut i = 0;
    while i < 8 {
        hash = byte(hash, bytes[i]);
        i += 1;
    }
    hash
}

const fn text(mut hash: u64, text: &str) -> u64 {
    let bytes = text.as_bytes();
    let mut i = 0;
    while i < bytes.len() {
        hash = byte(hash, bytes[i]);
        i += 1;
    }
    byte(hash, 0)
}

const fn kind(hash: u64, of: &Kind) -> u64 {
    match of {
        Kind::Primitive(Primitive::Bool) => byte(hash, 1),
        Kind::Primitive(Primitive::U8) => byte(hash, 2),
        Kind::Primitive(Primitive::U16) => byte(hash, 3),
        Kind::Primitive(Primitive::U32) => byte(hash, 4),
        Kind::Primitive(Primitive::U64) => byte(hash, 5),
        Kind::Primitive(Primitive::I8) => byte(hash, 6),
        Kind::Primitive(Primitive::I16) => byte(hash, 7),
        Kind::Primitive(Primitive::I32) => byte(hash, 8),
        Kind::Primitive(Primitive::I64) => byte(hash, 9),
        Kind::Primitive(Primitive::F32) => byte(hash, 10),
        Kind::Primitive(Primitive::F64) => byte(hash, 11),
        Kind::Enumeration(enumeration) => {
            let mut hash = kind(text(byte(hash, 12), enumeration.name), &enumeration.carrier);
            let mut i = 0;
            while i < enumeration.constants.len() {
                hash =
                    number(text(hash, enumeration.constants[i].name), enumeration.constants[i].value as u64);
                i += 1;
            }
            hash
        }
        Kind::Text(capacity) => number(byte(hash, 13), *capacity as u64),
        Kind::Optional(item) => kind(byte(hash, 14), item),
        Kind::Array(item, length) => kind(number(byte(hash, 15), *length as u64), item),
        Kind::Sequence(item, capacity) => kind(number(byte(hash, 16), *capacity as u64), item),
        Kind::Nested(descriptor) => number(byte(hash, 17), descriptor.hash),
        Kind::Tail(item) => kind(byte(hash, 18), item),
    }
}

/// Returns the schema hash (FNV-1a, 64 bits) of an interface.
/// It is over names, types, offsets and units, not documentation.
pub const fn schema_hash(name: &str, fields: &[Field]) -> u64 {
    let mut hash = text(0xcbf2_9ce4_8422_2325, name);
    let mut i = 0;
    while i < fields.len() {
        let field = &fields[i];
        hash = kind(number(text(text(hash, field.name), field.unit), field.offset as u64), &field.kind);
        i += 1;
    }
    hash
}
