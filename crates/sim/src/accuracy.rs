//! Errors of a robot's sensors, by its description and profile.

use slate_interfaces::SensorAccuracy;
use slate_module::math::{hypot, max};

use crate::robot::{NoiseDescription, RobotSensorDescription, SonarDescription};
use crate::simulation::Placement;

impl Placement {
    /// Returns the errors of the robot's sensors.
    /// They are zero if positioning, sonars and robot sensor are exact.
    pub fn accuracy(&self) -> SensorAccuracy {
        let positioning = self.positioning();
        let sonar = self.description.sonar.get(&self.sonar);
        let outliers = |it: &SonarDescription| it.dropout + it.crosstalk;
        let sighting = |value: fn(&RobotSensorDescription) -> f64| self.robot_sensor().map_or(0.0, value);
        let accuracy = SensorAccuracy {
            position_stddev: positioning.noise_position,
            orientation_stddev: positioning.noise_orientation,
            sonar_outliers: sonar.map_or(0.0, outliers),
            sighting_range_stddev: sighting(|it| it.noise_constant),
            sighting_range_relative_stddev: sighting(|it| it.noise_proportional),
            sighting_bearing_stddev: sighting(|it| it.noise_bearing),
            ..SensorAccuracy::default()
        };
        if accuracy == SensorAccuracy::default() {
            return accuracy;
        }
        let NoiseDescription { wheel_radius_bias, track_bias, .. } = self.description.noise;
        let odometry = self.odometry();
        let drive = &self.description.drive;
        // Both wheels are biased; their difference turns the robot.
        let by_radius = std::f64::consts::SQRT_2 * wheel_radius_bias;
        let by_distance = by_radius / drive.odometry_track.unwrap_or(drive.track);
        SensorAccuracy {
            odometry_translation_stddev: hypot(by_radius / 2.0, odometry.distance_bias),
            odometry_rotation_stddev: max(by_distance, hypot(track_bias, odometry.turn_bias)),
            ..accuracy
        }
    }
}
