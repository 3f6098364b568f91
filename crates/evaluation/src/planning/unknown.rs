//! Robot that drives through space it does not know.

use slate_planning::{AStar, CostGrid, DStarLite, GridCell, LETHAL};

use super::timed;
use crate::movingai::PathProblem;
use crate::{Figure, FigureGoal};

/// Sight of the robot along rows and columns, cells.
/// 5 m in cells of 0.1 m.
const SIGHT: i64 = 50;

/// Drives each problem with D* Lite, and compares each replan with a new A*.
/// Returns no figures for a map without obstacles, or of less than four times the robot's sight, most of which it would
/// know at once.
pub fn evaluate(grid: &CostGrid, problems: &[&PathProblem]) -> Vec<Figure> {
    if i64::from(grid.width().min(grid.height())) < 4 * SIGHT {
        return Vec::new();
    }
    let mut drive = UnknownDrive { a_star: AStar::default(), repaired: 0.0, anew: 0.0, plans: 0, differ: 0 };
    for problem in problems {
        drive.run(grid, problem);
    }
    if drive.plans == 0 {
        return Vec::new();
    }
    vec![
        Figure::new("D* Lite: plans in unknown space", drive.plans as f64),
        Figure::new("D* Lite: plans that cost another than A*'s", drive.differ as f64)
            .with_goal(FigureGoal::AtMost(0.0)),
        Figure::new("D* Lite: mean time of a new plan, ms", drive.repaired / drive.plans as f64),
        Figure::new("D* Lite: times faster than A* anew", drive.anew / drive.repaired)
            .with_goal(FigureGoal::AtLeast(10.0)),
    ]
}

struct UnknownDrive {
    a_star: AStar,
    /// Time of all new plans by both planners, ms.
    repaired: f64,
    anew: f64,
    plans: usize,
    differ: usize,
}

impl UnknownDrive {
    /// Drives until the goal is reached or known to be unreachable.
    /// Unseen cells count as free.
    fn run(&mut self, grid: &CostGrid, problem: &PathProblem) {
        let mut here = problem.start;
        let Ok(unseen) = CostGrid::new(grid.width(), grid.height(), |_| 0) else { return };
        let mut planner = DStarLite::new(unseen, here, problem.goal);
        observe(grid, &mut planner, here);
        // The first plan is the same work for both.
        let mut path: Vec<GridCell> = planner.plan().map(|path| path.cells().to_vec()).unwrap_or_default();
        let mut at = 0;
        while here != problem.goal && at + 1 < path.len() {
            at += 1;
            here = path[at];
            planner.move_to(here);
            let seen = obstacles_in_sight(grid, planner.grid(), here);
            if seen.is_empty() {
                continue;
            }
            let (found, repaired) = timed(|| {
                seen.iter().for_each(|cell| planner.set_cost(*cell, LETHAL));
                planner.plan().map(|found| {
                    path.clear();
                    path.extend_from_slice(found.cells());
                    found.cost()
                })
            });
            let known = planner.grid();
            let (exact, anew) =
                timed(|| self.a_star.search(known, here, problem.goal).map(|path| path.cost()));
            self.plans += 1;
            self.repaired += repaired;
            self.anew += anew;
            let is_same = match (found, exact) {
                (Some(found), Some(exact)) => (found - exact).abs() < 1e-6,
                (found, exact) => found.is_none() && exact.is_none(),
            };
            self.differ += usize::from(!is_same);
            if found.is_none() {
                break;
            }
            at = 0;
        }
    }
}

fn observe(grid: &CostGrid, planner: &mut DStarLite, from: GridCell) {
    for cell in obstacles_in_sight(grid, planner.grid(), from) {
        planner.set_cost(cell, LETHAL);
    }
}

/// Obstacles that a laser on the robot would hit, and that it does not know yet.
fn obstacles_in_sight(grid: &CostGrid, known: &CostGrid, from: GridCell) -> Vec<GridCell> {
    let mut seen = Vec::new();
    for end in rim() {
        if let Some(hit) = first_obstacle(grid, from, end)
            && known.is_passable(hit)
            && !seen.contains(&hit)
        {
            seen.push(hit);
        }
    }
    seen
}

/// Ends of the beams: the rim of a square, columns and rows from the robot.
fn rim() -> impl Iterator<Item = (i64, i64)> {
    let side = -SIGHT..=SIGHT;
    side.flat_map(|k| [(k, -SIGHT), (k, SIGHT), (-SIGHT, k), (SIGHT, k)])
}

/// Returns the first obstacle on a beam.
fn first_obstacle(grid: &CostGrid, from: GridCell, (columns, rows): (i64, i64)) -> Option<GridCell> {
    (1..=SIGHT).find_map(|step| {
        let at = |from: u32, by: i64| u32::try_from(i64::from(from) + (by * step).div_euclid(SIGHT)).ok();
        let cell = GridCell::new(at(from.column, columns)?, at(from.row, rows)?);
        (cell.column < grid.width() && cell.row < grid.height() && !grid.is_passable(cell)).then_some(cell)
    })
}
