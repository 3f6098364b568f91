use std::ops::RangeInclusive;

use slate_module::blackboard::interface::{Descriptor, Interface, Value, View};

/// Gate in front of an actuator: the only way of a command to it.
///
/// ```
/// use slate_interfaces::WheelSpeeds;
/// use slate_mapek::Gate;
///
/// let wheels = Gate::new(WheelSpeeds::ZERO).limit("left", -12.3..=12.3).limit("right", -12.3..=12.3).time_to_live("100ms");
/// ```
#[derive(Clone, Debug)]
pub struct Gate {
    pub(super) interface: &'static Descriptor,
    pub(super) safe: Value,
    pub(super) limits: Vec<(String, [f64; 2])>,
    pub(super) rate_limits: Vec<(String, f64)>,
    pub(super) time_to_live: Option<String>,
    pub(super) commanders: Vec<String>,
}

impl Gate {
    /// Creates a gate with the safe command, which applies without another one.
    pub fn new<T: Interface + Copy>(safe: T) -> Self {
        let mut safe = safe;
        Self {
            interface: T::DESCRIPTOR,
            safe: View::of(&mut safe).value(),
            limits: Vec::new(),
            rate_limits: Vec::new(),
            time_to_live: None,
            commanders: Vec::new(),
        }
    }

    /// Limits a field of the command to an interval, in the field's unit.
    #[must_use]
    pub fn limit(mut self, field: &str, range: RangeInclusive<f64>) -> Self {
        self.limits.push((field.into(), [*range.start(), *range.end()]));
        self
    }

    /// Limits the change of a field of the command, in its unit per second.
    #[must_use]
    pub fn rate_limit(mut self, field: &str, per_second: f64) -> Self {
        self.rate_limits.push((field.into(), per_second));
        self
    }

    /// Sets the age at which a command expires, such as `"100ms"`.
    #[must_use]
    pub fn time_to_live(mut self, duration: &str) -> Self {
        self.time_to_live = Some(duration.into());
        self
    }

    /// Accepts the commands of another port too, such as `teleoperation/wheels`.
    #[must_use]
    pub fn also(mut self, command: &str) -> Self {
        self.commanders.push(command.into());
        self
    }
}
