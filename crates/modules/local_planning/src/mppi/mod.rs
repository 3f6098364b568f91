//! Model predictive path integral control.

mod critics;
mod memory;
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

pub use memory::MppiMemory;
pub use parameters::{
    MppiCritics, MppiParameters, ObstaclesCritic, PathAlignCritic, PathAngleCritic, PathCritic,
};

/// Model predictive path integral control in Nav2's formulation.
/// Williams, Drews, Goldfain, Rehg and Theodorou, 2016, *Aggressive driving with model predictive path integral
/// control*.
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
    /// Newest four commands.
    earlier: [PlanarVelocity; 4],
    center: [f64; 2],
    /// Distance between outline and obstacle up to which they touch, m.
    touch: f32,
}

impl Mppi {
    /// Returns a controller; the same seed gives the same commands.
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

    /// Returns the next velocity command.
    /// `None` if every trajectory collides or leaves the field, if the robot is not inside of the field, or an argument
    /// is not a number or empty.
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
            || heading.is_some_and(|heading| !heading.is_finite())
            || !field.contains(position[0], position[1])
            || !self.path.update(path, position, self.center, self.parameters.prune_distance)
        {
            return None;
        }
        let limits = &self.parameters.limits;
        let start = RolloutStart::new(robot, self.center).within(limits, self.parameters.model_dt);
        let goal = path[path.len() - 1];
        let goal_distance = math::hypot(goal.x - position[0], goal.y - position[1]);
        let lookup = field.lookup();
        self.footprint.fit(field.resolution());
        // A robot that already touches an obstacle may leave it.
        self.footprint.allow(&lookup, [start.x, start.y], [start.cosine, start.sine], self.touch);
        for attempt in 0..=self.parameters.retry_attempt_limit {
            if attempt > 0 {
                self.mean.fill(0.0);
            }
            for _ in 0..self.parameters.iteration_count {
                if !self.improve(&start, heading, goal_distance, lookup) {
                    self.reset();
                    return None;
                }
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

    /// Returns weight and positions of a sampled trajectory of the newest success.
    /// That is the newest call that found a velocity; positions are a time step apart.
    ///
    /// The best one has 1; those that collide have 0. There are [`batch_size`](MppiParameters::batch_size) of them.
    pub fn sampled(&self, trajectory: usize) -> (f64, impl Iterator<Item = [f64; 2]> + '_) {
        let Rollouts { batch, x, y, .. } = &self.rollouts;
        // Costs have become weights.
        let weight = self.sums.costs.get(trajectory).map_or(0.0, |weight| f64::from(*weight));
        let positions = x.iter().zip(y).skip(trajectory).step_by(*batch);
        (weight, positions.map(|(x, y)| [self.center[0] + f64::from(*x), self.center[1] + f64::from(*y)]))
    }

    /// Samples, judges and averages once; returns false if the costs are not numbers.
    fn improve(
        &mut self,
        start: &RolloutStart,
        heading: Option<f64>,
        goal_distance: f64,
        field: FieldLookup<'_>,
    ) -> bool {
        self.noise.next_set();
        self.rollouts.run(start, &self.mean, Some(&self.noise));
        let scene = CriticScene {
            parameters: &self.parameters,
            rollouts: &self.rollouts,
            field,
            footprint: &self.footprint,
            path: &self.path,
            heading: heading.map(|heading| math::wrap_angle(heading) as f32),
            goal_distance,
            robot: ([start.x, start.y], start.yaw),
            touch: self.touch,
        };
        self.sums.judge(&scene);
        self.add_control_costs();
        self.sums.all_collide() || self.average()
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

    /// Replaces the mean controls by the cost-weighted average of the samples.
    /// Returns false, and leaves them, if the weights are not numbers.
    fn average(&mut self) -> bool {
        let Self { parameters, mean, rollouts, sums, .. } = self;
        let least = sums.costs.iter().fold(f32::INFINITY, |least, cost| crate::single::min(least, *cost));
        let mut total = 0.0_f32;
        for cost in &mut sums.costs {
            let excess = f64::from(*cost - least) / parameters.temperature;
            // Beyond, a weight is nothing beside the best one's.
            *cost = if excess < 30.0 { math::exp(-excess) as f32 } else { 0.0 };
            total += *cost;
        }
        // Costs that overflow leave no weight.
        if !(total.is_finite() && total > 0.0) {
            return false;
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
        true
    }

    /// Smooths the mean controls, and returns the first.
    /// If their trajectory collides, it returns that of the cheapest one.
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
            !field.contains_circle(at, self.footprint.circumscribed)
                || distance <= self.footprint.circumscribed + touch
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
