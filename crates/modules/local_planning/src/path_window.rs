//! Part of a path that is ahead.

use slate_interfaces::Point2;
use slate_module::math;

/// Distance between points of the window, m.
pub(crate) const SPACING: f64 = 0.05;

/// Resampled path from the point nearest to the robot.
/// Its points have equal distances, and are relative to the middle of the obstacle field.
#[derive(Clone, Debug, Default)]
pub(crate) struct PathWindow {
    pub x: Vec<f32>,
    pub y: Vec<f32>,
    /// End of the whole path.
    pub goal: [f32; 2],
    /// Length of the path from the robot on, m.
    pub remaining: f64,
}

impl PathWindow {
    /// Fills the window for a robot, up to `length`, m.
    /// Returns false for a path without a point, or with an invalid one.
    pub fn update(&mut self, path: &[Point2], robot: [f64; 2], center: [f64; 2], length: f64) -> bool {
        self.x.clear();
        self.y.clear();
        let is_finite = path.iter().all(|point| point.x.is_finite() && point.y.is_finite());
        let Some(last) = path.last().filter(|_| is_finite) else { return false };
        let relative = |x: f64, y: f64| ((x - center[0]) as f32, (y - center[1]) as f32);
        let (goal_x, goal_y) = relative(last.x, last.y);
        self.goal = [goal_x, goal_y];
        let (segment, from) = nearest(path, robot);
        self.remaining = 0.0;
        // Distance along the current segment at which the next point is.
        let mut next = 0.0;
        let most = (length / SPACING) as usize + 2;
        let mut start = from;
        for end in &path[(segment + 1).min(path.len() - 1)..] {
            let (across, up) = (end.x - start[0], end.y - start[1]);
            let own = math::hypot(across, up);
            while next <= own && own > 0.0 && self.x.len() < most {
                let (x, y) = relative(start[0] + next / own * across, start[1] + next / own * up);
                self.x.push(x);
                self.y.push(y);
                next += SPACING;
            }
            next -= own;
            self.remaining += own;
            start = [end.x, end.y];
        }
        if self.x.len() < most {
            self.x.push(goal_x);
            self.y.push(goal_y);
        }
        true
    }

    pub fn len(&self) -> usize {
        self.x.len()
    }

    pub fn point(&self, at: usize) -> [f32; 2] {
        [self.x[at], self.y[at]]
    }
}

/// Returns the path segment nearest to a point, and the nearest point on it.
fn nearest(path: &[Point2], [x, y]: [f64; 2]) -> (usize, [f64; 2]) {
    let mut best = (0, [path[0].x, path[0].y]);
    let mut least = f64::INFINITY;
    for (at, pair) in path.windows(2).enumerate() {
        let (across, up) = (pair[1].x - pair[0].x, pair[1].y - pair[0].y);
        let square = across * across + up * up;
        let along = (x - pair[0].x) * across + (y - pair[0].y) * up;
        let share = if square > 0.0 { math::clamp(along / square, 0.0, 1.0) } else { 0.0 };
        let point = [pair[0].x + share * across, pair[0].y + share * up];
        let distance = math::hypot(x - point[0], y - point[1]);
        if distance < least {
            (least, best) = (distance, (at, point));
        }
    }
    best
}
