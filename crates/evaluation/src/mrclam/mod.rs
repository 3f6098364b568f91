//! Localization by landmarks on UTIAS's data set MRCLAM.
//! Leung, Halpern, Barfoot and Liu, 2011, *The UTIAS multi-robot cooperative localization and mapping dataset*.

mod data;

use std::path::Path;

use slate_interfaces::Pose2;
use slate_localization::{
    FilterMeasurement, MeasuredLandmark, MeasuredVariables, PlanarFilter, PlanarFilterParameters, RangeKind,
    StateVariable,
};
use slate_module::math;

use crate::{DataError, Evaluation, Figure, FigureGoal};
pub use data::{LandmarkLog, LoggedSighting, LoggedTwist};

/// Robot of the goal, and root mean square error of its position, m.
const GOAL: (u32, f64) = (3, 0.12);
/// Robots of the data set.
const ROBOTS: u32 = 5;
/// Standard deviations of the odometry's twist, m/s and rad/s.
const TWIST_STDDEV: [f64; 2] = [0.01, 0.02];
/// Standard deviations of a landmark's range (m, and per meter) and bearing, rad.
const LANDMARK_STDDEV: [f64; 3] = [0.03, 0.02, 0.015];
/// Mahalanobis distance from which a landmark is an outlier: barcodes are misread.
const GATE: f64 = 5.0;
/// Standard deviations of the first pose, which is the true one, m and rad.
const INITIAL_STDDEV: [f64; 3] = [0.01, 0.01, 0.01];

/// Setting of a filter for the data.
#[derive(Clone, Copy)]
struct FilterSetting {
    name: &'static str,
    range_kind: RangeKind,
    /// Standard deviation of the scales of odometry and ranges.
    scale_stddev: f64,
}

/// Filter that is to reach the goal, and what its parts contribute.
const SETTINGS: [FilterSetting; 3] = [
    FilterSetting {
        name: "ranges as depths of a camera, scales estimated",
        range_kind: RangeKind::Depth,
        scale_stddev: 0.1,
    },
    FilterSetting {
        name: "ranges as depths of a camera, scales of 1",
        range_kind: RangeKind::Depth,
        scale_stddev: 0.0,
    },
    FilterSetting {
        name: "ranges as distances, scales estimated",
        range_kind: RangeKind::Distance,
        scale_stddev: 0.1,
    },
];

/// Evaluates the Kalman filter on each robot of a folder that has its files.
///
/// # Errors
/// A file that can't be read, or is not what its format says.
pub fn evaluate(folder: &Path) -> Result<Vec<Evaluation>, DataError> {
    let robots = (1..=ROBOTS).filter(|robot| folder.join(format!("Robot{robot}_Odometry.dat")).exists());
    robots.map(|robot| evaluate_robot(&LandmarkLog::read(folder, robot)?, robot, folder)).collect()
}

fn evaluate_robot(log: &LandmarkLog, robot: u32, folder: &Path) -> Result<Evaluation, DataError> {
    let (mut figures, mut notes) = (Vec::new(), Vec::new());
    let duration = log.odometry.last().map_or(0.0, |twist| twist.time);
    figures.push(Figure::new("length of the log, s", duration));
    figures.push(Figure::new("landmarks in view", log.sightings.len() as f64));
    for setting in SETTINGS {
        let empty = || DataError::new(folder, format!("robot {robot} has no true pose at its odometry"));
        let drive = drive(log, setting).ok_or_else(empty)?;
        let name = setting.name;
        let position =
            Figure::new(format!("{name}: RMSE of the position, m"), root_mean_square(&drive.position));
        let is_goal = robot == GOAL.0 && name == SETTINGS[0].name;
        figures.push(if is_goal { position.with_goal(FigureGoal::AtMost(GOAL.1)) } else { position });
        let largest = drive.position.iter().copied().fold(0.0, math::max);
        figures.push(Figure::new(format!("{name}: largest error of the position, m"), largest));
        let heading = root_mean_square(&drive.heading).to_degrees();
        figures.push(Figure::new(format!("{name}: RMSE of the heading, degrees"), heading));
        figures.push(Figure::new(format!("{name}: outliers"), drive.rejected as f64));
        if let [linear, angular, range] = drive.scales
            && setting.scale_stddev > 0.0
        {
            notes.push(format!(
                "{name}: scales at the end: odometry {linear:.3} and {angular:.3}, ranges {range:.3}"
            ));
        }
    }
    Ok(Evaluation { name: format!("MRCLAM, robot {robot}"), figures, notes })
}

