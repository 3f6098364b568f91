//! Position of a feature of an image in the map.

use slate_grid::Geometry;
use slate_interfaces::{OccupancyGrid, PanTiltState, Pose2};
use slate_module::math;

use super::ports::{FeatureTrackerIo, FeatureTrackerParams};
use crate::detection::ImageDetection;

/// Occupancy from which a cell is a wall, percent.
const OCCUPIED: i8 = 65;
/// Occupancy below which a cell is free, percent.
const FREE: i8 = 50;
/// Free distance at both sides of an object that stands alone, m.
/// It is its least thickness, too.
const FREE_SIDE_DISTANCE: f64 = 0.7;
const THICKNESS: f64 = 0.5;
/// Error of the edges of a box, pixels.
const EDGE_ERROR: f64 = 2.5;
/// Errors of a feature in a wall: range, m, and bearing, rad.
/// The bearing is that by pose and head.
const WALL_ERROR: f64 = 0.25;
const BEARING_ERROR: f64 = 0.015;
/// Mean distance between a wall and a feature before it, m.
/// It is for features whose lower edge is not on the floor.
const BEFORE_WALL: f64 = 0.1;
/// A wall this much nearer than the floor hides the floor, m.
const HIDDEN: f64 = 0.3;
/// Factor on the covariance of a sight.
/// Errors of successive images are the same ones.
const CORRELATION: f64 = 4.0;

/// A camera in the map.
pub(super) struct CameraView {
    /// Of its optical center: x, y and height, m.
    position: [f64; 3],
    /// Heading of the robot and angles of the head, rad.
    theta: f64,
    head: [f64; 2],
    /// fx, fy, cx, cy.
    intrinsics: [f64; 4],
    size: [f64; 2],
}

/// A feature in the map.
pub(super) struct FeatureSight {
    /// x, y and height of its middle, m.
    pub position: [f64; 3],
    /// Covariance of x and y: xx, xy, yy.
    pub covariance: [f64; 3],
    pub range: f64,
}

impl CameraView {
    /// Returns the camera of a robot at a pose.
    /// `None` before its calibration and its mount are known.
    pub fn of(io: &FeatureTrackerIo, pose: &Pose2) -> Option<Self> {
        let (info, base) = (io.camera_info.get()?, io.camera_base.get()?);
        let PanTiltState { pan, tilt, .. } = io.head.get().copied().unwrap_or_default();
        let (sine, cosine) = (math::sin(pose.theta), math::cos(pose.theta));
        let mount = base.translation;
        let [fx, _, cx, _, fy, cy, ..] = info.k;
        let position =
            [pose.x + mount.x * cosine - mount.y * sine, pose.y + mount.x * sine + mount.y * cosine, mount.z];
        let size = [f64::from(info.width), f64::from(info.height)];
        let is_calibrated = fx > 0.0 && fy > 0.0;
        is_calibrated.then_some(Self {
            position,
            theta: pose.theta,
            head: [pan, tilt],
            intrinsics: [fx, fy, cx, cy],
            size,
        })
    }

    /// Direction of a pixel in the map frame.
    fn ray(&self, x: f64, y: f64) -> [f64; 3] {
        let [fx, fy, cx, cy] = self.intrinsics;
        let (left, up) = ((cx - x) / fx, (cy - y) / fy);
        let [pan, tilt] = self.head;
        // About the tilt axis, downwards, then about the vertical.
        let (sine, cosine) = (math::sin(tilt), math::cos(tilt));
        let (ahead, up) = (cosine + sine * up, cosine * up - sine);
        let heading = self.theta + pan;
        let (sine, cosine) = (math::sin(heading), math::cos(heading));
        [cosine * ahead - sine * left, sine * ahead + cosine * left, up]
    }

    /// Returns the position of a feature.
    /// `None` beyond the range, and for a box that the image cuts.
    pub fn locate(
        &self,
        feature: &ImageDetection,
        map: Option<(Geometry, &OccupancyGrid)>,
        params: &FeatureTrackerParams,
    ) -> Option<FeatureSight> {
        let (half, bottom) = (0.5 * feature.width, feature.y + 0.5 * feature.height);
        let is_cut = feature.x - half < 1.0 || feature.x + half > self.size[0] - 2.0;
        if is_cut {
            return None;
        }
        let lower = self.ray(feature.x, bottom);
        let across = math::hypot(lower[0], lower[1]);
        let direction = [lower[0] / across, lower[1] / across];
        let height = self.position[2];
        // The lower edge is on the floor, if the image has it and it is below the horizon.
        let is_floor = lower[2] < -0.02 && bottom < self.size[1] - 2.0;
        let floor = if is_floor { height * across / -lower[2] } else { f64::INFINITY };
        let from = [self.position[0], self.position[1]];
        let (wall, behind) = map.map_or((f64::INFINITY, None), |(geometry, map)| {
            wall_range(&geometry, map, (from, direction), params.max_range + 1.0)
        });
        let edge = EDGE_ERROR / self.intrinsics[1];
        let (range, error) = if floor <= wall + HIDDEN {
            (floor, 0.05 + floor * floor * edge / height)
        } else if let Some(behind) = behind {
            // Seen over something low: it is anywhere from there to the next wall, and another place to look from tells.
            (0.5 * (wall + behind), WALL_ERROR + 0.3 * (behind - wall))
        } else {
            // In the wall, or before it with a lower part that was not recognized.
            (math::max(0.0, wall - BEFORE_WALL), WALL_ERROR)
        };
        if range > params.max_range {
            return None;
        }
        let middle = self.ray(feature.x, feature.y);
        let rise = middle[2] / math::hypot(middle[0], middle[1]);
        let side = 0.03 + BEARING_ERROR * range;
        let ([c, s], [along, beside]) = (direction, [CORRELATION * error * error, CORRELATION * side * side]);
        Some(FeatureSight {
            position: [
                self.position[0] + range * c,
                self.position[1] + range * s,
                math::max(0.0, height + range * rise),
            ],
            covariance: [
                along * c * c + beside * s * s,
                (along - beside) * c * s,
                along * s * s + beside * c * c,
            ],
            range,
        })
    }
}

/// Returns the distance to the first occupied cell in a direction, m.
/// Infinite without one up to `most`. If it stands alone, with free space to both sides, also the distance to the next
/// one behind it, or `most`.
fn wall_range(
    geometry: &Geometry,
    map: &OccupancyGrid,
    (from, [across, up]): ([f64; 2], [f64; 2]),
    most: f64,
) -> (f64, Option<f64>) {
    let step = 0.5 * geometry.resolution;
    let value = |range: f64, aside: f64| {
        let (x, y) = (from[0] + range * across - aside * up, from[1] + range * up + aside * across);
        geometry.cell(x, y).map(|(column, row)| map.data[geometry.index(column, row)])
    };
    let range_of = |k: usize| k as f64 * step;
    let steps = (most / step) as usize;
    let is_wall = |k: &usize| value(range_of(*k), 0.0).is_some_and(|value| value >= OCCUPIED);
    let Some(wall) = (0..steps).find(is_wall) else { return (f64::INFINITY, None) };
    let is_free = |aside: f64| value(range_of(wall), aside).is_some_and(|value| (0..FREE).contains(&value));
    let stands_alone = is_free(FREE_SIDE_DISTANCE) && is_free(-FREE_SIDE_DISTANCE);
    let next = (wall + (THICKNESS / step) as usize..steps).find(is_wall).unwrap_or(steps);
    (range_of(wall), stands_alone.then(|| range_of(next)))
}
