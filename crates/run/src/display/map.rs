//! Map of the world in characters.

use crossterm::style::Color;
use slate_module::math;
use slate_report::Scene;

use super::styled::StyledLine;

const OBSTACLE: char = '█';

/// Arrows for headings, counter-clockwise from x.
const ARROWS: [char; 8] = ['→', '↗', '↑', '↖', '←', '↙', '↓', '↘'];

/// Obstacles on a grid of characters, each twice as high as wide.
pub struct CharacterMap {
    columns: usize,
    rows: usize,
    minimum: [f64; 2],
    /// Height of a character, meters.
    height: f64,
    fixed: Vec<char>,
}

/// Mark over the obstacles.
pub struct CharacterMark {
    pub x: f64,
    pub y: f64,
    pub text: String,
    pub color: Option<Color>,
}

impl CharacterMap {
    /// Fits a scene into columns and rows; `None` for a scene without extent.
    pub fn new(scene: &Scene, columns: usize, rows: usize) -> Option<Self> {
        let (minimum, maximum) = (scene.bounds.minimum, scene.bounds.maximum);
        let [width, depth] = [maximum[0] - minimum[0], maximum[1] - minimum[1]];
        let height = math::max(depth / rows as f64, 2.0 * width / columns as f64);
        if !(width > 0.0 && depth > 0.0 && height.is_finite()) {
            return None;
        }
        let columns = ((2.0 * width / height).ceil() as usize).clamp(1, columns);
        let rows = ((depth / height).ceil() as usize).clamp(1, rows);
        let mut map = Self { columns, rows, minimum, height, fixed: vec![' '; columns * rows] };
        for polygon in &scene.polygons {
            map.fill(|x, y| is_inside(&polygon.points, x, y));
            map.trace(&polygon.points);
        }
        for circle in &scene.circles {
            map.fill(|x, y| math::hypot(x - circle.center[0], y - circle.center[1]) <= circle.radius);
        }
        Some(map)
    }

    /// Returns the width with the frame around the map.
    pub fn width(&self) -> usize {
        self.columns + 2
    }

    fn fill(&mut self, is_occupied: impl Fn(f64, f64) -> bool) {
        for row in 0..self.rows {
            for column in 0..self.columns {
                let x = self.minimum[0] + (column as f64 + 0.5) * self.height / 2.0;
                let y = self.minimum[1] + ((self.rows - row) as f64 - 0.5) * self.height;
                if is_occupied(x, y) {
                    self.fixed[row * self.columns + column] = OBSTACLE;
                }
            }
        }
    }

    /// Draws an outline, which may be thinner than a character.
    fn trace(&mut self, points: &[[f64; 2]]) {
        for (from, to) in points.iter().zip(points.iter().cycle().skip(1)) {
            let [dx, dy] = [to[0] - from[0], to[1] - from[1]];
            let steps = (4.0 * math::hypot(dx, dy) / self.height).ceil().clamp(1.0, 1e4);
            for step in 0..steps as usize {
                let part = step as f64 / steps;
                if let Some((column, row)) = self.cell(from[0] + part * dx, from[1] + part * dy) {
                    self.fixed[row * self.columns + column] = OBSTACLE;
                }
            }
        }
    }

    /// Returns the column and row of a point on the map.
    fn cell(&self, x: f64, y: f64) -> Option<(usize, usize)> {
        let column = (x - self.minimum[0]) / (self.height / 2.0);
        let row = (y - self.minimum[1]) / self.height;
        let is_on_map = column >= 0.0 && row >= 0.0 && column.is_finite() && row.is_finite();
        let (column, row) = (column as usize, row as usize);
        (is_on_map && column < self.columns && row < self.rows).then(|| (column, self.rows - 1 - row))
    }

    /// Draws the map with marks, the later over the earlier ones, in a frame.
    pub fn draw(&self, marks: &[CharacterMark]) -> Vec<StyledLine> {
        let mut cells: Vec<(char, Option<Color>)> =
            self.fixed.iter().map(|sign| (*sign, Some(Color::DarkGrey))).collect();
        for mark in marks {
            let Some((column, row)) = self.cell(mark.x, mark.y) else { continue };
            for (place, sign) in mark.text.chars().enumerate().take(self.columns - column) {
                cells[row * self.columns + column + place] = (sign, mark.color);
            }
        }
        let edge = |left: char, right: char| {
            let mut line = StyledLine::default();
            line.push(format!("{left}{}{right}", "─".repeat(self.columns)), Some(Color::DarkGrey));
            line
        };
        let rows = cells.chunks(self.columns).map(|row| {
            let mut line = StyledLine::default();
            line.push("│", Some(Color::DarkGrey));
            for span in row.chunk_by(|a, b| a.1 == b.1) {
                line.push(span.iter().map(|(sign, _)| *sign).collect::<String>(), span[0].1);
            }
            line.push("│", Some(Color::DarkGrey));
            line
        });
        [edge('┌', '┐')].into_iter().chain(rows).chain([edge('└', '┘')]).collect()
    }
}

/// Returns the arrow for a heading in radians.
pub fn arrow(theta: f64) -> char {
    let eighths = (theta / std::f64::consts::FRAC_PI_4).round();
    let place = if eighths.is_finite() { eighths.rem_euclid(8.0) as usize } else { 0 };
    ARROWS[place % ARROWS.len()]
}

/// Returns whether a point is inside a polygon, by the even-odd rule.
fn is_inside(points: &[[f64; 2]], x: f64, y: f64) -> bool {
    let mut inside = false;
    for (a, b) in points.iter().zip(points.iter().cycle().skip(1)) {
        if (a[1] > y) != (b[1] > y) && x < a[0] + (y - a[1]) / (b[1] - a[1]) * (b[0] - a[0]) {
            inside = !inside;
        }
    }
    inside
}

#[cfg(test)]
mod tests {
    use slate_report::{Bounds, Polygon};

    use super::*;

    #[test]
    fn map_shows_obstacles_and_robots_where_they_are() {
        let points = vec![[1.0, 1.0], [2.0, 1.0], [2.0, 2.0], [1.0, 2.0]];
        let scene = Scene {
            bounds: Bounds { minimum: [0.0, 0.0], maximum: [4.0, 4.0] },
            polygons: vec![Polygon { name: "box".into(), points }],
            ..Scene::default()
        };
        let map = CharacterMap::new(&scene, 80, 4).unwrap();
        let robot = CharacterMark { x: 3.1, y: 3.1, text: arrow(1.6).to_string(), color: None };
        let drawn: Vec<_> = map.draw(&[robot]).iter().map(|line| line.render(80, false)).collect();
        assert_eq!(drawn[1], "│      ↑ │");
        assert!(drawn[3].starts_with("│  ██"), "{drawn:?}");
        assert_eq!((map.width(), drawn.len()), (10, 6));
        assert!(CharacterMap::new(&Scene::default(), 80, 4).is_none());
    }
}
