//! Local planning: velocities that follow a path round observed obstacles.
//!
//! [`Mppi`] is model predictive path integral control in Nav2's formulation, [`Dwa`] the dynamic window approach. Both
//! read an [`ObstacleField`], the distances to the obstacles around the robot, and check its footprint. [`VfhPlus`] is
//! for rings of sonars, whose cones fill a [`CertaintyGrid`].
//! [`ProgressChecker`] and [`RecoverySequence`] free a robot that is stuck. All of it is plain data without an agent
//! and without a clock; the same calls give the same velocities.
//!
//! ```
//! use slate_avoidance::Footprint;
//! use slate_interfaces::{Point2, Pose2};
//! use slate_local_planning::{MotionState, Mppi, MppiParameters, ObstacleField, PlanarVelocity};
//! use slate_module::Random;
//!
//! let footprint = Footprint::new(&[[0.25, 0.2], [-0.25, 0.2], [-0.25, -0.2], [0.25, -0.2]]).unwrap();
//! let parameters = MppiParameters { batch_size: 200, ..MppiParameters::default() };
//! let mut planner = Mppi::new(parameters, &footprint, Random::new(1, "planner")).unwrap();
//! // In the robot's own frame: no localization.
//! let robot = MotionState { pose: Pose2 { x: 0.0, y: 0.0, theta: 0.0 }, velocity: PlanarVelocity::ZERO };
//! let mut field = ObstacleField::new(4.0, 0.05).unwrap();
//! field.update([0.0, 0.0], [[1.0, -0.6], [1.2, 0.9]].into_iter());
//! let path = [Point2 { x: 0.0, y: 0.0 }, Point2 { x: 3.0, y: 0.0 }];
//! let velocity = planner.plan(&robot, &path, None, &field).unwrap();
//! assert!(velocity.vx > 0.0);
//! ```

mod dwa;
mod error;
mod footprint_points;
mod mppi;
mod observations;
mod obstacle_field;
mod path_window;
mod progress;
mod saved_pose;
mod single;
mod velocity;
mod vfh_plus;
mod wavefront;

pub use dwa::{Dwa, DwaParameters};
pub use error::LocalPlanningError;
pub use footprint_points::FootprintPoints;
pub use mppi::{
    Mppi, MppiCritics, MppiMemory, MppiParameters, ObstaclesCritic, PathAlignCritic, PathAngleCritic,
    PathCritic,
};
pub use observations::ObservationBuffer;
pub use obstacle_field::ObstacleField;
pub use progress::{ProgressChecker, RecoveryBehavior, RecoveryCommand, RecoverySequence};
pub use velocity::{MotionLimits, MotionModel, MotionState, PlanarVelocity};
pub use vfh_plus::{CertaintyGrid, VfhPlus, VfhPlusParameters};
