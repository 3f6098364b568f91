//! First difference of two interfaces, in words.

use super::{Descriptor, Field, Kind};

/// Words for the two places of interfaces, such as `here` and `there`.
type Places<'w> = (&'w str, &'w str);

/// Describes the first difference of two interfaces; `None` for equal schemas.
/// `places` are words for where they are, such as `("here", "there")`.
pub fn difference(one: &Descriptor, other: &Descriptor, places: (&str, &str)) -> Option<String> {
    if one.hash == other.hash {
        return None;
    }
    let (here, there) = places;
    if one.name != other.name {
        return Some(format!("{here} it is {}, {there} {}", one.name, other.name));
    }
    let found = first_difference((one, other), "", places);
    Some(found.unwrap_or_else(|| format!("{} has another schema {there}", one.name)))
}

fn first_difference(
    (one, other): (&Descriptor, &Descriptor),
    prefix: &str,
    places: Places<'_>,
) -> Option<String> {
    let only = |field: &Field, place: &str| {
        Some(format!("{} has `{prefix}{}` ({}) only {place}", one.name, field.name, describe(field)))
    };
    let count = one.fields.len().max(other.fields.len());
    (0..count).find_map(|i| match (one.fields.get(i), other.fields.get(i)) {
        (Some(own), Some(other)) => field_difference(own, other, prefix, places),
        (Some(own), None) => only(own, places.0),
        (None, Some(other)) => only(other, places.1),
        (None, None) => None,
    })
}

fn field_difference(
    one: &Field,
    other: &Field,
    prefix: &str,
    places @ (here, there): Places<'_>,
) -> Option<String> {
    let path = format!("{prefix}{}", one.name);
    if one.name != other.name {
        return Some(format!("a field is `{path}` {here} and `{prefix}{}` {there}", other.name));
    }
    if one.unit != other.unit || one.kind.describe() != other.kind.describe() {
        return Some(format!("`{path}` is {} {here} and {} {there}", describe(one), describe(other)));
    }
    kind_difference((&one.kind, &other.kind), &path, places)
}

/// Returns the first difference inside types of the same name.
fn kind_difference(kinds: (&Kind, &Kind), path: &str, places @ (here, there): Places<'_>) -> Option<String> {
    match kinds {
        (Kind::Nested(own), Kind::Nested(other)) if own.hash != other.hash => {
            first_difference((own, other), &format!("{path}/"), places)
        }
        (Kind::Enumeration(own), Kind::Enumeration(other)) => {
            let carriers = (own.carrier.describe(), other.carrier.describe());
            let values =
                own.constants.iter().zip(other.constants).find(|(own, other)| own.value != other.value);
            if carriers.0 != carriers.1 {
                Some(format!("`{path}` is carried by {} {here} and by {} {there}", carriers.0, carriers.1))
            } else if own.name != other.name {
                Some(format!("`{path}` is {} {here} and {} {there}", own.name, other.name))
            } else {
                values.map(|(own, other)| {
                    format!("`{path}`: {} is {} {here} and {} {there}", own.name, own.value, other.value)
                })
            }
        }
        (Kind::Optional(own), Kind::Optional(other))
        | (Kind::Array(own, _), Kind::Array(other, _))
        | (Kind::Sequence(own, _), Kind::Sequence(other, _))
        | (Kind::Tail(own), Kind::Tail(other)) => kind_difference((own, other), path, places),
        _ => None,
    }
}

fn describe(field: &Field) -> String {
    let unit = if field.unit.is_empty() { "without unit".into() } else { format!("in {}", field.unit) };
    format!("{} {unit}", field.kind.describe())
}
