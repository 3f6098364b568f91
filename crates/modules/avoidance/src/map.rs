use serde::{Deserialize, Serialize};
use slate_interfaces::{Pose2, SonarScan};
use slate_module::math;

use crate::footprint::Footprint;
use crate::parameters::Parameters;

/// Cells along one side of the map.
pub(crate) const SIDE: usize = 50;
/// Edge of a cell, meters.
pub(crate) const CELL: f64 = 0.05;
/// Half the edge of the map, meters.
pub(crate) const HALF_EDGE: f64 = 0.5 * SIDE as f64 * CELL;

/// Confidence from which a mark counts as an obstacle: one echo suffices.
const OCCUPIED: f64 = 0.3;
const HIT: f64 = 0.4;
/// Tolerance of a mark nearer than the reading, meters.
const TOLERANCE: f64 = 0.04;
/// Cosine of the angle up to which silence disproves a mark in full.
/// Beyond the angle of `OTHER_DIRECTION` it has no effect. A smooth surface reflects only sound that arrives at most 45
/// degrees off its normal, so silence disproves a mark only from about the direction of its echo.
const SAME_DIRECTION: f64 = 0.95;
const OTHER_DIRECTION: f64 = 0.8;
const NONE: u16 = u16::MAX;
const SONARS: usize = 16;

/// Position of a sonar echo.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Mark {
    /// Position in the world, meters.
    pub x: f64,
    /// Position in the world, meters.
    pub y: f64,
    /// Direction of the sonar beam, unit vector in the world.
    direction: [f64; 2],
    /// Confidence that the cell is occupied now, 0 to 1.
    confidence: f64,
    /// Time of the first echo, seconds.
    pub since: f64,
}

/// Local map of sonar echoes, at most one per cell of a robot-centered grid.
///
/// An echo has a range, but no direction within the cone. So it marks the whole arc at this
/// range, and removes nearer marks in the cone, until the marks fit all echoes.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(try_from = "Saved", into = "Saved")]
pub struct LocalMap {
    marks: Vec<Mark>,
    /// Index of each cell's mark.
    /// Cells repeat beyond the edge of the map, where no marks are kept.
    slots: Vec<u16>,
    time: Option<f64>,
}

/// Saved state of the map: the cells follow from the marks.
#[derive(Serialize, Deserialize)]
struct Saved {
    marks: Vec<Mark>,
    time: Option<f64>,
}

/// Sonar in the world, and its reading.
#[derive(Clone, Copy, Default)]
struct Cone {
    x: f64,
    y: f64,
    axis: [f64; 2],
    range: f64,
    has_echo: bool,
}

/// Rates at which marks lose confidence in an update.
struct Fading {
    /// Time since the one before, as a part of the obstacle timeout.
    elapsed: f64,
    miss_weight: f64,
    /// Cosine of half the field of view, less a margin.
    edge: f64,
}

impl Default for LocalMap {
    fn default() -> Self {
        Self { marks: Vec::with_capacity(SIDE * SIDE), slots: vec![NONE; SIDE * SIDE], time: None }
    }
}

impl LocalMap {
    /// Iterates over present obstacles.
    pub fn obstacles(&self) -> impl Iterator<Item = &Mark> {
        self.marks.iter().filter(|mark| mark.confidence >= OCCUPIED)
    }

    /// Returns the time of the last scan, seconds.
    pub fn time(&self) -> Option<f64> {
        self.time
    }

    /// Updates the map from a scan at `pose` and `time` (seconds). Skips invalid ones.
    pub fn update(
        &mut self,
        pose: Pose2,
        scan: &SonarScan,
        footprint: &Footprint,
        parameters: &Parameters,
        time: f64,
    ) {
        let opening = scan.field_of_view > 0.0 && scan.field_of_view <= std::f64::consts::PI;
        if !(on_the_map(pose.x, pose.y) && pose.theta.is_finite() && time.is_finite() && opening) {
            return;
        }
        let memory = math::max(parameters.obstacle_timeout, 1e-3);
        let elapsed = self.time.map_or(0.0, |last| math::clamp(time - last, 0.0, memory));
        self.time = Some(time);
        let mut cones = [Cone::default(); SONARS];
        let cones = place(pose, scan, &mut cones);
        let edge = math::cos(0.5 * scan.field_of_view - 0.017);
        let fading = Fading { elapsed: elapsed / memory, miss_weight: parameters.miss_weight, edge };
        self.fade(pose, cones, footprint, &fading);
        self.mark_echoes(pose, cones, scan.field_of_view, edge);
    }

