//! Obstacle avoidance as a plain module, by a laser scanner alone.
//! The target is in the robot's own frame.

use serde::{Deserialize, Serialize};
use slate_avoidance::{Footprint, approach_speed};
use slate_local_planning::{
    Dwa, DwaParameters, LocalPlanningError, MotionState, ObservationBuffer, ObstacleField, PlanarVelocity,
};
use slate_plugin::interfaces::{LaserScan, MissionOutcome, MissionState, Point2, Pose2, Twist2, Verdict};
use slate_plugin::module::Refusal;
use slate_plugin::prelude::*;

use crate::frames::PlanarTransform;

/// Edge length of a cell around the robot, m.
const RESOLUTION: f64 = 0.05;
/// Rate of the laser that the planner is made for, Hz.
const SCAN_RATE: f64 = 10.0;
/// Time between scans that are remembered, s.
const MEMORY_INTERVAL: f64 = 0.5;

/// Ports of [`ObstacleAvoidance`].
#[ports]
pub struct ObstacleAvoidanceIo {
    /// Target in the robot's frame at the time of the value.
    /// Its heading does not count.
    local_target: Input<Pose2>,
    /// Scan of the laser.
    #[stale(after = "500ms")]
    laser_scan: Input<LaserScan>,
    /// Velocity that the robot should have.
    #[safe(Twist2::ZERO)]
    control_speed: Output<Twist2>,
    /// Progress towards the target.
    status: Output<AvoidanceStatus>,
    /// Verdict on the way to the target, for a robot that has no other mission.
    verdict: Output<Verdict>,
}

/// Progress of an obstacle avoidance.
#[interface]
#[derive(PartialEq)]
pub struct AvoidanceStatus {
    /// Distance to the target, by the commanded velocities since it was set.
    #[unit("m")]
    pub distance: f64,
    /// True if the robot is at the target.
    pub has_arrived: Bool,
    /// True if no velocity is free, so that it backs up.
    pub is_blocked: Bool,
}

/// Parameters of [`ObstacleAvoidance`].
#[params]
#[derive(PartialEq)]
pub struct ObstacleAvoidanceParams {
    #[param(default = 0.5, range = 0.0..=5.0, unit = "m/s", doc = "maximum velocity")]
    max_linear_velocity: f64,
    #[param(default = 0.9, range = 0.05..=10.0, unit = "rad/s", doc = "maximum angular velocity")]
    max_angular_velocity: f64,
    #[param(default = 0.6, range = 0.05..=20.0, unit = "m/s^2", doc = "maximum acceleration")]
    max_linear_acceleration: f64,
    #[param(default = 1.3, range = 0.05..=50.0, unit = "rad/s^2", doc = "maximum angular acceleration")]
    max_angular_acceleration: f64,
    #[param(default = 0.15, range = 0.01..=5.0, unit = "m", doc = "distance from the target at which the robot stops")]
    goal_tolerance: f64,
    #[param(default = 1.5, range = 0.2..=10.0, unit = "s", doc = "simulation horizon of a sampled velocity")]
    lookahead_time: f64,
    #[param(default = 0.5, range = 0.0..=5.0, unit = "m", doc = "inflation radius: distance up to which a trajectory near an obstacle costs more")]
    inflation_radius: f64,
    #[param(default = 0.04, range = 0.0..=1.0, unit = "m", doc = "margin around the footprint")]
    clearance: f64,
    #[param(default = 1.5, range = 0.0..=60.0, unit = "s", doc = "how long obstacles out of sight are remembered")]
    observation_persistence: f64,
    #[param(default = 0.724, range = 0.05..=5.0, unit = "m", doc = "length of the robot, about its reference point")]
    length: f64,
    #[param(default = 0.616, range = 0.05..=5.0, unit = "m", doc = "width of the robot")]
    width: f64,
    #[param(default = 0.0, range = -5.0..=5.0, unit = "m", doc = "x of the laser on the robot")]
    laser_x: f64,
    #[param(default = 0.0, range = -5.0..=5.0, unit = "m", doc = "y of the laser on the robot")]
    laser_y: f64,
    #[param(default = 0.0, range = -3.2..=3.2, unit = "rad", doc = "heading of the laser on the robot")]
    laser_theta: f64,
}

/// Obstacle avoidance around what a laser sees: OpenRDK's `obstacleAvoidance`.
/// The target is in the robot's own frame.
///
/// A target stays where it was set. The robot reckons its way there by the velocities that it has commanded, so that it
/// needs no localization and no odometry. The velocity is that of [`Dwa`] for the newest scan.
pub struct ObstacleAvoidance;

