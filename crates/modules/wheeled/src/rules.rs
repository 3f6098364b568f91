//! Rules of reflexes in Knowledge: thresholds that may change while the robot runs.

use std::fmt;

use slate_avoidance::{ROBOT_SENSOR, ReflexRules, RuleError, SONAR, SensorRule};
use slate_plugin::prelude::*;

/// Rules for the reflexes.
#[ports]
pub struct RulePorts {
    /// Rules of the reflex that avoids obstacles.
    rules: Output<ReflexRules>,
}

/// The last refused rules: each is logged once.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct RefusedRules {
    error: Option<RuleError>,
    /// Whether there are rules.
    is_written: bool,
}

impl RefusedRules {
    /// Writes the rules if the robot has their sensors; else the previous rules remain.
    ///
    /// The first rules are written in any case: a sensor that never measures counts as near.
    pub fn update(&mut self, ports: &RulePorts, rules: ReflexRules, sensors: &[&str], now: &Tick) {
        let error = rules.check(sensors).err();
        if error.is_none() || !self.is_written {
            ports.rules.set(rules);
            self.is_written = true;
        }
        match error {
            // By default, of a robot that may have no sonars.
            Some(_) if rules.sensors == default_sensor_rules() => {}
            Some(error) if self.error != Some(error) => {
                now.error(format_args!("{}", RefusedRule { error, sensors }));
            }
            _ => {}
        }
        self.error = error;
    }
}

/// Name of the bumpers in a robot model.
pub const BUMPER: &str = "bumper";

/// A refused rule of a robot with these sensors. It begins with the place of the rule, by which the host finds its line.
pub struct RefusedRule<'a> {
    /// What is wrong.
    pub error: RuleError,
    /// Names of the robot's sensors that may have a rule.
    pub sensors: &'a [&'a str],
}

impl fmt::Display for RefusedRule<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("params.sensor_rules")?;
        if let Some(index) = self.error.index() {
            write!(f, ".{index}")?;
        }
        match self.error {
            RuleError::Sensor { sensor, .. } if has_threshold(sensor.as_str()) => {
                return write!(
                    f,
                    ": the robot has no Sensor `{sensor}` that works: it is missing or switched off, and the reflexes that read it stop the robot"
                );
            }
            error => write!(f, ": {error}")?,
        }
        if let RuleError::Sensor { .. } = self.error {
            f.write_str("; expected one of ")?;
            for (number, sensor) in self.sensors.iter().enumerate() {
                f.write_str(if number == 0 { "" } else { ", " })?;
                f.write_str(sensor)?;
            }
        }
        Ok(())
    }
}

/// Returns whether a reflex has a threshold for a sensor of this name.
pub fn has_threshold(sensor: &str) -> bool {
    [SONAR, ROBOT_SENSOR, BUMPER].contains(&sensor)
}

/// The threshold of the sonars of a Pioneer.
pub fn default_sensor_rules() -> Sequence<SensorRule, 4> {
    Sequence::new(&[SensorRule { distance: 0.1, sensor: Text::new(SONAR) }])
}
