//! Occupancy grid of a running SLAM.

use serde::{Deserialize, Serialize};
use slate_grid::{Geometry, UNKNOWN_CELL};
use slate_interfaces::{OccupancyGrid, Pose2};
use slate_module::math;

use crate::render::{BeamCounts, extent};
use crate::saved;
use crate::se2;

/// Margin of cells by which a map grows beyond a scan's need, on each side.
const GROWTH: i64 = 40;
/// Change of a pose from which a scan is redrawn, m and rad.
const MOVED: [f64; 2] = [0.02, 0.005];

/// Occupancy grid that grows with the scans.
/// It is redrawn when their poses have changed.
///
/// Drawing anew continues beside the map that is shown, some scans at a time, and takes its place at the end.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub(crate) struct LiveMap {
    shown: DrawnScans,
    redrawn: Option<DrawnScans>,
}

/// Settings of a [`LiveMap`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct MapSettings {
    /// Edge length of a cell, m.
    pub resolution: f64,
    /// Largest number of cells.
    pub most_cells: usize,
    /// Share of beams that end in a cell from which it is occupied, percent.
    pub occupied_threshold: i8,
    /// Maximum number of scans redrawn in a step.
    pub redrawn_scans: usize,
}

/// Scans that are drawn into a grid.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
struct DrawnScans {
    beams: BeamCounts,
    /// First cell in a grid of that resolution whose corner is the map's origin.
    first: [i64; 2],
    /// Pose of each scan when it was drawn.
    #[serde(with = "saved::poses")]
    poses: Vec<Pose2>,
    /// True if a scan did not fit into the largest grid.
    is_cut: bool,
}

impl LiveMap {
    /// Draws new scans, and some of those whose poses have changed.
    /// Returns true if the published map has changed.
    pub fn update<'a>(
        &mut self,
        poses: &[Pose2],
        points: impl Fn(usize) -> &'a [[f64; 2]],
        settings: &MapSettings,
    ) -> bool {
        let before = self.shown.poses.len();
        self.shown.draw(poses, &points, settings, usize::MAX);
        let has_new = self.shown.poses.len() > before;
        if self.redrawn.is_none() && self.shown.has_moved(poses) {
            self.redrawn = Some(DrawnScans::default());
        }
        let Some(redrawn) = &mut self.redrawn else { return has_new };
        redrawn.draw(poses, &points, settings, settings.redrawn_scans);
        if redrawn.poses.len() < poses.len() {
            return has_new;
        }
        self.shown = std::mem::take(redrawn);
        self.redrawn = None;
        true
    }

    /// Returns the number of cells.
    pub fn cells(&self) -> usize {
        self.shown.beams.counts.len()
    }

    /// Returns true while scans are redrawn.
    pub fn is_redrawn(&self) -> bool {
        self.redrawn.is_some()
    }

    /// Returns true if scans are cut, as the largest grid does not hold them.
    pub fn is_cut(&self) -> bool {
        self.shown.is_cut
    }

    /// Fills a grid of as many cells.
    pub fn write(&self, grid: &mut OccupancyGrid, settings: &MapSettings) {
        let geometry = self.shown.beams.geometry;
        grid.origin = geometry.origin();
        grid.resolution = geometry.resolution;
        (grid.width, grid.height) = (geometry.width as u32, geometry.height as u32);
        for (cell, share) in grid.data.iter_mut().zip(self.shown.beams.shares()) {
            *cell = match share {
                UNKNOWN_CELL => UNKNOWN_CELL,
                share if share >= settings.occupied_threshold => 100,
                _ => 0,
            };
        }
    }
}

impl DrawnScans {
    /// Draws a limited number of new scans.
    fn draw<'a>(
        &mut self,
        poses: &[Pose2],
        points: impl Fn(usize) -> &'a [[f64; 2]],
        settings: &MapSettings,
        most: usize,
    ) {
        for (scan, pose) in poses.iter().enumerate().skip(self.poses.len()).take(most) {
            let points = points(scan);
            self.cover(extent(*pose, points), settings);
            self.beams.insert(*pose, points);
            self.poses.push(*pose);
        }
    }

    fn has_moved(&self, poses: &[Pose2]) -> bool {
        self.poses.iter().zip(poses).any(|(drawn, pose)| {
            se2::distance(*drawn, *pose) > MOVED[0]
                || math::angle_between(drawn.theta, pose.theta).abs() > MOVED[1]
        })
    }

    /// Grows the grid to cover a box, unless it would have too many cells.
    fn cover(&mut self, [low, high]: [[f64; 2]; 2], settings: &MapSettings) {
        let cell = |value: f64| (value / settings.resolution).floor() as i64;
        let (low, high) = (low.map(cell), high.map(cell));
        let is_empty = self.beams.counts.is_empty();
        let size = [self.beams.geometry.width as i64, self.beams.geometry.height as i64];
        let (mut first, mut last) = (self.first, [0, 1].map(|axis| self.first[axis] + size[axis] - 1));
        for axis in 0..2 {
            if is_empty || low[axis] < first[axis] {
                first[axis] = low[axis] - GROWTH;
            }
            if is_empty || high[axis] > last[axis] {
                last[axis] = high[axis] + GROWTH;
            }
        }
        let grown = [0, 1].map(|axis| (last[axis] - first[axis] + 1) as usize);
        if !is_empty && grown.map(|cells| cells as i64) == size {
            return;
        }
        let corner = first.map(|cell| cell as f64 * settings.resolution);
        let origin = Pose2 { x: corner[0], y: corner[1], theta: 0.0 };
        match Geometry::with_origin(origin, settings.resolution, grown, settings.most_cells) {
            Some(geometry) => self.grow(geometry, first),
            None => self.is_cut = true,
        }
    }

    /// Copies the counts into a larger grid.
    fn grow(&mut self, geometry: Geometry, first: [i64; 2]) {
        let before = std::mem::replace(&mut self.beams, BeamCounts::new(geometry));
        let [columns, rows] = [0, 1].map(|axis| (self.first[axis] - first[axis]) as usize);
        self.first = first;
        let width = before.geometry.width;
        for (row, counts) in before.counts.chunks_exact(width.max(1)).enumerate() {
            let start = geometry.index(columns, rows + row);
            self.beams.counts[start..start + width].copy_from_slice(counts);
        }
    }
}
