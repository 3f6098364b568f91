//! Office of the evaluation.

use slate_grid::Geometry;
use slate_module::Random;

use super::building::Building;
use crate::DataError;

const WIDTH: f64 = 40.0;
const HEIGHT: f64 = 22.0;
const RESOLUTION: f64 = 0.05;
const WALL: f64 = 0.1;
const DOOR: f64 = 1.0;

/// Returns the office: two corridors with rooms, joined at both ends.
/// Rooms are on the corridors' sides; desks and cabinets stand in them. All is drawn from one seed, so that it is
/// always the same office.
pub fn office() -> Result<Building, DataError> {
    let name = "office of 40 m by 22 m, made by the evaluation";
    let geometry = Geometry::new([0.0, 0.0], [WIDTH, HEIGHT], RESOLUTION, 1 << 20)
        .ok_or_else(|| DataError::new(name.as_ref(), "has no cells"))?;
    let mut floor = FloorPlan { walls: vec![false; geometry.cells()], geometry };
    let mut random = Random::new(1, "office");
    for (low, high) in [([0.0, 0.0], [WIDTH, WALL]), ([0.0, HEIGHT - WALL], [WIDTH, HEIGHT])] {
        floor.fill(low, high, true);
    }
    for left in [0.0, WIDTH - WALL] {
        floor.fill([left, 0.0], [left + WALL, HEIGHT], true);
    }
    // Rooms below the first corridor, between both, and above the second.
    floor.rooms([0.0, WIDTH], [0.0, 6.0], |_| 6.0, &mut random);
    floor.rooms([2.0, WIDTH - 2.0], [8.0, 14.0], |room| if room % 2 == 0 { 8.0 } else { 14.0 }, &mut random);
    floor.rooms([0.0, WIDTH], [16.0, HEIGHT], |_| 16.0, &mut random);
    Building::new(name.into(), geometry, &floor.walls)
}

struct FloorPlan {
    geometry: Geometry,
    walls: Vec<bool>,
}

impl FloorPlan {
    /// Fills a rectangle with walls, or opens it.
    fn fill(&mut self, low: [f64; 2], high: [f64; 2], is_wall: bool) {
        let cells = |length: f64| (length / RESOLUTION).round() as usize;
        for row in cells(low[1])..cells(high[1]).min(self.geometry.height) {
            for column in cells(low[0])..cells(high[0]).min(self.geometry.width) {
                let cell = self.geometry.index(column, row);
                self.walls[cell] = is_wall;
            }
        }
    }

    /// Creates rooms side by side, each with a door.
    /// The door is in the wall at the y that its number gives.
    fn rooms(
        &mut self,
        [left, right]: [f64; 2],
        [low, high]: [f64; 2],
        door: impl Fn(usize) -> f64,
        random: &mut Random,
    ) {
        let mut from = left;
        self.fill([left, low], [left + WALL, high], true);
        for room in 0.. {
            let mut to = from + random.uniform(3.0, 6.0);
            if to > right - 3.0 {
                to = right;
            }
            self.fill([to - WALL, low], [to, high], true);
            for wall in [low, high - WALL] {
                self.fill([from, wall], [to, wall + WALL], true);
            }
            let at = random.uniform(from + 0.4, to - DOOR - 0.4);
            let wall = if door(room) == low { low } else { high - WALL };
            self.fill([at, wall], [at + DOOR, wall + WALL], false);
            self.furnish([from, to], [low, high], wall == low, random);
            if to == right {
                return;
            }
            from = to;
        }
    }

    /// Places desks and a cabinet along the walls without a door.
    fn furnish(&mut self, [left, right]: [f64; 2], [low, high]: [f64; 2], is_low: bool, random: &mut Random) {
        // Away from the door by more than its width.
        let (near, far) = if is_low { (low + 1.6, high - 0.9) } else { (low + 0.1, high - 2.4) };
        for _ in 0..3 {
            let y = random.uniform(near, far);
            let (width, depth) = if random.unit() < 0.5 { (0.7, 1.4) } else { (0.5, 0.8) };
            let x = if random.unit() < 0.5 { left + WALL } else { right - WALL - width };
            let top = if y + depth > high - WALL { high - WALL } else { y + depth };
            self.fill([x, y], [x + width, top], true);
        }
    }
}
