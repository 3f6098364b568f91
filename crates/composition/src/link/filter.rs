use slate_blackboard::interface::{Descriptor, Kind, Primitive};

use super::field_place::{FieldPlace, NoField};
use super::number::Number;
use slate_configuration::Comparison;

/// The filter of a link.
#[derive(Clone, Debug, Default)]
pub struct Filter {
    every: u64,
    when: Option<FieldCondition>,
}

/// A condition on a field.
#[derive(Clone, Debug)]
struct FieldCondition {
    place: FieldPlace,
    comparison: Comparison,
    value: f64,
}

impl Filter {
    /// Reads a filter for values of an interface.
    pub fn new(
        descriptor: &'static Descriptor,
        every: Option<u64>,
        when: Option<&str>,
    ) -> Result<Self, NoField> {
        let when = when.map(|text| FieldCondition::parse(descriptor, text)).transpose()?;
        Ok(Self { every: every.unwrap_or(1), when })
    }

    /// Returns whether the value with that sequence number passes.
    #[inline]
    pub fn passes(&self, bytes: &[u8], items: usize, sequence: u64) -> bool {
        sequence.is_multiple_of(self.every.max(1))
            && self.when.as_ref().is_none_or(|when| when.holds(bytes, items))
    }
}

impl FieldCondition {
    fn parse(descriptor: &'static Descriptor, text: &str) -> Result<Self, NoField> {
        let wrong = |help: String| NoField { message: format!("`{text}` is not a condition"), help };
        let usual = || wrong("write a field, a comparison and a number, such as `range < 0.5`".into());
        let (field, comparison, value) = Comparison::split(text).ok_or_else(usual)?;
        let place = FieldPlace::find(descriptor, field)?;
        let value = match (place.kind, value) {
            (Kind::Primitive(Primitive::Bool), "true") => Some(1.0),
            (Kind::Primitive(Primitive::Bool), "false") => Some(0.0),
            (Kind::Enumeration(enumeration), name) => {
                let mut constants = enumeration.constants.iter();
                let constant = constants.find(|constant| constant.name.eq_ignore_ascii_case(name));
                if constant.is_none() {
                    return Err(wrong(format!("`{field}` is {}", place.kind.describe())));
                }
                constant.map(|constant| constant.value as f64)
            }
            (kind, number) if Number::of(&kind).is_some() => {
                number.parse().ok().filter(|number: &f64| number.is_finite())
            }
            (kind, _) => {
                return Err(wrong(format!("`{field}` is {}, which is not a number", kind.describe())));
            }
        };
        let condition = Self { place, comparison, value: value.ok_or_else(usual)? };
        match condition.constant_result() {
            None => Ok(condition),
            Some(always) => Err(NoField {
                message: format!("`{text}` {} holds", if always { "always" } else { "never" }),
                help: format!(
                    "`{field}` is {}: compare it with a value that it may have",
                    condition.place.kind.describe()
                ),
            }),
        }
    }

    /// Returns the condition's result if it is the same for all values of the field.
    fn constant_result(&self) -> Option<bool> {
        let (low, high) = match self.place.kind {
            Kind::Primitive(Primitive::Bool) => (0.0, 1.0),
            Kind::Enumeration(enumeration) if enumeration.constants.len() > 1 => {
                let mut each = enumeration.constants.iter();
                let first =
                    each.next().map(|constant| self.comparison.holds(constant.value as f64, self.value))?;
                let same =
                    each.all(|constant| self.comparison.holds(constant.value as f64, self.value) == first);
                return same.then_some(first);
            }
            kind => {
                let (low, high) = Number::of(&kind)?.range()?;
                (low as f64, high as f64)
            }
        };
        let is_value = self.value.fract() == 0.0 && (low..=high).contains(&self.value);
        match self.comparison {
            Comparison::Equal if !is_value => Some(false),
            Comparison::Unequal if !is_value => Some(true),
            Comparison::Equal | Comparison::Unequal => None,
            other => {
                let ends = [low, high].map(|end| other.holds(end, self.value));
                (ends[0] == ends[1]).then_some(ends[0])
            }
        }
    }

    fn holds(&self, bytes: &[u8], items: usize) -> bool {
        if !self.place.is_in(bytes, items) {
            return false;
        }
        let at = &bytes[self.place.offset..];
        let number = match self.place.kind {
            Kind::Primitive(Primitive::Bool) => f64::from(u8::from(at[0] != 0)),
            Kind::Enumeration(enumeration) => match Number::of(&enumeration.carrier) {
                Some(number) => number.read(at).as_f64(),
                None => return false,
            },
            kind => match Number::of(&kind) {
                Some(number) => number.read(at).as_f64(),
                None => return false,
            },
        };
        self.comparison.holds(number, self.value)
    }
}
