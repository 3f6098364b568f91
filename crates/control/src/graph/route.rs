//! Path of an edge in a drawing.

use std::fmt::Write;

/// Radius of the corners of a line.
const CORNER_RADIUS: f64 = 7.0;

/// Route of an edge between its two ends.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct EdgeRoute {
    /// Stretches through the columns between the two ends: left, right, and y.
    pub(super) passes: Vec<(f64, f64, f64)>,
    /// Right border of the column of the source.
    pub(super) border: f64,
    /// X of the vertical line that edges of one source into another group share.
    pub(super) trunk: Option<f64>,
    /// Right x, left x and y of a loop-closing edge, which runs back below its group.
    pub(super) detour: Option<(f64, f64, f64)>,
}

impl EdgeRoute {
    /// Returns whether the edge closes a loop.
    pub fn is_back(&self) -> bool {
        self.detour.is_some()
    }

    /// Returns the middle of the line below the group, of an edge that closes a loop.
    pub fn turn(&self) -> Option<(f64, f64)> {
        self.detour.map(|(right, left, low)| ((right + left) / 2.0, low))
    }

    /// Returns the height at which the edge reaches its destination's column.
    /// `None` without a column in between.
    pub fn arrival(&self) -> Option<f64> {
        self.passes.last().map(|(.., y)| *y)
    }

    /// Returns the SVG path from the source's right side to the destination's left.
    pub fn path(&self, start: (f64, f64), end: (f64, f64)) -> String {
        let mut path = format!("M{:.1} {:.1}", start.0, start.1);
        if let Some((right, left, low)) = self.detour {
            rounded(&[start, (right, start.1), (right, low), (left, low), (left, end.1), end], &mut path);
            return path;
        }
        let mut at = start;
        if self.border > start.0 {
            at.0 = self.border;
            let _ = write!(path, "H{:.1}", at.0);
        }
        let stretches = self.passes.iter().copied().chain([(end.0, end.0, end.1)]);
        for (index, (left, right, y)) in stretches.enumerate() {
            match self.trunk.filter(|_| index == 0 && (y - at.1).abs() > 1.0) {
                Some(trunk) => rounded(&[at, (trunk, at.1), (trunk, y), (left, y)], &mut path),
                None => {
                    let middle = (at.0 + left) / 2.0;
                    let _ = write!(path, "C{middle:.1} {:.1} {middle:.1} {y:.1} {left:.1} {y:.1}", at.1);
                }
            }
            if right > left {
                let _ = write!(path, "H{right:.1}");
            }
            at = (right, y);
        }
        path
    }
}

/// Appends a line through points with round corners, from the first point on.
fn rounded(points: &[(f64, f64)], path: &mut String) {
    let toward = |point: (f64, f64), other: (f64, f64)| {
        let (x, y) = (other.0 - point.0, other.1 - point.1);
        let length = (x * x + y * y).sqrt();
        let part = if length > 2.0 * CORNER_RADIUS { CORNER_RADIUS / length } else { 0.5 };
        (point.0 + x * part, point.1 + y * part)
    };
    for corner in points.windows(3) {
        let (before, after) = (toward(corner[1], corner[0]), toward(corner[1], corner[2]));
        let _ = write!(
            path,
            "L{:.1} {:.1}Q{:.1} {:.1} {:.1} {:.1}",
            before.0, before.1, corner[1].0, corner[1].1, after.0, after.1
        );
    }
    if let Some((x, y)) = points.last() {
        let _ = write!(path, "L{x:.1} {y:.1}");
    }
}
