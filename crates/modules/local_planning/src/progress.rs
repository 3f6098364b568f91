//! Progress and recovery.

use serde::{Deserialize, Serialize};
use slate_interfaces::Pose2;
use slate_module::math;

use crate::error::LocalPlanningError;
use crate::saved_pose::{ProgressPose, ProgressPoseTime};
use crate::velocity::PlanarVelocity;

/// Detects that a robot is stuck, as Nav2's progress checkers.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ProgressChecker {
    /// Distance within which a robot makes no progress, `required_movement_radius`, m.
    radius: f64,
    /// Time without progress after which it is stuck, `movement_time_allowance`, s.
    allowance: f64,
    /// Pose and time of the last progress.
    #[serde(with = "ProgressPoseTime")]
    newest: Option<(Pose2, f64)>,
}

impl ProgressChecker {
    /// Returns a checker without observations.
    ///
    /// # Errors
    /// A radius or a time that is not above 0.
    pub fn new(
        required_movement_radius: f64,
        movement_time_allowance: f64,
    ) -> Result<Self, LocalPlanningError> {
        LocalPlanningError::unless_positive(&[
            ("required_movement_radius", required_movement_radius),
            ("movement_time_allowance", movement_time_allowance),
        ])?;
        Ok(Self { radius: required_movement_radius, allowance: movement_time_allowance, newest: None })
    }

    /// Returns whether the robot makes progress, from its pose at a time in s.
    pub fn check(&mut self, pose: &Pose2, time: f64) -> bool {
        let Some((from, since)) = self.newest else {
            self.newest = time.is_finite().then_some((*pose, time));
            return true;
        };
        let has_moved = math::hypot(pose.x - from.x, pose.y - from.y) > self.radius;
        if time.is_finite() && pose.is_known() && (has_moved || !from.is_known()) {
            self.newest = Some((*pose, time));
            return true;
        }
        time - since <= self.allowance
    }

    /// Resets the checker, as after a recovery.
    pub fn reset(&mut self) {
        self.newest = None;
    }
}

/// Behavior that frees a robot that is stuck.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub enum RecoveryBehavior {
    /// Forgets obstacles that are out of sight.
    ClearCostmap,
    /// Drives backwards, m at m/s.
    BackUp {
        /// Distance, m.
        distance: f64,
        /// Speed, m/s.
        speed: f64,
    },
    /// Turns in place, rad at rad/s.
    Spin {
        /// Angle, counter-clockwise, rad.
        angle: f64,
        /// Speed, rad/s.
        speed: f64,
    },
    /// Waits, s.
    Wait {
        /// Time, s.
        duration: f64,
    },
}

/// Maximum duration of a behavior, s.
const MOST_SECONDS: f64 = 600.0;

impl RecoveryBehavior {
    fn check(&self) -> Result<(), LocalPlanningError> {
        let in_time = |name: &'static str, seconds: f64| {
            LocalPlanningError::unless(seconds <= MOST_SECONDS, name, "a motion or a wait of up to 600 s")
        };
        match *self {
            Self::ClearCostmap => Ok(()),
            Self::BackUp { distance, speed } => {
                LocalPlanningError::unless_magnitudes(&[("distance", distance)])?;
                LocalPlanningError::unless_positive(&[("speed", speed)])?;
                in_time("distance", distance / speed)
            }
            Self::Spin { angle, speed } => {
                LocalPlanningError::unless_magnitudes(&[("angle", angle.abs())])?;
                LocalPlanningError::unless_positive(&[("speed", speed)])?;
                in_time("angle", angle.abs() / speed)
            }
            Self::Wait { duration } => {
                LocalPlanningError::unless_magnitudes(&[("duration", duration)])?;
                in_time("duration", duration)
            }
        }
    }
}

/// Command of a recovery behavior.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum RecoveryCommand {
    /// Clear the costmap, and stand still.
    ClearCostmap,
    /// Move at a velocity.
    Move(PlanarVelocity),
    /// End of the behavior: plan again.
    Done,
}

/// Recovery behaviors in turn, as Nav2's `RoundRobin`.
/// Each time the robot is stuck, the next one runs.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct RecoverySequence {
    behaviors: Vec<RecoveryBehavior>,
    next: usize,
    running: Option<RunningRecovery>,
}

#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
struct RunningRecovery {
    behavior: RecoveryBehavior,
    #[serde(with = "ProgressPose")]
    start: Pose2,
    /// Time of the start, s.
    since: f64,
    /// Angle turned, rad, and heading before.
    turned: f64,
    heading: f64,
}

/// Timeout of a motion without progress, as a multiple of its nominal duration.
const TIMEOUT_FACTOR: f64 = 3.0;

impl RecoverySequence {
    /// Returns a sequence of behaviors, which run in that order.
    ///
    /// # Errors
    /// A speed that is not above 0, a distance, an angle or a time that is not a number, or a behavior that takes more than
    /// ten minutes.
    pub fn new(behaviors: Vec<RecoveryBehavior>) -> Result<Self, LocalPlanningError> {
        behaviors.iter().try_for_each(RecoveryBehavior::check)?;
        Ok(Self { behaviors, next: 0, running: None })
    }

    /// Starts the next behavior at a pose and a time in s; returns it.
    /// `None` without any.
    pub fn start(&mut self, pose: &Pose2, time: f64) -> Option<RecoveryBehavior> {
        let behavior = *self.behaviors.get(self.next)?;
        self.next = (self.next + 1) % self.behaviors.len();
        self.running =
            Some(RunningRecovery { behavior, start: *pose, since: time, turned: 0.0, heading: pose.theta });
        Some(behavior)
    }

    /// Starts at the first behavior the next time, as the robot has made progress.
    pub fn reset(&mut self) {
        (self.next, self.running) = (0, None);
    }

    /// Returns true if a behavior runs.
    pub fn is_running(&self) -> bool {
        self.running.is_some()
    }

    /// Returns the next command.
    /// A motion ends when `is_free` reports a contact.
    pub fn step(
        &mut self,
        pose: &Pose2,
        time: f64,
        is_free: impl Fn(PlanarVelocity) -> bool,
    ) -> RecoveryCommand {
        let Some(running) = &mut self.running else { return RecoveryCommand::Done };
        running.turned += math::angle_between(running.heading, pose.theta);
        running.heading = pose.theta;
        let elapsed = time - running.since;
        let (velocity, done, takes) = match running.behavior {
            RecoveryBehavior::ClearCostmap => {
                self.running = None;
                return RecoveryCommand::ClearCostmap;
            }
            RecoveryBehavior::Wait { duration } => (PlanarVelocity::ZERO, elapsed >= duration, duration),
            RecoveryBehavior::BackUp { distance, speed } => {
                let moved = math::hypot(pose.x - running.start.x, pose.y - running.start.y);
                let velocity = PlanarVelocity { vx: -speed, ..PlanarVelocity::ZERO };
                (velocity, moved >= distance, distance / speed)
            }
            RecoveryBehavior::Spin { angle, speed } => {
                let wz = if angle < 0.0 { -speed } else { speed };
                let velocity = PlanarVelocity { wz, ..PlanarVelocity::ZERO };
                (velocity, running.turned.abs() >= angle.abs(), angle.abs() / speed)
            }
        };
        let is_motion = velocity != PlanarVelocity::ZERO;
        if done || !(0.0..=TIMEOUT_FACTOR * takes).contains(&elapsed) || (is_motion && !is_free(velocity)) {
            self.running = None;
            return RecoveryCommand::Done;
        }
        RecoveryCommand::Move(velocity)
    }
}
