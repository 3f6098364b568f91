//! Correlative scan matching by branch and bound.

use std::cmp::Ordering;
use std::collections::BinaryHeap;

use slate_interfaces::Pose2;
use slate_module::math;

use crate::max_grids::MaxGrids;

/// Poses among which a scan is searched, around a guess.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct SearchWindow {
    /// Farthest along x and y, m.
    pub distance: f64,
    /// Farthest rotation, rad.
    pub angle: f64,
    /// Largest relative loss of score at the border of the window, 0 to 1.
    /// A pose there loses against the guess.
    pub penalty: f64,
}

/// Most likely pose of a window.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct CorrelativeMatch {
    pub pose: Pose2,
    /// Mean likelihood of the points, 0 to 1.
    pub score: f64,
}

/// Poses whose score is at most `bound`, those of one angle in a square of offsets.
#[derive(Clone, Copy, Debug)]
struct Branch {
    bound: f64,
    angle: usize,
    offset: [i32; 2],
    level: usize,
}

/// Points as cells for each angle of a window.
struct Rotations {
    cells: Vec<Vec<[i32; 2]>>,
    angles: Vec<f64>,
}

/// Returns the most likely pose of a window in the map.
/// `None` if its score is below `minimum` (Olson, 2009, *Real-time correlative scan matching*; by branch and bound as
/// Hess et al., 2016, algorithm 3).
pub(crate) fn search(
    grids: &MaxGrids,
    resolution: f64,
    points: &[[f64; 2]],
    guess: Pose2,
    window: SearchWindow,
    minimum: f64,
) -> Option<CorrelativeMatch> {
    if points.is_empty() {
        return None;
    }
    let rotations = Rotations::new(points, guess, window, resolution);
    let reach = (window.distance / resolution).ceil() as i32;
    let penalty = |angle: f64, [right, up]: [i32; 2]| {
        let lost = |value: f64, most: f64| if most > 0.0 { value * value / (most * most) } else { 0.0 };
        let far = f64::from(right) * f64::from(right) + f64::from(up) * f64::from(up);
        let share = lost(far.sqrt(), f64::from(reach)) + lost(angle, window.angle);
        window.penalty * share / 2.0
    };
    let scale = 1.0 / (255.0 * points.len() as f64);
    let bound = |angle: usize, offset: [i32; 2], level: usize| {
        let score = f64::from(grids.sum(level, &rotations.cells[angle], offset)) * scale;
        if level == 0 { score - penalty(rotations.angles[angle], offset) } else { score }
    };
    let mut open = BinaryHeap::new();
    let push = |open: &mut BinaryHeap<Branch>, angle: usize, offset: [i32; 2], level: usize| {
        if offset[0] <= reach && offset[1] <= reach {
            let bound = bound(angle, offset, level);
            if bound >= minimum {
                open.push(Branch { bound, angle, offset, level });
            }
        }
    };
    let top = grids.levels() - 1;
    let squares = || (-reach..=reach).step_by(1 << top);
    for angle in 0..rotations.angles.len() {
        for up in squares() {
            squares().for_each(|right| push(&mut open, angle, [right, up], top));
        }
    }
    while let Some(Branch { bound: score, angle, offset: [right, up], level }) = open.pop() {
        if level == 0 {
            let score = score + penalty(rotations.angles[angle], [right, up]);
            let pose = Pose2 {
                x: guess.x + f64::from(right) * resolution,
                y: guess.y + f64::from(up) * resolution,
                theta: math::wrap_angle(guess.theta + rotations.angles[angle]),
            };
            return Some(CorrelativeMatch { pose, score });
        }
        let half = 1 << (level - 1);
        for [x, y] in [[0, 0], [half, 0], [0, half], [half, half]] {
            push(&mut open, angle, [right + x, up + y], level - 1);
        }
    }
    None
}

impl Rotations {
    /// Returns the search with its step sizes.
    /// By a step, points at their mean distance (root of the mean square) move by a cell.
    fn new(points: &[[f64; 2]], guess: Pose2, window: SearchWindow, resolution: f64) -> Self {
        let square = points.iter().map(|[x, y]| x * x + y * y).sum::<f64>() / points.len() as f64;
        let steps = (window.angle * square.sqrt() / resolution).ceil() as i32;
        let step = if steps > 0 { window.angle / f64::from(steps) } else { 0.0 };
        let angles: Vec<f64> = (-steps..=steps).map(|k| f64::from(k) * step).collect();
        let cells = angles.iter().map(|angle| {
            let pose = Pose2 { theta: guess.theta + angle, ..guess };
            let place = |value: f64| (value / resolution).floor() as i32;
            crate::se2::transform_all(pose, points).map(|[x, y]| [place(x), place(y)]).collect()
        });
        Self { cells: cells.collect(), angles }
    }
}

impl PartialEq for Branch {
    fn eq(&self, other: &Self) -> bool {
        self.cmp(other) == Ordering::Equal
    }
}

impl Eq for Branch {}

impl PartialOrd for Branch {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}

/// Orders branches by bound.
/// Among equal ones the smaller square comes first, then the first angle and offset.
impl Ord for Branch {
    fn cmp(&self, other: &Self) -> Ordering {
        let rest = |branch: &Self| (branch.level, branch.angle, branch.offset);
        self.bound.total_cmp(&other.bound).then_with(|| rest(other).cmp(&rest(self)))
    }
}