    /// Lowers the confidence of marks by time and by sonars that disprove them.
    /// Removes marks without confidence, far from the robot or inside of it.
    fn fade(&mut self, pose: Pose2, cones: &[Cone], footprint: &Footprint, fading: &Fading) {
        let (sine, cosine) = (math::sin(pose.theta), math::cos(pose.theta));
        let mut index = 0;
        while let Some(mark) = self.marks.get_mut(index) {
            let (dx, dy) = (mark.x - pose.x, mark.y - pose.y);
            let silence =
                cones.iter().fold(0.0, |most, cone| math::max(most, cone.disproves(mark, fading.edge)));
            mark.confidence -= fading.elapsed + fading.miss_weight * silence;
            let away = dx.abs() >= HALF_EDGE || dy.abs() >= HALF_EDGE;
            let inside =
                footprint.distance_within(cosine * dx + sine * dy, cosine * dy - sine * dx, 0.1) < -0.01;
            if mark.confidence <= 0.0 || away || inside {
                self.remove(index);
            } else {
                index += 1;
            }
        }
    }

    /// Marks the arcs of the echoes, but for what another sonar disproves.
    fn mark_echoes(&mut self, pose: Pose2, cones: &[Cone], field_of_view: f64, edge: f64) {
        let Some(time) = self.time else { return };
        let has_echo = |(_, cone): &(usize, &Cone)| cone.has_echo && cone.range < 2.0 * HALF_EDGE;
        for (number, cone) in cones.iter().enumerate().filter(has_echo) {
            // At least the ends of the arc, and no cell between them left out.
            let steps = (cone.range * field_of_view / (0.8 * CELL)) as u32 + 1;
            for step in 0..=steps {
                let angle = 0.5 * field_of_view * (2.0 * f64::from(step) / f64::from(steps) - 1.0);
                let (sine, cosine) = (math::sin(angle), math::cos(angle));
                let direction = [
                    cosine * cone.axis[0] - sine * cone.axis[1],
                    sine * cone.axis[0] + cosine * cone.axis[1],
                ];
                let (x, y) = (cone.x + cone.range * direction[0], cone.y + cone.range * direction[1]);
                let mark = Mark { x, y, direction, confidence: HIT, since: time };
                let away = (mark.x - pose.x).abs() >= HALF_EDGE || (mark.y - pose.y).abs() >= HALF_EDGE;
                let disproved = cones
                    .iter()
                    .enumerate()
                    .any(|(other, cone)| other != number && cone.disproves(&mark, edge) > 0.5);
                if !away && !disproved {
                    self.insert(mark);
                }
            }
        }
    }

    /// Replaces the marks by obstacles of another map at `time` (seconds).
    /// Each obstacle is x, y and the time of its first echo.
    pub fn set(&mut self, obstacles: impl Iterator<Item = (f64, f64, f64)>, time: f64) {
        self.marks.clear();
        self.slots.fill(NONE);
        self.time = Some(time);
        for (x, y, since) in obstacles.filter(|(x, y, _)| on_the_map(*x, *y)) {
            self.insert(Mark { x, y, direction: [0.0; 2], confidence: 1.0, since });
        }
    }

    fn insert(&mut self, mark: Mark) {
        let slot = slot_of(&mark);
        match self.marks.get_mut(usize::from(self.slots[slot])) {
            Some(known) => {
                let same = (known.x - mark.x).abs() <= CELL && (known.y - mark.y).abs() <= CELL;
                let (confidence, since) =
                    if same { (known.confidence, known.since) } else { (0.0, mark.since) };
                *known = Mark { confidence: math::min(confidence + mark.confidence, 1.0), since, ..mark };
            }
            None => {
                // A `u16` can number all cells, and each holds one mark at most.
                self.slots[slot] = self.marks.len() as u16;
                self.marks.push(mark);
            }
        }
    }

