use serde::{Deserialize, Serialize};

use super::wheel_angles::WheelAngles;

/// Drive of a robot.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct DriveDescription {
    /// Kind of drive; differential by default.
    #[serde(default)]
    pub kind: DriveKind,
    /// Metres.
    pub wheel_radius: f64,
    /// Metres between the sides; of omni wheels the diameter of the circle on which they stand.
    pub track: f64,
    /// Radians per second.
    pub maximum_wheel_speed: f64,
    /// Radians per second squared.
    pub maximum_wheel_acceleration: f64,
    /// Metres between the axles. Of skid steering only, as all that follows.
    #[serde(default)]
    pub wheelbase: Option<f64>,
    /// Effective track width for odometry: that of an equivalent differential drive, metres.
    #[serde(default)]
    pub odometry_track: Option<f64>,
    /// How the wheels grip.
    #[serde(default)]
    pub friction: Option<Friction>,
    /// How single wheels grip that do so in another way.
    #[serde(default)]
    pub wheel_friction: WheelFriction,
    /// Where omni wheels stand.
    #[serde(default)]
    pub wheel_angles: Option<WheelAngles>,
}

/// Kind of drive.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum DriveKind {
    /// Two driven wheels on one axle, which roll without slipping.
    #[default]
    Differential,
    /// Four driven wheels that all point ahead: they slip sideways when the robot turns.
    SkidSteer,
    /// Three or four omni wheels on a circle: the robot moves in all directions.
    Omni,
}

/// Friction of a wheel: coefficients of the normal force.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Friction {
    /// Of the greatest force in the direction in which the wheel rolls.
    pub longitudinal: f64,
    /// Of the greatest force across.
    pub lateral: f64,
    /// Of the force that brakes a wheel because it rolls.
    #[serde(default)]
    pub rolling_resistance: f64,
}

/// Wheels that do not grip like the others, as one on ice.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct WheelFriction {
    /// Of the front left wheel.
    pub front_left: Option<Friction>,
    /// Of the front right wheel.
    pub front_right: Option<Friction>,
    /// Of the back left wheel.
    pub back_left: Option<Friction>,
    /// Of the back right wheel.
    pub back_right: Option<Friction>,
}

impl WheelFriction {
    /// Front left, front right, back left, back right.
    pub fn all(&self) -> [(&'static str, Option<Friction>); 4] {
        [
            ("front_left", self.front_left),
            ("front_right", self.front_right),
            ("back_left", self.back_left),
            ("back_right", self.back_right),
        ]
    }
}

impl Friction {
    fn is_one(self) -> bool {
        [self.longitudinal, self.lateral, self.rolling_resistance]
            .iter()
            .all(|value| value.is_finite() && *value >= 0.0)
    }
}

impl DriveDescription {
    /// Returns the key of an invalid or missing value, and the expectation.
    pub(super) fn mistake(&self) -> Option<(Vec<&'static str>, String)> {
        let positive = |value: f64| value.is_finite() && value > 0.0;
        let skids = self.kind == DriveKind::SkidSteer;
        let numbers = [
            ("wheel_radius", Some(self.wheel_radius)),
            ("track", Some(self.track)),
            ("maximum_wheel_speed", Some(self.maximum_wheel_speed)),
            ("maximum_wheel_acceleration", Some(self.maximum_wheel_acceleration)),
            ("wheelbase", self.wheelbase),
            ("odometry_track", self.odometry_track),
        ];
        for (key, value) in numbers {
            if value.is_some_and(|value| !positive(value)) {
                return Some((vec![key], "expected a positive, finite number".into()));
            }
        }
        if let Some(mistake) = self.mistake_of_omni() {
            return Some(mistake);
        }
        let different = self.wheel_friction.all().into_iter().find(|(_, friction)| friction.is_some());
        let of_skid_steering = [
            ("wheelbase", self.wheelbase.is_some()),
            ("odometry_track", self.odometry_track.is_some()),
            ("friction", self.friction.is_some()),
        ];
        for (key, is_there) in of_skid_steering {
            if skids && !is_there {
                return Some((vec![], format!("kind = \"skid_steer\" needs `{key}`, too")));
            }
            if !skids && is_there {
                return Some((vec![key], not_of_differential(key)));
            }
        }
        if !skids && different.is_some() {
            return Some((vec!["wheel_friction"], not_of_differential("wheel_friction")));
        }
        let coefficients = "expected coefficients of friction, which are not negative";
        if self.friction.is_some_and(|friction| !friction.is_one()) {
            return Some((vec!["friction"], coefficients.into()));
        }
        let mut wheels = self.wheel_friction.all().into_iter();
        let wrong = wheels.find(|(_, friction)| friction.is_some_and(|own| !own.is_one()));
        wrong.map(|(wheel, _)| (vec!["wheel_friction", wheel], coefficients.into()))
    }
}

impl DriveDescription {
    /// Returns the key of an invalid or missing value of omni wheels, and the expectation.
    fn mistake_of_omni(&self) -> Option<(Vec<&'static str>, String)> {
        let is_omni = self.kind == DriveKind::Omni;
        match self.wheel_angles {
            None if is_omni => {
                Some((vec![], "kind = \"omni\" needs `wheel_angles`, such as [60, 180, 300], too".into()))
            }
            Some(_) if !is_omni => {
                Some((vec!["wheel_angles"], "`wheel_angles` is of kind = \"omni\" only".into()))
            }
            Some(angles) if angles.directions() < 3 => {
                let message = "expected wheels in three directions or more, apart from each other";
                Some((vec!["wheel_angles"], message.into()))
            }
            _ => None,
        }
    }
}

fn not_of_differential(key: &str) -> String {
    format!("`{key}` is of kind = \"skid_steer\" only; the wheels of other drives do not slip")
}
