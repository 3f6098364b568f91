//! Reflex: stops before a collision.

use slate_avoidance::Footprint;
use slate_plugin::interfaces::{LaserScan, Odometry, Pose2, Twist2};
use slate_plugin::prelude::*;
use slate_wheeled::knowledge::WheeledModel;

use crate::actions::Halt;
use crate::frames::PlanarTransform;

/// Rules of the collision stop, from Knowledge.
#[interface]
#[derive(PartialEq)]
pub struct CollisionRules {
    /// Time to a collision below which the robot stops; 0 for no stop.
    #[unit("s")]
    pub time_before_collision: f64,
    /// Margin around the outline in which a point is a collision.
    #[unit("m")]
    pub collision_distance: f64,
    /// Age of a scan from which the robot stops.
    #[unit("s")]
    pub source_timeout: f64,
    /// Points of a scan from which something is an obstacle.
    pub min_points: u32,
}

/// Sensors and knowledge of the reflex.
#[ports]
pub struct CollisionSensors {
    /// Scan of the laser.
    #[stale(after = "500ms")]
    laser: Input<LaserScan>,
    /// Velocity of the robot.
    #[stale(after = "500ms")]
    odometry: Input<Odometry>,
    /// Rules, from Knowledge.
    rules: Input<CollisionRules>,
    /// Robot model with the outline and the mount of the laser, from Knowledge.
    robot: Input<WheeledModel>,
}

/// Stops the robot when its present velocity leads to a collision within a time.
/// It uses the newest scan (the approach mode of Nav2's collision monitor), and stops also while the scan or the
/// velocity is old. It has no memory.
///
/// A stationary robot triggers no reflex, so that its Plan can lead it elsewhere.
pub struct CollisionStop;

/// Duration of a stop unless it is renewed, s.
const HALT: f64 = 0.25;
/// Time between two poses that are checked, s.
const TIME_STEP: f64 = 0.1;
/// Velocities below which the robot counts as stopped, m/s and rad/s.
const STANDING: [f64; 2] = [0.02, 0.05];
/// Name of the laser in a robot model.
const LASER: &str = "laser";

impl ReactiveModel for CollisionStop {
    const NAME: &'static str = "collision_stop";
    const DOC: &'static str = "Stops the robot before it collides at its present velocity.";
    const RANK: i32 = 10;
    type Sensors = CollisionSensors;
    type Params = ();
    type State = ();

    fn run(_: &mut (), sensors: &CollisionSensors, (): &(), now: &Tick) -> Option<ActionRequest> {
        let halt = || Some(Halt::request(HALT));
        // Before the robot is known, nothing moves it.
        let robot = sensors.robot.get()?;
        let rules = sensors.rules.get()?;
        let is_late = |time: u64| now.now().saturating_sub(time) as f64 * 1e-9 > rules.source_timeout;
        let (Some(scan), Some(odometry)) = (sensors.laser.get(), sensors.odometry.get()) else {
            return halt();
        };
        if is_late(sensors.laser.stamp().time) || is_late(sensors.odometry.stamp().time) {
            return halt();
        }
        let Ok(footprint) = Footprint::of(&robot.chassis.outline) else { return halt() };
        let twist = odometry.twist;
        if !(twist.linear.is_finite() && twist.angular.is_finite()) {
            return halt();
        }
        if twist.linear.abs() < STANDING[0] && twist.angular.abs() < STANDING[1] {
            return None;
        }
        let mount = robot.robot.sensor(LASER).map_or(Pose2::default(), |device| device.mount);
        collides(scan, &mount, &footprint, twist, rules).then(|| Halt::request(HALT))
    }
}

/// Returns true if enough points of a scan reach the margin of the outline.
/// The robot moves at the given velocity.
fn collides(
    scan: &LaserScan,
    mount: &Pose2,
    footprint: &Footprint,
    twist: Twist2,
    rules: &CollisionRules,
) -> bool {
    let mount = PlanarTransform::of(mount);
    let margin = rules.collision_distance;
    let steps = (rules.time_before_collision / TIME_STEP).ceil() as u32;
    // No point that is farther comes near in that time.
    let radius = footprint.outline().fold(0.0, |most, [x, y]| math::max(most, math::hypot(x, y)));
    let reach = twist.linear.abs() * rules.time_before_collision + radius + margin;
    let points = scan.ranges.iter().enumerate().filter_map(|(beam, range)| {
        let range = f64::from(*range);
        if !(range >= scan.range_min && range < scan.range_max) {
            return None;
        }
        let angle = scan.angle_min + beam as f64 * scan.angle_increment;
        let [x, y] = mount.point([range * math::cos(angle), range * math::sin(angle)]);
        (x * x + y * y <= reach * reach).then_some([x, y])
    });
    let is_hit = |[x, y]: &[f64; 2]| {
        let now = footprint.distance(*x, *y);
        (1..=steps).any(|step| {
            let time = math::min(f64::from(step) * TIME_STEP, rules.time_before_collision);
            let [x, y] = PlanarTransform::of(&pose_after(twist, time)).inverse_point([*x, *y]);
            let then = footprint.distance(x, y);
            // Points that are already too near may get farther away.
            then < margin && then < now - 1e-3
        })
    };
    points.filter(is_hit).take(rules.min_points as usize).count() >= rules.min_points as usize
}

/// Returns the pose after a time at a constant velocity.
fn pose_after(twist: Twist2, time: f64) -> Pose2 {
    let theta = twist.angular * time;
    // The chord of an arc has half its angle.
    let half = 0.5 * theta;
    let chord = twist.linear * time * if half.abs() > 1e-6 { math::sin(half) / half } else { 1.0 };
    Pose2 { x: chord * math::cos(half), y: chord * math::sin(half), theta }
}
