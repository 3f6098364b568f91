use serde::{Deserialize, Serialize};
use slate_interfaces::{LaserScan, MapStroke, OccupancyGrid, Pose2};
use slate_module::prelude::*;

use crate::geometry::{Geometry, Line, MOST};
use crate::painting::{BARE, Painting};

/// Ports of [`OccupancyMapper`].
#[ports]
pub struct OccupancyMapperIo {
    /// What the laser scanner sees.
    scan: Input<LaserScan>,
    /// Where the robot is.
    #[stale(after = "500ms")]
    pose: Input<Pose2>,
    /// What a person paints.
    strokes: Inbox<MapStroke>,
    /// What is where.
    #[capacity(65_536)]
    map: Output<OccupancyGrid>,
}

/// Parameters of [`OccupancyMapper`].
#[params]
pub struct OccupancyMapperParams {
    #[param(default = -5.0, unit = "m", doc = "the map's lowest x")]
    x: f64,
    #[param(default = -5.0, unit = "m", doc = "the map's lowest y")]
    y: f64,
    #[param(default = 10.0, range = 0.1..=1000.0, unit = "m", doc = "how far it goes along x")]
    width: f64,
    #[param(default = 10.0, range = 0.1..=1000.0, unit = "m", doc = "how far it goes along y")]
    height: f64,
    #[param(default = 0.05, range = 0.01..=1.0, unit = "m", doc = "side of a cell")]
    resolution: f64,
    #[param(default = 0.2, range = 0.02..=60.0, unit = "s", doc = "from one map to the next")]
    period: f64,
    #[param(default = 0.0, range = -10.0..=10.0, unit = "m", doc = "how far in front of the robot's reference point the laser sits")]
    mount_x: f64,
    #[param(default = 0.0, range = -10.0..=10.0, unit = "m", doc = "how far left of the robot's reference point the laser sits")]
    mount_y: f64,
    #[param(default = 0.0, range = -3.2..=3.2, unit = "rad", doc = "where its angle 0 looks")]
    mount_theta: f64,
}

/// Makes a map of what a laser scanner sees, and of what a person paints.
///
/// A cell that a beam goes through is more likely free, one where a beam ends more likely occupied (Moravec and Elfes); each cell counts
/// once a scan, and who was there and has left is forgotten after a second or two.
pub struct OccupancyMapper;

/// State of [`OccupancyMapper`].
#[derive(Default, Serialize, Deserialize)]
pub struct OccupancyMapperState {
    geometry: Option<Geometry>,
    /// How likely each cell is occupied: logarithms of the odds, in units of 0.05.
    odds: Vec<i8>,
    /// The scan in which a cell was counted last.
    counted: Vec<u32>,
    scans: u32,
    painting: Painting,
    /// When the map was told last, and whether it is another one since.
    told: Option<u64>,
    changed: bool,
}

/// What a beam says of a cell, and how sure a cell can be, in units of 0.05.
const FREE: i8 = -6;
const OCCUPIED: i8 = 17;
const SUREST: i8 = 70;

#[module(stage = SensorProcess)]
impl Module for OccupancyMapper {
    type Io = OccupancyMapperIo;
    type Params = OccupancyMapperParams;
    type State = OccupancyMapperState;

