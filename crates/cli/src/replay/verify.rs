//! Runs that are made again from recordings, and compared.

use std::path::Path;

use slate::record::replay::{Comparison, Verdict};
use slate::runtime::{Agent, Mode, Options, Rate};

use crate::examples;
use crate::failure::Failure;
use crate::output;

/// Makes a run again: 0 when it is identical, 1 when it is not, and 2 when that can't be said.
pub fn verify(file: &Path) -> Result<u8, Failure> {
    let comparison = Comparison::open(file)?;
    let run = comparison.run();
    let not_covered = |reason: &str| {
        output::line(format_args!("not covered: {reason}"));
        Ok(2)
    };
    if let Some(obstacle) = run.obstacle() {
        return not_covered(&obstacle);
    }
    let database = run.configuration(vec!["log.targets.console=false".into()])?;
    if let Some(obstacle) = run.obstacle_in(&database.current()) {
        return not_covered(&obstacle);
    }
    let how = Options {
        mode: Mode::Staged,
        rate: Rate::Max,
        armed: run.is_armed(),
        follows_files: false,
        recording: Some(comparison.recording()),
        ..Options::default()
    };
    let agent = Agent::load_with(&database, &examples::plugins(), how)?;
    match comparison.compare(agent)? {
        Verdict::Identical { values, cycles, whole } => {
            let end = if whole { "" } else { ", up to where the recording was cut off" };
            output::line(format_args!("identical, {values} values in {cycles} cycles{end}"));
            Ok(0)
        }
        Verdict::Different(difference) => {
            output::line(difference);
            Ok(1)
        }
        Verdict::NotCovered(reason) => not_covered(&reason),
    }
}
