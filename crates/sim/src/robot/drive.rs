use serde::{Deserialize, Serialize};

use super::wheel_angles::WheelAngles;

/// Drive of a robot.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct DriveDescription {
    /// Kind of drive; differential by default.
    #[serde(default)]
    pub kind: DriveKind,
    /// Wheel radius, m.
    pub wheel_radius: f64,
    /// Distance between the sides, m.
    /// For omni wheels, the diameter of the circle on which they stand.
    pub track: f64,
    /// Maximum wheel speed, rad/s.
    pub maximum_wheel_speed: f64,
    /// Maximum wheel acceleration, rad/s².
    pub maximum_wheel_acceleration: f64,
    /// Distance between the axles, m.
    /// For skid steering only, as are the following ones.
    #[serde(default)]
    pub wheelbase: Option<f64>,
    /// Effective track width for odometry, m.
    /// It is that of an equivalent differential drive.
    #[serde(default)]
    pub odometry_track: Option<f64>,
    /// Friction of the wheels.
    #[serde(default)]
    pub friction: Option<Friction>,
    /// Friction of single wheels that differ.
    #[serde(default)]
    pub wheel_friction: WheelFriction,
    /// Positions of omni wheels.
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
    /// Four driven wheels that all point ahead.
    /// They slip sideways when the robot turns.
    SkidSteer,
    /// Three or four omni wheels on a circle: the robot moves in all directions.
    Omni,
}

/// Friction of a wheel: coefficients of the normal force.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Friction {
    /// Coefficient of the greatest force along the rolling direction.
    pub longitudinal: f64,
    /// Coefficient of the greatest force across it.
    pub lateral: f64,
    /// Coefficient of the rolling resistance.
    #[serde(default)]
    pub rolling_resistance: f64,
}

/// Friction of wheels that differ from the others, such as one on ice.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct WheelFriction {
    /// Friction of the front left wheel.
    pub front_left: Option<Friction>,
    /// Friction of the front right wheel.
    pub front_right: Option<Friction>,
    /// Friction of the back left wheel.
    pub back_left: Option<Friction>,
    /// Friction of the back right wheel.
    pub back_right: Option<Friction>,
}

impl WheelFriction {
    /// Returns all wheels: front left, front right, back left, back right.
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
    pub(super) fn invalid_value(&self) -> Option<(Vec<&'static str>, String)> {
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
        if let Some(invalid_value) = self.invalid_omni_value() {
            return Some(invalid_value);
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
    /// Returns the key of an invalid or missing value of omni wheels.
    /// The expectation follows.
    fn invalid_omni_value(&self) -> Option<(Vec<&'static str>, String)> {
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