/// Errors of a filter, at each odometry.
#[derive(Default)]
struct LandmarkDrive {
    position: Vec<f64>,
    heading: Vec<f64>,
    rejected: u64,
    scales: [f64; 3],
}

fn parameters(setting: FilterSetting) -> PlanarFilterParameters {
    PlanarFilterParameters {
        process_noise: [2.5e-3, 2.5e-3, 1e-2, 1.0, 1e-4, 1.0],
        dynamic_process_noise: true,
        initial_odometry_scale_stddev: [setting.scale_stddev; 2],
        initial_landmark_scale_stddev: 0.5 * setting.scale_stddev,
        ..PlanarFilterParameters::default()
    }
}

/// Runs a filter through a log in the order of time.
/// No estimate uses later data.
fn drive(log: &LandmarkLog, setting: FilterSetting) -> Option<LandmarkDrive> {
    let mut filter = PlanarFilter::new(parameters(setting)).ok()?;
    let (start, pose) =
        log.odometry.iter().find_map(|twist| Some((twist.time, log.true_pose(twist.time)?)))?;
    filter.initialize(pose, INITIAL_STDDEV, nanoseconds(start));
    let mut sightings = log.sightings.iter().skip_while(|sighting| sighting.time < start).peekable();
    let mut drive = LandmarkDrive::default();
    for twist in log.odometry.iter().skip_while(|twist| twist.time < start) {
        while let Some(sighting) = sightings.next_if(|sighting| sighting.time < twist.time) {
            filter.update(&landmark(sighting, setting), nanoseconds(sighting.time), GATE);
        }
        let time = nanoseconds(twist.time);
        filter.predict(time);
        if let Some(truth) = log.true_pose(twist.time) {
            drive.compare(&filter.estimate()?.pose, &truth);
        }
        filter.update(&odometry(twist), time, f64::INFINITY);
    }
    drive.rejected = filter.rejected();
    let scale = |variable| filter.variable(variable).map_or(f64::NAN, |(mean, _)| mean);
    drive.scales = [
        scale(StateVariable::OdometryLinearScale),
        scale(StateVariable::OdometryAngularScale),
        scale(StateVariable::LandmarkRangeScale),
    ];
    Some(drive)
}

impl LandmarkDrive {
    fn compare(&mut self, pose: &Pose2, truth: &Pose2) {
        self.position.push(math::hypot(pose.x - truth.x, pose.y - truth.y));
        self.heading.push(math::angle_between(truth.theta, pose.theta));
    }
}

fn odometry(twist: &LoggedTwist) -> FilterMeasurement {
    let [linear, angular] = TWIST_STDDEV;
    let variables = MeasuredVariables::default()
        .with(StateVariable::Vx, twist.linear, linear)
        .with(StateVariable::Vy, 0.0, linear)
        .with(StateVariable::Vyaw, twist.angular, angular);
    FilterMeasurement::Odometry(variables)
}

fn landmark(sighting: &LoggedSighting, setting: FilterSetting) -> FilterMeasurement {
    let [constant, relative, bearing_stddev] = LANDMARK_STDDEV;
    FilterMeasurement::Landmark(MeasuredLandmark {
        landmark: sighting.landmark,
        range: sighting.range,
        range_kind: setting.range_kind,
        bearing: sighting.bearing,
        range_stddev: constant + relative * sighting.range,
        bearing_stddev,
    })
}

fn nanoseconds(seconds: f64) -> u64 {
    (seconds * 1e9) as u64
}

/// Returns the root mean square; NaN without values.
fn root_mean_square(values: &[f64]) -> f64 {
    (values.iter().map(|value| value * value).sum::<f64>() / values.len() as f64).sqrt()
}
