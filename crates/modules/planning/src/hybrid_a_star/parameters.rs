//! Parameters, with the names of Nav2's Smac planner.

use std::f64::consts::TAU;

use slate_module::InvalidParameter;

use crate::steering_path::PathPenalties;

/// Paths that a robot can drive.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum DriveModel {
    /// Forward only: `DUBIN`.
    Dubins,
    /// Forward and in reverse: `REEDS_SHEPP`.
    #[default]
    ReedsShepp,
}

/// Parameters of [`HybridAStar`](crate::HybridAStar).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct HybridAStarParameters {
    /// Paths that the robot can drive, `motion_model_for_search`.
    pub drive_model: DriveModel,
    /// Smallest radius of a turn of the robot's origin, `minimum_turning_radius`, m.
    pub minimum_turning_radius: f64,
    /// Number of heading bins, `angle_quantization_bins`.
    pub angle_quantization_bins: u32,
    /// Factor on the length in reverse, `reverse_penalty`.
    pub reverse_penalty: f64,
    /// Cost of a change between forward and reverse, `change_penalty`, m.
    pub change_penalty: f64,
    /// Factor on the length of an arc, `non_straight_penalty`.
    pub non_straight_penalty: f64,
    /// Interval of analytic expansions, `analytic_expansion_ratio`.
    /// One is tried every so many cells of the distance to the goal.
    pub analytic_expansion_ratio: f64,
    /// States after which the search gives up, `max_iterations`.
    pub max_iterations: u32,
}

impl Default for HybridAStarParameters {
    fn default() -> Self {
        Self {
            drive_model: DriveModel::default(),
            minimum_turning_radius: 0.4,
            angle_quantization_bins: 72,
            reverse_penalty: 2.0,
            change_penalty: 0.0,
            non_straight_penalty: 1.2,
            analytic_expansion_ratio: 3.5,
            max_iterations: 300_000,
        }
    }
}

impl HybridAStarParameters {
    pub(super) fn check(&self) -> Result<(), InvalidParameter> {
        InvalidParameter::unless_positive(&[("minimum_turning_radius", self.minimum_turning_radius)])?;
        let bins = self.angle_quantization_bins;
        InvalidParameter::unless((8..=1024).contains(&bins), "angle_quantization_bins", "8 to 1024")?;
        let factors = [
            ("reverse_penalty", self.reverse_penalty),
            ("non_straight_penalty", self.non_straight_penalty),
            ("analytic_expansion_ratio", self.analytic_expansion_ratio),
        ];
        for (name, factor) in factors {
            InvalidParameter::unless(factor.is_finite() && factor >= 1.0, name, "a number from 1")?;
        }
        InvalidParameter::unless_magnitudes(&[("change_penalty", self.change_penalty)])?;
        InvalidParameter::unless(self.max_iterations > 0, "max_iterations", "a number above 0")
    }

    pub(super) fn penalties(&self) -> PathPenalties {
        PathPenalties {
            reverse: self.reverse_penalty,
            non_straight: self.non_straight_penalty,
            change: self.change_penalty,
        }
    }

    /// Returns the length of a step, m.
    /// The step leaves a cell of that resolution and turns by whole bins at most.
    pub(super) fn step_length(&self, resolution: f64) -> f64 {
        let bin = TAU / f64::from(self.angle_quantization_bins) * self.minimum_turning_radius;
        let least = std::f64::consts::SQRT_2 * resolution;
        (least / bin).ceil() * bin
    }
}
