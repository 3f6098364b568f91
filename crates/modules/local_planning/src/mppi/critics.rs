//! Costs of trajectories.

use super::parameters::{MppiCritics, MppiParameters};
use super::rollouts::Rollouts;
use crate::footprint_points::FootprintPoints;
use crate::obstacle_field::FieldLookup;
use crate::path_window::{PathWindow, SPACING};
use crate::single::{max, wrap_angle};
use crate::velocity::MotionModel;

/// Scene in which critics score trajectories.
pub(crate) struct CriticScene<'a> {
    pub parameters: &'a MppiParameters,
    pub rollouts: &'a Rollouts,
    pub field: FieldLookup<'a>,
    pub footprint: &'a FootprintPoints,
    pub path: &'a PathWindow,
    /// Heading at the goal, rad; `None` for any.
    pub heading: Option<f32>,
    /// Distance of the robot to the goal, m.
    pub goal_distance: f64,
    /// Position, relative to the middle of the field, and heading of the robot.
    pub robot: ([f32; 2], f32),
    /// Distance between outline and obstacle up to which they touch, m.
    pub touch: f32,
}

/// Sums of each trajectory, used again.
#[derive(Clone, Debug, Default)]
pub(crate) struct CriticSums {
    /// Costs.
    pub costs: Vec<f32>,
    /// Distance driven, and sum of a critic.
    driven: Vec<f32>,
    sums: Vec<f32>,
    critical: Vec<f32>,
    repulsive: Vec<f32>,
    /// Collision of each trajectory; true if it collides.
    pub collides: Vec<bool>,
}

impl CriticSums {
    pub fn new(batch: usize) -> Self {
        let sums = || vec![0.0; batch];
        Self {
            costs: sums(),
            driven: sums(),
            sums: sums(),
            critical: sums(),
            repulsive: sums(),
            collides: vec![false; batch],
        }
    }

    /// Returns true if all trajectories collide.
    pub fn all_collide(&self) -> bool {
        self.collides.iter().all(|collides| *collides)
    }

    /// Computes the costs of all trajectories.
    pub fn judge(&mut self, scene: &CriticScene<'_>) {
        self.costs.fill(0.0);
        self.obstacles(scene);
        self.constraint(scene);
        let critics = &scene.parameters.critics;
        let is_near = |threshold: f64| scene.goal_distance <= threshold;
        if is_near(critics.goal.threshold_to_consider) {
            self.goal(scene);
        }
        if is_near(critics.goal_angle.threshold_to_consider) {
            self.goal_angle(scene);
        }
        if !is_near(critics.prefer_forward.threshold_to_consider) {
            self.prefer_forward(scene);
        }
        if scene.parameters.motion_model == MotionModel::Omni {
            self.twirling(scene);
        }
        self.path(scene, critics, is_near);
    }

    /// Returns the critics of the path.
    fn path(&mut self, scene: &CriticScene<'_>, critics: &MppiCritics, is_near: impl Fn(f64) -> bool) {
        let furthest = furthest_reached(scene);
        if !is_near(critics.path_align.threshold_to_consider) {
            self.path_align(scene, furthest);
        }
        if !is_near(critics.path_follow.threshold_to_consider) {
            self.path_follow(scene, furthest);
        }
        if !is_near(critics.path_angle.threshold_to_consider) {
            self.path_angle(scene, furthest);
        }
    }

    /// Adds the cost of nearness to obstacles.
    /// The inscribed circle is checked first, then the outline where it is near enough to matter.
    fn obstacles(&mut self, scene: &CriticScene<'_>) {
        let critic = &scene.parameters.critics.obstacles;
        let (rollouts, footprint) = (scene.rollouts, scene.footprint);
        let batch = rollouts.batch;
        let margin = critic.collision_margin_distance as f32;
        let touch = scene.touch;
        let inflation = critic.inflation_radius as f32 + footprint.inscribed;
        let outline = footprint.circumscribed + max(margin, touch);
        self.critical.fill(0.0);
        self.repulsive.fill(0.0);
        self.collides.fill(false);
        for step in 0..rollouts.steps {
            let row = step * batch;
            for k in 0..batch {
                if self.collides[k] {
                    continue;
                }
                let at = [rollouts.x[row + k], rollouts.y[row + k]];
                // Cells beyond the field are unknown, so they count as occupied.
                if !scene.field.contains_circle(at, footprint.circumscribed) {
                    self.collides[k] = true;
                    continue;
                }
                let distance = scene.field.distance(at[0], at[1]);
                if distance >= inflation {
                    continue;
                }
                self.repulsive[k] += inflation - distance;
                if distance < outline {
                    let heading = [rollouts.cosine[row + k], rollouts.sine[row + k]];
                    let clearance = match distance > footprint.inscribed {
                        true => footprint.clearance(&scene.field, at, heading),
                        // Deep inside, whatever the field's errors.
                        false => -1.0,
                    };
                    self.collides[k] = clearance <= touch;
                    self.critical[k] += max(0.0, margin - clearance);
                }
            }
        }
        let is_near = scene.goal_distance < critic.near_goal_distance;
        let repulsion = if is_near { 0.0 } else { critic.repulsion_weight as f32 / rollouts.steps as f32 };
        let (critical, collision) = (critic.critical_weight as f32, critic.collision_cost as f32);
        for k in 0..batch {
            let cost = if self.collides[k] { collision } else { critical * self.critical[k] };
            self.costs[k] += cost + repulsion * self.repulsive[k];
        }
    }

