use slate_interfaces::{Point2, Pose2};
use slate_module::math;

use crate::map::{CELL, LocalMap, SIDE, cell_of};
use crate::other::Other;

const CELLS: usize = SIDE * SIDE;
const UNREACHED: u16 = u16::MAX;
const NONE: u16 = u16::MAX;
/// Cost and length of a step straight and diagonal, in fifths of a cell.
const STRAIGHT: u16 = 5;
const DIAGONAL: u16 = 7;
/// Number of buckets, larger than the spread of costs in the queue.
/// The spread is that over the edge of the map plus the largest step cost.
const BUCKETS: usize = 4096;
/// Steps of the path examined for a waypoint, cells.
const WAYPOINT_STEPS: usize = 16;
/// Steps of the path that are remembered, cells.
pub(crate) const PATH_STEPS: usize = 64;
/// Factor on the cost of a step on free ground.
/// The remembered path is cheaper by `PREFERENCE`; tight and blocked cells cost more.
const FREE: u8 = 6;
const PREFERENCE: u8 = 1;
const TIGHT: u8 = 10;
const BLOCKED: u8 = 48;

/// Widths that make a cell costly or cheap, meters from the nearest mark.
#[derive(Clone, Copy)]
pub(crate) struct Widths {
    /// Nearer than this the robot's middle can't be.
    pub(crate) blocked: f64,
    /// Nearer than this the robot can't turn on the spot.
    pub(crate) tight: f64,
}

/// Finds the cheapest path through the local map and its farthest visible point.
///
/// Dijkstra's algorithm from the goal (or, when that is beyond, from the whole edge of the map, where the rest of the
/// way is taken as straight) until the robot's cell is reached. No cell is impassable: an obstacle that is only
/// supposed must not make the goal unreachable.
///
/// `way` holds the cells of the way that was found last; a new one must be clearly cheaper to replace it, or the robot
/// would waver between two ways round the same thing.
pub(crate) fn waypoint(
    map: &LocalMap,
    others: &[Other],
    pose: Pose2,
    goal: Point2,
    widths: Widths,
    reach: f64,
    way: &mut Vec<[i32; 2]>,
) -> Point2 {
    let mut grid = Grid::new(pose);
    grid.mark(map, others);
    grid.measure();
    grid.weigh(widths);
    grid.prefer(way);
    grid.search(goal);
    grid.remember(way);
    grid.follow(goal, reach)
}

struct Grid {
    /// World's cell in the lower left corner.
    corner: [i64; 2],
    /// Position of the robot, as a point and as an index.
    robot: Point2,
    robot_cell: usize,
    /// Distance to the nearest mark, fifths of a cell.
    clearance: [u16; CELLS],
    /// Factor on the cost of steps into a cell.
    weight: [u8; CELLS],
    cost: [u16; CELLS],
}

impl Grid {
    fn new(pose: Pose2) -> Self {
        let middle = (SIDE / 2) as i64;
        Self {
            corner: [cell_of(pose.x) - middle, cell_of(pose.y) - middle],
            robot: Point2 { x: pose.x, y: pose.y },
            robot_cell: SIDE / 2 * SIDE + SIDE / 2,
            clearance: [UNREACHED; CELLS],
            weight: [1; CELLS],
            cost: [UNREACHED; CELLS],
        }
    }

    fn index(&self, x: f64, y: f64) -> Option<usize> {
        let (column, row) = (cell_of(x) - self.corner[0], cell_of(y) - self.corner[1]);
        let inside = 0..SIDE as i64;
        (inside.contains(&column) && inside.contains(&row)).then(|| row as usize * SIDE + column as usize)
    }

    fn middle(&self, cell: usize) -> Point2 {
        let coordinate = |number: usize, corner: i64| (corner + number as i64) as f64 * CELL + 0.5 * CELL;
        Point2 { x: coordinate(cell % SIDE, self.corner[0]), y: coordinate(cell / SIDE, self.corner[1]) }
    }

    /// Marks echoes, and the outlines of other robots.
    fn mark(&mut self, map: &LocalMap, others: &[Other]) {
        let heard = map.obstacles().map(|mark| (mark.x, mark.y));
        for (x, y) in heard.chain(others.iter().flat_map(Other::outline)) {
            if let Some(cell) = self.index(x, y) {
                self.clearance[cell] = 0;
            }
        }
    }