    fn tick(
        state: &mut OccupancyMapperState,
        io: &OccupancyMapperIo,
        params: &OccupancyMapperParams,
        now: &Tick,
    ) -> Outcome {
        let corner = [params.x, params.y];
        let Some(geometry) = Geometry::new(corner, [params.width, params.height], params.resolution) else {
            now.error(format_args!(
                "a map of {} m by {} m has more than {MOST} cells of {} m; make the cells larger or the map smaller",
                params.width, params.height, params.resolution
            ));
            return Outcome::Failed;
        };
        if state.geometry != Some(geometry) {
            state.begin(geometry);
        }
        let mut is_painted = false;
        for stroke in io.strokes.iter() {
            match state.painting.take(&stroke) {
                Ok(()) => is_painted = true,
                Err(reason) => {
                    now.warn(format_args!("a stroke is refused: {}", why(reason)));
                    stroke.refuse(reason);
                }
            }
        }
        if let (Some(scan), Some(pose)) = (io.scan.new(), io.pose.fresh()) {
            let (sine, cosine) = (math::sin(pose.theta), math::cos(pose.theta));
            let laser = Pose2 {
                x: pose.x + params.mount_x * cosine - params.mount_y * sine,
                y: pose.y + params.mount_x * sine + params.mount_y * cosine,
                theta: pose.theta + params.mount_theta,
            };
            state.look(&geometry, scan, laser);
        }
        let is_due =
            state.told.is_none_or(|told| now.now().saturating_sub(told) as f64 >= params.period * 1e9 - 1.0);
        if is_painted || (state.changed && is_due) {
            state.tell(&geometry, io, now);
        }
        Outcome::Ok
    }
}

/// Why a stroke is refused, and what to do about it.
fn why(reason: u16) -> &'static str {
    match reason {
        MapStroke::FULL => "there are as many as are kept; take some back with UNDO",
        MapStroke::NOTHING => "there is none to take back",
        _ => "it takes a mark, a width of more than 0 m and at least one point, all of them numbers",
    }
}

impl OccupancyMapperState {
    fn begin(&mut self, geometry: Geometry) {
        self.geometry = Some(geometry);
        self.odds.clear();
        self.odds.resize(geometry.cells(), 0);
        self.counted.clear();
        self.counted.resize(geometry.cells(), 0);
        self.painting.make_room(&geometry);
        self.scans = 0;
        self.changed = true;
    }

    fn look(&mut self, geometry: &Geometry, scan: &LaserScan, laser: Pose2) {
        // No map is as large; what is farther away is none of it.
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
                // What is too near or no number says nothing.
                let is_seen = range >= scan.range_min && direction.is_finite();
                let hits = range < scan.range_max;
                let length = math::min(range, scan.range_max);
                let (sine, cosine) = (math::sin(direction), math::cos(direction));
                let to = geometry.place(laser.x + length * cosine, laser.y + length * sine);
                (is_seen && is_near(to)).then_some((to, hits))
            })
        };
        // Where one beam ends no other of the same scan has gone through.
        for (to, _) in beams().filter(|(_, hits)| *hits) {
            self.count(geometry, (to.0.floor() as i64, to.1.floor() as i64), OCCUPIED);
        }
        for (to, _) in beams() {
            for cell in Line::new(from, to) {
                self.count(geometry, cell, FREE);
            }
        }
        self.changed = true;
    }

    fn count(&mut self, geometry: &Geometry, (column, row): (i64, i64), says: i8) {
        let (Ok(column), Ok(row)) = (usize::try_from(column), usize::try_from(row)) else { return };
        if column >= geometry.width || row >= geometry.height {
            return;
        }
        let cell = geometry.index(column, row);
        if self.counted[cell] == self.scans {
            return;
        }
        self.counted[cell] = self.scans;
        self.odds[cell] = self.odds[cell].saturating_add(says).clamp(-SUREST, SUREST);
    }

    fn tell(&mut self, geometry: &Geometry, io: &OccupancyMapperIo, now: &Tick) {
        let painted = self.painting.cells(geometry);
        let odds = &self.odds;
        io.map.write(geometry.cells(), |map| {
            map.origin = geometry.origin();
            map.resolution = geometry.resolution;
            (map.width, map.height) = (geometry.width as u32, geometry.height as u32);
            for (cell, (shown, odds)) in map.data.iter_mut().zip(odds).enumerate() {
                *shown = match painted.get(cell) {
                    Some(painted) if *painted != BARE => *painted,
                    _ => percent(*odds),
                };
            }
        });
        self.told = Some(now.now());
        self.changed = false;
    }
}

/// How likely it is occupied; -1 when nothing is known.
fn percent(odds: i8) -> i8 {
    if odds == 0 {
        return -1;
    }
    (100.0 / (1.0 + math::exp(-0.05 * f64::from(odds))) + 0.5) as i8
}
