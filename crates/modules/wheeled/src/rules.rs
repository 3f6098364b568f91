//! Rules of reflexes in Knowledge: thresholds that may change while the robot runs.

use slate_avoidance::{ReflexRules, RuleError, SONAR, SensorRule};
use slate_plugin::prelude::*;

/// Rules for the reflexes.
#[ports]
pub struct RulePorts {
    /// Rules of the reflex that avoids obstacles.
    rules: Output<ReflexRules>,
}

/// The last refused rules: each is logged once.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct RefusedRules(Option<RuleError>);

impl RefusedRules {
    /// Writes the rules if the robot model lists their sensors; else the rules that hold stay.
    pub fn update(&mut self, ports: &RulePorts, rules: ReflexRules, listed: &[&str], now: &Tick) {
        let error = rules.check(listed).err();
        match error {
            None => ports.rules.set(rules),
            Some(error) if self.0 != Some(error) => {
                now.error(format_args!(
                    "the parameter `sensor_rules`: {error}; it lists {}",
                    listed.join(", ")
                ));
            }
            Some(_) => {}
        }
        self.0 = error;
    }
}

/// The threshold of the sonars of a Pioneer.
pub fn default_sensor_rules() -> Sequence<SensorRule, 4> {
    Sequence::new(&[SensorRule { distance: 0.1, sensor: Text::new(SONAR) }])
}
