//! Constants of a message, as enumerations of its fields or as they are.

use slate::blackboard::interface::Primitive;
use slate::ros_messages::{DefinedConstant, DefinedCount, DefinedItem, DefinedMessage};
use slate_sorted::SortedSet;

use super::{camel_case, unique};
use crate::interface::parse::upper_case;
use crate::interface::word::identifier_error;

/// Values of a field that has one of several constants.
pub(super) struct ImportedEnumeration<'a> {
    pub name: String,
    /// Field of the message.
    pub field: &'a str,
    pub carrier: Primitive,
    pub constants: Vec<EnumerationConstant<'a>>,
}

pub(super) struct EnumerationConstant<'a> {
    pub name: String,
    pub value: i64,
    pub defined: &'a DefinedConstant<'a>,
}

/// Enumerations of an interface, and the constants that are in none.
type ImportedConstants<'a> = (Vec<ImportedEnumeration<'a>>, Vec<&'a DefinedConstant<'a>>);

/// Constants `FIELD_NAME` of a field's type are an enumeration.
///
/// # Errors
/// The line of a constant whose value does not fit its type, and the reason.
pub(super) fn enumerations<'a>(
    interface: &str,
    message: &'a DefinedMessage<'a>,
    names: &mut SortedSet<String>,
) -> Result<ImportedConstants<'a>, (usize, String)> {
    let mut enumerations: Vec<ImportedEnumeration<'a>> = Vec::new();
    let mut others = Vec::new();
    for (at, constant) in message.constants.iter().enumerate() {
        let value = value(constant).map_err(|reason| (constant.line, reason))?;
        let is_same = |other: &DefinedConstant<'_>| other.name.eq_ignore_ascii_case(constant.name);
        if message.constants[..at].iter().any(is_same) {
            return Err((constant.line, format!("there are two constants `{}`", constant.name)));
        }
        let field = field_of(message, constant);
        let own = field.zip(value).and_then(|((field, carrier, name), value)| {
            Some((field, carrier, EnumerationConstant { name: variant(name)?, value, defined: constant }))
        });
        let Some((field, carrier, own)) = own else {
            others.push(constant);
            continue;
        };
        match enumerations.iter_mut().find(|known| known.field == field) {
            Some(known)
                if known.constants.iter().any(|known| known.value == own.value || known.name == own.name) =>
            {
                others.push(constant);
            }
            Some(known) => known.constants.push(own),
            None => {
                let name = unique(format!("{interface}{}", camel_case(field)), names);
                enumerations.push(ImportedEnumeration { name, field, carrier, constants: vec![own] });
            }
        }
    }
    Ok((enumerations, others))
}

/// Returns the field whose values a constant names, and the constant's name there.
fn field_of<'a>(
    message: &'a DefinedMessage<'a>,
    constant: &DefinedConstant<'a>,
) -> Option<(&'a str, Primitive, &'a str)> {
    let DefinedItem::Number(carrier) = constant.item else { return None };
    let _integers = carrier.integers()?;
    let fields =
        message.fields.iter().filter(|field| field.count == DefinedCount::One && field.item == constant.item);
    let named = fields.filter_map(|field| {
        let name = constant.name.strip_prefix(&field.name.to_ascii_uppercase())?.strip_prefix('_')?;
        Some((field.name, carrier, name))
    });
    named.max_by_key(|(field, ..)| field.len())
}

/// Converts `NOT_CHARGING` to `NotCharging`, if the constant stays the same.
fn variant(name: &str) -> Option<String> {
    let variant = camel_case(&name.to_ascii_lowercase());
    let is_name = variant.starts_with(|first: char| first.is_ascii_alphabetic());
    (is_name && identifier_error(&variant).is_none() && upper_case(&variant) == name).then_some(variant)
}

/// Returns the value of an integer constant.
/// `None` for another type, or beyond 64 bits with a sign.
fn value(constant: &DefinedConstant<'_>) -> Result<Option<i64>, String> {
    let DefinedConstant { name, value, item, .. } = constant;
    if !name.starts_with(|first: char| first.is_ascii_alphabetic()) {
        return Err(format!("`{name}` is not the name of a constant: expected one such as `MODE_IDLE`"));
    }
    let expected = match item {
        DefinedItem::Number(Primitive::Bool) if boolean(value).is_some() => return Ok(None),
        DefinedItem::Number(Primitive::Bool) => "true or false".to_owned(),
        DefinedItem::Number(number) => match number.integers() {
            Some(range) => match integer(value).filter(|value| range.contains(value)) {
                Some(value) => return Ok(value.try_into().ok()),
                None => format!("a number from {} to {}", range.start(), range.end()),
            },
            None if value.parse::<f32>().is_ok_and(f32::is_finite) => return Ok(None),
            None if *number == Primitive::F64 && value.parse::<f64>().is_ok_and(f64::is_finite) => {
                return Ok(None);
            }
            None => "a finite number".to_owned(),
        },
        _ => return Ok(None),
    };
    Err(format!("`{value}` is not a value of {name}: expected {expected}"))
}

/// Parses a truth value.
pub(super) fn boolean(text: &str) -> Option<bool> {
    match text {
        "true" | "True" | "1" => Some(true),
        "false" | "False" | "0" => Some(false),
        _ => None,
    }
}

/// Parses a whole number, decimal or hexadecimal.
pub(super) fn integer(text: &str) -> Option<i128> {
    let (sign, digits) = text.strip_prefix('-').map_or((1, text), |digits| (-1, digits));
    let number = match digits.strip_prefix("0x").or_else(|| digits.strip_prefix("0X")) {
        Some(digits) => i128::from(u64::from_str_radix(digits, 16).ok()?),
        None => i128::from(digits.parse::<u64>().ok()?),
    };
    Some(sign * number)
}
