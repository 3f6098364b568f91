//! Dynamic window approach.

use slate_avoidance::Footprint;
use slate_interfaces::{Point2, Pose2};
use slate_module::math;

use crate::error::LocalPlanningError;
use crate::footprint_points::FootprintPoints;
use crate::obstacle_field::ObstacleField;
use crate::path_window::PathWindow;
use crate::velocity::{MOST_EXCESS, MotionState, PlanarVelocity};
use crate::wavefront::GridWavefront;

/// Parameters of [`Dwa`], with the names of ROS's `base_local_planner`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DwaParameters {
    /// Largest velocity forward, `max_vel_x`, m/s.
    pub max_vel_x: f64,
    /// Least velocity forward, `min_vel_x`, m/s.
    pub min_vel_x: f64,
    /// Largest angular velocity, `max_vel_theta`, rad/s.
    pub max_vel_theta: f64,
    /// Least angular velocity of a turn in place, `min_in_place_vel_theta`, rad/s.
    pub min_in_place_vel_theta: f64,
    /// Velocity when nothing else is possible, `escape_vel`, m/s; negative.
    pub escape_vel: f64,
    /// Largest acceleration, `acc_lim_x`, m/s².
    pub acc_lim_x: f64,
    /// Largest angular acceleration, `acc_lim_theta`, rad/s².
    pub acc_lim_theta: f64,
    /// Time horizon of trajectories, `sim_time`, s.
    pub sim_time: f64,
    /// Distance between points of a trajectory, `sim_granularity`, m.
    pub sim_granularity: f64,
    /// Angle between points of a trajectory, `angular_sim_granularity`, rad.
    pub angular_sim_granularity: f64,
    /// Sampled velocities forward, `vx_samples`.
    pub vx_samples: usize,
    /// Sampled angular velocities, `vtheta_samples`.
    pub vtheta_samples: usize,
    /// Rate of calls, `controller_frequency`, Hz.
    pub controller_frequency: f64,
    /// Weight of the distance to the path, `pdist_scale`, 1/m.
    pub pdist_scale: f64,
    /// Weight of the distance to the local goal, `gdist_scale`, 1/m.
    pub gdist_scale: f64,
    /// Weight of the cost of cells, 0 to 252, `occdist_scale`.
    pub occdist_scale: f64,
    /// Distance from an obstacle up to which cells have a cost, `inflation_radius`, m.
    pub inflation_radius: f64,
    /// Decay rate of the cost with distance, `cost_scaling_factor`, 1/m.
    pub cost_scaling_factor: f64,
    /// Travel that lets a turn in place reverse, `oscillation_reset_dist`, m.
    pub oscillation_reset_dist: f64,
    /// Distance ahead at which turns in place are scored, `heading_lookahead`, m.
    /// The local goal is scored there.
    pub heading_lookahead: f64,
}

impl Default for DwaParameters {
    /// Defaults of ROS's `base_local_planner`.
    fn default() -> Self {
        Self {
            max_vel_x: 0.5,
            min_vel_x: 0.1,
            max_vel_theta: 1.0,
            min_in_place_vel_theta: 0.4,
            escape_vel: -0.1,
            acc_lim_x: 2.5,
            acc_lim_theta: 3.2,
            sim_time: 1.0,
            sim_granularity: 0.025,
            angular_sim_granularity: 0.025,
            vx_samples: 3,
            vtheta_samples: 20,
            controller_frequency: 20.0,
            pdist_scale: 0.6,
            gdist_scale: 0.8,
            occdist_scale: 0.01,
            inflation_radius: 0.55,
            cost_scaling_factor: 10.0,
            oscillation_reset_dist: 0.05,
            heading_lookahead: 0.325,
        }
    }
}

