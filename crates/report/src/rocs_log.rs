//! Logs in the format of RoCS's authors.
//! A header, then a line `X, Y, T, Action` each 50 ms.

use std::path::Path;

use crate::{Route, Sample, Trajectory};
use slate_bag::Error;

/// A log of one robot, as the authors of RoCS publish it of their runs.
#[derive(Clone, Debug, PartialEq)]
pub struct RocsLog {
    /// The robot, named after the file.
    pub robot: String,
    /// Trajectory of the robot, with the action that waited in its Pipeline.
    pub trajectory: Trajectory,
    /// Number of lines left out.
    /// These are lines with a torn position, which their program reads while another thread writes it, and all lines
    /// after the simulator was reset.
    pub left_out: usize,
}

const HEADER: &str = "X, Y, T, Action";
/// Time between two lines, nanoseconds.
const SAMPLE_PERIOD: u64 = 50_000_000;
/// Maximum distance between consecutive lines, meters.
/// A line farther away is torn.
const MAX_STEP: f64 = 0.3;
/// Number of consecutive lines elsewhere that mean a relocated robot.
/// Fewer are torn lines.
const RELOCATION_LINES: usize = 10;
/// Maximum size of a log, bytes.
const MAX_FILE_SIZE: u64 = 64 << 20;

impl RocsLog {
    /// Reads a log.
    ///
    /// # Errors
    /// When the file can't be read, is too large, or a line is not of this format.
    pub fn read(path: &Path) -> Result<Self, Error> {
        let failed = |source| Error::Read { path: path.into(), source };
        let size = std::fs::metadata(path).map_err(failed)?.len();
        if size > MAX_FILE_SIZE {
            let what = format!("it has {size} bytes, expected at most {MAX_FILE_SIZE}; cut it");
            return Err(Error::Unfit { path: path.into(), what });
        }
        let text = std::fs::read_to_string(path).map_err(failed)?;
        let robot = path.file_stem().unwrap_or_default().to_string_lossy().into_owned();
        let mut samples = Vec::new();
        for (number, line) in text.lines().enumerate() {
            let wrong = |what: String| Error::Line { path: path.into(), line: number as u64 + 1, what };
            if number == 0 {
                if line.trim() != HEADER {
                    return Err(wrong(format!(
                        "expected the header `{HEADER}`, found `{}`",
                        shortened(line)
                    )));
                }
                continue;
            }
            if !line.trim().is_empty() {
                samples.push(sample(line, number, &robot).map_err(wrong)?);
            }
        }
        if samples.is_empty() {
            let what = format!("it has no line after its header `{HEADER}`");
            return Err(Error::Unfit { path: path.into(), what });
        }
        let (samples, left_out) = remove_torn(samples);
        Ok(Self { robot, trajectory: Trajectory { samples }, left_out })
    }
}

fn sample(line: &str, number: usize, robot: &str) -> Result<Sample, String> {
    let expected = || {
        format!(
            "expected x, y, heading and an action such as `1.0, 2.0, 0.5, GoAhead`, found `{}`",
            shortened(line)
        )
    };
    let mut cells = line.splitn(4, ',').map(str::trim);
    let mut number_of = || cells.next().and_then(|cell| cell.parse::<f64>().ok()).ok_or_else(expected);
    let (x, y, theta) = (number_of()?, number_of()?, number_of()?);
    let action = cells.next().filter(|action| !action.is_empty()).ok_or_else(expected)?;
    // Their reflexes are called `Reaction` and by their law.
    let route = if action.starts_with("Reaction") { Route::Reactive } else { Route::Deliberative };
    let time = (number as u64 - 1) * SAMPLE_PERIOD;
    Ok(Sample { time, robot: robot.into(), x, y, theta, route: Some(route), action: action.into() })
}

/// Returns the start of a line, for messages.
fn shortened(line: &str) -> String {
    line.chars().take(60).collect()
}

/// Removes torn samples, and those after the robot was relocated.
/// Returns also the number of removed samples.
fn remove_torn(samples: Vec<Sample>) -> (Vec<Sample>, usize) {
    let near = |one: &Sample, other: &Sample| libm::hypot(one.x - other.x, one.y - other.y) <= MAX_STEP;
    let follow = |samples: &[Sample]| samples.windows(2).all(|pair| near(&pair[0], &pair[1]));
    let mut kept: Vec<Sample> = Vec::with_capacity(samples.len());
    for (index, sample) in samples.iter().enumerate() {
        let next = &samples[index..samples.len().min(index + RELOCATION_LINES)];
        match kept.last() {
            Some(last) if near(last, sample) => kept.push(sample.clone()),
            // The simulator was reset.
            Some(_) if next.len() == RELOCATION_LINES && follow(next) => break,
            Some(_) => {}
            None if follow(&next[..next.len().min(2)]) => kept.push(sample.clone()),
            None => {}
        }
    }
    let left_out = samples.len() - kept.len();
    (kept, left_out)
}
