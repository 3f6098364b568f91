//! MessagePack, in which monitors read blackboards.

use serde_json::Value;

/// Appends a value.
pub fn pack(value: &Value, bytes: &mut Vec<u8>) {
    match value {
        Value::Null => bytes.push(0xc0),
        Value::Bool(truth) => bytes.push(0xc2 | u8::from(*truth)),
        Value::Number(number) => match (number.as_i64(), number.as_f64()) {
            (Some(whole), _) => pack_integer(whole, bytes),
            (None, float) => {
                bytes.push(0xcb);
                bytes.extend(float.unwrap_or_default().to_be_bytes());
            }
        },
        Value::String(text) => {
            pack_length([0xd9, 0xda, 0xdb], text.len(), bytes);
            bytes.extend(text.as_bytes());
        }
        Value::Array(items) => {
            pack_length([0xdc, 0xdc, 0xdd], items.len(), bytes);
            items.iter().for_each(|item| pack(item, bytes));
        }
        Value::Object(entries) => {
            pack_length([0xde, 0xde, 0xdf], entries.len(), bytes);
            for (name, value) in entries {
                pack(&Value::from(name.as_str()), bytes);
                pack(value, bytes);
            }
        }
    }
}

fn pack_integer(whole: i64, bytes: &mut Vec<u8>) {
    match whole {
        -32..=127 => bytes.push(whole as u8),
        _ => {
            bytes.push(0xd3);
            bytes.extend(whole.to_be_bytes());
        }
    }
}

/// Appends a type and a length, using the type with one, two or four length bytes.
/// The first two types are equal if no type has a length of one byte.
fn pack_length([short, middle, long]: [u8; 3], length: usize, bytes: &mut Vec<u8>) {
    match (u8::try_from(length), u16::try_from(length)) {
        (Ok(length), _) if short != middle => bytes.extend([short, length]),
        (_, Ok(length)) => {
            bytes.push(middle);
            bytes.extend(length.to_be_bytes());
        }
        // The packed value comes from a property, which is shorter.
        _ => {
            bytes.push(long);
            bytes.extend((length as u32).to_be_bytes());
        }
    }
}
