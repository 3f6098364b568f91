//! Footprint as points.

use slate_avoidance::Footprint;
use slate_interfaces::Pose2;
use slate_module::math;

use crate::obstacle_field::{FieldLookup, ObstacleField};

/// Largest number of points on an edge.
const MOST_POINTS: f64 = 10_000.0;

/// Tolerance of contact points at the start, m.
/// A point that may touch is free there within it.
const CONTACT_TOLERANCE: f32 = 1e-3;

/// Points and circles of a footprint, for lookups in a distance field.
/// The points are on its outline.
#[derive(Clone, Debug)]
pub struct FootprintPoints {
    corners: Vec<[f64; 2]>,
    points: Vec<[f32; 2]>,
    /// Largest distance between neighboring points, m.
    spacing: f64,
    /// Allowance of each point, added to its distances, m.
    allowances: Vec<f32>,
    /// Radius of the inscribed circle around the reference point, m.
    pub(crate) inscribed: f32,
    /// Radius of the smallest one around it, m.
    pub(crate) circumscribed: f32,
}

impl FootprintPoints {
    /// Computes corners and circles of a footprint.
    /// Points on its outline follow with a field's resolution.
    pub fn new(footprint: &Footprint) -> Self {
        let corners: Vec<[f64; 2]> = footprint.outline().collect();
        let farthest = corners.iter().fold(0.0, |most, [x, y]| math::max(most, math::hypot(*x, *y)));
        Self {
            corners,
            points: Vec::new(),
            spacing: 0.0,
            allowances: Vec::new(),
            inscribed: math::max(0.0, -footprint.distance(0.0, 0.0)) as f32,
            circumscribed: farthest as f32,
        }
    }

    /// Places the points at most a cell apart.
    /// No occupied cell then fits between two of them.
    pub(crate) fn fit(&mut self, resolution: f64) {
        if self.spacing == resolution {
            return;
        }
        self.spacing = resolution;
        self.points.clear();
        self.points.extend(outline(&self.corners, resolution));
        self.allowances.clear();
        self.allowances.resize(self.points.len(), 0.0);
    }

    /// Allows points that touch at a pose to do so while they come no nearer.
    /// All others must stay free.
    pub(crate) fn allow(&mut self, field: &FieldLookup<'_>, at: [f32; 2], heading: [f32; 2], touch: f32) {
        for (point, allowance) in self.points.iter().zip(&mut self.allowances) {
            let distance = distance_at(field, *point, at, heading);
            *allowance = if distance <= touch { touch - distance + CONTACT_TOLERANCE } else { 0.0 };
        }
    }

    /// Returns the distance of the footprint at a pose to an obstacle, m.
    /// 0 where they overlap, or where the footprint is not inside of the field, so that its surroundings are unknown.
    pub fn distance(&self, field: &ObstacleField, pose: &Pose2) -> f64 {
        let center = field.center();
        let at = [(pose.x - center[0]) as f32, (pose.y - center[1]) as f32];
        let heading = [math::cos(pose.theta) as f32, math::sin(pose.theta) as f32];
        let lookup = field.lookup();
        let is_overlapping = lookup.distance(at[0], at[1]) <= self.inscribed;
        if is_overlapping || !lookup.contains_circle(at, self.circumscribed) {
            return 0.0;
        }
        let distances =
            outline(&self.corners, field.resolution()).map(|point| distance_at(&lookup, point, at, heading));
        f64::from(distances.fold(f32::INFINITY, crate::single::min))
    }

    /// Returns the clearance of the outline's points with their allowances, m.
    /// The pose is relative to the field's middle.
    #[inline(always)]
    pub(crate) fn clearance(
        &self,
        field: &FieldLookup<'_>,
        [x, y]: [f32; 2],
        [cosine, sine]: [f32; 2],
    ) -> f32 {
        let mut least = f32::INFINITY;
        for (point, allowance) in self.points.iter().zip(&self.allowances) {
            let distance = distance_at(field, *point, [x, y], [cosine, sine]) + allowance;
            if distance < least {
                least = distance;
            }
        }
        least
    }
}

/// Points on an outline that are at most a spacing apart.
fn outline(corners: &[[f64; 2]], spacing: f64) -> impl Iterator<Item = [f32; 2]> + '_ {
    corners.iter().zip(corners.iter().cycle().skip(1)).flat_map(move |(from, to)| {
        let (across, up) = (to[0] - from[0], to[1] - from[1]);
        let count = math::min(MOST_POINTS, (math::hypot(across, up) / spacing).ceil()) as usize;
        (0..count).map(move |k| {
            let share = k as f64 / count as f64;
            [(from[0] + share * across) as f32, (from[1] + share * up) as f32]
        })
    })
}

/// Returns the distance to an obstacle of a point in the robot's frame, m.
#[inline(always)]
fn distance_at(
    field: &FieldLookup<'_>,
    [px, py]: [f32; 2],
    [x, y]: [f32; 2],
    [cosine, sine]: [f32; 2],
) -> f32 {
    field.distance(x + px * cosine - py * sine, y + px * sine + py * cosine)
}
