//! SLAM by one of the methods.

use nalgebra::Matrix3;
use serde::{Deserialize, Serialize};
use slate_interfaces::Pose2;
use slate_module::Tick;

use super::params::{MethodParameters, SlamParams};
use crate::graph_slam::GraphSlam;
use crate::parameters::InvalidSlamParameter;
use crate::particle_slam::ParticleSlam;
use crate::pose_graph::Constraint;

/// SLAM by one of the methods.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub(super) enum LiveSlam {
    Graph(GraphSlam),
    ParticleFilter(ParticleSlam),
}

impl LiveSlam {
    pub fn new(params: &SlamParams) -> Result<Self, InvalidSlamParameter> {
        Ok(match params.method()? {
            MethodParameters::Graph(parameters) => Self::Graph(GraphSlam::new(parameters)?),
            MethodParameters::ParticleFilter(parameters) => {
                Self::ParticleFilter(ParticleSlam::new(parameters)?)
            }
        })
    }

    pub fn insert(&mut self, odometry: Pose2, points: &[[f64; 2]], now: &Tick) {
        match self {
            Self::Graph(slam) => slam.track(odometry, points),
            Self::ParticleFilter(slam) => now.random(|random| slam.insert(odometry, points, random)),
        };
    }

    /// Does some of the deferred work of scans; returns true if it did any.
    pub fn work(&mut self, units: usize) -> bool {
        let Self::Graph(slam) = self else { return false };
        let had_work = slam.has_work();
        for _ in 0..units {
            if !slam.work() {
                break;
            }
        }
        had_work
    }

    pub fn has_work(&self) -> bool {
        matches!(self, Self::Graph(slam) if slam.has_work())
    }

    pub fn request_finish(&mut self) {
        if let Self::Graph(slam) = self {
            slam.request_finish();
        }
    }

    /// Poses of the scans, in the frame of the first one.
    pub fn poses(&self) -> &[Pose2] {
        match self {
            Self::Graph(slam) => slam.poses(),
            Self::ParticleFilter(slam) => slam.poses(),
        }
    }

    pub fn points(&self, scan: usize) -> &[[f64; 2]] {
        match self {
            Self::Graph(slam) => slam.points(scan),
            Self::ParticleFilter(slam) => slam.points(scan),
        }
    }

    /// Returns the covariance of the newest pose, in the frame of the first scan.
    pub fn covariance(&self) -> Matrix3<f64> {
        match self {
            Self::Graph(slam) => slam.covariance(),
            Self::ParticleFilter(slam) => slam.covariance(),
        }
    }

    /// Constraints by which loops are closed; none of the particle filter.
    pub fn loop_closures(&self) -> impl Iterator<Item = &Constraint> + Clone {
        let constraints = match self {
            Self::Graph(slam) => slam.graph().constraints.as_slice(),
            Self::ParticleFilter(_) => &[],
        };
        constraints.iter().filter(|constraint| constraint.is_robust)
    }
}
