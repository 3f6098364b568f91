use std::io::{IsTerminal, Write};

use slate::record::Batch;
use slate::runtime::Rate;

use crate::arguments::{BatchOptions, MAXIMUM_SEED, ModeName};
use crate::examples;
use crate::failure::Failure;
use crate::mission::{How, Mission};
use crate::output;

/// Runs many seeds; true when all reached their goal.
pub fn batch(options: &BatchOptions) -> Result<bool, Failure> {
    let rate = if options.common.mode == ModeName::Threaded { Rate::REALTIME } else { Rate::Max };
    // Before the first run, so that no work is lost.
    let last = options.seed.checked_add(options.runs - 1);
    if last.is_none_or(|last| last > MAXIMUM_SEED) {
        return Err(Failure::Seeds);
    }
    let mut summaries = Vec::new();
    let counting = std::io::stderr().is_terminal();
    for i in 0..options.runs {
        let seed = options.seed + i;
        let mut sets = options.common.set.clone();
        sets.push(format!("agent.seed={seed}"));
        let application =
            examples::find(&options.name, None, Vec::new(), sets, options.common.host.as_deref())?;
        let workers = options.common.workers.into();
        let mode = options.common.mode;
        let how =
            How { mode, rate, workers, log: Vec::new(), trajectory: false, follows: false, disarmed: false };
        summaries.push(Mission::load(application, how)?.run()?.summary);
        if counting {
            eprint!("\r{} of {} runs", i + 1, options.runs);
            // Only a counter; what can't be shown is not missed.
            let _ = std::io::stderr().flush();
        }
    }
    if counting {
        eprintln!();
    }
    let batch = Batch::of(&summaries);
    output::line(&batch);
    if options.common.json {
        output::line(batch.json_line()?);
    }
    Ok(summaries.iter().all(slate::record::Summary::succeeded))
}