    /// Adds the cost of velocities beyond the limits.
    /// Those of an omnidirectional robot count together; a present speed that the limits no longer allow counts with
    /// its excess.
    fn constraint(&mut self, scene: &CriticScene<'_>) {
        let (rollouts, limits) = (scene.rollouts, &scene.parameters.limits);
        let weight = (scene.parameters.critics.constraint * scene.parameters.model_dt) as f32;
        let (fastest, slowest) = (limits.vx_max as f32, limits.vx_min as f32);
        for row in (0..rollouts.steps).map(|step| step * rollouts.batch) {
            for k in 0..rollouts.batch {
                let vx = rollouts.vx[row + k];
                let speed = match rollouts.vy.get(row + k) {
                    Some(vy) if vx > 0.0 => (vx * vx + vy * vy).sqrt(),
                    Some(vy) => -(vx * vx + vy * vy).sqrt(),
                    None => vx,
                };
                self.costs[k] += weight * (max(0.0, speed - fastest) + max(0.0, slowest - speed));
            }
        }
    }

    fn goal(&mut self, scene: &CriticScene<'_>) {
        let rollouts = scene.rollouts;
        let weight = scene.parameters.critics.goal.cost_weight as f32 / rollouts.steps as f32;
        let [goal_x, goal_y] = scene.path.goal;
        for row in (0..rollouts.steps).map(|step| step * rollouts.batch) {
            for k in 0..rollouts.batch {
                let (across, up) = (rollouts.x[row + k] - goal_x, rollouts.y[row + k] - goal_y);
                self.costs[k] += weight * (across * across + up * up).sqrt();
            }
        }
    }

    fn goal_angle(&mut self, scene: &CriticScene<'_>) {
        let Some(heading) = scene.heading else { return };
        let rollouts = scene.rollouts;
        let weight = scene.parameters.critics.goal_angle.cost_weight as f32 / rollouts.steps as f32;
        for row in (0..rollouts.steps).map(|step| step * rollouts.batch) {
            for k in 0..rollouts.batch {
                self.costs[k] += weight * wrap_angle(rollouts.yaw[row + k] - heading).abs();
            }
        }
    }

    fn prefer_forward(&mut self, scene: &CriticScene<'_>) {
        let rollouts = scene.rollouts;
        let critic = &scene.parameters.critics.prefer_forward;
        let weight = (critic.cost_weight * scene.parameters.model_dt) as f32;
        for row in (0..rollouts.steps).map(|step| step * rollouts.batch) {
            for k in 0..rollouts.batch {
                self.costs[k] += weight * max(0.0, -rollouts.vx[row + k]);
            }
        }
    }

    fn twirling(&mut self, scene: &CriticScene<'_>) {
        let rollouts = scene.rollouts;
        let weight = scene.parameters.critics.twirling as f32 / rollouts.steps as f32;
        for row in (0..rollouts.steps).map(|step| step * rollouts.batch) {
            for k in 0..rollouts.batch {
                self.costs[k] += weight * rollouts.wz[row + k].abs();
            }
        }
    }

