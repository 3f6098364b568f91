//! Trials of the localization with a robot that drives.

use slate_interfaces::Pose2;
use slate_localization::{LikelihoodField, MonteCarloLocalization};
use slate_module::{Random, math};
use slate_sim::robot::LaserDescription;

use super::building::Building;
use super::drive::{RouteDrive, ends_of_beams};
use super::settings::{BEAMS, parameters};

/// Distance within which the pose must be found, m.
pub const TRAVEL: f64 = 20.0;
/// Errors up to which a pose is found, m and rad.
pub const FOUND: [f64; 2] = [0.25, 0.09];
/// Distance that a robot drives before it is kidnapped, m.
const BEFORE_KIDNAPPING: f64 = 5.0;
/// Steps after which a robot that does not move is given up.
const MOST_STEPS: usize = 20_000;

/// Setting of a trial.
#[derive(Clone, Copy)]
pub struct TrialSetting<'a> {
    pub building: &'a Building,
    pub laser: &'a LaserDescription,
    pub field: &'a LikelihoodField,
}

/// Errors of a pose while a robot drives.
#[derive(Clone, Debug, Default)]
pub struct Errors {
    /// Position, m.
    pub position: Vec<f64>,
    /// Heading, rad.
    pub heading: Vec<f64>,
}

impl Errors {
    /// Errors of a route that can't be driven, as of a pose that is unknown.
    pub fn unknown() -> Self {
        Self { position: vec![f64::INFINITY], heading: vec![f64::INFINITY] }
    }
}

/// Reason for a search of the pose.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SearchKind {
    /// Search of an unknown initial pose.
    Global,
    /// Search after the robot was kidnapped.
    Kidnapped,
}

impl SearchKind {
    fn name(self) -> &'static str {
        match self {
            Self::Global => "global",
            Self::Kidnapped => "kidnapped",
        }
    }

    /// Searches for the pose.
    pub fn run(self, setting: TrialSetting<'_>, seed: u64) -> Option<PoseSearch> {
        match self {
            Self::Global => find(setting, seed),
            Self::Kidnapped => kidnap(setting, seed),
        }
    }
}

/// End of a search for the pose.
#[derive(Clone, Copy, Debug)]
pub struct PoseSearch {
    /// Distance driven until the pose was right to the end, m.
    /// Infinite if it was wrong at the end.
    pub found_after: f64,
}

impl PoseSearch {
    /// Search that has not found the pose, or could not begin.
    pub const FAILED: Self = Self { found_after: f64::INFINITY };

    /// Returns whether the pose was right at the end.
    pub fn is_found(&self) -> bool {
        self.found_after.is_finite()
    }
}

/// Robot with its filter.
struct Trial<'a> {
    setting: TrialSetting<'a>,
    drive: RouteDrive<'a>,
    localization: MonteCarloLocalization,
    random: Random,
    points: Vec<[f64; 2]>,
}

impl<'a> Trial<'a> {
    fn new(setting: TrialSetting<'a>, name: &str, seed: u64) -> Option<Self> {
        Some(Self {
            drive: RouteDrive::new(setting.building, setting.laser, name, seed),
            localization: MonteCarloLocalization::new(parameters()).ok()?,
            random: Random::new(seed, &format!("{name}/localization")),
            points: Vec::new(),
            setting,
        })
    }

    fn start_known(&mut self) {
        self.localization.initialize(self.drive.truth, [0.2, 0.2, 0.1], &mut self.random);
    }

    /// Drives on to that distance, and hands out errors and distance after each step.
    fn drive(&mut self, distance: f64, mut seen: impl FnMut([f64; 2], f64)) {
        let Self { setting, drive, localization, random, points } = self;
        advance(drive, distance, |drive| {
            ends_of_beams(drive.scan(), setting.laser, BEAMS, points);
            localization.update(drive.odometry, points, setting.field, random);
            seen(errors(localization, &drive.truth), drive.driven);
        });
    }

    /// Drives until the pose must be found.
    fn search(&mut self) -> PoseSearch {
        let begin = self.drive.driven;
        let mut found_after = f64::INFINITY;
        self.drive(begin + TRAVEL, |[position, heading], driven| {
            let is_right = position < FOUND[0] && heading < FOUND[1];
            found_after = match is_right {
                true if found_after.is_finite() => found_after,
                true => driven - begin,
                false => f64::INFINITY,
            };
        });
        PoseSearch { found_after }
    }
}

/// Drives on to that distance.
fn advance(drive: &mut RouteDrive<'_>, distance: f64, mut seen: impl FnMut(&mut RouteDrive<'_>)) {
    for _ in 0..MOST_STEPS {
        if drive.driven >= distance {
            return;
        }
        drive.step();
        seen(drive);
    }
}

/// Errors of position, m, and heading, rad.
fn errors(localization: &MonteCarloLocalization, truth: &Pose2) -> [f64; 2] {
    let Some(estimate) = localization.estimate() else { return [f64::INFINITY; 2] };
    let Pose2 { x, y, theta } = estimate.pose;
    [math::hypot(x - truth.x, y - truth.y), math::angle_between(truth.theta, theta).abs()]
}

/// Follows a pose that is known along a route.
pub fn track(setting: TrialSetting<'_>, seed: u64, length: f64) -> Option<Errors> {
    let mut trial = Trial::new(setting, "track", seed)?;
    trial.start_known();
    let mut errors = Errors::default();
    trial.drive(length, |[position, heading], driven| {
        // The first meter is for the filter to converge.
        if driven > 1.0 {
            errors.position.push(position);
            errors.heading.push(heading);
        }
    });
    Some(errors)
}

/// Returns the robot's poses in a search, `spacing` apart (m).
pub fn poses(setting: TrialSetting<'_>, search: SearchKind, seed: u64, spacing: f64) -> Vec<Pose2> {
    let mut drive = RouteDrive::new(setting.building, setting.laser, search.name(), seed);
    if search == SearchKind::Kidnapped {
        advance(&mut drive, BEFORE_KIDNAPPING, |_| {});
        drive.kidnap();
    }
    let begin = drive.driven;
    let mut poses = vec![drive.truth];
    advance(&mut drive, begin + TRAVEL, |drive| {
        if drive.driven - begin >= spacing * poses.len() as f64 {
            poses.push(drive.truth);
        }
    });
    poses
}

/// Finds a pose that may be anywhere.
fn find(setting: TrialSetting<'_>, seed: u64) -> Option<PoseSearch> {
    let mut trial = Trial::new(setting, SearchKind::Global.name(), seed)?;
    trial.localization.initialize_globally(setting.field, &mut trial.random);
    Some(trial.search())
}

/// Finds a pose again, after the robot was carried elsewhere.
fn kidnap(setting: TrialSetting<'_>, seed: u64) -> Option<PoseSearch> {
    let mut trial = Trial::new(setting, SearchKind::Kidnapped.name(), seed)?;
    trial.start_known();
    trial.drive(BEFORE_KIDNAPPING, |_, _| {});
    trial.drive.kidnap();
    Some(trial.search())
}
