use slate_module::blackboard::interface::{AccessError, Descriptor, FloatMap, View, find};

use crate::StopLatch;
use crate::bound::Bound;

/// What a gate guards, and how.
#[derive(Clone, Debug)]
pub struct GateConfiguration {
    pub(crate) name: String,
    pub(crate) descriptor: &'static Descriptor,
    pub(crate) bounds: Vec<Bound>,
    pub(crate) time_to_live: u64,
    pub(crate) safe: Vec<u8>,
    pub(crate) stop_latch: StopLatch,
}

/// Why a gate can't be configured so.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum ConfigurationError {
    /// The actuator's interface has no such field.
    #[error("gate `{gate}`: {error}")]
    UnknownField {
        /// Name of the gate.
        gate: String,
        /// What was looked for, and what there is.
        error: AccessError,
    },
    /// The field is no single number.
    #[error("gate `{gate}`: `{field}` is {kind}; only a single number can be limited")]
    NotNumeric {
        /// Name of the gate.
        gate: String,
        /// Path of the field.
        field: String,
        /// What it is.
        kind: String,
    },
    /// The field is an item of a sequence or of a tail, which a command may leave out.
    #[error(
        "gate `{gate}`: `{field}` is not part of every command; only fields and items of arrays can be limited"
    )]
    NotAlwaysThere {
        /// Name of the gate.
        gate: String,
        /// Path of the field.
        field: String,
    },
    /// No value of the field's type lies in the interval.
    #[error("gate `{gate}`: the limits of `{field}`, {low} to {high}, leave it no value")]
    EmptyLimits {
        /// Name of the gate.
        gate: String,
        /// Path of the field.
        field: String,
        /// The lower limit.
        low: f64,
        /// The upper limit.
        high: f64,
    },
    /// The rate is not a finite number above zero.
    #[error("gate `{gate}`: the rate limit of `{field}` must be finite and above 0, not {per_second}")]
    WrongRate {
        /// Name of the gate.
        gate: String,
        /// Path of the field.
        field: String,
        /// The rate that was given.
        per_second: f64,
    },
    /// The safe command is no value of the actuator's interface.
    #[error("gate `{gate}`: the safe command has {found} bytes, but {interface} has {expected}")]
    WrongSize {
        /// Name of the gate.
        gate: String,
        /// Name of the actuator's interface.
        interface: &'static str,
        /// Its bytes.
        expected: usize,
        /// Those of the safe command.
        found: usize,
    },
    /// The safe command has a number that is infinite or not a number.
    #[error("gate `{gate}`: the safe command has a number that is not finite")]
    SafeNotFinite {
        /// Name of the gate.
        gate: String,
    },
}

impl GateConfiguration {
    /// How long a command takes effect if nothing else is said, nanoseconds.
    pub const DEFAULT_TIME_TO_LIVE: u64 = 100_000_000;

    /// A gate for commands of that interface (without a tail, if it has one): no limits, a time to live of 100 ms,
    /// all zero as the safe command, and a stop latch of its own.
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

    /// Holds a number (`left`, `arm/joints/3`) in the closed interval from `low` to `high`, in the field's unit.
    /// Limits said before for the same field are replaced. The safe command is not limited.
    ///
    /// # Errors
    /// [`ConfigurationError`] when there is no such number, or the interval leaves it no value.
    pub fn limit(mut self, field: &str, low: f64, high: f64) -> Result<Self, ConfigurationError> {
        let ordered = low.is_finite() && high.is_finite() && low <= high;
        if !self.bound(field)?.limit(low, high) || !ordered {
            return Err(ConfigurationError::EmptyLimits { gate: self.name, field: field.into(), low, high });
        }
        Ok(self)
    }

    /// Lets a number change by at most `per_second`, in the field's unit per second.
    ///
    /// A command may differ from what the actuator got last by the rate times the time from the one command's offer
    /// to the other's, of which at most the time to live counts; from the safe command the time counts since the
    /// actuator got it last. So a rate needs commands that are renewed, and bounds every step even after a pause.
    /// It is for moving values only: the safe command takes effect at once, whatever the rate, and so do the limits
    /// of [`limit`](Self::limit). An integer's value is rounded, and may be off by that.
    ///
    /// # Errors
    /// [`ConfigurationError`] when there is no such number, or the rate is not a finite number above zero.
    pub fn rate_limit(mut self, field: &str, per_second: f64) -> Result<Self, ConfigurationError> {
        if !(per_second.is_finite() && per_second > 0.0) {
            return Err(ConfigurationError::WrongRate { gate: self.name, field: field.into(), per_second });
        }
        self.bound(field)?.rate_limit(per_second);
        Ok(self)
    }

    /// How long a command takes effect and its lease lasts without being renewed, nanoseconds. Exactly that long
    /// after its offer it is over; with 0 no command ever takes effect.
    #[must_use]
    pub fn time_to_live(mut self, nanoseconds: u64) -> Self {
        self.time_to_live = nanoseconds;
        self
    }

    /// What the actuator gets whenever there is no command to pass: a value of its interface.
    ///
    /// # Errors
    /// [`ConfigurationError`] when it has another size or a number that is not finite.
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
        if !FloatMap::new(self.descriptor).canonicalize(&mut self.safe, 0) {
            return Err(ConfigurationError::SafeNotFinite { gate: self.name });
        }
        Ok(self)
    }

    /// The software stop of the agent, which its gates share.
    #[must_use]
    pub fn stop_latch(mut self, latch: &StopLatch) -> Self {
        self.stop_latch = latch.clone();
        self
    }

    fn bound(&mut self, field: &str) -> Result<&mut Bound, ConfigurationError> {
        let place = find(self.descriptor, field)
            .map_err(|error| ConfigurationError::UnknownField { gate: self.name.clone(), error })?;
        // In a command of zeros every sequence is empty, so what it still has, every command has.
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