impl DwaParameters {
    fn check(&self) -> Result<(), LocalPlanningError> {
        LocalPlanningError::unless_positive(&[
            ("max_vel_x", self.max_vel_x),
            ("max_vel_theta", self.max_vel_theta),
            ("acc_lim_x", self.acc_lim_x),
            ("acc_lim_theta", self.acc_lim_theta),
            ("sim_time", self.sim_time),
            ("sim_granularity", self.sim_granularity),
            ("angular_sim_granularity", self.angular_sim_granularity),
            ("controller_frequency", self.controller_frequency),
        ])?;
        LocalPlanningError::unless_magnitudes(&[
            ("min_vel_x", self.min_vel_x),
            ("min_in_place_vel_theta", self.min_in_place_vel_theta),
            ("pdist_scale", self.pdist_scale),
            ("gdist_scale", self.gdist_scale),
            ("occdist_scale", self.occdist_scale),
            ("inflation_radius", self.inflation_radius),
            ("cost_scaling_factor", self.cost_scaling_factor),
            ("oscillation_reset_dist", self.oscillation_reset_dist),
            ("heading_lookahead", self.heading_lookahead),
        ])?;
        let is_backwards = self.escape_vel.is_finite() && self.escape_vel <= 0.0;
        LocalPlanningError::unless(is_backwards, "escape_vel", "a number up to 0")?;
        LocalPlanningError::unless((1..=1_000).contains(&self.vx_samples), "vx_samples", "1 to 1000")?;
        let is_sampled = (2..=1_000).contains(&self.vtheta_samples);
        LocalPlanningError::unless(is_sampled, "vtheta_samples", "2 to 1000")?;
        let points = self.sim_time
            * math::max(
                self.max_vel_x / self.sim_granularity,
                self.max_vel_theta / self.angular_sim_granularity,
            );
        LocalPlanningError::unless(
            points <= 10_000.0,
            "sim_granularity",
            "at most 10000 points in `sim_time`",
        )
    }
}

/// Dynamic window approach as in ROS's `base_local_planner`.
/// Fox, Burgard and Thrun, 1997, *The dynamic window approach to collision avoidance*. Velocities that can be reached
/// within a period, each held for [`sim_time`](DwaParameters::sim_time), are scored by the path, the local goal and the
/// costs of cells.
#[derive(Clone, Debug)]
pub struct Dwa {
    parameters: DwaParameters,
    footprint: FootprintPoints,
    path: PathWindow,
    to_path: GridWavefront,
    to_goal: GridWavefront,
    /// Direction of the newest turn in place, and where it was.
    turning: Option<(f64, [f64; 2])>,
    /// Least and largest velocity that it was made with.
    least_vel_x: f64,
    most_vel_x: f64,
}

/// Candidate: velocity and score, the lower the better.
#[derive(Clone, Copy, Debug)]
struct ScoredVelocity {
    velocity: PlanarVelocity,
    score: f64,
}

impl Dwa {
    /// Returns a planner.
    ///
    /// # Errors
    /// A parameter that no planner can have.
    pub fn new(parameters: DwaParameters, footprint: &Footprint) -> Result<Self, LocalPlanningError> {
        parameters.check()?;
        Ok(Self {
            parameters,
            footprint: FootprintPoints::new(footprint),
            path: PathWindow::default(),
            to_path: GridWavefront::default(),
            to_goal: GridWavefront::default(),
            turning: None,
            least_vel_x: parameters.min_vel_x,
            most_vel_x: parameters.max_vel_x,
        })
    }

    /// Sets the largest velocity forward, m/s.
    /// It is at most the one that this was made with; the least one is lowered with it.
    pub fn set_max_velocity(&mut self, max_vel_x: f64) {
        let most = math::clamp(max_vel_x, 0.0, self.most_vel_x);
        self.parameters.max_vel_x = most;
        self.parameters.min_vel_x = math::min(self.least_vel_x, most);
    }

    /// Returns the next velocity command.
    /// It is [`escape_vel`](DwaParameters::escape_vel) if no velocity is free; `None` if an argument is not a number or
    /// empty, the robot is not inside of the field, or the path does not enter it.
    pub fn plan(
        &mut self,
        robot: &MotionState,
        path: &[Point2],
        field: &ObstacleField,
    ) -> Option<PlanarVelocity> {
        let position = [robot.pose.x, robot.pose.y];
        let reach = field.side() as f64 * field.resolution();
        if !robot.is_finite()
            || !field.contains(position[0], position[1])
            || !self.path.update(path, position, field.center(), reach)
        {
            return None;
        }
        let robot = &self.within_limits(robot);
        self.footprint.fit(field.resolution());
        self.spread(field)?;
        self.forget_turn(position);
        let best = self.best(robot, field);
        let escape = PlanarVelocity { vx: self.parameters.escape_vel, ..PlanarVelocity::ZERO };
        let velocity = best.map_or(escape, |best| best.velocity);
        if velocity.vx == 0.0 && velocity.wz != 0.0 && self.turning.is_none() {
            self.turning = Some((velocity.wz.signum(), position));
        }
        Some(velocity)
    }

