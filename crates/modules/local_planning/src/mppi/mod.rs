//! Model predictive path integral control.

mod critics;
mod parameters;
mod rollouts;
mod smoothing;

use slate_avoidance::Footprint;
use slate_interfaces::{Point2, Pose2};
use slate_module::{Random, math};

use crate::error::LocalPlanningError;
use crate::footprint_points::FootprintPoints;
use crate::obstacle_field::{FieldLookup, ObstacleField};
use crate::path_window::PathWindow;
use crate::velocity::{MotionModel, MotionState, PlanarVelocity};

use critics::{CriticScene, CriticSums};
use rollouts::{ControlNoise, ControlSequence, RolloutStart, Rollouts};

pub use parameters::{
    MppiCritics, MppiParameters, ObstaclesCritic, PathAlignCritic, PathAngleCritic, PathCritic,
};

/// Model predictive path integral control (Williams, Drews, Goldfain, Rehg and Theodorou, 2016, *Aggressive driving
/// with model predictive path integral control*) in Nav2's formulation.
///
/// Each call samples trajectories around the controls of the call before, judges them by [critics](MppiCritics), and
/// averages their controls by cost. Calls are [`model_dt`](MppiParameters::model_dt) apart. A call allocates nothing.
#[derive(Clone, Debug)]
pub struct Mppi {
    parameters: MppiParameters,
    footprint: FootprintPoints,
    mean: ControlSequence,
    noise: ControlNoise,
    rollouts: Rollouts,
    /// Trajectory of the mean controls.
    planned: Rollouts,
    sums: CriticSums,
    path: PathWindow,
    /// The four newest commands.
    earlier: [PlanarVelocity; 4],
    center: [f64; 2],
    /// Distance between outline and obstacle up to which they touch, m.
    touch: f32,
}

impl Mppi {
    /// Makes a controller; the same seed gives the same commands.
    ///
    /// # Errors
    /// A parameter that no controller can have.
    pub fn new(
        parameters: MppiParameters,
        footprint: &Footprint,
        mut random: Random,
    ) -> Result<Self, LocalPlanningError> {
        parameters.check()?;
        Ok(Self {
            footprint: FootprintPoints::new(footprint),
            mean: ControlSequence::new(parameters.time_steps),
            noise: ControlNoise::new(&parameters, &mut random),
            rollouts: Rollouts::new(&parameters, parameters.batch_size),
            planned: Rollouts::new(&parameters, 1),
            sums: CriticSums::new(parameters.batch_size),
            path: PathWindow::default(),
            earlier: [PlanarVelocity::ZERO; 4],
            center: [0.0, 0.0],
            touch: parameters.critics.obstacles.collision_distance as f32,
            parameters,
        })
    }

    /// Forgets the controls of earlier calls.
    pub fn reset(&mut self) {
        self.mean.fill(0.0);
        self.earlier = [PlanarVelocity::ZERO; 4];
    }

    /// Returns the velocity to command next; `None` if every trajectory collides, or an argument is no number or empty.
    ///
    /// `path` leads to the goal, in the frame of the robot's pose and of the field; `heading` is that at the goal, rad,
    /// `None` for any.
    pub fn plan(
        &mut self,
        robot: &MotionState,
        path: &[Point2],
        heading: Option<f64>,
        field: &ObstacleField,
    ) -> Option<PlanarVelocity> {
        self.center = field.center();
        let position = [robot.pose.x, robot.pose.y];
        if !robot.is_finite()
            || !self.path.update(path, position, self.center, self.parameters.prune_distance)
        {
            return None;
        }
        let start = RolloutStart::new(robot, self.center);
        let goal = path[path.len() - 1];
        let goal_distance = math::hypot(goal.x - position[0], goal.y - position[1]);
        let lookup = field.lookup();
        self.touch = self.touch_distance(&start, lookup);
        for attempt in 0..=self.parameters.retry_attempt_limit {
            if attempt > 0 {
                self.mean.fill(0.0);
            }
            for _ in 0..self.parameters.iteration_count {
                self.improve(&start, heading, goal_distance, lookup);
            }
            if !self.sums.all_collide() {
                return Some(self.command(&start, lookup));
            }
        }
        self.reset();
        None
    }

