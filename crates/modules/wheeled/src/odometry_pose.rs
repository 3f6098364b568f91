//! Sensors of position and heading by odometry.
//! They replace a positioning system and a compass (section 6.1 of the paper).

use slate_plugin::interfaces::{Odometry, Orientation, Pose2, Position};
use slate_plugin::prelude::*;

/// Wheel encoders.
#[ports]
pub struct OdometrySource {
    /// Odometry of a driver, a simulator or a Sensor.
    source: Input<Odometry>,
}

/// Pose of the odometry frame in the map frame: where the robot was put down.
#[params]
pub struct OdometryStart {
    #[param(default = 0.0, unit = "m", doc = "initial x")]
    pub start_x: f64,
    #[param(default = 0.0, unit = "m", doc = "initial y")]
    pub start_y: f64,
    #[param(default = 0.0, range = -3.2..=3.2, unit = "rad", doc = "initial heading")]
    pub start_theta: f64,
}

impl OdometryStart {
    /// Transforms a pose from the odometry frame to the map frame.
    fn place(&self, pose: Pose2) -> Pose2 {
        let (sine, cosine) = (math::sin(self.start_theta), math::cos(self.start_theta));
        Pose2 {
            x: self.start_x + cosine * pose.x - sine * pose.y,
            y: self.start_y + sine * pose.x + cosine * pose.y,
            theta: math::wrap_angle(self.start_theta + pose.theta),
        }
    }
}

/// Position by odometry; it drifts.
pub struct OdometryPosition;

impl Sensor for OdometryPosition {
    const NAME: &'static str = "odometry_position";
    const DOC: &'static str = "Position by the odometry.";
    type Io = OdometrySource;
    type Params = OdometryStart;
    type State = ();
    type Value = Position;

    fn get_data(_: &mut (), io: &OdometrySource, start: &OdometryStart, _: &Tick) -> Option<Position> {
        let Pose2 { x, y, .. } = start.place(io.source.updated()?.pose);
        Some(Position { x, y, z: 0.0 })
    }
}

/// Heading by odometry; it drifts.
pub struct OdometryOrientation;

impl Sensor for OdometryOrientation {
    const NAME: &'static str = "odometry_orientation";
    const DOC: &'static str = "Heading by the odometry.";
    type Io = OdometrySource;
    type Params = OdometryStart;
    type State = ();
    type Value = Orientation;

    fn get_data(_: &mut (), io: &OdometrySource, start: &OdometryStart, _: &Tick) -> Option<Orientation> {
        Some(Orientation { theta: start.place(io.source.updated()?.pose).theta })
    }
}