    /// Returns the state with its velocity clamped to a few times the limits.
    /// This bounds the points of a trajectory.
    fn within_limits(&self, robot: &MotionState) -> MotionState {
        let parameters = &self.parameters;
        let fastest = MOST_EXCESS * math::max(parameters.max_vel_x, parameters.escape_vel.abs());
        let turn = MOST_EXCESS * parameters.max_vel_theta;
        let PlanarVelocity { vx, vy, wz } = robot.velocity;
        let velocity =
            PlanarVelocity { vx: math::clamp(vx, -fastest, fastest), vy, wz: math::clamp(wz, -turn, turn) };
        MotionState { velocity, ..*robot }
    }

    /// Runs waves from the path and from its last point in the field.
    fn spread(&mut self, field: &ObstacleField) -> Option<()> {
        let side = field.side();
        let inscribed = f64::from(self.footprint.inscribed);
        let is_free = |cell: usize| field.cell_distance(cell) > inscribed;
        self.to_path.clear(side);
        self.to_goal.clear(side);
        let mut last = None;
        for at in 0..self.path.len() {
            let [x, y] = self.path.point(at);
            let Some(cell) = field.cell_of(x, y) else { break };
            self.to_path.seed(cell);
            last = Some(cell);
        }
        self.to_goal.seed(last?);
        self.to_path.run(side, is_free);
        self.to_goal.run(side, is_free);
        Some(())
    }

    fn forget_turn(&mut self, [x, y]: [f64; 2]) {
        let reset = self.parameters.oscillation_reset_dist;
        self.turning = self.turning.filter(|(_, at)| math::hypot(x - at[0], y - at[1]) < reset);
    }

    /// Tries all velocities of the window, then turns in place.
    fn best(&self, robot: &MotionState, field: &ObstacleField) -> Option<ScoredVelocity> {
        let parameters = &self.parameters;
        let period = 1.0 / parameters.controller_frequency;
        let PlanarVelocity { vx, wz, .. } = robot.velocity;
        let (up, turn) = (parameters.acc_lim_x * period, parameters.acc_lim_theta * period);
        let fastest = math::max(parameters.min_vel_x, math::min(parameters.max_vel_x, vx + up));
        let slowest = math::min(fastest, math::max(parameters.min_vel_x, vx - up));
        let left = math::max(-parameters.max_vel_theta, math::min(parameters.max_vel_theta, wz + turn));
        let right = math::min(parameters.max_vel_theta, math::max(-parameters.max_vel_theta, wz - turn));
        let forward =
            (0..parameters.vx_samples).map(|k| spread_over(slowest, fastest, k, parameters.vx_samples));
        let turns = || {
            (0..parameters.vtheta_samples)
                .map(|k| spread_over(right, left, k, parameters.vtheta_samples))
                .chain([0.0])
        };
        let mut best: Option<ScoredVelocity> = None;
        for vx in forward {
            for wz in turns() {
                let velocity = PlanarVelocity { vx, vy: 0.0, wz };
                let scored = self.score(robot, velocity, field);
                if let Some(score) = scored.filter(|score| best.is_none_or(|best| *score < best.score)) {
                    best = Some(ScoredVelocity { velocity, score });
                }
            }
        }
        self.best_turn(robot, field, best, turns())
    }

