//! Invalid parameters.

/// Parameter that no local planner can have.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error("invalid `{name}`: expected {expected}")]
pub struct LocalPlanningError {
    /// Name of the parameter.
    pub name: &'static str,
    /// Valid values of the parameter.
    pub expected: &'static str,
}

impl LocalPlanningError {
    /// Returns an error unless the value is valid.
    pub(crate) fn unless(is_valid: bool, name: &'static str, expected: &'static str) -> Result<(), Self> {
        if is_valid { Ok(()) } else { Err(Self { name, expected }) }
    }

    /// Returns an error unless each value is a finite number from 0.
    pub(crate) fn unless_magnitudes(values: &[(&'static str, f64)]) -> Result<(), Self> {
        values.iter().try_for_each(|(name, value)| {
            Self::unless(value.is_finite() && *value >= 0.0, name, "a number from 0")
        })
    }

    /// Returns an error unless each value is a finite number above 0.
    pub(crate) fn unless_positive(values: &[(&'static str, f64)]) -> Result<(), Self> {
        values.iter().try_for_each(|(name, value)| {
            Self::unless(value.is_finite() && *value > 0.0, name, "a number above 0")
        })
    }
}
