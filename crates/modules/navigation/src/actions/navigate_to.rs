//! Navigation to a pose.

use serde::{Deserialize, Serialize};
use slate_local_planning::{ProgressChecker, RecoveryBehavior};
use slate_plugin::prelude::*;

use super::follow_path::{FollowPath, FollowStep, GoalPose};
use super::recovery::{BackUp, ClearCostmap, Spin, Wait};
use crate::body::NavigationBody;
use crate::settings::ControllerSettings;

/// Drives to a pose along the Plan's path, and frees itself where it is stuck.
#[derive(Serialize, Deserialize)]
pub struct NavigateTo {
    goal: GoalPose,
    follow: FollowPath,
    recovery: Option<RecoveryAction>,
    progress: Option<ProgressChecker>,
    /// Cycles without a free velocity.
    blocked: u32,
    /// Recoveries since the robot last got on.
    retries: u32,
    /// Position of the newest recovery, in the odometry frame, m.
    stuck_at: [f64; 2],
}

/// Arguments of [`NavigateTo`].
#[derive(Clone, Copy)]
pub struct NavigateToArguments {
    /// x in the map frame, m.
    pub x: f64,
    /// y in the map frame, m.
    pub y: f64,
    /// Heading, rad.
    pub theta: f64,
    /// 1 if the heading counts, 0 for any.
    pub has_heading: f64,
}
arguments!(NavigateToArguments { x, y, theta, has_heading });

/// Recovery that runs.
#[derive(Serialize, Deserialize)]
enum RecoveryAction {
    ClearCostmap(ClearCostmap),
    BackUp(BackUp),
    Spin(Spin),
    Wait(Wait),
}

/// Cycles without a free velocity after which a robot is stuck.
const MOST_BLOCKED: u32 = 40;

impl ActionKind for NavigateTo {
    const KIND: &'static str = "NavigateTo";
    type Arguments = NavigateToArguments;

    fn start(arguments: NavigateToArguments) -> Self {
        let NavigateToArguments { x, y, theta, has_heading } = arguments;
        Self {
            goal: GoalPose { x, y, heading: (has_heading > 0.5).then_some(theta) },
            follow: FollowPath::default(),
            recovery: None,
            progress: None,
            blocked: 0,
            retries: 0,
            stuck_at: [0.0; 2],
        }
    }

    fn children(&self, tree: &mut ActionTree) {
        match &self.recovery {
            None => tree.child(&self.follow),
            Some(RecoveryAction::ClearCostmap(action)) => tree.child(action),
            Some(RecoveryAction::BackUp(action)) => tree.child(action),
            Some(RecoveryAction::Spin(action)) => tree.child(action),
            Some(RecoveryAction::Wait(action)) => tree.child(action),
        }
    }
}

impl Action<NavigationBody> for NavigateTo {
    fn act(&mut self, acting: &Acting<'_, NavigationBody>) -> Step {
        if let Some(recovery) = &mut self.recovery {
            if recovery.act(acting) == Step::Running {
                return Step::Running;
            }
            // In the same cycle, so that the wheels never wait for a command.
            self.recovery = None;
            self.progress = None;
            self.follow.reset();
        }
        match self.follow.step(Some(self.goal), acting) {
            FollowStep::Arrived => return Step::Done,
            FollowStep::Failed => return Step::Failed,
            FollowStep::Waiting => {
                (self.progress, self.blocked) = (None, 0);
                return Step::Running;
            }
            FollowStep::Driving => self.blocked = 0,
            FollowStep::Blocked => self.blocked += 1,
        }
        if self.blocked >= MOST_BLOCKED || !self.makes_progress(acting) {
            return self.recover(acting);
        }
        Step::Running
    }

    fn cancel(&mut self, acting: &Acting<'_, NavigationBody>) {
        acting.body.stand(acting.priority);
    }
}

impl NavigateTo {
    /// Returns true if the robot makes progress.
    fn makes_progress(&mut self, acting: &Acting<'_, NavigationBody>) -> bool {
        let (Ok(settings), Ok(odometry)) = (acting.body.settings(), acting.body.odometry()) else {
            return true;
        };
        let pose = odometry.pose;
        let radius = settings.required_movement_radius;
        if math::hypot(pose.x - self.stuck_at[0], pose.y - self.stuck_at[1]) > 2.0 * radius {
            self.retries = 0;
        }
        if self.progress.is_none() {
            self.progress = ProgressChecker::new(radius, settings.movement_time_allowance).ok();
        }
        self.progress.as_mut().is_none_or(|progress| progress.check(&pose, acting.now.seconds()))
    }

    /// Starts the next recovery, unless none has helped.
    fn recover(&mut self, acting: &Acting<'_, NavigationBody>) -> Step {
        let Acting { body, now, .. } = *acting;
        let (Ok(settings), Ok(odometry)) = (body.settings(), body.odometry()) else { return Step::Running };
        if self.retries >= settings.number_of_retries {
            now.warn(format_args!(
                "NavigateTo ({:.2}, {:.2}): the robot is stuck, and {} recoveries have not helped",
                self.goal.x, self.goal.y, self.retries
            ));
            return Step::Failed;
        }
        let recoveries = ControllerSettings::recoveries();
        let behavior = recoveries[self.retries as usize % recoveries.len()];
        self.retries += 1;
        self.blocked = 0;
        self.stuck_at = [odometry.pose.x, odometry.pose.y];
        self.recovery = Some(RecoveryAction::of(behavior));
        now.info(format_args!("the robot is stuck: {behavior:?}"));
        Step::Running
    }
}

impl RecoveryAction {
    fn of(behavior: RecoveryBehavior) -> Self {
        match behavior {
            RecoveryBehavior::ClearCostmap => Self::ClearCostmap(ClearCostmap::start(())),
            RecoveryBehavior::BackUp { distance, speed } => Self::BackUp(BackUp::start([distance, speed])),
            RecoveryBehavior::Spin { angle, speed } => Self::Spin(Spin::start([angle, speed])),
            RecoveryBehavior::Wait { duration } => Self::Wait(Wait::start(duration)),
        }
    }

    fn act(&mut self, acting: &Acting<'_, NavigationBody>) -> Step {
        match self {
            Self::ClearCostmap(action) => action.act(acting),
            Self::BackUp(action) => action.act(acting),
            Self::Spin(action) => action.act(acting),
            Self::Wait(action) => action.act(acting),
        }
    }
}
