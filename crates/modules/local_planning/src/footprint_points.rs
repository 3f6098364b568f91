//! Footprint as points.

use slate_avoidance::Footprint;
use slate_interfaces::Pose2;
use slate_module::math;

use crate::obstacle_field::{FieldLookup, ObstacleField};

/// Distance between points on the outline, m.
const SPACING: f64 = 0.08;

/// Points on a footprint's outline, and its circles, for lookups in a distance field.
#[derive(Clone, Debug)]
pub struct FootprintPoints {
    points: Vec<[f32; 2]>,
    /// Radius of the largest circle around the reference point inside of the outline, m.
    pub(crate) inscribed: f32,
    /// Radius of the smallest one around it, m.
    pub(crate) circumscribed: f32,
}

impl FootprintPoints {
    /// Makes points that are at most 8 cm apart.
    pub fn new(footprint: &Footprint) -> Self {
        let corners: Vec<[f64; 2]> = footprint.outline().collect();
        let mut points = Vec::new();
        for (from, to) in corners.iter().zip(corners.iter().cycle().skip(1)) {
            let (across, up) = (to[0] - from[0], to[1] - from[1]);
            let count = (math::hypot(across, up) / SPACING).ceil() as usize;
            for k in 0..count {
                let share = k as f64 / count as f64;
                points.push([(from[0] + share * across) as f32, (from[1] + share * up) as f32]);
            }
        }
        let farthest = corners.iter().fold(0.0, |most, [x, y]| math::max(most, math::hypot(*x, *y)));
        Self {
            points,
            inscribed: math::max(0.0, -footprint.distance(0.0, 0.0)) as f32,
            circumscribed: farthest as f32,
        }
    }

    /// Returns the distance of the footprint at a pose to the nearest obstacle, m; 0 where they overlap.
    pub fn distance(&self, field: &ObstacleField, pose: &Pose2) -> f64 {
        let center = field.center();
        let at = [(pose.x - center[0]) as f32, (pose.y - center[1]) as f32];
        let heading = [math::cos(pose.theta) as f32, math::sin(pose.theta) as f32];
        let lookup = field.lookup();
        let is_inside = lookup.distance(at[0], at[1]) <= self.inscribed;
        if is_inside { 0.0 } else { f64::from(self.clearance(&lookup, at, heading)) }
    }

    /// Returns the least distance of the outline's points to an obstacle, m, for a pose relative to the field's middle.
    #[inline(always)]
    pub(crate) fn clearance(
        &self,
        field: &FieldLookup<'_>,
        [x, y]: [f32; 2],
        [cosine, sine]: [f32; 2],
    ) -> f32 {
        let mut least = f32::INFINITY;
        for [px, py] in &self.points {
            let distance = field.distance(x + px * cosine - py * sine, y + px * sine + py * cosine);
            if distance < least {
                least = distance;
            }
        }
        least
    }
}
