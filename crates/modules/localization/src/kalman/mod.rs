//! Extended Kalman filter of pose and twist.

mod belief;
mod ekf;
mod filter;
mod landmarks;
mod measurement;
mod parameters;
mod params;
mod sources;
mod tangent_plane;

pub use belief::{Innovation, StateVariable};
pub use ekf::{Ekf, EkfIo, EkfState, RejectedMeasurements};
pub use filter::{MeasurementOutcome, PlanarFilter};
pub use landmarks::{Landmark, LandmarkDetection, LandmarkDetections, LandmarkMap};
pub use measurement::{FilterMeasurement, MeasuredLandmark, MeasuredVariables, RangeKind};
pub use parameters::PlanarFilterParameters;
pub use params::EkfParams;
pub use tangent_plane::TangentPlane;
