//! Files of the UTIAS data set.

use std::fs;
use std::path::Path;

use slate_interfaces::Pose2;
use slate_module::math;
use slate_sorted::SortedMap;

use crate::DataError;

/// Time between two poses of the truth beyond which the one between is unknown, s.
const LONGEST_GAP: f64 = 0.5;
/// Subjects from this number on are landmarks; those before are robots.
const FIRST_LANDMARK: u32 = 6;

/// Log of a robot, with the known landmarks.
/// Times are in seconds since the first odometry.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct LandmarkLog {
    /// Velocities that hold until the next, in the order of time.
    pub odometry: Vec<LoggedTwist>,
    /// Landmarks in view, in the order of time.
    pub sightings: Vec<LoggedSighting>,
    /// Poses by the motion capture system, in the order of time.
    pub truth: Vec<(f64, Pose2)>,
}

/// Velocities of the odometry.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LoggedTwist {
    /// s.
    pub time: f64,
    /// Forward, m/s.
    pub linear: f64,
    /// Counter-clockwise, rad/s.
    pub angular: f64,
}

/// Landmark in view.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LoggedSighting {
    /// s.
    pub time: f64,
    /// Position by the motion capture system, m.
    pub landmark: [f64; 2],
    /// m.
    pub range: f64,
    /// Counter-clockwise from the front, rad.
    pub bearing: f64,
}

impl LandmarkLog {
    /// Reads the files of a robot.
    ///
    /// # Errors
    /// A file that can't be read, or a line that is not as its format says.
    pub fn read(folder: &Path, robot: u32) -> Result<Self, DataError> {
        let file = |name: &str| folder.join(format!("Robot{robot}_{name}.dat"));
        let odometry = rows::<3>(&file("Odometry"))?;
        let begin = odometry.first().map_or(0.0, |row| row[0]);
        let subjects: SortedMap<u32, u32> = rows::<2>(&folder.join("Barcodes.dat"))?
            .iter()
            .map(|row| (row[1] as u32, row[0] as u32))
            .collect();
        let places: SortedMap<u32, [f64; 2]> = rows::<3>(&folder.join("Landmark_Groundtruth.dat"))?
            .iter()
            .map(|row| (row[0] as u32, [row[1], row[2]]))
            .collect();
        let sighting = |[time, code, range, bearing]: &[f64; 4]| {
            // Other robots, and barcodes that were misread, have no place.
            let subject = subjects.get(&(*code as u32)).filter(|subject| **subject >= FIRST_LANDMARK)?;
            let landmark = *places.get(subject)?;
            Some(LoggedSighting { time: time - begin, landmark, range: *range, bearing: *bearing })
        };
        Ok(Self {
            odometry: odometry
                .iter()
                .map(|[time, linear, angular]| LoggedTwist {
                    time: time - begin,
                    linear: *linear,
                    angular: *angular,
                })
                .collect(),
            sightings: rows::<4>(&file("Measurement"))?.iter().filter_map(sighting).collect(),
            truth: rows::<4>(&file("Groundtruth"))?
                .iter()
                .map(|[time, x, y, theta]| (time - begin, Pose2 { x: *x, y: *y, theta: *theta }))
                .collect(),
        })
    }

    /// Returns the true pose at a time, between two measured ones; `None` in a gap.
    pub fn true_pose(&self, time: f64) -> Option<Pose2> {
        let after = self.truth.partition_point(|(at, _)| *at <= time);
        let ((earlier, from), (later, to)) = (self.truth.get(after.checked_sub(1)?)?, self.truth.get(after)?);
        if later - earlier > LONGEST_GAP {
            return None;
        }
        let share = (time - earlier) / (later - earlier);
        let turn = math::angle_between(from.theta, to.theta);
        Some(Pose2 {
            x: from.x + share * (to.x - from.x),
            y: from.y + share * (to.y - from.y),
            theta: math::wrap_angle(from.theta + share * turn),
        })
    }
}

/// Returns the first columns of each line that is no comment.
fn rows<const N: usize>(file: &Path) -> Result<Vec<[f64; N]>, DataError> {
    let text = fs::read_to_string(file).map_err(|error| DataError::unreadable(file, &error))?;
    let lines =
        text.lines().enumerate().filter(|(_, line)| !line.starts_with('#') && !line.trim().is_empty());
    lines
        .map(|(number, line)| {
            let mut words = line.split_whitespace();
            let mut row = [0.0; N];
            for column in &mut row {
                let word = words.next().and_then(|word| word.parse::<f64>().ok());
                let wrong = || DataError::at(file, number, format!("expected {N} numbers"));
                *column = word.filter(|number| number.is_finite()).ok_or_else(wrong)?;
            }
            Ok(row)
        })
        .collect()
}