    /// Poses of the planned trajectory, a time step apart.
    pub fn trajectory(&self) -> impl Iterator<Item = Pose2> + '_ {
        (0..self.planned.steps).map(|step| Pose2 {
            x: self.center[0] + f64::from(self.planned.x[step]),
            y: self.center[1] + f64::from(self.planned.y[step]),
            theta: math::wrap_angle(f64::from(self.planned.yaw[step])),
        })
    }

    /// A robot that is already too near to an obstacle may move, but hardly nearer.
    fn touch_distance(&self, start: &RolloutStart, field: FieldLookup<'_>) -> f32 {
        let at = [start.x, start.y];
        let clearance = self.footprint.clearance(&field, at, [start.cosine, start.sine]);
        let touch = self.parameters.critics.obstacles.collision_distance as f32;
        crate::single::min(touch, clearance - 0.01)
    }

    /// Samples, judges and averages once.
    fn improve(
        &mut self,
        start: &RolloutStart,
        heading: Option<f64>,
        goal_distance: f64,
        field: FieldLookup<'_>,
    ) {
        self.noise.next_set();
        self.rollouts.run(start, &self.mean, Some(&self.noise));
        let scene = CriticScene {
            parameters: &self.parameters,
            rollouts: &self.rollouts,
            field,
            footprint: &self.footprint,
            path: &self.path,
            heading: heading.map(|heading| heading as f32),
            goal_distance,
            robot: ([start.x, start.y], start.yaw),
            touch: self.touch,
        };
        self.sums.judge(&scene);
        self.add_control_costs();
        if !self.sums.all_collide() {
            self.average();
        }
    }

    /// Costs of controls away from the mean (Williams et al., 2016, equation 34).
    fn add_control_costs(&mut self) {
        let Self { parameters, mean, rollouts, sums, .. } = self;
        let weight = |stddev: f64| (parameters.gamma / (stddev * stddev)) as f32;
        let batch = rollouts.batch;
        let parts = [
            (&mean.vx, &rollouts.vx, weight(parameters.vx_std)),
            (&mean.wz, &rollouts.wz, weight(parameters.wz_std)),
            (&mean.vy, &rollouts.vy, weight(parameters.vy_std)),
        ];
        for (mean, sampled, weight) in parts {
            for (mean, row) in mean.iter().zip(sampled.chunks_exact(batch)) {
                for (cost, control) in sums.costs.iter_mut().zip(row) {
                    *cost += weight * mean * (control - mean);
                }
            }
        }
    }

    /// Replaces the mean controls by the average of the sampled ones, weighted by their costs.
    fn average(&mut self) {
        let Self { parameters, mean, rollouts, sums, .. } = self;
        let least = sums.costs.iter().fold(f32::INFINITY, |least, cost| crate::single::min(least, *cost));
        let mut total = 0.0_f32;
        for cost in &mut sums.costs {
            let excess = f64::from(*cost - least) / parameters.temperature;
            // Beyond, a weight is nothing beside the best one's.
            *cost = if excess < 30.0 { math::exp(-excess) as f32 } else { 0.0 };
            total += *cost;
        }
        let batch = rollouts.batch;
        let parts =
            [(&mut mean.vx, &rollouts.vx), (&mut mean.wz, &rollouts.wz), (&mut mean.vy, &rollouts.vy)];
        for (mean, sampled) in parts {
            for (mean, row) in mean.iter_mut().zip(sampled.chunks_exact(batch)) {
                // In lanes, so that the sum has one order and still is fast.
                let mut lanes = [0.0_f32; 8];
                for (weights, controls) in sums.costs.chunks(8).zip(row.chunks(8)) {
                    for ((lane, weight), control) in lanes.iter_mut().zip(weights).zip(controls) {
                        *lane += weight * control;
                    }
                }
                *mean = lanes.iter().sum::<f32>() / total;
            }
        }
    }

    /// Smooths the mean controls, and takes the first; if their trajectory collides, those of the cheapest one.
    fn command(&mut self, start: &RolloutStart, field: FieldLookup<'_>) -> PlanarVelocity {
        self.smooth();
        self.planned.run(start, &self.mean, None);
        if self.planned_collides(field) {
            self.take_cheapest();
            self.planned.run(start, &self.mean, None);
        }
        let first = |part: &[f32]| part.first().map_or(0.0, |value| f64::from(*value));
        let velocity = PlanarVelocity {
            vx: first(&self.planned.vx),
            vy: first(&self.planned.vy),
            wz: first(&self.planned.wz),
        };
        self.earlier.rotate_left(1);
        self.earlier[3] = velocity;
        self.mean.vx.copy_from_slice(&self.planned.vx);
        self.mean.wz.copy_from_slice(&self.planned.wz);
        if self.parameters.motion_model == MotionModel::Omni {
            self.mean.vy.copy_from_slice(&self.planned.vy);
        }
        self.mean.shift();
        velocity
    }

    fn smooth(&mut self) {
        let earlier = |part: fn(&PlanarVelocity) -> f64| self.earlier.each_ref().map(|v| part(v) as f32);
        let (vx, vy, wz) = (earlier(|v| v.vx), earlier(|v| v.vy), earlier(|v| v.wz));
        smoothing::smooth(&mut self.mean.vx, &vx);
        smoothing::smooth(&mut self.mean.vy, &vy);
        smoothing::smooth(&mut self.mean.wz, &wz);
    }

    fn planned_collides(&self, field: FieldLookup<'_>) -> bool {
        let planned = &self.planned;
        let touch = self.touch;
        (0..planned.steps).any(|step| {
            let at = [planned.x[step], planned.y[step]];
            let distance = field.distance(at[0], at[1]);
            let heading = [planned.cosine[step], planned.sine[step]];
            distance <= self.footprint.circumscribed + touch
                && (distance <= self.footprint.inscribed
                    || self.footprint.clearance(&field, at, heading) <= touch)
        })
    }

    fn take_cheapest(&mut self) {
        let Self { mean, rollouts, sums, .. } = self;
        // Costs have become weights.
        let weights = sums.costs.iter().enumerate();
        let best =
            weights.fold((0, 0.0), |best, (k, weight)| if *weight > best.1 { (k, *weight) } else { best });
        let parts =
            [(&mut mean.vx, &rollouts.vx), (&mut mean.wz, &rollouts.wz), (&mut mean.vy, &rollouts.vy)];
        for (mean, sampled) in parts {
            for (mean, row) in mean.iter_mut().zip(sampled.chunks_exact(rollouts.batch)) {
                *mean = row[best.0];
            }
        }
    }
}
