//! Constants of a message, as enumerations of its fields or as they are.

use std::collections::BTreeSet;

use slate::blackboard::interface::Primitive;
use slate::record::ros::{DefinedConstant, DefinedCount, DefinedItem, DefinedMessage};

use super::{camel_case, unique};
use crate::interface::parse::upper_case;
use crate::interface::word::objection;

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
    names: &mut BTreeSet<String>,
) -> Result<ImportedConstants<'a>, (usize, String)> {
    let mut enumerations: Vec<ImportedEnumeration<'a>> = Vec::new();
    let mut others = Vec::new();
    for constant in &message.constants {
        let value = value(constant).map_err(|reason| (constant.line, reason))?;
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

/// The field whose values a constant names, and what the constant is called there.
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

/// `NOT_CHARGING` as `NotCharging`, if that becomes the same constant again.
fn variant(name: &str) -> Option<String> {
    let variant = camel_case(&name.to_ascii_lowercase());
    let is_name = variant.starts_with(|first: char| first.is_ascii_alphabetic());
    (is_name && objection(&variant).is_none() && upper_case(&variant) == name).then_some(variant)
}

/// Value of an integer constant; nothing of another type, or beyond 64 bits with a sign.
fn value(constant: &DefinedConstant<'_>) -> Result<Option<i64>, String> {
    let DefinedItem::Number(primitive) = constant.item else { return Ok(None) };
    let Some(range) = primitive.integers() else { return Ok(None) };
    let expected = format!("expected a number from {} to {}", range.start(), range.end());
    match integer(constant.value).filter(|value| range.contains(value)) {
        Some(value) => Ok(value.try_into().ok()),
        None => Err(format!("`{}` is not a value of {}: {expected}", constant.value, constant.name)),
    }
}

/// A whole number, decimal or hexadecimal.
pub(super) fn integer(text: &str) -> Option<i128> {
    let (sign, digits) = text.strip_prefix('-').map_or((1, text), |digits| (-1, digits));
    let number = match digits.strip_prefix("0x").or_else(|| digits.strip_prefix("0X")) {
        Some(digits) => i128::from(u64::from_str_radix(digits, 16).ok()?),
        None => i128::from(digits.parse::<u64>().ok()?),
    };
    Some(sign * number)
}
