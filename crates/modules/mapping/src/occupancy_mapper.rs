use serde::{Deserialize, Serialize};
use slate_grid::{Geometry, LineCells};
use slate_interfaces::{LaserScan, MapStroke, OccupancyGrid, Pose2};
use slate_mapek::RobotModel;
use slate_mapek::prelude::*;
use slate_module::prelude::*;

use crate::MOST_CELLS;
use crate::painting::{BARE, Painting};

/// Ports of [`OccupancyMapper`].
#[ports]
pub struct OccupancyMapperIo {
    /// Scan of the laser.
    scan: Observed<LaserScan>,
    /// Pose of the robot in the map frame, from Knowledge.
    #[stale(after = "500ms")]
    pose: Input<Pose2>,
    /// Robot model, from Knowledge: it has the mount of the laser.
    robot: Input<RobotModel>,
    /// Manual corrections, painted over the measured map.
    strokes: Inbox<MapStroke>,
    /// 2D occupancy grid.
    #[capacity(65_536)]
    change: Change<OccupancyGrid>,
}

/// Parameters of [`OccupancyMapper`].
#[params]
pub struct OccupancyMapperParams {
    #[param(default = -5.0, unit = "m", doc = "lowest x of the map")]
    origin_x: f64,
    #[param(default = -5.0, unit = "m", doc = "lowest y of the map")]
    origin_y: f64,
    #[param(default = 10.0, range = 0.1..=1000.0, unit = "m", doc = "extent along x")]
    width: f64,
    #[param(default = 10.0, range = 0.1..=1000.0, unit = "m", doc = "extent along y")]
    height: f64,
    #[param(default = 0.05, range = 0.01..=1.0, unit = "m", doc = "edge length of a cell")]
    resolution: f64,
    #[param(default = 0.2, range = 0.02..=60.0, unit = "s", doc = "time between two published maps")]
    publish_period: f64,
    #[param(default = 1000.0, range = 0.1..=1000.0, unit = "m", doc = "range up to which a scan is mapped")]
    max_laser_range: f64,
    #[param(default = "laser", doc = "name of the laser in the robot model")]
    laser: Text<28>,
}

/// Occupancy grid mapping with known poses.
///
/// A beam is a miss for cells that it crosses and a hit where it ends (Thrun, Burgard and Fox, *Probabilistic Robotics*, 9.2); each cell
/// counts once a scan. The log odds saturate: moving objects fade after 1 to 2 s. Painted cells override measured ones.
pub struct OccupancyMapper;

/// State of [`OccupancyMapper`].
#[derive(Default, Serialize, Deserialize)]
pub struct OccupancyMapperState {
    geometry: Option<Geometry>,
    /// Log odds of occupancy, in units of 0.05.
    log_odds: Vec<i8>,
    /// Newest scan that has updated a cell.
    updated: Vec<u32>,
    scans: u32,
    painting: Painting,
    /// Number of the newest scans whose laser the robot model does not list.
    unlisted: u8,
    /// Time of the newest published map, and true if it has changed since.
    published: Option<u64>,
    changed: bool,
}

/// Scans of an unlisted laser before a warning.
/// The robot model lists a sensor once it has measured, a cycle later.
const UNLISTED_SCANS: u8 = 3;
/// Log odds of a miss and a hit, and their saturation, in units of 0.05.
const MISS: i8 = -6;
const HIT: i8 = 17;
const SATURATION: i8 = 70;

impl Analyze for OccupancyMapper {
    const NAME: &'static str = "occupancy_mapper";
    const DOC: &'static str = "Maps the surroundings from laser scans.";
    type Observed = OccupancyMapperIo;
    type Params = OccupancyMapperParams;
    type State = OccupancyMapperState;
    type Value = InPlace<OccupancyGrid>;

    fn process(
        state: &mut OccupancyMapperState,
        io: &OccupancyMapperIo,
        params: &OccupancyMapperParams,
        now: &Tick,
    ) -> Option<InPlace<OccupancyGrid>> {
        let corner = [params.origin_x, params.origin_y];
        let Some(geometry) =
            Geometry::new(corner, [params.width, params.height], params.resolution, MOST_CELLS)
        else {
            now.error(format_args!(
                "a map of {} m by {} m has more than {MOST_CELLS} cells of {} m; make the cells larger or the map smaller",
                params.width, params.height, params.resolution
            ));
            return None;
        };
        if state.geometry != Some(geometry) {
            state.reset(geometry);
        }
        let mut is_painted = false;
        for stroke in io.strokes.iter() {
            match state.painting.add(&stroke) {
                Ok(()) => is_painted = true,
                Err(reason) => {
                    now.warn(format_args!("invalid stroke: {}", refusal(reason)));
                    stroke.refuse(reason);
                }
            }
        }
        if let (Some(scan), Some(pose), Some(robot)) = (io.scan.updated(), io.pose.fresh(), io.robot.get()) {
            match robot.sensor(params.laser.as_str()) {
                Some(laser) => {
                    let range_max = math::min(scan.range_max, params.max_laser_range);
                    state.integrate(&geometry, (scan, range_max), mounted(pose, &laser.mount));
                }
                None if state.unlisted == UNLISTED_SCANS => now.warn(format_args!(
                    "the robot model lists no sensor `{}`, and its scans are not mapped; expected the laser's name as the parameter `laser`",
                    params.laser.as_str()
                )),
                None => {}
            }
            let is_listed = robot.sensor(params.laser.as_str()).is_some();
            state.unlisted = if is_listed { 0 } else { state.unlisted.saturating_add(1) };
        }
        let is_due = state.published.is_none_or(|published| {
            now.now().saturating_sub(published) as f64 >= params.publish_period * 1e9 - 1.0
        });
        (is_painted || (state.changed && is_due)).then(|| state.publish(&geometry, &io.change, now))
    }
}