    /// Returns the turn in place that faces the local goal best.
    /// Only turns that cost no more than the best velocity count.
    fn best_turn(
        &self,
        robot: &MotionState,
        field: &ObstacleField,
        mut best: Option<ScoredVelocity>,
        turns: impl Iterator<Item = f64>,
    ) -> Option<ScoredVelocity> {
        let parameters = &self.parameters;
        let mut nearest = f64::INFINITY;
        for wz in turns.filter(|wz| self.may_turn(*wz)) {
            // A turn in place has at least this speed.
            let least = parameters.min_in_place_vel_theta;
            let wz = if wz > 0.0 { math::max(wz, least) } else { math::min(wz, -least) };
            let velocity = PlanarVelocity { vx: 0.0, vy: 0.0, wz };
            let Some(score) = self.score(robot, velocity, field) else { continue };
            let theta = robot.pose.theta + wz * parameters.sim_time;
            let ahead = parameters.heading_lookahead;
            let center = field.center();
            let x = robot.pose.x + ahead * math::cos(theta) - center[0];
            let y = robot.pose.y + ahead * math::sin(theta) - center[1];
            let steps = field.cell_of(x as f32, y as f32).and_then(|cell| self.to_goal.steps(cell));
            let distance = steps.map_or(f64::MAX, f64::from);
            if distance < nearest && best.is_none_or(|best| score <= best.score) {
                nearest = distance;
                best = Some(ScoredVelocity { velocity, score });
            }
        }
        best
    }

    fn may_turn(&self, wz: f64) -> bool {
        wz != 0.0 && self.turning.is_none_or(|(direction, _)| wz.signum() == direction)
    }

    /// Returns the score of a velocity.
    /// `None` if its trajectory collides or leads nowhere.
    fn score(&self, robot: &MotionState, velocity: PlanarVelocity, field: &ObstacleField) -> Option<f64> {
        let parameters = &self.parameters;
        let points = math::max(
            math::max(robot.velocity.vx.abs(), velocity.vx.abs()) * parameters.sim_time
                / parameters.sim_granularity,
            velocity.wz.abs() * parameters.sim_time / parameters.angular_sim_granularity,
        );
        let count = math::max(points + 0.5, 1.0) as usize;
        let seconds = parameters.sim_time / count as f64;
        let mut pose = robot.pose;
        let (mut vx, mut wz) = (robot.velocity.vx, robot.velocity.wz);
        let (up, turn) = (parameters.acc_lim_x * seconds, parameters.acc_lim_theta * seconds);
        let mut dearest = 0.0;
        for _ in 0..count {
            dearest = math::max(dearest, self.cost(&pose, field)?);
            vx = math::clamp(velocity.vx, vx - up, vx + up);
            wz = math::clamp(velocity.wz, wz - turn, wz + turn);
            pose.x += vx * seconds * math::cos(pose.theta);
            pose.y += vx * seconds * math::sin(pose.theta);
            pose.theta += wz * seconds;
        }
        dearest = math::max(dearest, self.cost(&pose, field)?);
        let center = field.center();
        let cell = field.cell_of((pose.x - center[0]) as f32, (pose.y - center[1]) as f32)?;
        let meters = |steps: u32| f64::from(steps) * field.resolution();
        Some(
            parameters.pdist_scale * meters(self.to_path.steps(cell)?)
                + parameters.gdist_scale * meters(self.to_goal.steps(cell)?)
                + parameters.occdist_scale * dearest,
        )
    }

    /// Returns the cost of a pose.
    /// 0 to 252, as of an inflation layer; `None` for a collision.
    fn cost(&self, pose: &Pose2, field: &ObstacleField) -> Option<f64> {
        let center = field.center();
        let at = [(pose.x - center[0]) as f32, (pose.y - center[1]) as f32];
        let lookup = field.lookup();
        let distance = lookup.distance(at[0], at[1]);
        let (inscribed, circumscribed) = (self.footprint.inscribed, self.footprint.circumscribed);
        // An obstacle's cell reaches half of its size around its middle.
        let touch = (0.5 * field.resolution()) as f32;
        // Cells beyond the field are unknown, so they count as occupied.
        if distance <= inscribed || !lookup.contains_circle(at, circumscribed) {
            return None;
        }
        if distance <= circumscribed + touch {
            let heading = [math::cos(pose.theta) as f32, math::sin(pose.theta) as f32];
            if self.footprint.clearance(&lookup, at, heading) <= touch {
                return None;
            }
        }
        if f64::from(distance) > self.parameters.inflation_radius {
            return Some(0.0);
        }
        let beyond = f64::from(distance - inscribed);
        Some(252.0 * math::exp(-self.parameters.cost_scaling_factor * beyond))
    }
}

/// Returns the k-th of values that are spread evenly over a range, with its ends.
fn spread_over(low: f64, high: f64, k: usize, count: usize) -> f64 {
    if count < 2 { high } else { low + (high - low) * k as f64 / (count - 1) as f64 }
}