    /// Distances to the marks by two passes over the cells (chamfer distance).
    fn measure(&mut self) {
        let distance = &mut self.clearance;
        for row in 0..SIDE {
            for column in 0..SIDE {
                let cell = row * SIDE + column;
                let mut least = distance[cell];
                if column > 0 {
                    least = least.min(distance[cell - 1].saturating_add(STRAIGHT));
                }
                if row > 0 {
                    least = least.min(distance[cell - SIDE].saturating_add(STRAIGHT));
                    if column > 0 {
                        least = least.min(distance[cell - SIDE - 1].saturating_add(DIAGONAL));
                    }
                    if column + 1 < SIDE {
                        least = least.min(distance[cell - SIDE + 1].saturating_add(DIAGONAL));
                    }
                }
                distance[cell] = least;
            }
        }
        for row in (0..SIDE).rev() {
            for column in (0..SIDE).rev() {
                let cell = row * SIDE + column;
                let mut least = distance[cell];
                if column + 1 < SIDE {
                    least = least.min(distance[cell + 1].saturating_add(STRAIGHT));
                }
                if row + 1 < SIDE {
                    least = least.min(distance[cell + SIDE].saturating_add(STRAIGHT));
                    if column + 1 < SIDE {
                        least = least.min(distance[cell + SIDE + 1].saturating_add(DIAGONAL));
                    }
                    if column > 0 {
                        least = least.min(distance[cell + SIDE - 1].saturating_add(DIAGONAL));
                    }
                }
                distance[cell] = least;
            }
        }
    }

    fn weigh(&mut self, widths: Widths) {
        let units = |width: f64| (width / CELL * f64::from(STRAIGHT)) as u16;
        let (blocked, tight) = (units(widths.blocked), units(widths.tight));
        for (weight, clearance) in self.weight.iter_mut().zip(&self.clearance) {
            *weight = match *clearance {
                clearance if clearance >= tight => FREE,
                clearance if clearance >= blocked => TIGHT,
                _ => BLOCKED,
            };
        }
    }

    fn prefer(&mut self, way: &[[i32; 2]]) {
        // Wide enough that the way may shift a little as the map fills.
        let mut preferred = [false; CELLS];
        for [column, row] in way {
            let (column, row) = (i64::from(*column), i64::from(*row));
            for row in row - self.corner[1] - 1..row - self.corner[1] + 2 {
                for column in column - self.corner[0] - 1..column - self.corner[0] + 2 {
                    let inside = 0..SIDE as i64;
                    if inside.contains(&column) && inside.contains(&row) {
                        preferred[row as usize * SIDE + column as usize] = true;
                    }
                }
            }
        }
        for (weight, _) in self.weight.iter_mut().zip(preferred).filter(|(_, preferred)| *preferred) {
            *weight -= PREFERENCE;
        }
    }

    fn remember(&self, way: &mut Vec<[i32; 2]>) {
        way.clear();
        let mut cell = self.robot_cell;
        while way.len() < PATH_STEPS {
            // Cells on the map have numbers far below the limits of an `i32`.
            let number = |corner: i64, cell: usize| (corner + cell as i64) as i32;
            way.push([number(self.corner[0], cell % SIDE), number(self.corner[1], cell / SIDE)]);
            match self.downhill(cell) {
                Some(next) => cell = next,
                None => break,
            }
        }
    }

    /// Returns the next cell on the path to the goal; `None` at its end.
    fn downhill(&self, cell: usize) -> Option<usize> {
        let mut best = cell;
        for (neighbor, _) in neighbors(cell) {
            if self.cost[neighbor] < self.cost[best] {
                best = neighbor;
            }
        }
        (best != cell).then_some(best)
    }

    fn search(&mut self, goal: Point2) {
        let mut queue = Queue { first: [NONE; BUCKETS], next: [NONE; CELLS], previous: [NONE; CELLS] };
        let mut waiting = 0_usize;
        let mut start = |cost: &mut [u16; CELLS], cell: usize, value: u16| {
            cost[cell] = value;
            queue.add(cell, value);
            waiting += 1;
        };
        let mut current = UNREACHED;
        if let Some(cell) = self.index(goal.x, goal.y) {
            start(&mut self.cost, cell, 0);
            current = 0;
        } else {
            let edge = (0..SIDE).flat_map(|i| [i, (SIDE - 1) * SIDE + i, i * SIDE, i * SIDE + SIDE - 1]);
            let nearest =
                edge.clone().fold(f64::INFINITY, |least, cell| math::min(least, self.way_left(cell, goal)));
            for cell in edge {
                // Weighed as free ground. Where the spread outgrows the queue, the way is surely not the best.
                let value =
                    (self.way_left(cell, goal) - nearest) / CELL * f64::from(STRAIGHT * u16::from(FREE));
                if self.cost[cell] == UNREACHED && value < 3500.0 {
                    start(&mut self.cost, cell, value as u16);
                    current = current.min(value as u16);
                }
            }
        }
        while waiting > 0 {
            let Some(cell) = queue.take(current) else {
                current += 1;
                continue;
            };
            waiting -= 1;
            if cell == self.robot_cell {
                return;
            }
            for (neighbor, length) in neighbors(cell) {
                let cost = current + length * u16::from(self.weight[neighbor]);
                if cost < self.cost[neighbor] {
                    if self.cost[neighbor] == UNREACHED {
                        waiting += 1;
                    } else {
                        queue.unlink(neighbor, self.cost[neighbor]);
                    }
                    self.cost[neighbor] = cost;
                    queue.add(neighbor, cost);
                }
            }
        }
    }