    fn remove(&mut self, index: usize) {
        let gone = self.marks.swap_remove(index);
        self.slots[slot_of(&gone)] = NONE;
        if let Some(moved) = self.marks.get(index) {
            self.slots[slot_of(moved)] = index as u16;
        }
    }
}

/// Transforms the sonars of a scan to the world; leaves out invalid readings.
fn place<'a>(pose: Pose2, scan: &SonarScan, cones: &'a mut [Cone; SONARS]) -> &'a [Cone] {
    let (sine, cosine) = (math::sin(pose.theta), math::cos(pose.theta));
    let mut count = 0;
    for (placement, echo) in scan.placements.iter().zip(scan.echoes.iter()) {
        let has_echo = echo.heard.get();
        let range = if has_echo { echo.range } else { scan.range_max };
        let placed = on_the_map(placement.x, placement.y) && placement.theta.is_finite();
        if !range.is_finite() || range < 0.0 || !placed || count == SONARS {
            continue;
        }
        let bearing = pose.theta + placement.theta;
        cones[count] = Cone {
            x: pose.x + cosine * placement.x - sine * placement.y,
            y: pose.y + sine * placement.x + cosine * placement.y,
            axis: [math::cos(bearing), math::sin(bearing)],
            range,
            has_echo,
        };
        count += 1;
    }
    &cones[..count]
}

impl Cone {
    /// Returns the evidence of a reading against a mark, 0 to 1.
    /// `edge` is the cosine of half the opening angle.
    fn disproves(&self, mark: &Mark, edge: f64) -> f64 {
        let (dx, dy) = (mark.x - self.x, mark.y - self.y);
        let along = dx * self.axis[0] + dy * self.axis[1];
        if along <= 0.0 || along >= self.range {
            return 0.0;
        }
        let squared = dx * dx + dy * dy;
        let limit = self.range - TOLERANCE;
        if limit <= 0.0 || squared >= limit * limit || along * along < edge * edge * squared {
            return 0.0;
        }
        let alike = (dx * mark.direction[0] + dy * mark.direction[1]) / squared.sqrt();
        math::clamp((alike - OTHER_DIRECTION) / (SAME_DIRECTION - OTHER_DIRECTION), 0.0, 1.0)
    }
}

fn slot_of(mark: &Mark) -> usize {
    cell_of(mark.y).rem_euclid(SIDE as i64) as usize * SIDE + cell_of(mark.x).rem_euclid(SIDE as i64) as usize
}

/// Returns true if a point is near enough to the origin for a cell index.
pub(crate) fn on_the_map(x: f64, y: f64) -> bool {
    x.abs() < 1e6 && y.abs() < 1e6
}

/// Returns the row or column of the cell at a coordinate of the world.
pub(crate) fn cell_of(coordinate: f64) -> i64 {
    let cell = coordinate / CELL;
    let truncated = cell as i64;
    if cell < truncated as f64 { truncated - 1 } else { truncated }
}

impl From<LocalMap> for Saved {
    fn from(map: LocalMap) -> Self {
        Self { marks: map.marks, time: map.time }
    }
}

impl TryFrom<Saved> for LocalMap {
    type Error = String;

    fn try_from(saved: Saved) -> Result<Self, String> {
        let mut map = Self { time: saved.time, ..Self::default() };
        for mark in saved.marks {
            let slot = slot_of(&mark);
            if !on_the_map(mark.x, mark.y) {
                return Err("a mark beyond the map".to_owned());
            }
            if map.slots[slot] != NONE {
                return Err("two marks in one cell of the map".to_owned());
            }
            map.slots[slot] = map.marks.len() as u16;
            map.marks.push(mark);
        }
        Ok(map)
    }
}
