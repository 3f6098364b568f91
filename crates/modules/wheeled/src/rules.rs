//! Rules of reflexes in Knowledge: thresholds that may change while the robot runs.

use std::fmt;

use slate_avoidance::{MAX_DISTANCE, ROBOT_SENSOR, ReflexRules, RuleError, SONAR, SensorRule};
use slate_plugin::prelude::*;

/// Rules of the reflexes of a wheeled robot.
#[interface]
#[derive(PartialEq)]
pub struct WheeledRules {
    /// Rules of the reflex that avoids obstacles.
    /// A sensor with a rule here is required by all reflexes.
    pub avoid_obstacle: ReflexRules,
    /// Rules of the reflex that gives way.
    pub give_way: GiveWayRules,
    /// Rules of the reflex that follows a wall.
    pub keep_wall: KeepWallRules,
    /// Rules of the reflex that backs away from a contact.
    pub bumper_release: BumperReleaseRules,
}

/// Rules of the reflex that gives way to another robot.
#[interface]
#[derive(PartialEq)]
pub struct GiveWayRules {
    /// Distance of another robot's center below which it gives way.
    #[unit("m")]
    pub min_separation: f64,
    /// Bearing from straight ahead or behind within which it gives way.
    /// The robot can't move sideways.
    #[unit("rad")]
    pub max_bearing: f64,
    /// Linear velocity.
    #[unit("m/s")]
    pub linear_velocity: f64,
    /// Range of the sonars in its direction below which it stays.
    #[unit("m")]
    pub min_clearance: f64,
    /// Linear velocity above which the robot drives on.
    #[unit("m/s")]
    pub standing_velocity: f64,
}

/// Rules of the reflex that follows a wall.
#[interface]
#[derive(PartialEq)]
pub struct KeepWallRules {
    /// Distance of the robot's center from a wall on the left; negative: on the right.
    #[unit("m")]
    pub wall_distance: f64,
    /// Linear velocity along the wall.
    #[unit("m/s")]
    pub linear_velocity: f64,
    /// Maximum angular velocity.
    #[unit("rad/s")]
    pub max_angular_velocity: f64,
    /// Lookahead distance of pure pursuit.
    #[unit("m")]
    pub lookahead_distance: f64,
    /// Maximum range at which a wall is followed.
    #[unit("m")]
    pub max_range: f64,
    /// Duration of the arc about the end of a wall.
    #[unit("s")]
    pub timeout: f64,
    /// Tolerance in direction of a sonar beside.
    #[unit("rad")]
    pub side_tolerance: f64,
    /// Tolerance in direction of a sonar ahead.
    #[unit("rad")]
    pub front_tolerance: f64,
    /// Margin over the wall distance at which it turns away from an obstacle ahead.
    #[unit("m")]
    pub front_margin: f64,
    /// Angle by which it turns away from an obstacle ahead.
    #[unit("rad")]
    pub turn_angle: f64,
}

/// Rules of the reflex that backs away from a contact.
#[interface]
#[derive(PartialEq)]
pub struct BumperReleaseRules {
    /// Linear velocity away from the contact.
    #[unit("m/s")]
    pub linear_velocity: f64,
    /// Distance to travel after the bumper is released.
    #[unit("m")]
    pub distance: f64,
    /// Time after which a robot with a pressed bumper stops.
    #[unit("s")]
    pub timeout: f64,
}

/// Rules for the reflexes.
#[ports]
pub struct RulePorts {
    /// Rules of the reflexes.
    #[role("rule")]
    rules: Output<WheeledRules>,
}

impl WheeledRules {
    /// Returns the rules with the default threshold of the sonars.
    /// A rule for the sonars stays.
    ///
    /// A rule for another sensor does not switch the reflex by sonars off.
    pub fn with_sonars(mut self) -> Self {
        if self.avoid_obstacle.distance(SONAR).is_none() {
            let mut sensors = [SensorRule::default(); 4];
            let default = default_sensor_rules();
            let all = default.iter().chain(self.avoid_obstacle.sensors.iter());
            let count = sensors.iter_mut().zip(all).map(|(place, rule)| *place = *rule).count();
            self.avoid_obstacle.sensors = Sequence::new(&sensors[..count]);
        }
        self
    }

    /// Returns the rules for sonars with errors.
    /// The distance of the sonars' rule (m) and the clearances (m) are greater.
    #[must_use]
    pub fn widened(mut self, distance: f64, clearance: f64) -> Self {
        let reflex = &mut self.avoid_obstacle;
        reflex.side_clearance += clearance;
        reflex.min_clearance += clearance;
        let mut sensors = [SensorRule::default(); 4];
        for (wide, rule) in sensors.iter_mut().zip(reflex.sensors.iter()) {
            let more = if rule.sensor.as_str() == SONAR { distance } else { 0.0 };
            let distance = math::max(rule.distance, math::min(rule.distance + more, MAX_DISTANCE));
            *wide = SensorRule { distance, ..*rule };
        }
        reflex.sensors = Sequence::new(&sensors[..reflex.sensors.len()]);
        self
    }

    /// Returns true if a sensor has a rule.
    /// While it is late, no reflex that reads it drives.
    pub fn is_required(&self, sensor: &str) -> bool {
        self.avoid_obstacle.distance(sensor).is_some()
    }
}

/// Rules of a robot, checked against its sensors.
#[derive(Clone, Copy, Debug, Default)]
pub struct CheckedRules {
    /// Last error, which is logged once.
    error: Option<RuleError>,
    /// True if rules are published.
    is_published: bool,
}

impl CheckedRules {
    /// Publishes the rules if the robot has their sensors.
    /// Else the previous rules remain.
    ///
    /// The first rules are published in any case: a sensor that never measures counts as near.
    pub fn publish(
        &mut self,
        ports: &RulePorts,
        rules: WheeledRules,
        error: Option<RefusedRule<'_>>,
        now: &Tick,
    ) {
        if error.is_none() || !self.is_published {
            ports.rules.set(rules);
            self.is_published = true;
        }
        let last = std::mem::replace(&mut self.error, error.as_ref().map(|refused| refused.error));
        if let Some(refused) = error.filter(|refused| last != Some(refused.error)) {
            now.error(format_args!("{refused}"));
        }
    }
}

/// Name of the bumpers in a robot model.
pub const BUMPER: &str = "bumper";

/// Invalid rule of a robot with these sensors.
/// It begins with the place of the rule, by which the host finds its line.
pub struct RefusedRule<'a> {
    error: RuleError,
    sensors: &'a [&'a str],
}

impl<'a> RefusedRule<'a> {
    /// Checks the rules of a robot with these sensors, of those that may have a rule.
    pub fn find(rules: &ReflexRules, sensors: &'a [&'a str]) -> Option<Self> {
        rules.check(sensors).err().map(|error| Self { error, sensors })
    }
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

/// Returns the threshold of the sonars of a Pioneer.
pub fn default_sensor_rules() -> Sequence<SensorRule, 4> {
    Sequence::new(&[SensorRule { distance: 0.1, sensor: Text::new(SONAR) }])
}
