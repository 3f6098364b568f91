//! Parameters of the controller, with the names and defaults of Nav2.

use crate::error::LocalPlanningError;
use crate::velocity::{MotionLimits, MotionModel};

/// Parameters of [`Mppi`](crate::Mppi).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MppiParameters {
    /// Steps of a trajectory, `time_steps`.
    pub time_steps: usize,
    /// Time of a step, which is also that between two calls, `model_dt`, s.
    pub model_dt: f64,
    /// Number of sampled trajectories, `batch_size`.
    pub batch_size: usize,
    /// Number of optimization iterations per call, `iteration_count`.
    pub iteration_count: usize,
    /// Standard deviation of the sampled velocity forward, `vx_std`, m/s.
    pub vx_std: f64,
    /// Standard deviation of the sampled velocity to the left, `vy_std`, m/s.
    pub vy_std: f64,
    /// Standard deviation of the sampled angular velocity, `wz_std`, rad/s.
    pub wz_std: f64,
    /// Temperature of the softmax weights, `temperature`.
    /// The lower, the less costly trajectories count.
    pub temperature: f64,
    /// Weight of the controls' change, `gamma`.
    pub gamma: f64,
    /// Number of retries when all trajectories collide, `retry_attempt_limit`.
    pub retry_attempt_limit: usize,
    /// Length of the path ahead that is followed, `prune_distance`, m.
    pub prune_distance: f64,
    /// Motion model.
    pub motion_model: MotionModel,
    /// Limits of velocities and accelerations, `vx_max` and so on.
    pub limits: MotionLimits,
    /// Critics that score a trajectory.
    pub critics: MppiCritics,
}

impl Default for MppiParameters {
    fn default() -> Self {
        Self {
            time_steps: 56,
            model_dt: 0.05,
            batch_size: 1_000,
            iteration_count: 1,
            vx_std: 0.2,
            vy_std: 0.2,
            wz_std: 0.4,
            temperature: 0.3,
            gamma: 0.015,
            retry_attempt_limit: 1,
            prune_distance: 1.7,
            motion_model: MotionModel::default(),
            limits: MotionLimits::default(),
            critics: MppiCritics::default(),
        }
    }
}

/// Critics of [`Mppi`](crate::Mppi), as in Nav2; one with `cost_weight` 0 is off.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MppiCritics {
    /// `ConstraintCritic`: weight of velocities beyond the limits.
    pub constraint: f64,
    /// `ObstaclesCritic`.
    pub obstacles: ObstaclesCritic,
    /// `GoalCritic`: distance to the goal, once it is near.
    pub goal: PathCritic,
    /// `GoalAngleCritic`: heading at the goal.
    pub goal_angle: PathCritic,
    /// `PathAlignCritic`: distance from the path.
    pub path_align: PathAlignCritic,
    /// `PathFollowCritic`: progress along the path.
    pub path_follow: PathCritic,
    /// `PathAngleCritic`: heading away from the path.
    pub path_angle: PathAngleCritic,
    /// `PreferForwardCritic`: driving backwards.
    pub prefer_forward: PathCritic,
    /// `TwirlingCritic`: turns of an omnidirectional robot.
    pub twirling: f64,
}

impl Default for MppiCritics {
    fn default() -> Self {
        let critic = |cost_weight, threshold_to_consider, offset_from_furthest| PathCritic {
            cost_weight,
            threshold_to_consider,
            offset_from_furthest,
        };
        Self {
            constraint: 4.0,
            obstacles: ObstaclesCritic::default(),
            goal: critic(5.0, 1.4, 0),
            goal_angle: critic(3.0, 0.5, 0),
            path_align: PathAlignCritic::default(),
            path_follow: critic(5.0, 1.4, 6),
            path_angle: PathAngleCritic {
                cost_weight: 2.0,
                threshold_to_consider: 0.5,
                offset_from_furthest: 4,
                max_angle_to_furthest: 1.0,
            },
            prefer_forward: critic(5.0, 0.5, 0),
            twirling: 10.0,
        }
    }
}

/// Critic that counts by the distance to the goal.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PathCritic {
    /// `cost_weight`.
    pub cost_weight: f64,
    /// Distance to the goal that enables a critic, `threshold_to_consider`, m.
    /// A critic of the goal counts up to it, one of the path from it on.
    pub threshold_to_consider: f64,
    /// Offset beyond the furthest path point reached, `offset_from_furthest`.
    /// Points of the path, 5 cm apart.
    pub offset_from_furthest: usize,
}

/// Distance of trajectories from the path.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PathAlignCritic {
    /// `cost_weight`.
    pub cost_weight: f64,
    /// Distance to the goal from which it counts, `threshold_to_consider`, m.
    pub threshold_to_consider: f64,
    /// Path points that trajectories must reach, `offset_from_furthest`.
    /// Points are 5 cm apart; below that number the critic does not count.
    pub offset_from_furthest: usize,
    /// Steps between the points of a trajectory that count, `trajectory_point_step`.
    pub trajectory_point_step: usize,
    /// Share of the path in obstacles that disables it, `max_path_occupancy_ratio`.
    pub max_path_occupancy_ratio: f64,
}

