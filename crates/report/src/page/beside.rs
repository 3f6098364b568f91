//! Comparison of a run with published logs.

use super::table::Table;
use super::{Section, SectionPart};
use crate::Error;
use crate::plot::{self, Drawing};
use crate::{RocsLog, RouteUse, Sample, Scene, Trajectory};

/// Draws the run and the logs side by side, and compares the robots' use of routes.
pub(super) fn section(
    title: &str,
    scene: &Scene,
    trajectory: &Trajectory,
    logs: &[RocsLog],
) -> Result<Section, Error> {
    let mut section = Section::new("Beside");
    let mut table = Table::new("beside", &COLUMNS);
    let is_scripted = |robot: &&str| scene.scripted.iter().any(|name| name == robot);
    for robot in trajectory.robots().into_iter().filter(|robot| !is_scripted(robot)) {
        table.row(row(&format!("{robot} of this run"), &trajectory.of(robot)));
    }
    for log in logs {
        table.row(row(&log.robot, &log.trajectory.of(&log.robot)));
    }
    // All logs are in one picture, as they are of one run.
    let samples = logs.iter().flat_map(|log| log.trajectory.samples.iter().cloned());
    let theirs = Trajectory { samples: samples.collect() };
    let lines: usize = logs.iter().map(|log| log.trajectory.samples.len()).sum();
    let left_out: usize = logs.iter().map(|log| log.left_out).sum();
    let drawings = [
        Drawing { title: title.into(), caption: "this run".into(), scene, trajectory },
        Drawing {
            title: names(logs),
            caption: format!("{lines} lines of published logs, {left_out} left out"),
            scene,
            trajectory: &theirs,
        },
    ];
    let picture = plot::beside(&drawings)?;
    let caption = format!("This run, and beside it {}.", names(logs));
    section.parts.push(SectionPart::Drawn("beside", caption, picture));
    section.table(table, "No robot is known.");
    section.text(
        "Times of a log are those of its program, a line each 50 ms; a simulator that runs faster or slower than that makes \
         its robots look as fast. A change of the route lasts if the new route holds for 0.2 s.",
    );
    Ok(section)
}

const COLUMNS: [&str; 7] = [
    "robot",
    "#time/s",
    "#distance/m",
    "#route changes",
    "#lasting route changes",
    "#reactive share of the time/%",
    "#reactive share of the distance/%",
];

fn row(name: &str, samples: &[&Sample]) -> [String; 7] {
    let used = RouteUse::of(samples);
    [
        name.into(),
        format!("{:.1}", used.duration),
        format!("{:.2}", used.distance),
        used.changes.to_string(),
        used.lasting_changes.to_string(),
        format!("{:.1}", used.reactive_samples * 100.0),
        format!("{:.1}", used.reactive_distance * 100.0),
    ]
}

fn names(logs: &[RocsLog]) -> String {
    logs.iter().map(|log| log.robot.as_str()).collect::<Vec<_>>().join(" and ")
}
