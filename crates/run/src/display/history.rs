//! History of a run for its display: events, speeds and trails.

use std::collections::VecDeque;

use slate_module::math;
use slate_report::Route;
use slate_sorted::SortedMap;

use crate::observation::{JudgeVerdict, Observation, RobotNow};

/// Maximum number of events that are kept.
const MAX_EVENTS: usize = 64;

/// Maximum number of points of a trail; the oldest is dropped first.
const MAX_POINTS: usize = 400;

/// Distance between points of a trail, meters.
const POINT_SPACING: f64 = 0.1;

/// Time over which a speed is measured, nanoseconds of the agent's time.
const SPEED_PERIOD: u64 = 200_000_000;

/// Event in a run.
pub struct RunEvent {
    /// Agent's time, nanoseconds.
    pub time: u64,
    pub text: String,
    pub route: Option<Route>,
}

/// Robot as a display has seen it.
#[derive(Default)]
pub struct RobotTrack {
    pub now: RobotNow,
    /// Speed, m/s.
    pub speed: Option<f64>,
    /// Distance to the goal, meters.
    pub goal_distance: Option<f64>,
    /// Actions that wait for their turn.
    pub waiting: Vec<String>,
    pub trail: VecDeque<([f64; 2], Option<Route>)>,
    /// Time and position of the robot when its speed was measured.
    measured: Option<(u64, [f64; 2])>,
    collisions: f64,
}

/// Data that a display has seen.
#[derive(Default)]
pub struct SeenRun {
    pub time: u64,
    /// Robots by name.
    pub robots: SortedMap<String, RobotTrack>,
    pub events: VecDeque<RunEvent>,
    /// Number of events, including those that are no longer kept.
    pub event_count: usize,
    /// State of the mission, if any.
    pub mission: Option<String>,
}

impl SeenRun {
    /// Looks at the robots and the mission once more.
    pub fn update(&mut self, observation: &Observation, time: u64) {
        self.time = time;
        let mut new = Vec::new();
        for robot in &observation.robots {
            let Some(now) = robot.now() else { continue };
            let goal = robot.goal();
            let track = self.robots.entry(robot.name.clone()).or_default();
            let is_new = (now.route, &now.action) != (track.now.route, &track.now.action);
            if is_new && !now.action.is_empty() {
                let route = now.route.map_or(String::new(), |route| format!(" {}", route.name()));
                let text = format!("{}{route}: {}", robot.name, now.action);
                new.push(RunEvent { time, text, route: now.route });
            }
            track.follow(now, goal, time);
            track.waiting = robot.waiting(time);
        }
        for metrics in observation.metrics() {
            let count = metrics.figures.get("collisions").copied().unwrap_or_default();
            let Some(track) = self.robots.get_mut(&metrics.robot) else { continue };
            if count > track.collisions {
                let text = format!("{}: collision", metrics.robot);
                new.push(RunEvent { time, text, route: None });
            }
            track.collisions = count;
        }
        if let Some(JudgeVerdict { state, reason, .. }) = observation.verdict() {
            let state = state.to_lowercase();
            if self.mission.as_ref().is_some_and(|before| *before != state) && state != "running" {
                let text = format!("mission {state}: {reason}");
                new.push(RunEvent { time, text, route: None });
            }
            self.mission = Some(state);
        }
        self.event_count += new.len();
        self.events.extend(new);
        let excess = self.events.len().saturating_sub(MAX_EVENTS);
        self.events.drain(..excess);
    }

    /// Returns the events after the first `count`, as far as they are kept.
    pub fn events_from(&self, count: usize) -> impl Iterator<Item = &RunEvent> {
        let new = self.event_count.saturating_sub(count);
        self.events.iter().skip(self.events.len().saturating_sub(new))
    }
}

impl RobotTrack {
    fn follow(&mut self, now: RobotNow, goal: Option<[f64; 2]>, time: u64) {
        let at = [now.x, now.y];
        let distance = |from: [f64; 2]| math::hypot(at[0] - from[0], at[1] - from[1]);
        match self.measured {
            Some((before, from)) if time >= before => {
                if time - before >= SPEED_PERIOD {
                    self.speed = Some(distance(from) / ((time - before) as f64 * 1e-9));
                    self.measured = Some((time, at));
                }
            }
            // The first look, or the run has resumed from an earlier time.
            _ => self.measured = Some((time, at)),
        }
        let is_farther = self.trail.back().is_none_or(|(last, _)| distance(*last) >= POINT_SPACING);
        if is_farther {
            if self.trail.len() == MAX_POINTS {
                self.trail.pop_front();
            }
            self.trail.push_back((at, now.route));
        }
        self.goal_distance = goal.map(distance);
        self.now = now;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn speed_and_goal_distance_follow_from_poses() {
        let mut track = RobotTrack::default();
        for step in 0..=10 {
            let now = RobotNow { x: f64::from(step) * 0.05, ..RobotNow::default() };
            track.follow(now, Some([1.0, 0.0]), u64::from(step as u8) * 100_000_000);
        }
        assert!(track.speed.is_some_and(|speed| (speed - 0.5).abs() < 1e-9), "{:?}", track.speed);
        assert!(track.goal_distance.is_some_and(|distance| (distance - 0.5).abs() < 1e-9));
        assert!(track.trail.len() <= 6);
    }
}