    /// Adds the distance to the path point at the trajectory's driven length.
    fn path_align(&mut self, scene: &CriticScene<'_>, furthest: usize) {
        let critic = &scene.parameters.critics.path_align;
        if furthest < critic.offset_from_furthest || is_occupied(scene, furthest) {
            return;
        }
        let (rollouts, path) = (scene.rollouts, scene.path);
        let batch = rollouts.batch;
        self.driven.fill(0.0);
        self.sums.fill(0.0);
        let (start_x, start_y) = (scene.robot.0[0], scene.robot.0[1]);
        let mut before: Option<usize> = None;
        let per_point = (1.0 / SPACING) as f32;
        let last = path.len() - 1;
        let mut count = 0;
        for row in (0..rollouts.steps).step_by(critic.trajectory_point_step).map(|step| step * batch) {
            for k in 0..batch {
                let (x, y) = (rollouts.x[row + k], rollouts.y[row + k]);
                let (from_x, from_y) = match before {
                    Some(before) => (rollouts.x[before + k], rollouts.y[before + k]),
                    None => (start_x, start_y),
                };
                let (across, up) = (x - from_x, y - from_y);
                self.driven[k] += (across * across + up * up).sqrt();
                let at = ((self.driven[k] * per_point) as usize).min(last);
                let (across, up) = (x - path.x[at], y - path.y[at]);
                self.sums[k] += (across * across + up * up).sqrt();
            }
            before = Some(row);
            count += 1;
        }
        let weight = critic.cost_weight as f32 / count as f32;
        self.costs.iter_mut().zip(&self.sums).for_each(|(cost, sum)| *cost += weight * sum);
    }

    /// Adds the distance of the trajectory's end to a path point beyond all ends.
    fn path_follow(&mut self, scene: &CriticScene<'_>, furthest: usize) {
        let critic = &scene.parameters.critics.path_follow;
        let (rollouts, path) = (scene.rollouts, scene.path);
        let last = path.len() - 1;
        let mut target = (furthest + critic.offset_from_furthest).min(last);
        // A point in an obstacle is no place to strive for.
        while target < last && is_blocked(scene, target) {
            target += 1;
        }
        let [x, y] = path.point(target);
        let row = (rollouts.steps - 1) * rollouts.batch;
        let weight = critic.cost_weight as f32;
        for k in 0..rollouts.batch {
            let (across, up) = (rollouts.x[row + k] - x, rollouts.y[row + k] - y);
            self.costs[k] += weight * (across * across + up * up).sqrt();
        }
    }

    /// Adds the angle between the trajectory's last heading and a path point.
    /// It counts while the robot heads elsewhere.
    fn path_angle(&mut self, scene: &CriticScene<'_>, furthest: usize) {
        let critic = &scene.parameters.critics.path_angle;
        let (rollouts, path) = (scene.rollouts, scene.path);
        let target = path.point((furthest + critic.offset_from_furthest).min(path.len() - 1));
        let ([x, y], yaw) = scene.robot;
        let direction = bearing(target[1] - y, target[0] - x);
        if wrap_angle(direction - yaw).abs() < critic.max_angle_to_furthest as f32 {
            return;
        }
        let row = (rollouts.steps - 1) * rollouts.batch;
        let weight = critic.cost_weight as f32;
        for k in row..row + rollouts.batch {
            let direction = bearing(target[1] - rollouts.y[k], target[0] - rollouts.x[k]);
            self.costs[k - row] += weight * wrap_angle(direction - rollouts.yaw[k]).abs();
        }
    }
}

fn bearing(up: f32, across: f32) -> f32 {
    slate_module::math::atan2(f64::from(up), f64::from(across)) as f32
}

/// Returns true if the robot's middle can't be at a point of the path.
fn is_blocked(scene: &CriticScene<'_>, at: usize) -> bool {
    let [x, y] = scene.path.point(at);
    scene.field.distance(x, y) <= scene.footprint.inscribed
}

/// Returns true if too many path points, up to `furthest`, are in obstacles.
fn is_occupied(scene: &CriticScene<'_>, furthest: usize) -> bool {
    let critic = &scene.parameters.critics.path_align;
    let blocked = (0..furthest).filter(|at| is_blocked(scene, *at)).count();
    blocked as f64 > critic.max_path_occupancy_ratio * furthest as f64
}

/// Returns the index of the furthest path point reached by a trajectory.
/// The point is the nearest one to the trajectory's end.
fn furthest_reached(scene: &CriticScene<'_>) -> usize {
    let (rollouts, path) = (scene.rollouts, scene.path);
    let row = (rollouts.steps - 1) * rollouts.batch;
    let mut furthest = 0;
    for k in row..row + rollouts.batch {
        let (x, y) = (rollouts.x[k], rollouts.y[k]);
        let square = |at: usize| {
            let (across, up) = (path.x[at] - x, path.y[at] - y);
            across * across + up * up
        };
        // Only a point beyond the furthest one matters.
        let mut least = (0..=furthest).fold(f32::INFINITY, |least, at| crate::single::min(least, square(at)));
        for at in furthest + 1..path.len() {
            let square = square(at);
            if square < least {
                (least, furthest) = (square, at);
            }
        }
    }
    furthest
}