/// State of [`ObstacleAvoidance`].
#[derive(Serialize, Deserialize)]
pub struct ObstacleAvoidanceState {
    /// Pose by the commanded velocities: x, y and heading.
    pose: [f64; 3],
    velocity: PlanarVelocity,
    /// In the frame of `pose`.
    target: Option<[f64; 2]>,
    has_arrived: bool,
    is_blocked: bool,
    memory: ObservationBuffer,
    /// True if the log reports the scan as missing or old.
    is_blind: bool,
    #[serde(skip)]
    planner: Option<Box<TargetPlanner>>,
}

/// Made anew from the parameters, so that it is no state.
struct TargetPlanner {
    params: ObstacleAvoidanceParams,
    dwa: Dwa,
    field: ObstacleField,
    hits: Vec<[f64; 2]>,
}

#[module(stage = Act)]
impl Module for ObstacleAvoidance {
    type Io = ObstacleAvoidanceIo;
    type Params = ObstacleAvoidanceParams;
    type State = ObstacleAvoidanceState;

    fn create(_: &Setup<'_>, params: &ObstacleAvoidanceParams) -> Result<ObstacleAvoidanceState, Refusal> {
        TargetPlanner::new(params).map_err(|error| Refusal::from(error.to_string()))?;
        Ok(ObstacleAvoidanceState {
            pose: [0.0; 3],
            velocity: PlanarVelocity::ZERO,
            target: None,
            has_arrived: false,
            is_blocked: false,
            memory: ObservationBuffer::new(params.observation_persistence, MEMORY_INTERVAL),
            is_blind: false,
            planner: None,
        })
    }

    fn tick(
        state: &mut ObstacleAvoidanceState,
        io: &ObstacleAvoidanceIo,
        params: &ObstacleAvoidanceParams,
        now: &Tick,
    ) -> Outcome {
        state.reckon(now.elapsed());
        if let Some(target) = io.local_target.updated() {
            state.take_target(target);
        }
        let is_blind = io.laser_scan.fresh().is_none() && state.target.is_some();
        // Before the first scan it is no news.
        if is_blind && io.laser_scan.get().is_some() && !state.is_blind {
            now.warn(format_args!("no fresh laser scan: the robot stops until one arrives"));
        }
        state.is_blind = is_blind;
        let outcome = match state.plan(io, params, now) {
            Ok(()) => Outcome::Ok,
            Err(error) => {
                now.error(format_args!("{error}"));
                state.velocity = PlanarVelocity::ZERO;
                Outcome::Degraded
            }
        };
        state.publish(io);
        if is_blind { Outcome::Degraded } else { outcome }
    }
}

impl ObstacleAvoidanceState {
    /// Goes on at the commanded velocity.
    fn reckon(&mut self, seconds: f64) {
        let PlanarVelocity { vx, wz, .. } = self.velocity;
        let [x, y, theta] = self.pose;
        let middle = theta + 0.5 * wz * seconds;
        self.pose = [
            x + vx * seconds * math::cos(middle),
            y + vx * seconds * math::sin(middle),
            math::wrap_angle(theta + wz * seconds),
        ];
    }

    fn pose(&self) -> Pose2 {
        let [x, y, theta] = self.pose;
        Pose2 { x, y, theta }
    }

    fn take_target(&mut self, target: &Pose2) {
        let is_point = target.x.is_finite() && target.y.is_finite();
        self.target = is_point.then(|| PlanarTransform::of(&self.pose()).point([target.x, target.y]));
        self.has_arrived = false;
    }

    fn distance(&self) -> Option<f64> {
        let [x, y] = self.target?;
        Some(math::hypot(x - self.pose[0], y - self.pose[1]))
    }

    /// Chooses the velocity of this cycle.
    fn plan(
        &mut self,
        io: &ObstacleAvoidanceIo,
        params: &ObstacleAvoidanceParams,
        now: &Tick,
    ) -> Result<(), LocalPlanningError> {
        let (Some(scan), Some(distance), Some(target)) =
            (io.laser_scan.fresh(), self.distance(), self.target)
        else {
            self.velocity = PlanarVelocity::ZERO;
            return Ok(());
        };
        self.has_arrived |= distance <= params.goal_tolerance;
        if self.has_arrived || params.max_linear_velocity == 0.0 {
            self.velocity = PlanarVelocity::ZERO;
            return Ok(());
        }
        if !io.laser_scan.is_new() {
            return Ok(());
        }
        let mut planner = match self.planner.take().filter(|planner| planner.is_for(params)) {
            Some(planner) => planner,
            None => Box::new(TargetPlanner::new(params)?),
        };
        planner.see(scan, &self.pose(), &mut self.memory, now);
        let velocity = planner.velocity(&self.pose(), self.velocity, (target, distance), params);
        self.is_blocked = velocity.is_none_or(|velocity| velocity.vx < 0.0);
        self.velocity = velocity.unwrap_or(PlanarVelocity::ZERO);
        self.planner = Some(planner);
        Ok(())
    }