/// Returns the pose of a device in the map frame.
/// It combines that of the robot, and its mount on the robot.
fn mounted(robot: &Pose2, mount: &Pose2) -> Pose2 {
    let (sine, cosine) = (math::sin(robot.theta), math::cos(robot.theta));
    Pose2 {
        x: robot.x + mount.x * cosine - mount.y * sine,
        y: robot.y + mount.x * sine + mount.y * cosine,
        theta: robot.theta + mount.theta,
    }
}

/// Returns the reason of a refused stroke, and its remedy.
fn refusal(reason: u16) -> &'static str {
    match reason {
        MapStroke::FULL => "expected at most 256 strokes; remove some with UNDO",
        MapStroke::NOTHING => "no stroke left to undo",
        _ => "expected a mark, a width greater than 0 m and at least one point of finite coordinates",
    }
}

impl OccupancyMapperState {
    fn reset(&mut self, geometry: Geometry) {
        self.geometry = Some(geometry);
        self.log_odds.clear();
        self.log_odds.resize(geometry.cells(), 0);
        self.updated.clear();
        self.updated.resize(geometry.cells(), 0);
        self.painting.reserve(&geometry);
        self.scans = 0;
        self.changed = true;
    }

    fn integrate(&mut self, geometry: &Geometry, (scan, range_max): (&LaserScan, f64), laser: Pose2) {
        // No map is that large.
        let is_near = |(column, row): (f64, f64)| column.abs() < 1e6 && row.abs() < 1e6;
        let from = geometry.place(laser.x, laser.y);
        if !is_near(from) || !laser.theta.is_finite() || !scan.range_max.is_finite() {
            return;
        }
        self.scans = self.scans.wrapping_add(1);
        let beams = || {
            scan.ranges.iter().enumerate().filter_map(|(beam, range)| {
                let range = f64::from(*range);
                let direction = laser.theta + scan.angle_min + beam as f64 * scan.angle_increment;
                // Ranges below the minimum and NaN are no measurement.
                let is_valid = range >= scan.range_min && direction.is_finite();
                let hits = range < range_max;
                let length = math::min(range, range_max);
                let (sine, cosine) = (math::sin(direction), math::cos(direction));
                let to = geometry.place(laser.x + length * cosine, laser.y + length * sine);
                (is_valid && is_near(to)).then_some((to, hits))
            })
        };
        // Hits first: a cell with a hit counts no miss of the same scan.
        for (to, _) in beams().filter(|(_, hits)| *hits) {
            self.update(geometry, (to.0.floor() as i64, to.1.floor() as i64), HIT);
        }
        for (to, _) in beams() {
            for cell in LineCells::new(from, to) {
                self.update(geometry, cell, MISS);
            }
        }
        self.changed = true;
    }

    fn update(&mut self, geometry: &Geometry, (column, row): (i64, i64), log_odds: i8) {
        let (Ok(column), Ok(row)) = (usize::try_from(column), usize::try_from(row)) else { return };
        if column >= geometry.width || row >= geometry.height {
            return;
        }
        let cell = geometry.index(column, row);
        if self.updated[cell] == self.scans {
            return;
        }
        self.updated[cell] = self.scans;
        self.log_odds[cell] = self.log_odds[cell].saturating_add(log_odds).clamp(-SATURATION, SATURATION);
    }

    fn publish(
        &mut self,
        geometry: &Geometry,
        change: &Change<OccupancyGrid>,
        now: &Tick,
    ) -> InPlace<OccupancyGrid> {
        let painted = self.painting.cells(geometry);
        let log_odds = &self.log_odds;
        let written = change.write(geometry.cells(), |map| {
            map.origin = geometry.origin();
            map.resolution = geometry.resolution;
            (map.width, map.height) = (geometry.width as u32, geometry.height as u32);
            for (cell, (shown, log_odds)) in map.data.iter_mut().zip(log_odds).enumerate() {
                *shown = match painted.get(cell) {
                    Some(painted) if *painted != BARE => *painted,
                    _ => occupancy(*log_odds),
                };
            }
        });
        self.published = Some(now.now());
        self.changed = false;
        written
    }
}

/// Returns the probability of occupancy in percent; -1 if unknown.
fn occupancy(log_odds: i8) -> i8 {
    if log_odds == 0 {
        return -1;
    }
    (100.0 / (1.0 + math::exp(-0.05 * f64::from(log_odds))) + 0.5) as i8
}
