//! Reference relations between poses.

use std::fs;
use std::path::Path;

use slate_interfaces::Pose2;
use slate_slam::se2;

use crate::DataError;

/// Relation: pose at a time in the frame of the pose at another time.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Relation {
    /// Two times of the relation, s.
    pub times: [f64; 2],
    /// Pose at the second time, in the frame of that at the first.
    pub relative: Pose2,
}

/// Means and standard deviations of a trajectory's errors against relations.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RelationErrors {
    /// Absolute translational error, m.
    pub translation: [f64; 2],
    /// Absolute rotational error, rad.
    pub rotation: [f64; 2],
}

/// Reads relations of a file.
/// Each is a line of two times, a translation and a rotation about x, y and z; times of the file are later than those
/// of the log by `offset`, s.
///
/// # Errors
/// A file that has no relations; the error names the line.
pub fn read_relations(file: &Path, offset: f64) -> Result<Vec<Relation>, DataError> {
    let text = fs::read_to_string(file).map_err(|error| DataError::unreadable(file, &error))?;
    let mut relations = Vec::new();
    for (number, line) in text.lines().enumerate().filter(|(_, line)| !line.trim().is_empty()) {
        let columns: Option<Vec<f64>> = line.split_whitespace().map(|word| word.parse().ok()).collect();
        let Some(&[from, to, x, y, _, _, _, theta]) = columns.as_deref() else {
            let reason = "expected eight numbers: two times, x, y, z, roll, pitch, yaw";
            return Err(DataError::at(file, number, reason));
        };
        relations.push(Relation { times: [from - offset, to - offset], relative: Pose2 { x, y, theta } });
    }
    match relations.is_empty() {
        true => Err(DataError::new(file, "no relation in it")),
        false => Ok(relations),
    }
}

/// Returns the errors of a trajectory of times, ascending, and poses.
/// Kuemmerle et al., 2009, *On measuring the accuracy of SLAM algorithms*, equation 4.
pub fn errors(trajectory: &[(f64, Pose2)], relations: &[Relation]) -> RelationErrors {
    let (mut translations, mut rotations) = (Vec::new(), Vec::new());
    for Relation { times, relative } in relations {
        let [from, to] = times.map(|time| at(trajectory, time));
        let error = se2::relative(*relative, se2::relative(from, to));
        translations.push(slate_module::math::hypot(error.x, error.y));
        rotations.push(error.theta.abs());
    }
    RelationErrors {
        translation: mean_and_deviation(&translations),
        rotation: mean_and_deviation(&rotations),
    }
}

/// Returns the pose at a time, interpolated linearly between its neighbors.
/// Outside, that of the nearest end.
fn at(trajectory: &[(f64, Pose2)], time: f64) -> Pose2 {
    let after = trajectory.partition_point(|(other, _)| *other < time);
    let Some((late, end)) = trajectory.get(after) else {
        return trajectory.last().map_or(Pose2::UNKNOWN, |(_, pose)| *pose);
    };
    let Some((early, start)) = after.checked_sub(1).map(|before| &trajectory[before]) else { return *end };
    let share = if late > early { (time - early) / (late - early) } else { 1.0 };
    let step = se2::relative(*start, *end);
    let part = Pose2 { x: share * step.x, y: share * step.y, theta: share * step.theta };
    se2::compose(*start, part)
}

fn mean_and_deviation(values: &[f64]) -> [f64; 2] {
    let count = values.len().max(1) as f64;
    let mean = values.iter().sum::<f64>() / count;
    let square = values.iter().map(|value| (value - mean) * (value - mean)).sum::<f64>() / count;
    [mean, square.sqrt()]
}
