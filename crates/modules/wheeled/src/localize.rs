//! Dead reckoning: a pose from odometry, instead of a positioning system in a real deployment (section 6.1 of the paper).
//!
//! The Analyze writes position and orientation to Knowledge, where all other blocks read them instead of those of a positioning system and a
//! compass. They drift with the odometry.

use slate_plugin::interfaces::{Odometry, Orientation, Pose2, Position};
use slate_plugin::prelude::*;

/// Wheel encoders.
#[ports]
pub struct Encoders {
    #[stale(after = "500ms")]
    odometry: Sensed<Odometry>,
}

/// Monitors the odometry.
pub struct OdometryMonitor;

impl Monitor for OdometryMonitor {
    const NAME: &'static str = "odometry_monitor";
    const DOC: &'static str = "Monitors the odometry.";
    type Sensors = Encoders;
    type Params = ();
    type State = ();
    type Value = Odometry;

    fn interpret(_: &mut (), sensors: &Encoders, _: &(), _: &Tick) -> Option<Odometry> {
        let odometry = sensors.odometry.fresh()?;
        let Pose2 { x, y, theta } = odometry.pose;
        (x.is_finite() && y.is_finite() && theta.is_finite()).then_some(*odometry)
    }
}

/// Percept of the odometry, and the pose from it.
#[ports]
pub struct ObservedOdometry {
    odometry: Observed<Odometry>,
    /// Position, written with every measurement.
    position: Output<Position>,
    /// Heading, written with every measurement.
    orientation: Output<Orientation>,
}

/// Parameters of [`Localize`]: pose of the odometry frame.
#[params]
pub struct LocalizeParams {
    #[param(default = 0.0, unit = "m", doc = "initial x")]
    pub start_x: f64,
    #[param(default = 0.0, unit = "m", doc = "initial y")]
    pub start_y: f64,
    #[param(default = 0.0, range = -3.2..=3.2, unit = "rad", doc = "initial heading")]
    pub start_theta: f64,
    #[param(default = 0.05, range = 0.0..=10.0, doc = "displacement (m) or rotation (rad) that is reported")]
    pub min_change: f64,
}

impl LocalizeParams {
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

/// Estimates the pose from odometry; reports changes.
pub struct Localize;

impl Analyze for Localize {
    const NAME: &'static str = "localize";
    const DOC: &'static str = "Estimates the pose from odometry.";
    type Observed = ObservedOdometry;
    type Params = LocalizeParams;
    type State = Option<(f64, f64, f64)>;
    type Value = Pose2;

    fn process(
        told: &mut Option<(f64, f64, f64)>,
        observed: &ObservedOdometry,
        params: &LocalizeParams,
        _: &Tick,
    ) -> Option<Pose2> {
        let pose = params.place(observed.odometry.updated()?.pose);
        observed.position.set(Position { x: pose.x, y: pose.y, z: 0.0 });
        observed.orientation.set(Orientation { theta: pose.theta });
        let moved = told.is_none_or(|(x, y, theta)| {
            math::hypot(pose.x - x, pose.y - y) >= params.min_change
                || math::angle_between(theta, pose.theta).abs() >= params.min_change
        });
        moved.then(|| {
            *told = Some((pose.x, pose.y, pose.theta));
            pose
        })
    }
}
