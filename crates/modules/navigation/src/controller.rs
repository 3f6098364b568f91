//! Local planner of an action; it continues after a restart.

use serde::{Deserialize, Serialize};
use slate_avoidance::Footprint;
use slate_local_planning::{Dwa, LocalPlanningError, MotionState, Mppi, MppiMemory, PlanarVelocity};
use slate_plugin::interfaces::{Odometry, Path, Point2, Pose2};
use slate_plugin::module::Random;
use slate_plugin::prelude::*;

use crate::body::{MissingInput, NavigationBody};
use crate::frames::PlanarTransform;
use crate::local_plan::LocalPlan;
use crate::local_window::LocalWindow;
use crate::settings::{ControllerSettings, LocalPlannerChoice};

/// Local planner that follows paths.
/// Its state is its memory between ticks; the rest is rebuilt.
#[derive(Default, Serialize, Deserialize)]
pub struct PathController {
    memory: MppiMemory,
    /// Newest velocity, and when it was planned, s.
    newest: Option<(PlanarVelocity, f64)>,
    #[serde(skip)]
    planner: Option<(ControllerSettings, FollowingPlanner)>,
    #[serde(skip)]
    window: Option<Box<LocalWindow>>,
    /// Path in the odometry frame.
    #[serde(skip)]
    path: Vec<Point2>,
}

enum FollowingPlanner {
    Mppi(Box<Mppi>),
    Dwa(Box<Dwa>),
}

/// Inputs of a local planner in a cycle.
pub struct ControlInputs<'a> {
    /// Pose in the map frame.
    pub pose: Pose2,
    /// Odometry of the same time.
    pub odometry: &'a Odometry,
    /// Points on obstacles in the odometry frame.
    pub obstacles: &'a [Point2],
    /// Settings.
    pub settings: &'a ControllerSettings,
}

impl<'a> ControlInputs<'a> {
    /// Reads them.
    ///
    /// # Errors
    /// The input that is missing or old.
    pub fn read(body: &'a NavigationBody) -> Result<Self, MissingInput> {
        Ok(Self {
            pose: body.pose()?,
            odometry: body.odometry()?,
            obstacles: &body.obstacles()?.points,
            settings: body.settings()?,
        })
    }
}

impl PathController {
    /// Returns the velocity that follows a path in the map frame.
    /// At its end the robot turns to a heading, rad; `None` if no velocity is free.
    ///
    /// # Errors
    /// Settings or an outline that no local planner can have.
    pub fn follow(
        &mut self,
        inputs: &ControlInputs<'_>,
        (path, heading): (&Path, Option<f64>),
        body: &NavigationBody,
        now: &Tick,
    ) -> Result<Option<PlanarVelocity>, LocalPlanningError> {
        let (settings, time) = (inputs.settings, now.seconds());
        if let Some((velocity, planned)) = self.newest
            && (0.0..settings.model_dt - 1e-6).contains(&(time - planned))
        {
            return Ok(Some(velocity));
        }
        let window = LocalWindow::fit(&mut self.window, settings.window_size, body)?;
        window.update(&inputs.odometry.pose, inputs.obstacles);
        let planner = match &mut self.planner {
            Some((known, planner)) if *known == *settings => planner,
            other => {
                let mut planner = FollowingPlanner::new(settings, &window.footprint)?;
                if let FollowingPlanner::Mppi(planner) = &mut planner {
                    planner.resume(&self.memory);
                }
                &mut other.insert((*settings, planner)).1
            }
        };
        let to_odometry = PlanarTransform::between(&inputs.pose, &inputs.odometry.pose);
        self.path.clear();
        self.path.extend(path.points.iter().map(|point| to_odometry.point2(*point)));
        let heading = heading.map(|heading| to_odometry.heading(heading));
        let state = MotionState { pose: inputs.odometry.pose, velocity: inputs.odometry.twist.into() };
        let velocity = match planner {
            FollowingPlanner::Mppi(planner) => {
                let velocity = planner.plan(&state, &self.path, heading, &window.field);
                planner.remember(&mut self.memory);
                if velocity.is_some() {
                    let poses = (&inputs.odometry.pose, &inputs.pose);
                    LocalPlan::write(&body.local_plan, planner, settings, poses);
                }
                velocity
            }
            FollowingPlanner::Dwa(planner) => planner.plan(&state, &self.path, &window.field),
        };
        self.newest = velocity.map(|velocity| (velocity, time));
        Ok(velocity)
    }

    /// Returns whether a velocity keeps clear of obstacles for a short time.
    ///
    /// # Errors
    /// As [`LocalWindow::fit`].
    pub fn is_free(
        &mut self,
        inputs: &ControlInputs<'_>,
        velocity: PlanarVelocity,
        body: &NavigationBody,
    ) -> Result<bool, LocalPlanningError> {
        let window = LocalWindow::fit(&mut self.window, inputs.settings.window_size, body)?;
        window.update(&inputs.odometry.pose, inputs.obstacles);
        Ok(window.is_free(&inputs.odometry.pose, velocity))
    }

    /// Forgets earlier controls, as after a recovery.
    pub fn reset(&mut self) {
        (self.memory, self.newest) = (MppiMemory::default(), None);
        if let Some((_, FollowingPlanner::Mppi(planner))) = &mut self.planner {
            planner.reset();
        }
    }
}

impl FollowingPlanner {
    fn new(settings: &ControllerSettings, footprint: &Footprint) -> Result<Self, LocalPlanningError> {
        if settings.planner == LocalPlannerChoice::DWA {
            return Ok(Self::Dwa(Box::new(Dwa::new(settings.dwa(), footprint)?)));
        }
        let random = Random::new(settings.seed, "local planner");
        Ok(Self::Mppi(Box::new(Mppi::new(settings.mppi(), footprint, random)?)))
    }
}