impl Default for PathAlignCritic {
    fn default() -> Self {
        Self {
            cost_weight: 10.0,
            threshold_to_consider: 0.5,
            offset_from_furthest: 20,
            trajectory_point_step: 4,
            max_path_occupancy_ratio: 0.07,
        }
    }
}

/// Heading of trajectories relative to the path.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PathAngleCritic {
    /// `cost_weight`.
    pub cost_weight: f64,
    /// Distance to the goal from which it counts, `threshold_to_consider`, m.
    pub threshold_to_consider: f64,
    /// Offset beyond the furthest path point reached, `offset_from_furthest`.
    /// Points of the path, 5 cm apart.
    pub offset_from_furthest: usize,
    /// Angle between heading and path that enables it, `max_angle_to_furthest`, rad.
    pub max_angle_to_furthest: f64,
}

/// Nearness of trajectories to obstacles.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ObstaclesCritic {
    /// Weight of nearness within `inflation_radius`, `repulsion_weight`.
    pub repulsion_weight: f64,
    /// Weight of nearness within `collision_margin_distance`, `critical_weight`.
    pub critical_weight: f64,
    /// Cost of a collision, `collision_cost`.
    pub collision_cost: f64,
    /// Clearance below which a pose is too near, `collision_margin_distance`, m.
    /// The distance between footprint and obstacle.
    pub collision_margin_distance: f64,
    /// Distance between footprint and obstacle that counts as contact, m.
    /// It is above 0, as the field is not exact.
    pub collision_distance: f64,
    /// Range beyond the inscribed circle of repulsion, `inflation_radius`, m.
    /// Distance from the robot's inscribed circle up to which an obstacle repels.
    pub inflation_radius: f64,
    /// Goal distance below which obstacles do not repel, `near_goal_distance`, m.
    pub near_goal_distance: f64,
}

impl Default for ObstaclesCritic {
    fn default() -> Self {
        Self {
            repulsion_weight: 1.5,
            critical_weight: 20.0,
            collision_cost: 100_000.0,
            collision_margin_distance: 0.1,
            collision_distance: 0.03,
            inflation_radius: 0.55,
            near_goal_distance: 0.5,
        }
    }
}

impl MppiParameters {
    pub(crate) fn check(&self) -> Result<(), LocalPlanningError> {
        self.motion_model.check()?;
        self.limits.check()?;
        LocalPlanningError::unless((2..=1_000).contains(&self.time_steps), "time_steps", "2 to 1000")?;
        LocalPlanningError::unless((1..=100_000).contains(&self.batch_size), "batch_size", "1 to 100000")?;
        let is_iterable = (1..=100).contains(&self.iteration_count);
        LocalPlanningError::unless(is_iterable, "iteration_count", "1 to 100")?;
        LocalPlanningError::unless(self.retry_attempt_limit <= 100, "retry_attempt_limit", "0 to 100")?;
        LocalPlanningError::unless_positive(&[
            ("model_dt", self.model_dt),
            ("vx_std", self.vx_std),
            ("vy_std", self.vy_std),
            ("wz_std", self.wz_std),
            ("temperature", self.temperature),
            ("prune_distance", self.prune_distance),
        ])?;
        LocalPlanningError::unless_magnitudes(&[("gamma", self.gamma)])?;
        // Turns of a step are polynomials, which are exact enough up to there.
        let turn = self.model_dt * self.limits.wz_max;
        LocalPlanningError::unless(turn <= 1.0, "model_dt", "at most a turn of 1 rad at `wz_max`")?;
        LocalPlanningError::unless(self.prune_distance <= 100.0, "prune_distance", "at most 100 m")?;
        self.critics.check()
    }
}

impl MppiCritics {
    fn check(&self) -> Result<(), LocalPlanningError> {
        let ObstaclesCritic {
            repulsion_weight,
            critical_weight,
            collision_cost,
            collision_margin_distance,
            collision_distance,
            inflation_radius,
            near_goal_distance,
        } = self.obstacles;
        LocalPlanningError::unless_magnitudes(&[
            ("repulsion_weight", repulsion_weight),
            ("critical_weight", critical_weight),
            ("collision_cost", collision_cost),
            ("collision_margin_distance", collision_margin_distance),
            ("collision_distance", collision_distance),
            ("inflation_radius", inflation_radius),
            ("near_goal_distance", near_goal_distance),
            ("constraint", self.constraint),
            ("twirling", self.twirling),
            ("path_align.cost_weight", self.path_align.cost_weight),
            ("path_align.threshold_to_consider", self.path_align.threshold_to_consider),
            ("path_align.max_path_occupancy_ratio", self.path_align.max_path_occupancy_ratio),
            ("path_angle.cost_weight", self.path_angle.cost_weight),
            ("path_angle.threshold_to_consider", self.path_angle.threshold_to_consider),
            ("path_angle.max_angle_to_furthest", self.path_angle.max_angle_to_furthest),
        ])?;
        for critic in [self.goal, self.goal_angle, self.path_follow, self.prefer_forward] {
            LocalPlanningError::unless_magnitudes(&[
                ("cost_weight", critic.cost_weight),
                ("threshold_to_consider", critic.threshold_to_consider),
            ])?;
        }
        let step = self.path_align.trajectory_point_step;
        LocalPlanningError::unless(step > 0, "trajectory_point_step", "a number above 0")
    }
}
