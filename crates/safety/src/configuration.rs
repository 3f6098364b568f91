use slate_module::blackboard::interface::{AccessError, CanonicalForm, Descriptor, View, find};

use crate::StopLatch;
use crate::bound::Bound;

/// Configuration of a gate.
#[derive(Clone, Debug)]
pub struct GateConfiguration {
    pub(crate) name: String,
    pub(crate) descriptor: &'static Descriptor,
    pub(crate) bounds: Vec<Bound>,
    pub(crate) time_to_live: u64,
    pub(crate) safe: Vec<u8>,
    pub(crate) stop_latch: StopLatch,
}

/// Error of a gate's configuration.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum ConfigurationError {
    /// Field that the actuator's interface does not have.
    #[error("gate `{gate}`: {error}")]
    UnknownField {
        /// Name of the gate.
        gate: String,
        /// Missing field, and the fields of the interface.
        error: AccessError,
    },
    /// Field that is not a single number.
    #[error("gate `{gate}`: `{field}` is {kind}; only a single number can be limited")]
    NotNumeric {
        /// Name of the gate.
        gate: String,
        /// Path of the field.
        field: String,
        /// Type of the field.
        kind: String,
    },
    /// Field that a command may leave out.
    /// It is an item of a sequence or of a tail.
    #[error(
        "gate `{gate}`: `{field}` is not part of every command; only fields and items of arrays can be limited"
    )]
    NotAlwaysThere {
        /// Name of the gate.
        gate: String,
        /// Path of the field.
        field: String,
    },
    /// Limits without a value of the field's type.
    #[error("gate `{gate}`: the limits of `{field}`, {low} to {high}, leave it no value")]
    EmptyLimits {
        /// Name of the gate.
        gate: String,
        /// Path of the field.
        field: String,
        /// Lower limit.
        low: f64,
        /// Upper limit.
        high: f64,
    },
    /// Rate that is not a finite number above zero.
    #[error("gate `{gate}`: the rate limit of `{field}` must be finite and above 0, not {per_second}")]
    WrongRate {
        /// Name of the gate.
        gate: String,
        /// Path of the field.
        field: String,
        /// Invalid rate.
        per_second: f64,
    },
    /// Safe command that is not a value of the actuator's interface.
    #[error("gate `{gate}`: the safe command has {found} bytes, but {interface} has {expected}")]
    WrongSize {
        /// Name of the gate.
        gate: String,
        /// Name of the actuator's interface.
        interface: &'static str,
        /// Size of the interface, bytes.
        expected: usize,
        /// Size of the safe command, bytes.
        found: usize,
    },
    /// Safe command with a number that is infinite or not a number.
    #[error("gate `{gate}`: the safe command has a number that is not finite")]
    SafeNotFinite {
        /// Name of the gate.
        gate: String,
    },
}

impl GateConfiguration {
    /// Default time to live of a command, nanoseconds.
    pub const DEFAULT_TIME_TO_LIVE: u64 = 100_000_000;

    /// Configures a gate for commands of an interface, without its tail.
    ///
    /// Defaults: no limits, a time to live of 100 ms, a safe command of zeros, and its own stop latch.
    pub fn new(name: &str, descriptor: &'static Descriptor) -> Self {
        Self {
            name: name.into(),
            descriptor,
            bounds: Vec::new(),
            time_to_live: Self::DEFAULT_TIME_TO_LIVE,
            safe: vec![0; descriptor.size],
            stop_latch: StopLatch::in_memory(),
        }
    }

    /// Limits a number (`left`, `arm/joints/3`) to `low..=high`, in the field's unit.
    ///
    /// Replaces earlier limits of the field. The safe command is not limited.
    ///
    /// # Errors
    /// [`ConfigurationError`] if the field is not a number, or the interval has no value of its type.
    pub fn limit(mut self, field: &str, low: f64, high: f64) -> Result<Self, ConfigurationError> {
        let ordered = low.is_finite() && high.is_finite() && low <= high;
        if !self.bound(field)?.limit(low, high) || !ordered {
            return Err(ConfigurationError::EmptyLimits { gate: self.name, field: field.into(), low, high });
        }
        Ok(self)
    }

    /// Limits the rate of a number to `per_second`, in the field's unit per second.
    ///
    /// A command differs from the actuator's newest value by at most the rate times the time between both offers, at most the time to
    /// live; after the safe command, the time since it took effect. So the rate bounds each step even after a pause, and needs renewed
    /// commands. The safe command and the limits of [`limit`](Self::limit) take effect at once. An integer is rounded.
    ///
    /// # Errors
    /// [`ConfigurationError`] if the field is not a number, or the rate is not finite and greater than zero.
    pub fn rate_limit(mut self, field: &str, per_second: f64) -> Result<Self, ConfigurationError> {
        if !(per_second.is_finite() && per_second > 0.0) {
            return Err(ConfigurationError::WrongRate { gate: self.name, field: field.into(), per_second });
        }
        self.bound(field)?.rate_limit(per_second);
        Ok(self)
    }

    /// Sets the time to live of a command and its lease, nanoseconds.
    ///
    /// It ends exactly this long after its offer; with 0 no command takes effect.
    #[must_use]
    pub fn time_to_live(mut self, nanoseconds: u64) -> Self {
        self.time_to_live = nanoseconds;
        self
    }

    /// Sets the safe command, the actuator's output without a valid command.
    /// It is a value of the actuator's interface.
    ///
    /// # Errors
    /// [`ConfigurationError`] if it has another size or a number that is not finite.
    pub fn safe(mut self, command: &[u8]) -> Result<Self, ConfigurationError> {
        if command.len() != self.descriptor.size {
            return Err(ConfigurationError::WrongSize {
                gate: self.name,
                interface: self.descriptor.name,
                expected: self.descriptor.size,
                found: command.len(),
            });
        }
        self.safe.copy_from_slice(command);
        if !CanonicalForm::new(self.descriptor).canonicalize(&mut self.safe, 0) {
            return Err(ConfigurationError::SafeNotFinite { gate: self.name });
        }
        Ok(self)
    }

    /// Sets the software stop, which the gates of an agent share.
    #[must_use]
    pub fn stop_latch(mut self, latch: &StopLatch) -> Self {
        self.stop_latch = latch.clone();
        self
    }

    fn bound(&mut self, field: &str) -> Result<&mut Bound, ConfigurationError> {
        let place = find(self.descriptor, field)
            .map_err(|error| ConfigurationError::UnknownField { gate: self.name.clone(), error })?;
        // In a command of zeros every sequence is empty, so fields that it has exist in every command.
        let zeros = vec![0; self.descriptor.size];
        if View::new(self.descriptor, &zeros, 0).and_then(|view| view.at(&place)).is_none() {
            return Err(ConfigurationError::NotAlwaysThere { gate: self.name.clone(), field: field.into() });
        }
        let Some(bound) = Bound::new(*place.kind(), place.offset()) else {
            let kind = place.kind().describe();
            return Err(ConfigurationError::NotNumeric {
                gate: self.name.clone(),
                field: field.into(),
                kind,
            });
        };
        let known = self.bounds.iter().position(|known| known.offset() == bound.offset());
        let index = known.unwrap_or_else(|| {
            self.bounds.push(bound);
            self.bounds.len() - 1
        });
        Ok(&mut self.bounds[index])
    }
}
