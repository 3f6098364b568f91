//! Localization on known maps, and sensor fusion by a Kalman filter.
//! The map is matched with odometry and laser scans; the filter fuses odometry, IMU, compass, positions and landmarks.
//!
//! [`MonteCarloLocalization`] is adaptive Monte Carlo localization (KLD-AMCL) as Nav2 has it, with the names and
//! defaults of its parameters: a [`LikelihoodField`] from an exact distance transform weighs particles, which an
//! odometry motion model moves, and KLD sampling adapts their number. It is plain data without an agent: the caller
//! gives poses of the odometry, points of the scan, and random numbers.
//!
//! [`PlanarFilter`] is an extended Kalman filter of pose and twist, in the role of `robot_localization`.
//!
//! ```
//! use slate_grid::Geometry;
//! use slate_interfaces::Pose2;
//! use slate_localization::{LikelihoodField, MonteCarloLocalization, MonteCarloParameters, SensorModel};
//! use slate_module::Random;
//!
//! // A room of 4 m by 3 m, with walls on all sides.
//! let geometry = Geometry::new([0.0, 0.0], [4.0, 3.0], 0.05, 10_000).unwrap();
//! let is_wall = |cell: usize| {
//!     let (column, row) = (cell % geometry.width, cell / geometry.width);
//!     column == 0 || row == 0 || column == geometry.width - 1 || row == geometry.height - 1
//! };
//! let field = LikelihoodField::new(geometry, is_wall, |_| true, SensorModel::default()).unwrap();
//! let mut localization = MonteCarloLocalization::new(MonteCarloParameters::default()).unwrap();
//! let mut random = Random::new(1, "localization");
//! localization.initialize(Pose2 { x: 1.0, y: 1.0, theta: 0.0 }, [0.1, 0.1, 0.1], &mut random);
//! // The robot at (1, 1) sees the walls before it and on its right.
//! let points = [[2.95, 0.0], [0.0, -0.95]];
//! localization.update(Pose2 { x: 0.0, y: 0.0, theta: 0.0 }, &points, &field, &mut random);
//! let estimate = localization.estimate().unwrap();
//! assert!((estimate.pose.x - 1.0).abs() < 0.1);
//! ```

mod amcl;
mod beam_skip;
mod bins;
mod candidate_pool;
mod estimate;
pub mod frames;
pub mod inputs;
mod kalman;
mod likelihood_field;
mod map_monitor;
mod map_saver;
mod map_server;
mod monte_carlo;
mod motion_model;
mod parameters;
mod particles;

pub use amcl::{Amcl, AmclIo, AmclParams, AmclState, GlobalLocalization};
pub use kalman::{
    Ekf, EkfIo, EkfParams, EkfState, FilterMeasurement, Innovation, Landmark, LandmarkDetection,
    LandmarkDetections, LandmarkMap, MeasuredLandmark, MeasuredVariables, MeasurementOutcome, PlanarFilter,
    PlanarFilterParameters, RangeKind, RejectedMeasurements, StateVariable, TangentPlane,
};
pub use likelihood_field::{LaserModelType, LikelihoodField, SensorModel};
pub use map_monitor::{MapMonitor, MapSensors};
pub use map_saver::{MapSaver, MapSaverIo, MapSaverParams, MapSaverState, SaveMap};
pub use map_server::{MapServer, MapServerBlock, MapServerIo, MapServerParams, MapServerState};
pub use monte_carlo::MonteCarloLocalization;
pub use motion_model::OdometryAlphas;
pub use parameters::{BeamSkip, Candidates, KldSampling, MonteCarloParameters, Recovery};
pub use slate_interfaces::Particle;
pub use slate_module::InvalidParameter;

use slate_mapek::{AnalyzeBlock, MonitorBlock};

/// Largest number of cells of a map that an agent has.
const MOST_CELLS: usize = 1 << 22;

slate_module::plugin!(
    AnalyzeBlock<Amcl>,
    AnalyzeBlock<Ekf>,
    MapSaver,
    MapServerBlock,
    MonitorBlock<MapMonitor>
);

#[cfg(doctest)]
#[doc = include_str!("../../../../book/src/35-localization.md")]
mod book {}
