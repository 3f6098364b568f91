//! Vector field histogram.

mod certainty_grid;

use std::f64::consts::{PI, TAU};

use slate_interfaces::{Point2, Pose2};
use slate_module::math;

use crate::error::LocalPlanningError;
use crate::velocity::{MotionState, PlanarVelocity};

pub use certainty_grid::CertaintyGrid;

/// Parameters of [`VfhPlus`], with the defaults of its paper if it has them.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct VfhPlusParameters {
    /// Sectors of the histogram.
    pub sectors: usize,
    /// Radius of the robot, m.
    pub robot_radius: f64,
    /// Distance that it keeps from obstacles, m.
    pub safety_distance: f64,
    /// Distance up to which cells count, m.
    pub active_radius: f64,
    /// Density of a sector below which it becomes free.
    pub threshold_low: f64,
    /// Density of a sector above which it becomes blocked.
    pub threshold_high: f64,
    /// Sectors from which an opening is wide.
    pub wide_opening: usize,
    /// Radius of the sharpest turn at the largest velocity, m.
    /// It falls with the velocity.
    pub minimum_turning_radius: f64,
    /// Weight of the angle to the target.
    pub target_weight: f64,
    /// Weight of the angle to the heading.
    pub heading_weight: f64,
    /// Weight of the angle to the direction chosen before.
    pub previous_weight: f64,
    /// Largest velocity, m/s.
    pub max_linear_velocity: f64,
    /// Largest angular velocity, rad/s.
    pub max_angular_velocity: f64,
    /// Angular velocity per angle to the chosen direction, 1/s.
    pub heading_gain: f64,
}

impl Default for VfhPlusParameters {
    fn default() -> Self {
        Self {
            sectors: 72,
            robot_radius: 0.26,
            safety_distance: 0.1,
            active_radius: 1.8,
            threshold_low: 0.6,
            threshold_high: 1.2,
            wide_opening: 16,
            minimum_turning_radius: 0.15,
            target_weight: 5.0,
            heading_weight: 2.0,
            previous_weight: 2.0,
            max_linear_velocity: 0.4,
            max_angular_velocity: 1.5,
            heading_gain: 2.0,
        }
    }
}

impl VfhPlusParameters {
    fn check(&self) -> Result<(), LocalPlanningError> {
        LocalPlanningError::unless((8..=720).contains(&self.sectors), "sectors", "8 to 720")?;
        let is_wide = (2..=self.sectors).contains(&self.wide_opening);
        LocalPlanningError::unless(is_wide, "wide_opening", "2 to `sectors`")?;
        LocalPlanningError::unless_positive(&[
            ("robot_radius", self.robot_radius),
            ("active_radius", self.active_radius),
            ("threshold_high", self.threshold_high),
            ("max_linear_velocity", self.max_linear_velocity),
            ("max_angular_velocity", self.max_angular_velocity),
            ("heading_gain", self.heading_gain),
        ])?;
        LocalPlanningError::unless_magnitudes(&[
            ("safety_distance", self.safety_distance),
            ("threshold_low", self.threshold_low),
            ("minimum_turning_radius", self.minimum_turning_radius),
            ("target_weight", self.target_weight),
            ("heading_weight", self.heading_weight),
            ("previous_weight", self.previous_weight),
        ])?;
        let is_hysteresis = self.threshold_low <= self.threshold_high;
        LocalPlanningError::unless(is_hysteresis, "threshold_low", "a number up to `threshold_high`")
    }
}

/// VFH+ on a [`CertaintyGrid`] of sonars.
/// Ulrich and Borenstein, 1998, *VFH+: Reliable obstacle avoidance for fast mobile robots*.
#[derive(Clone, Debug)]
pub struct VfhPlus {
    parameters: VfhPlusParameters,
    /// Obstacle density of each sector.
    /// Sector k is around the direction k x 2 pi / sectors of the frame (section 3.1).
    density: Vec<f64>,
    /// Binary histogram: true for a blocked sector, with hysteresis (section 3.2).
    binary: Vec<bool>,
    /// Masked histogram: true also for directions out of reach (section 3.3).
    /// The robot can't turn to them.
    masked: Vec<bool>,
    candidates: Vec<f64>,
    previous: Option<f64>,
}

