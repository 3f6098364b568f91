//! Layout of the display in a terminal.

use std::fmt::Write;

use crossterm::style::Color;
use slate_report::Scene;

use super::history::{RobotTrack, RunEvent, SeenRun};
use super::map::{CharacterMap, CharacterMark, arrow};
use super::styled::{StyledLine, route_color};

/// Minimum and maximum rows of the map, without its frame.
/// Fewer rows show nothing.
const MAP_ROWS: (usize, usize) = (6, 16);

/// Minimum width of the column of events beside the map.
const EVENT_COLUMNS: usize = 26;

/// Maximum number of events where the display has no map.
const EVENT_ROWS: usize = 5;

/// Width from which poses are shown as numbers, too.
const WIDE_COLUMNS: usize = 110;

/// Lays out a run in so many columns and rows.
pub struct FrameLayout {
    pub columns: usize,
    rows: usize,
    map: Option<CharacterMap>,
}

impl FrameLayout {
    /// Fits the map into a terminal of that size, below the title and a line per robot.
    pub fn new(scene: &Scene, robots: usize, (columns, rows): (usize, usize)) -> Self {
        // The last row is left to the cursor, and the title has one.
        let left = rows.saturating_sub(2 + robots).saturating_sub(2);
        let (least, most) = MAP_ROWS;
        let map = (left >= least && columns >= 40)
            .then(|| CharacterMap::new(scene, columns.saturating_sub(2).min(72), left.min(most)))
            .flatten();
        Self { columns, rows, map }
    }

    /// Returns the lines of a frame, never more than fit.
    pub fn lines(&self, title: &str, pace: Option<f64>, seen: &SeenRun, scene: &Scene) -> Vec<StyledLine> {
        let mut lines = vec![head(title, pace, seen)];
        let name_width = seen.robots.keys().map(|name| name.chars().count()).max().unwrap_or(0);
        for (name, track) in &seen.robots {
            lines.push(robot(
                &format!("{name:name_width$}"),
                track,
                self.columns >= WIDE_COLUMNS,
                self.columns,
            ));
        }
        match &self.map {
            Some(map) => lines.extend(self.map_with_events(map, seen, scene)),
            None => lines.extend(newest(seen, EVENT_ROWS).map(event)),
        }
        lines.truncate(self.rows.saturating_sub(1).max(1));
        lines
    }

    fn map_with_events(&self, map: &CharacterMap, seen: &SeenRun, scene: &Scene) -> Vec<StyledLine> {
        let mut lines = map.draw(&marks(seen, scene));
        if self.columns < map.width() + 2 + EVENT_COLUMNS {
            return lines;
        }
        let room = lines.len();
        for (line, own) in lines.iter_mut().zip(newest(seen, room)) {
            line.pad(map.width() + 2);
            line.append(event(own));
        }
        lines
    }
}

/// Returns the newest events, the oldest of them first.
fn newest(seen: &SeenRun, count: usize) -> impl Iterator<Item = &RunEvent> {
    seen.events.iter().skip(seen.events.len().saturating_sub(count))
}

/// Returns an event as a line.
pub fn event(event: &RunEvent) -> StyledLine {
    let mut line = StyledLine::default();
    line.push(format!("{:7.1} s  ", event.time as f64 * 1e-9), Some(Color::DarkGrey));
    line.push(event.text.clone(), route_color(event.route));
    line
}

fn head(title: &str, pace: Option<f64>, seen: &SeenRun) -> StyledLine {
    let mut text = format!("{title}  t {:.1} s", seen.time as f64 * 1e-9);
    if let Some(pace) = pace {
        let _ = write!(text, "  {pace:.1}x real time");
    }
    if let Some(mission) = &seen.mission {
        let _ = write!(text, "  mission {mission}");
    }
    let mut line = StyledLine::default();
    line.push(text, None);
    line
}