    fn publish(&self, io: &ObstacleAvoidanceIo) {
        io.control_speed.set(self.velocity.into());
        let Some(distance) = self.distance() else { return };
        io.status.set(AvoidanceStatus {
            distance,
            has_arrived: self.has_arrived.into(),
            is_blocked: self.is_blocked.into(),
        });
        let (state, outcome, reason) = match self.has_arrived {
            true => (MissionState::SUCCEEDED, MissionOutcome::GOAL_REACHED, "at the target"),
            false => (MissionState::RUNNING, MissionOutcome::OTHER, "on the way to the target"),
        };
        io.verdict.set(Verdict { state, outcome, reason: Text::new(reason) });
    }
}

impl TargetPlanner {
    fn new(params: &ObstacleAvoidanceParams) -> Result<Self, LocalPlanningError> {
        let (front, side) = (0.5 * params.length + params.clearance, 0.5 * params.width + params.clearance);
        let corners = [[front, side], [-front, side], [-front, -side], [front, -side]];
        let footprint = Footprint::new(&corners)
            .map_err(|_| LocalPlanningError { name: "length", expected: "an outline with an area" })?;
        let parameters = DwaParameters {
            max_vel_x: math::max(params.max_linear_velocity, 0.01),
            min_vel_x: math::min(0.1, math::max(params.max_linear_velocity, 0.01)),
            max_vel_theta: params.max_angular_velocity,
            min_in_place_vel_theta: math::min(0.4, params.max_angular_velocity),
            acc_lim_x: params.max_linear_acceleration,
            acc_lim_theta: params.max_angular_acceleration,
            sim_time: params.lookahead_time,
            vx_samples: 6,
            // The straight line to the target is not a path that was planned: it may lead through an obstacle.
            pdist_scale: 0.0,
            controller_frequency: SCAN_RATE,
            inflation_radius: params.inflation_radius,
            ..DwaParameters::default()
        };
        let reach = params.max_linear_velocity * params.lookahead_time;
        Ok(Self {
            params: *params,
            dwa: Dwa::new(parameters, &footprint)?,
            field: ObstacleField::new(2.0 * reach + 4.0, RESOLUTION)?,
            hits: Vec::with_capacity(4096),
        })
    }

    /// Returns true if it was made for these parameters.
    /// The largest velocity does not count, as it can change.
    fn is_for(&self, params: &ObstacleAvoidanceParams) -> bool {
        let max_linear_velocity = self.params.max_linear_velocity;
        self.params == ObstacleAvoidanceParams { max_linear_velocity, ..*params }
            && params.max_linear_velocity <= max_linear_velocity
    }

    /// Adds a scan to the memory, and fills the field from it.
    fn see(&mut self, scan: &LaserScan, pose: &Pose2, memory: &mut ObservationBuffer, now: &Tick) {
        let ObstacleAvoidanceParams { laser_x, laser_y, laser_theta, .. } = self.params;
        let mount = Pose2 { x: laser_x, y: laser_y, theta: laser_theta };
        self.hits.clear();
        for (beam, range) in scan.ranges.iter().enumerate() {
            let range = f64::from(*range);
            // False for NaN, too.
            if range >= scan.range_min && range < scan.range_max {
                let angle = scan.angle_min + beam as f64 * scan.angle_increment;
                self.hits.push([range * math::cos(angle), range * math::sin(angle)]);
            }
        }
        let laser = PlanarTransform::of(pose).pose(&mount);
        memory.insert(now.seconds(), &laser, &self.hits);
        self.field.update([pose.x, pose.y], memory.points());
    }

    /// Returns the velocity towards a target at a distance; `None` if none is free.
    fn velocity(
        &mut self,
        pose: &Pose2,
        velocity: PlanarVelocity,
        ([x, y], distance): ([f64; 2], f64),
        params: &ObstacleAvoidanceParams,
    ) -> Option<PlanarVelocity> {
        let most = params.max_linear_velocity;
        self.dwa.set_max_velocity(approach_speed(most, distance, 0.5 * params.max_linear_acceleration));
        let path = [Point2 { x: pose.x, y: pose.y }, Point2 { x, y }];
        self.dwa.plan(&MotionState { pose: *pose, velocity }, &path, &self.field)
    }
}