impl VfhPlus {
    /// Returns a planner.
    ///
    /// # Errors
    /// A parameter that no planner can have.
    pub fn new(parameters: VfhPlusParameters) -> Result<Self, LocalPlanningError> {
        parameters.check()?;
        Ok(Self {
            density: vec![0.0; parameters.sectors],
            binary: vec![false; parameters.sectors],
            masked: vec![false; parameters.sectors],
            candidates: Vec::with_capacity(3 * parameters.sectors),
            previous: None,
            parameters,
        })
    }

    /// Returns the velocity towards a target in the grid's frame.
    /// `None` if all directions are blocked, or an argument is not a number.
    pub fn plan(
        &mut self,
        robot: &MotionState,
        target: Point2,
        grid: &CertaintyGrid,
    ) -> Option<PlanarVelocity> {
        let pose = robot.pose;
        if !robot.is_finite() || !target.x.is_finite() || !target.y.is_finite() {
            return None;
        }
        self.fill(&pose, grid);
        self.mask(robot, grid);
        let wanted = math::atan2(target.y - pose.y, target.x - pose.x);
        self.find_candidates(wanted);
        let direction = self.cheapest(pose.theta, wanted)?;
        self.previous = Some(direction);
        Some(self.velocity(&pose, direction, target))
    }

    fn width(&self) -> f64 {
        TAU / self.parameters.sectors as f64
    }

    fn sector(&self, direction: f64) -> usize {
        let number = (direction / self.width()).round() as i64;
        number.rem_euclid(self.parameters.sectors as i64) as usize
    }

    /// Computes the primary and the binary polar histogram.
    fn fill(&mut self, pose: &Pose2, grid: &CertaintyGrid) {
        let VfhPlusParameters { robot_radius, safety_distance, active_radius, .. } = self.parameters;
        let (enlarged, width) = (robot_radius + safety_distance, self.width());
        self.density.fill(0.0);
        for (middle, certainty) in grid.cells() {
            let (across, up) = (middle.x - pose.x, middle.y - pose.y);
            let distance = math::hypot(across, up);
            if distance > active_radius || distance == 0.0 {
                continue;
            }
            // Equation 2, with a and b such that it is 1 beside the robot and 0 at the rim.
            let share = distance / active_radius;
            let magnitude = certainty * certainty * (1.0 - share * share);
            let bearing = math::atan2(up, across);
            let half = if distance > enlarged { math::asin(enlarged / distance) } else { 0.5 * PI };
            let reach = (half / width).floor() as i64;
            for by in -reach..=reach {
                let sector = self.sector(bearing + by as f64 * width);
                self.density[sector] += magnitude;
            }
        }
        let VfhPlusParameters { threshold_low, threshold_high, .. } = self.parameters;
        for (is_blocked, density) in self.binary.iter_mut().zip(&self.density) {
            *is_blocked = *density > threshold_high || (*is_blocked && *density >= threshold_low);
        }
    }