    fn way_left(&self, cell: usize, goal: Point2) -> f64 {
        let from = self.middle(cell);
        let (dx, dy) = (goal.x - from.x, goal.y - from.y);
        (dx * dx + dy * dy).sqrt()
    }

    /// Descends the cost from the robot, with shortcuts through no costlier cells.
    fn follow(&self, goal: Point2, reach: f64) -> Point2 {
        let mut cell = self.robot_cell;
        let mut target = goal;
        let mut dearest = self.weight[cell];
        for step in 0..WAYPOINT_STEPS {
            let Some(next) = self.downhill(cell) else {
                // The goal's own cell.
                return if step == 0 || self.view(goal, dearest) { goal } else { target };
            };
            cell = next;
            dearest = dearest.max(self.weight[cell]);
            let middle = self.middle(cell);
            let (dx, dy) = (middle.x - self.robot.x, middle.y - self.robot.y);
            if step >= 3 && (!self.view(middle, dearest) || dx * dx + dy * dy > reach * reach) {
                break;
            }
            target = middle;
        }
        target
    }

    /// Returns true if no cell on the straight line to a point exceeds the cost.
    fn view(&self, point: Point2, dearest: u8) -> bool {
        let (dx, dy) = (point.x - self.robot.x, point.y - self.robot.y);
        let steps = ((dx * dx + dy * dy).sqrt() / (0.5 * CELL)) as u32 + 1;
        (1..=steps).all(|step| {
            let part = f64::from(step) / f64::from(steps);
            self.index(self.robot.x + part * dx, self.robot.y + part * dy)
                .is_some_and(|cell| self.weight[cell] <= dearest)
        })
    }
}

/// Neighbors of a cell, with their distances.
fn neighbors(cell: usize) -> impl Iterator<Item = (usize, u16)> {
    const AROUND: [(i32, i32); 8] = [(1, 0), (-1, 0), (0, 1), (0, -1), (1, 1), (1, -1), (-1, 1), (-1, -1)];
    let (row, column) = ((cell / SIDE) as i32, (cell % SIDE) as i32);
    AROUND.iter().filter_map(move |(down, right)| {
        let (row, column) = (row + down, column + right);
        let inside = 0..SIDE as i32;
        let length = if down * right == 0 { STRAIGHT } else { DIAGONAL };
        (inside.contains(&row) && inside.contains(&column))
            .then(|| (row as usize * SIDE + column as usize, length))
    })
}

/// Bucket queue of cells by cost (Dial's queue).
/// A ring of buckets, each a doubly linked list through the cells.
struct Queue {
    first: [u16; BUCKETS],
    next: [u16; CELLS],
    previous: [u16; CELLS],
}

impl Queue {
    fn add(&mut self, cell: usize, cost: u16) {
        let bucket = usize::from(cost) % BUCKETS;
        let follower = self.first[bucket];
        self.next[cell] = follower;
        self.previous[cell] = NONE;
        if follower != NONE {
            self.previous[usize::from(follower)] = cell as u16;
        }
        self.first[bucket] = cell as u16;
    }

    fn take(&mut self, cost: u16) -> Option<usize> {
        let cell = self.first[usize::from(cost) % BUCKETS];
        (cell != NONE).then(|| {
            self.unlink(usize::from(cell), cost);
            usize::from(cell)
        })
    }

    fn unlink(&mut self, cell: usize, cost: u16) {
        let (before, after) = (self.previous[cell], self.next[cell]);
        if before == NONE {
            self.first[usize::from(cost) % BUCKETS] = after;
        } else {
            self.next[usize::from(before)] = after;
        }
        if after != NONE {
            self.previous[usize::from(after)] = before;
        }
    }
}
