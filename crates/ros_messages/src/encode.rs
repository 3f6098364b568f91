//! Messages of a definition, from values without types.

use serde_json::Value as Json;

use super::cdr::{CdrWriter, WireFormat, wire_length};
use super::schema::{Count, FieldType, Item};
use super::{Error, Primitive, RosPrimitive, Schema};

/// Encodes a JSON value as a message: little-endian CDR with its header.
/// A field that the value lacks is zero or empty; `null` is a NaN.
///
/// # Errors
/// The first field that does not fit, or that the message does not have.
pub fn encode_json(schema: &Schema, value: &Json) -> Result<Vec<u8>, Error> {
    encode_json_in(WireFormat::Cdr, schema, value)
}

/// Encodes a JSON value as a message of that format.
///
/// # Errors
/// The first field that does not fit, or that the message does not have.
pub fn encode_json_in(format: WireFormat, schema: &Schema, value: &Json) -> Result<Vec<u8>, Error> {
    let mut message = Vec::new();
    MessageEncoder(schema).put_record(&mut CdrWriter::of(format, &mut message), 0, Some(value), "")?;
    Ok(message)
}

/// Encodes messages of a schema.
struct MessageEncoder<'a>(&'a Schema);

impl MessageEncoder<'_> {
    fn put_record(
        &self,
        writer: &mut CdrWriter<'_>,
        index: usize,
        value: Option<&Json>,
        path: &str,
    ) -> Result<(), Error> {
        let record = &self.0.records()[index];
        let entries = match value {
            None => None,
            Some(Json::Object(entries)) => Some(entries),
            Some(other) => return Err(wrong(path, format!("is a message, found {other}"))),
        };
        let unknown = entries.and_then(|entries| entries.keys().find(|key| !record.names.contains(key)));
        if let Some(unknown) = unknown {
            let reason = format!("does not exist; {} has {}", record.name, record.names.join(", "));
            return Err(wrong(&joined(path, unknown), reason));
        }
        if record.types.is_empty() {
            writer.empty();
        }
        for (name, field) in record.names.iter().zip(&record.types) {
            let value = entries.and_then(|entries| entries.get(name));
            self.put_field(writer, *field, value, &joined(path, name))?;
        }
        Ok(())
    }

    fn put_field(
        &self,
        writer: &mut CdrWriter<'_>,
        field: FieldType,
        value: Option<&Json>,
        path: &str,
    ) -> Result<(), Error> {
        let items = match value {
            None => &[],
            Some(value) if matches!(field.count, Count::One) => {
                return self.put_item(writer, field.item, Some(value), path);
            }
            Some(Json::Array(items)) => items.as_slice(),
            Some(other) => return Err(wrong(path, format!("is a list, found {other}"))),
        };
        match field.count {
            Count::One => return self.put_item(writer, field.item, None, path),
            Count::Fixed(count) if value.is_none() => {
                return (0..count).try_for_each(|_| self.put_item(writer, field.item, None, path));
            }
            Count::Fixed(count) if items.len() != count => {
                return Err(wrong(path, format!("has {count} items, found {}", items.len())));
            }
            Count::Fixed(_) => {}
            Count::Any => writer.length(wire_length(items.len())?),
        }
        items.iter().try_for_each(|item| self.put_item(writer, field.item, Some(item), path))
    }

    fn put_item(
        &self,
        writer: &mut CdrWriter<'_>,
        item: Item,
        value: Option<&Json>,
        path: &str,
    ) -> Result<(), Error> {
        let unfit = |what: &str| wrong(path, format!("is {what}, found {}", value.unwrap_or(&Json::Null)));
        match item {
            Item::Record(index) => return self.put_record(writer, index, value, path),
            Item::Text => {
                let text = value.map_or(Some(""), Json::as_str);
                writer.text(text.ok_or_else(|| unfit("a text"))?)?;
            }
            Item::Primitive(Primitive::Bool) => {
                let truth = value.map_or(Some(false), Json::as_bool);
                writer.byte(truth.ok_or_else(|| unfit("true or false"))?.into());
            }
            Item::Primitive(kind @ (Primitive::F32 | Primitive::F64)) => {
                let number = match value {
                    None => Some(0.0),
                    Some(Json::Null) => Some(f64::NAN),
                    Some(value) => value.as_f64(),
                };
                let number = number.ok_or_else(|| unfit("a number"))?;
                match kind {
                    Primitive::F32 => writer.numbers(&(number as f32).to_ne_bytes(), 4),
                    _ => writer.numbers(&number.to_ne_bytes(), 8),
                }
            }
            Item::Primitive(kind) => {
                let whole =
                    |value: &Json| value.as_i64().map(i128::from).or_else(|| value.as_u64().map(i128::from));
                let number = value.map_or(Some(0), whole).filter(|number| kind.range().contains(number));
                let number = number.ok_or_else(|| unfit(&format!("a {}", kind.ros_name())))?;
                let bytes = number.to_le_bytes();
                writer.little(&bytes[..kind.size()], kind.size());
            }
        }
        Ok(())
    }
}

fn joined(path: &str, name: &str) -> String {
    if path.is_empty() { name.into() } else { format!("{path}.{name}") }
}

fn wrong(field: &str, reason: String) -> Error {
    Error::Field { field: field.into(), reason }
}