    /// Blocks the directions to which a turn at the current velocity hits a cell.
    fn mask(&mut self, robot: &MotionState, grid: &CertaintyGrid) {
        let parameters = self.parameters;
        let enlarged = parameters.robot_radius + parameters.safety_distance;
        let share = math::min(1.0, robot.velocity.vx.abs() / parameters.max_linear_velocity);
        let turn = share * parameters.minimum_turning_radius;
        let pose = robot.pose;
        let (sine, cosine) = (math::sin(pose.theta), math::cos(pose.theta));
        // Angles from the heading up to which the robot can turn, to the left and to the right.
        let (mut left, mut right) = (PI, PI);
        for (middle, certainty) in grid.cells() {
            let (across, up) = (middle.x - pose.x, middle.y - pose.y);
            let distance = math::hypot(across, up);
            if distance > parameters.active_radius || certainty < 0.5 {
                continue;
            }
            let angle = math::angle_between(pose.theta, math::atan2(up, across));
            let blocks = |side: f64| {
                let center = [-side * turn * sine, side * turn * cosine];
                math::hypot(across - center[0], up - center[1]) < turn + enlarged
            };
            if angle > 0.0 && turn > 0.0 && blocks(1.0) {
                left = math::min(left, angle);
            }
            if angle < 0.0 && turn > 0.0 && blocks(-1.0) {
                right = math::min(right, -angle);
            }
        }
        let width = self.width();
        for sector in 0..parameters.sectors {
            let angle = math::angle_between(pose.theta, sector as f64 * width);
            self.masked[sector] = self.binary[sector] || angle > left || angle < -right;
        }
    }

    /// Finds candidate directions in openings (section 3.4).
    /// The middle of a narrow one, both sides of a wide one and the target in it.
    fn find_candidates(&mut self, wanted: f64) {
        self.candidates.clear();
        let count = self.parameters.sectors;
        let width = self.width();
        let Some(blocked) = self.masked.iter().position(|is_blocked| *is_blocked) else {
            self.candidates.push(wanted);
            return;
        };
        let half = 0.5 * self.parameters.wide_opening as f64 * width;
        let mut first: Option<usize> = None;
        for at in blocked + 1..=blocked + count {
            let is_blocked = self.masked[at % count];
            match first {
                None if !is_blocked => first = Some(at),
                Some(from) if is_blocked => {
                    let (low, high) = (from as f64 * width, (at - 1) as f64 * width);
                    if at - from < self.parameters.wide_opening {
                        self.candidates.push(0.5 * (low + high));
                    } else {
                        self.candidates.push(low + half);
                        self.candidates.push(high - half);
                        let inside = math::angle_between(low, wanted);
                        let inside = if inside < 0.0 { inside + TAU } else { inside };
                        if inside >= half && inside <= high - low - half {
                            self.candidates.push(wanted);
                        }
                    }
                    first = None;
                }
                _ => {}
            }
        }
    }

    /// Returns the candidate of least cost (equation 14).
    fn cheapest(&self, heading: f64, wanted: f64) -> Option<f64> {
        let parameters = &self.parameters;
        let previous = self.previous.unwrap_or(heading);
        let cost = |direction: f64| {
            parameters.target_weight * math::angle_between(direction, wanted).abs()
                + parameters.heading_weight * math::angle_between(direction, heading).abs()
                + parameters.previous_weight * math::angle_between(direction, previous).abs()
        };
        let best = self.candidates.iter().fold(None, |best: Option<(f64, f64)>, direction| {
            let cost = cost(*direction);
            if best.is_none_or(|(_, least)| cost < least) { Some((*direction, cost)) } else { best }
        });
        best.map(|(direction, _)| math::wrap_angle(direction))
    }

    /// Returns the velocity that turns to a direction.
    /// It is lower for a larger turn and for denser obstacles there.
    fn velocity(&self, pose: &Pose2, direction: f64, target: Point2) -> PlanarVelocity {
        let parameters = &self.parameters;
        let error = math::angle_between(pose.theta, direction);
        let fastest = parameters.max_angular_velocity;
        let density = self.density[self.sector(pose.theta)] / parameters.threshold_high;
        let free = 1.0 - math::min(1.0, density);
        let ahead = math::max(0.0, math::cos(error));
        let near = math::min(1.0, math::hypot(target.x - pose.x, target.y - pose.y) / 0.5);
        PlanarVelocity {
            vx: parameters.max_linear_velocity * ahead * ahead * near * math::max(0.2, free),
            vy: 0.0,
            wz: math::clamp(parameters.heading_gain * error, -fastest, fastest),
        }
    }
}
