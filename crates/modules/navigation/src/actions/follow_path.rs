//! Following of the Plan's path.

use serde::{Deserialize, Serialize};
use slate_local_planning::{LocalPlanningError, PlanarVelocity};
use slate_plugin::interfaces::Point2;
use slate_plugin::prelude::*;

use crate::body::{MissingInput, NavigationBody};
use crate::controller::{ControlInputs, PathController};
use crate::frames::distance;

/// Follows the newest path of the Plan to its end, with any heading there.
///
/// While an input is missing or old it stands, says which, and continues when that is well again.
#[derive(Default, Serialize, Deserialize)]
pub struct FollowPath {
    controller: PathController,
    /// True if the end was within its tolerance.
    /// The robot then only turns.
    is_near: bool,
    /// Input that was missing in the newest cycle.
    missing: Option<MissingInput>,
}

/// Pose at the end of a path.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct GoalPose {
    /// x in the map frame, m.
    pub x: f64,
    /// y in the map frame, m.
    pub y: f64,
    /// Heading, rad; `None` for any.
    pub heading: Option<f64>,
}

/// Progress of a step along a path.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum FollowStep {
    /// Driving to the goal.
    Driving,
    /// No free velocity.
    Blocked,
    /// Missing input.
    Waiting,
    /// Arrival at the goal.
    Arrived,
    /// Invalid settings.
    Failed,
}

/// Largest distance between the end of a path and the goal that it is for, m.
const SAME_GOAL: f64 = 0.3;
/// Angular velocity per error of the heading, 1/s, and the least one, rad/s.
const TURN_GAIN: f64 = 1.5;
const MIN_ANGULAR_VELOCITY: f64 = 0.15;
/// Factor by which the tolerance grows once the robot is within it.
const HYSTERESIS: f64 = 2.0;

impl ActionKind for FollowPath {
    const KIND: &'static str = "FollowPath";
    type Arguments = ();

    fn start((): ()) -> Self {
        Self::default()
    }
}

impl Action<NavigationBody> for FollowPath {
    fn act(&mut self, acting: &Acting<'_, NavigationBody>) -> Step {
        match self.step(None, acting) {
            FollowStep::Driving | FollowStep::Blocked | FollowStep::Waiting => Step::Running,
            FollowStep::Arrived => Step::Done,
            FollowStep::Failed => Step::Failed,
        }
    }
}

impl FollowPath {
    /// Steps towards a goal, or to the end of the path without one.
    pub fn step(&mut self, goal: Option<GoalPose>, acting: &Acting<'_, NavigationBody>) -> FollowStep {
        let Acting { body, priority, now } = *acting;
        match self.velocity(goal, body, now) {
            Ok(PathVelocity::Free(velocity)) => {
                body.drive(velocity, priority);
                FollowStep::Driving
            }
            Ok(PathVelocity::NoneFree) => {
                body.stand(priority);
                FollowStep::Blocked
            }
            Ok(PathVelocity::Missing) => {
                body.stand(priority);
                FollowStep::Waiting
            }
            Ok(PathVelocity::Arrived) => {
                body.stand(priority);
                FollowStep::Arrived
            }
            Err(error) => {
                now.warn(format_args!("local planner: {error}"));
                body.stand(priority);
                FollowStep::Failed
            }
        }
    }

    /// Forgets earlier controls.
    pub fn reset(&mut self) {
        self.controller.reset();
    }

    fn velocity(
        &mut self,
        goal: Option<GoalPose>,
        body: &NavigationBody,
        now: &Tick,
    ) -> Result<PathVelocity, LocalPlanningError> {
        let read = ControlInputs::read(body).and_then(|inputs| {
            let path = body.path()?;
            let end = *path.points.last().ok_or(MissingInput::Path)?;
            let is_other =
                goal.is_some_and(|goal| distance(end, Point2 { x: goal.x, y: goal.y }) > SAME_GOAL);
            if is_other { Err(MissingInput::Path) } else { Ok((inputs, path, end)) }
        });
        self.report(read.as_ref().err().copied(), now);
        let Ok((inputs, path, end)) = read else { return Ok(PathVelocity::Missing) };
        let (pose, settings) = (inputs.pose, inputs.settings);
        let tolerance = settings.xy_goal_tolerance * if self.is_near { HYSTERESIS } else { 1.0 };
        self.is_near = distance(Point2 { x: pose.x, y: pose.y }, end) <= tolerance;
        let heading = goal.and_then(|goal| goal.heading);
        if !self.is_near {
            let velocity = self.controller.follow(&inputs, (path, heading), body, now)?;
            return Ok(velocity.map_or(PathVelocity::NoneFree, PathVelocity::Free));
        }
        let error = heading.map_or(0.0, |heading| math::angle_between(pose.theta, heading));
        if error.abs() <= settings.yaw_goal_tolerance {
            return Ok(PathVelocity::Arrived);
        }
        let most = 0.6 * settings.wz_max;
        let speed = math::clamp(TURN_GAIN * error.abs(), MIN_ANGULAR_VELOCITY, most);
        let turn = PlanarVelocity { wz: if error < 0.0 { -speed } else { speed }, ..PlanarVelocity::ZERO };
        let is_free = self.controller.is_free(&inputs, turn, body)?;
        Ok(if is_free { PathVelocity::Free(turn) } else { PathVelocity::NoneFree })
    }

    /// Logs an input that begins to be missing, and its end.
    fn report(&mut self, missing: Option<MissingInput>, now: &Tick) {
        match (std::mem::replace(&mut self.missing, missing), missing) {
            (before, Some(input)) if before != missing => {
                now.warn(format_args!("{input}; the robot stops until the input is valid again"));
            }
            (Some(_), None) => now.info(format_args!("all inputs are valid again: the robot continues")),
            _ => {}
        }
    }
}

/// Result of following a path in a cycle.
enum PathVelocity {
    Free(PlanarVelocity),
    NoneFree,
    Missing,
    Arrived,
}
