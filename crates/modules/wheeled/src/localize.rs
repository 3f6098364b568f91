//! Where the robot is, from the turns of its wheels: what takes the place of a positioning system in a real deployment (section
//! 6.1 of the paper).
//!
//! The Analyze keeps the robot's place in its knowledge: a position and an orientation that all other blocks read in the place of
//! those of a positioning system and of a compass. They drift: they are as good as the odometry.

use slate_plugin::interfaces::{Odometry, Orientation, Pose2, Position};
use slate_plugin::mapek::prelude::*;
use slate_plugin::prelude::*;

/// The wheels' encoders.
#[ports]
pub struct Encoders {
    #[stale(after = "500ms")]
    odometry: Input<Odometry>,
}

/// Watches the odometry.
pub struct OdometryMonitor;

impl Monitor for OdometryMonitor {
    const NAME: &'static str = "odometry_monitor";
    const DOC: &'static str = "Watches what the wheels' encoders say.";
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

/// The odometry's percept, and what the robot knows by it.
#[ports]
pub struct ObservedOdometry {
    odometry: Observed<Odometry>,
    /// Where the robot is, written with every measurement.
    position: Output<Position>,
    /// Which way it looks, written with every measurement.
    orientation: Output<Orientation>,
}

/// Where the robot was when its odometry began.
#[params]
pub struct LocalizeParams {
    #[param(default = 0.0, unit = "m", doc = "start, to the east")]
    pub start_x: f64,
    #[param(default = 0.0, unit = "m", doc = "start, to the north")]
    pub start_y: f64,
    #[param(default = 0.0, range = -3.2..=3.2, unit = "rad", doc = "where it looked")]
    pub start_theta: f64,
    #[param(default = 0.05, range = 0.0..=10.0, doc = "a way of fewer metres and a turn of fewer radians is not worth telling")]
    pub step: f64,
}

impl LocalizeParams {
    /// The pose in the map of one in the frame where odometry began.
    fn place(&self, pose: Pose2) -> Pose2 {
        let (sine, cosine) = (math::sin(self.start_theta), math::cos(self.start_theta));
        Pose2 {
            x: self.start_x + cosine * pose.x - sine * pose.y,
            y: self.start_y + sine * pose.x + cosine * pose.y,
            theta: math::wrap_angle(self.start_theta + pose.theta),
        }
    }
}

/// Tells where the robot is when it has moved.
pub struct Localize;

impl Analyze for Localize {
    const NAME: &'static str = "localize";
    const DOC: &'static str = "Tells where the robot is, by its odometry.";
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
        let pose = params.place(observed.odometry.new()?.pose);
        observed.position.set(Position { x: pose.x, y: pose.y, z: 0.0 });
        observed.orientation.set(Orientation { theta: pose.theta });
        let moved = told.is_none_or(|(x, y, theta)| {
            math::hypot(pose.x - x, pose.y - y) >= params.step
                || math::angle_between(theta, pose.theta).abs() >= params.step
        });
        moved.then(|| {
            *told = Some((pose.x, pose.y, pose.theta));
            pose
        })
    }
}