/// Returns a robot as a line.
/// With goal, speed, clearance, pose if wanted, route and action.
pub fn robot(name: &str, track: &RobotTrack, has_pose: bool, columns: usize) -> StyledLine {
    let now = &track.now;
    let mut text = name.to_owned();
    let _ = match track.goal_distance {
        Some(distance) => write!(text, "  goal {distance:5.2} m"),
        None => write!(text, "             "),
    };
    let _ = write!(text, "  {:4.2} m/s", track.speed.unwrap_or(0.0));
    if let Some(clearance) = now.clearance {
        let _ = write!(text, "  clear {clearance:.2} m");
    }
    if has_pose {
        let _ = write!(text, "  ({:+.2}, {:+.2}) m {:+4.0} deg", now.x, now.y, now.theta.to_degrees());
    }
    let mut line = StyledLine::default();
    line.push(text.trim_end().to_owned(), None);
    let mut doing = now.route.map_or(String::new(), |route| format!("  {:12}", route.name()));
    // The whole tree of actions if it fits, else the action at its root.
    let room = columns.saturating_sub(line.width() + doing.chars().count() + 2);
    let is_whole = !now.tree.is_empty() && now.tree.chars().count() <= room;
    let action = if is_whole { &now.tree } else { &now.action };
    let _ = write!(doing, "  {action}");
    if !track.waiting.is_empty() {
        let _ = write!(doing, "  waiting: {}", track.waiting.join(" | "));
    }
    line.push(doing.trim_end().to_owned(), route_color(now.route));
    line
}

/// Goals, trails and robots, in the order in which they are drawn.
fn marks(seen: &SeenRun, scene: &Scene) -> Vec<CharacterMark> {
    let mut marks = Vec::new();
    for track in seen.robots.values() {
        marks.extend(track.trail.iter().map(|([x, y], route)| CharacterMark {
            x: *x,
            y: *y,
            text: "·".into(),
            color: route_color(*route),
        }));
    }
    marks.extend(scene.goals.iter().map(|goal| CharacterMark {
        x: goal.x,
        y: goal.y,
        text: "×".into(),
        color: Some(Color::Green),
    }));
    for (name, track) in &seen.robots {
        let now = &track.now;
        let label: String = name.chars().take(3).collect();
        let text = format!("{}{label}", arrow(now.theta));
        marks.push(CharacterMark { x: now.x, y: now.y, text, color: route_color(now.route) });
    }
    marks
}

#[cfg(test)]
mod tests {
    use slate_report::{Bounds, Goal, Route};

    use super::*;
    use crate::observation::RobotNow;

    fn rendered(size: (usize, usize)) -> Vec<String> {
        rendered_with(size, Vec::new())
    }

    fn rendered_with(size: (usize, usize), waiting: Vec<String>) -> Vec<String> {
        let scene = Scene {
            bounds: Bounds { minimum: [0.0, 0.0], maximum: [4.0, 4.0] },
            goals: vec![Goal { label: "goal".into(), x: 3.0, y: 1.0 }],
            ..Scene::default()
        };
        let now = RobotNow {
            x: 1.0,
            y: 3.0,
            route: Some(Route::Reactive),
            action: "AvoidObstacle".into(),
            ..RobotNow::default()
        };
        let mut track = RobotTrack::default();
        (track.now, track.goal_distance, track.speed) = (now, Some(2.83), Some(0.4));
        track.waiting = waiting;
        let mut seen =
            SeenRun { time: 12_300_000_000, mission: Some("running".into()), ..SeenRun::default() };
        seen.robots.insert("r2".into(), track);
        let event = |number: u64| RunEvent { time: number, text: format!("event {number}"), route: None };
        seen.events.extend((0..40).map(event));
        let lines = FrameLayout::new(&scene, 1, size).lines("exp1, seed 0", Some(1.0), &seen, &scene);
        lines.iter().map(|line| line.render(size.0 - 1, false)).collect()
    }

    #[test]
    fn frame_shows_mission_robot_map_and_newest_events() {
        let lines = rendered((80, 24));
        assert_eq!(lines[0], "exp1, seed 0  t 12.3 s  1.0x real time  mission running");
        assert_eq!(lines[1], "r2  goal  2.83 m  0.40 m/s  reactive      AvoidObstacle");
        assert!(lines.iter().any(|line| line.contains("→r2")) && lines.iter().any(|line| line.contains('×')));
        assert!(lines.last().is_some_and(|line| line.ends_with("event 39")), "{lines:?}");
    }

    #[test]
    fn frame_shows_waiting_actions() {
        let lines = rendered_with((160, 24), vec!["TurnAngle(1.57) reflex of rank 2, 0.1 s".into()]);
        let expected = "AvoidObstacle  waiting: TurnAngle(1.57) reflex of rank 2, 0.1 s";
        assert!(lines[1].ends_with(expected), "{}", lines[1]);
    }

    #[test]
    fn frame_fits_into_a_terminal_of_any_size() {
        for (columns, rows) in [(80, 24), (200, 60), (40, 12), (60, 8), (20, 4)] {
            let lines = rendered((columns, rows));
            assert!(lines.len() < rows, "{columns} x {rows}: {lines:?}");
            assert!(lines.iter().all(|line| line.chars().count() < columns), "{columns} x {rows}: {lines:?}");
        }
    }
}
