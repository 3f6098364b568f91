mod route_tally;
mod routes;
mod stream;
mod thinned;

use serde::{Deserialize, Serialize};
use std::fmt::Write;

pub use route_tally::RouteTally;
pub use routes::RouteUse;
pub use stream::TrajectoryStream;
pub use thinned::{ThinnedTrajectory, TrajectoryPosition};

/// Route that commands a robot.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Route {
    /// Through Monitor, Analyze and Plan.
    Deliberative,
    /// Through a reactive model.
    Reactive,
}

impl Route {
    /// Returns the name of the route in files.
    pub fn name(self) -> &'static str {
        match self {
            Route::Deliberative => "deliberative",
            Route::Reactive => "reactive",
        }
    }
}

/// One robot at one time.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Sample {
    /// Time since the start of the run, nanoseconds.
    pub time: u64,
    /// Name of the robot.
    pub robot: String,
    /// Position, x, meters.
    pub x: f64,
    /// Position, y, meters.
    pub y: f64,
    /// Radians, counter-clockwise from the x axis.
    pub theta: f64,
    /// Route of the running action.
    /// `None` if no action runs or the robot follows a script.
    pub route: Option<Route>,
    /// The running action with its arguments; empty if none runs.
    pub action: String,
}

impl Sample {
    /// Seconds since the start of the run.
    pub fn seconds(&self) -> f64 {
        self.time as f64 / 1e9
    }

    /// Returns the kind of the running action: its name without arguments.
    pub fn kind(&self) -> &str {
        self.action.split(['(', '{', '>']).next().unwrap_or_default().trim()
    }
}

/// Poses and actions of the robots, sampled at times that the caller chooses.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Trajectory {
    /// Samples in order of time; the robots may alternate.
    pub samples: Vec<Sample>,
}

impl Trajectory {
    /// Names of the robots, in order of their first sample.
    pub fn robots(&self) -> Vec<&str> {
        let mut robots: Vec<&str> = Vec::new();
        for sample in &self.samples {
            if !robots.contains(&sample.robot.as_str()) {
                robots.push(&sample.robot);
            }
        }
        robots
    }

    /// Returns the samples of one robot, in order.
    pub fn of(&self, robot: &str) -> Vec<&Sample> {
        self.samples.iter().filter(|sample| sample.robot == robot).collect()
    }

    /// Returns the text of `trajectory.csv`: RFC 4180 with a header and line feeds.
    /// Numbers have enough digits to read the same value back; a missing route is `none`.
    pub fn csv(&self) -> String {
        let mut text = String::from(HEADER);
        self.samples.iter().for_each(|sample| append_row(sample, &mut text));
        text
    }
}

/// The first line of `trajectory.csv`.
const HEADER: &str = "time_s,robot,x_m,y_m,theta_rad,route,action\n";

/// Appends a row of `trajectory.csv`.
fn append_row(sample: &Sample, text: &mut String) {
    let Sample { robot, x, y, theta, route, action, .. } = sample;
    let (time, route) = (sample.seconds(), route.map_or("none", Route::name));
    let (robot, action) = (quoted(robot), quoted(action));
    // Writing to a string cannot fail.
    let _ = writeln!(text, "{time},{robot},{x},{y},{theta},{route},{action}");
}

fn quoted(field: &str) -> String {
    if field.contains([',', '"', '\n', '\r']) {
        format!("\"{}\"", field.replace('"', "\"\""))
    } else {
        field.to_owned()
    }
}

/// Returns the indices at which the route differs from the last known one.
/// Samples without a route do not count: a pause between two actions of one route is not a switch.
pub(crate) fn switches(samples: &[&Sample]) -> Vec<usize> {
    let mut last = None;
    let mut switches = Vec::new();
    for (index, sample) in samples.iter().enumerate() {
        if let Some(route) = sample.route {
            if last.is_some_and(|last| last != route) {
                switches.push(index);
            }
            last = Some(route);
        }
    }
    switches
}

/// Splits the samples where the route changes.
/// Each part but the last ends with the first sample of the next, so that lines through the parts meet.
pub(crate) fn parts<'a>(
    samples: &'a [&'a Sample],
) -> impl Iterator<Item = (Option<Route>, &'a [&'a Sample])> {
    let mut start = 0;
    samples.chunk_by(|one, next| one.route == next.route).map(move |chunk| {
        let first = start;
        start += chunk.len();
        let end = if start < samples.len() { start + 1 } else { start };
        (chunk[0].route, &samples[first..end])
    })
}
