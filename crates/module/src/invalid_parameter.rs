//! Invalid parameters of algorithms.

/// Parameter of an algorithm that is out of its range.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error("invalid `{name}`: expected {expected}")]
pub struct InvalidParameter {
    /// Name.
    pub name: &'static str,
    /// Expected values.
    pub expected: &'static str,
}

impl InvalidParameter {
    /// Returns an error unless the value is as expected.
    ///
    /// # Errors
    /// It is not.
    pub fn unless(is_valid: bool, name: &'static str, expected: &'static str) -> Result<(), Self> {
        if is_valid { Ok(()) } else { Err(Self { name, expected }) }
    }

    /// Returns an error unless each of the values is a finite number from 0.
    ///
    /// # Errors
    /// The first that is not.
    pub fn unless_magnitudes(values: &[(&'static str, f64)]) -> Result<(), Self> {
        values.iter().try_for_each(|(name, value)| {
            Self::unless(value.is_finite() && *value >= 0.0, name, "a number from 0")
        })
    }

    /// Returns an error unless each of the values is a finite number above 0.
    ///
    /// # Errors
    /// The first that is not.
    pub fn unless_positive(values: &[(&'static str, f64)]) -> Result<(), Self> {
        values.iter().try_for_each(|(name, value)| {
            Self::unless(value.is_finite() && *value > 0.0, name, "a number above 0")
        })
    }
}
