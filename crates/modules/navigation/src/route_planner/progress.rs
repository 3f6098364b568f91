//! Progress of a mission.

use serde::{Deserialize, Serialize};
use slate_plugin::interfaces::{Point2, Pose2};
use slate_plugin::module::blackboard::nearest_names;
use slate_plugin::prelude::*;

use super::places::KnownPlaces;
use crate::actions::GoalPose;
use crate::frames::PlanarTransform;
use crate::mission::{NavigationGoal, NavigationMission, NavigationStatus};

/// Progress of a mission.
#[derive(Default, Serialize, Deserialize)]
pub struct MissionProgress {
    /// Number of the mission.
    mission: u64,
    /// Index of the goal; in a loop, of all laps.
    index: u64,
    reached: u64,
    given_up: u64,
    /// Time of the newest plan, ns.
    planned: Option<u64>,
    /// End of the newest path, m.
    pub end: Option<[f64; 2]>,
    /// True if the action for the goal was requested.
    /// `ticket` is its number.
    pub is_requested: bool,
    ticket: u64,
    /// True if the robot docks: the approach is done.
    pub is_docking: bool,
    /// True if the action was cleared for a pause.
    pub is_paused: bool,
    /// Actions for this goal that failed.
    pub failures: u32,
    /// Time since which no path was found, s.
    blocked_since: Option<f64>,
    /// Time until which the robot stays, s.
    dwell_until: f64,
}

impl MissionProgress {
    /// Begins a mission; returns false for the current one.
    pub fn begin(&mut self, mission: &NavigationMission) -> bool {
        if self.mission == mission.number {
            return false;
        }
        *self = Self {
            mission: mission.number,
            reached: self.reached,
            given_up: self.given_up,
            ..Self::default()
        };
        true
    }

    /// Returns the present goal; `None` after the last one.
    pub fn goal<'m>(&self, mission: &'m NavigationMission) -> Option<&'m NavigationGoal> {
        let count = mission.goals.len() as u64;
        if count == 0 || (self.index >= count && !mission.is_loop.get()) {
            return None;
        }
        mission.goals.get((self.index % count) as usize)
    }

    /// Handles the actions that have ended.
    /// `docks` is true for a goal to dock at.
    pub fn take_endings(&mut self, situation: &Situation<'_>, docks: bool, dwell_time: f64, now: &Tick) {
        for ended in situation.ended() {
            if !self.is_requested || ended.ticket != self.ticket {
                continue;
            }
            match ended.ending {
                Ending::COMPLETED if docks && !self.is_docking => {
                    (self.is_docking, self.is_requested) = (true, false);
                }
                Ending::COMPLETED => {
                    self.reached += 1;
                    self.advance();
                    self.dwell_until = now.seconds() + dwell_time;
                }
                Ending::FAILED => {
                    self.failures += 1;
                    (self.is_docking, self.planned) = (false, None);
                }
                _ => {}
            }
        }
    }

    /// Gives up the current goal.
    pub fn give_up(&mut self) {
        self.given_up += 1;
        self.advance();
    }

    /// Advances to the next goal.
    fn advance(&mut self) {
        *self = Self {
            mission: self.mission,
            index: self.index + 1,
            reached: self.reached,
            given_up: self.given_up,
            ..Self::default()
        };
    }

    /// Returns true if the robot dwells at a goal.
    pub fn dwells(&self, time: f64) -> bool {
        time < self.dwell_until
    }

    /// Returns true if a plan is due.
    pub fn is_due(&self, period: f64, now: &Tick) -> bool {
        let elapsed = |planned: u64| now.now().saturating_sub(planned) as f64;
        !self.is_docking && self.planned.is_none_or(|planned| elapsed(planned) >= period * 1e9 - 1.0)
    }

    /// Notes a path.
    pub fn set_planned(&mut self, end: Point2, now: &Tick) {
        (self.planned, self.blocked_since) = (Some(now.now()), None);
        let is_same = self.end.is_some_and(|[x, y]| math::hypot(x - end.x, y - end.y) < SAME_END);
        if !is_same {
            // An action that leads elsewhere is replaced.
            (self.end, self.is_requested) = (Some([end.x, end.y]), false);
        }
    }

    /// Notes that no path was found; returns for how long, s.
    pub fn set_blocked(&mut self, now: &Tick) -> f64 {
        self.planned = Some(now.now());
        now.seconds() - *self.blocked_since.get_or_insert(now.seconds())
    }

    /// Returns true if the newest plan found no path.
    pub fn is_blocked(&self) -> bool {
        self.blocked_since.is_some()
    }

    /// Notes a request.
    pub fn set_requested(&mut self, ticket: u64) {
        (self.is_requested, self.ticket) = (true, ticket);
    }

    /// Writes the counts.
    pub fn write(&self, status: &mut NavigationStatus) {
        (status.goal, status.reached, status.given_up) = (self.index, self.reached, self.given_up);
    }
}

/// Distance within which the ends of two paths are the same, m.
const SAME_END: f64 = 0.2;

/// Goal in the map frame.
#[derive(Clone, Copy, Debug)]
pub struct ResolvedGoal {
    /// Pose of the goal.
    pub goal: GoalPose,
    /// Point at which docking begins; `None` without docking.
    dock_from: Option<Point2>,
}

impl ResolvedGoal {
    /// Finds the pose of a goal.
    ///
    /// # Errors
    /// The graph has no such place; with the name of a similar one.
    pub fn of(
        goal: &NavigationGoal,
        places: &KnownPlaces,
        dock_distance: f64,
    ) -> Result<Self, Option<String>> {
        let name = goal.place.as_str();
        let pose = if name.is_empty() {
            GoalPose { x: goal.x, y: goal.y, heading: goal.has_heading.get().then_some(goal.theta) }
        } else {
            let near = || nearest_names(name, places.names()).first().cloned();
            let place = places.find(name).ok_or_else(near)?;
            GoalPose { x: place.position.x, y: place.position.y, heading: place.heading }
        };
        let GoalPose { x, y, heading } = pose;
        // Without a heading it can't dock.
        let dock_from = heading.filter(|_| goal.dock.get()).map(|theta| {
            let [x, y] = PlanarTransform::of(&Pose2 { x, y, theta }).point([-dock_distance, 0.0]);
            Point2 { x, y }
        });
        Ok(Self { goal: pose, dock_from })
    }

    /// Returns true if the robot docks.
    pub fn docks(&self) -> bool {
        self.dock_from.is_some()
    }

    /// Returns the position of the goal.
    pub fn position(&self) -> Point2 {
        Point2 { x: self.goal.x, y: self.goal.y }
    }

    /// Returns the end of the path.
    pub fn approach(&self) -> Point2 {
        self.dock_from.unwrap_or(self.position())
    }
}
