//! Runs that are made again from recordings, and compared.

use std::path::Path;

use serde_json::json;
use slate::replay::{Comparison, Verdict};
use slate::runtime::{Agent, Mode, Options, Rate, printable};

use super::attached::Attached;
use super::play::first;
use crate::examples;
use crate::failure::Failure;
use crate::output::{self, counted};

/// Repeats a run; 0 if it is identical, 1 if not, 2 if that can't be decided.
pub fn verify(file: &Path, json: bool) -> Result<u8, Failure> {
    let (verdict, whole, attached) = made_again(file)?;
    let code = match verdict {
        Verdict::Identical { .. } => 0,
        Verdict::Different(_) => 1,
        Verdict::Nothing | Verdict::NotCovered(_) => 2,
    };
    if json {
        output::document("slate.verify/1", &document(file, &verdict, whole, &attached));
        return Ok(code);
    }
    for name in &attached.replaced {
        eprintln!(
            "{}",
            output::harmless(format_args!("{name} has changed since; the recorded version is used"))
        );
    }
    for name in &attached.absent {
        eprintln!(
            "{}",
            output::harmless(format_args!("{name} is not in the recording; that of this disk is taken"))
        );
    }
    match verdict {
        Verdict::Identical { values, cycles, whole } => {
            let (values, cycles) = (counted(values, "value", "values"), counted(cycles, "cycle", "cycles"));
            let end = if whole { "" } else { ", up to where the recording was cut off" };
            output::line(format_args!("identical, {values} in {cycles}{end}"));
        }
        Verdict::Different(difference) => output::line(difference),
        Verdict::Nothing => output::line(format_args!(
            "nothing to compare: {} has no value that a run of the same writes again, as when it ended before its first cycle",
            printable(file)
        )),
        Verdict::NotCovered(reason) => output::line(format_args!("not covered: {reason}")),
    }
    Ok(code)
}

/// Repeats a run.
/// Returns the verdict, whether the recording is complete, and the files used.
fn made_again(file: &Path) -> Result<(Verdict, bool, Attached), Failure> {
    let comparison = Comparison::open(file)?;
    let run = comparison.run();
    let has_ended = run.has_ended();
    if let Some(obstacle) = run.obstacle() {
        return Ok((Verdict::NotCovered(obstacle), has_ended, Attached::default()));
    }
    let quiet = || vec!["log.targets.console=false".into()];
    let mut database = run.configuration(quiet())?;
    let attached = Attached::of(run, &database.current())?;
    if !attached.sets.is_empty() {
        database = run.configuration([quiet(), attached.sets.clone()].concat())?;
    }
    if let Some(obstacle) = run.obstacle_in(&database.current()) {
        return Ok((Verdict::NotCovered(obstacle), has_ended, attached));
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
    Ok((comparison.compare(agent)?, has_ended, attached))
}

/// Returns the result as JSON.
fn document(file: &Path, verdict: &Verdict, whole: bool, attached: &Attached) -> serde_json::Value {
    let (mut counts, mut difference, mut reason) = (None, None, None);
    let outcome = match verdict {
        Verdict::Identical { values, cycles, .. } => {
            counts = Some((values, cycles));
            "identical"
        }
        Verdict::Different(own) => {
            difference = Some(first(own, "replayed"));
            "different"
        }
        Verdict::Nothing => "nothing_to_compare",
        Verdict::NotCovered(own) => {
            reason = Some(own);
            "not_covered"
        }
    };
    json!({
        "file": printable(file).to_string(),
        "outcome": outcome,
        "whole": whole,
        "values": counts.map(|(values, _)| values),
        "cycles": counts.map(|(_, cycles)| cycles),
        "first": difference,
        "reason": reason,
        "replaced": attached.replaced,
        "absent": attached.absent,
    })
}
