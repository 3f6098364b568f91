//! Goals of a robot that navigates.

use serde::{Deserialize, Serialize};
use slate_plugin::prelude::*;

/// Maximum number of goals of a mission.
pub const MOST_GOALS: usize = 16;

/// Goal of navigation: a pose in the map frame, or a named place.
#[interface]
#[derive(PartialEq)]
pub struct NavigationGoal {
    /// x in the map frame; of no meaning with a place.
    #[unit("m")]
    pub x: f64,
    /// y in the map frame; of no meaning with a place.
    #[unit("m")]
    pub y: f64,
    /// Heading at the goal, if it counts.
    #[unit("rad")]
    pub theta: f64,
    /// True if the heading counts.
    /// A place has its own.
    pub has_heading: Bool,
    /// Docking: true if the robot docks there: slowly, straight and within 2 cm.
    pub dock: Bool,
    /// Name of a place of the navigation graph; empty for the pose.
    pub place: Text<28>,
}

/// Name of a place.
#[interface]
#[derive(PartialEq)]
pub struct PlaceName {
    /// Name of the place, as in the navigation graph.
    pub place: Text<28>,
}

/// Change of a mission.
#[interface]
pub enum NavigationCommand {
    /// New mission with this goal alone.
    GoTo,
    /// Appends a goal to the mission.
    Append,
    /// Pause until a resumption.
    Pause,
    /// Resumes the mission after a pause.
    Resume,
    /// Cancels the mission.
    Cancel,
}

/// Request of a change of the mission, for Knowledge.
#[interface]
#[derive(PartialEq)]
pub struct NavigationRequest {
    /// Command of the change.
    pub command: NavigationCommand,
    /// Goal of a `GoTo` or an `Append`.
    pub goal: NavigationGoal,
}

impl NavigationRequest {
    /// Refusal: the mission has sixteen goals already.
    pub const FULL: u16 = 1;
    /// Refusal: the pose is not a number.
    pub const NOT_FINITE: u16 = 2;
    /// Refusal: the robot has no mission to pause, resume or cancel.
    pub const NO_MISSION: u16 = 3;
}

/// Goals of a robot, from Knowledge.
#[interface]
#[derive(PartialEq)]
pub struct NavigationMission {
    /// Number of the mission; a new one begins with its first goal.
    pub number: u64,
    /// Pause state: true while the robot stands.
    pub is_paused: Bool,
    /// Loop: true if the first goal follows the last one.
    pub is_loop: Bool,
    /// Goals in the order of the visits.
    pub goals: Sequence<NavigationGoal, 16>,
}

/// State of navigation.
#[interface]
pub enum NavigationState {
    /// No goal.
    Idle,
    /// Driving to the goal.
    Navigating,
    /// Paused.
    Paused,
    /// No path at present; it plans again.
    Blocked,
    /// An input is missing or old.
    WaitingForInput,
    /// All goals were reached or given up.
    Finished,
}

/// Status of navigation, of the Plan.
#[interface]
#[derive(PartialEq)]
pub struct NavigationStatus {
    /// State.
    pub state: NavigationState,
    /// Number of the mission.
    pub mission: u64,
    /// Index of the goal in the mission; in a loop, of all laps.
    pub goal: u64,
    /// Goals reached since the start.
    pub reached: u64,
    /// Goals given up since the start.
    pub given_up: u64,
    /// Length of the path that is left when it was planned.
    #[unit("m")]
    pub distance: f64,
    /// Nearest free point, if the goal is in an obstacle; else the goal.
    pub nearest_free: Point2,
    /// Reason in words, such as why a goal is given up.
    pub reason: Text<124>,
}

/// Goal as state.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct SavedGoal {
    x: f64,
    y: f64,
    theta: f64,
    has_heading: bool,
    dock: bool,
    place: String,
}

impl From<&NavigationGoal> for SavedGoal {
    fn from(goal: &NavigationGoal) -> Self {
        Self {
            x: goal.x,
            y: goal.y,
            theta: goal.theta,
            has_heading: goal.has_heading.get(),
            dock: goal.dock.get(),
            place: goal.place.as_str().into(),
        }
    }
}

impl From<&PlaceName> for SavedGoal {
    fn from(name: &PlaceName) -> Self {
        Self { place: name.place.as_str().into(), ..Self::default() }
    }
}

impl From<&Point2> for SavedGoal {
    fn from(point: &Point2) -> Self {
        Self { x: point.x, y: point.y, ..Self::default() }
    }
}

impl From<&SavedGoal> for NavigationGoal {
    fn from(goal: &SavedGoal) -> Self {
        Self {
            x: goal.x,
            y: goal.y,
            theta: goal.theta,
            has_heading: goal.has_heading.into(),
            dock: goal.dock.into(),
            place: Text::new(&goal.place),
        }
    }
}
