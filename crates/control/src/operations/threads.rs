//! Processor use of the agent's threads, as Linux counts it.

use std::fs;
use std::path::Path;
use std::sync::Arc;

use serde_json::{Value as Json, json};

use super::shape;
use crate::Role;
use crate::answer::OperationAnswer;
use crate::operation::{Operation, OperationRequest};
use crate::problem::Problem;
use crate::surface::ControlSurface;

/// Directory of the threads of this process.
const THREADS_FOLDER: &str = "/proc/self/task";

pub(super) const READ: Operation = Operation::get(
    "/threads",
    "threads",
    Role::Viewer,
    "Processor time of each thread of the agent, and the time it was ready and waited for a processor; empty \
     where the system does not report it",
).answers(|| {
        shape::list(shape::object(&[
            ("id", shape::count()),
            ("name", shape::text()),
            ("processor", shape::count()),
            ("busy", json!({ "type": "integer", "minimum": 0, "description": "Processor time, ns." })),
            (
                "waited",
                json!({ "type": "integer", "minimum": 0, "description": "Time spent ready without a processor, ns." }),
            ),
            (
                "turns",
                json!({ "type": "integer", "minimum": 0, "description": "Number of times scheduled." }),
            ),
        ]))
    }, read);

fn read(_: &Arc<ControlSurface>, _: &OperationRequest) -> Result<OperationAnswer, Problem> {
    let folders = fs::read_dir(THREADS_FOLDER).into_iter().flatten().flatten();
    let mut threads: Vec<_> = folders.filter_map(|folder| thread(&folder.path())).collect();
    threads.sort_by_key(|(id, _)| *id);
    Ok(OperationAnswer::json(threads.into_iter().map(|(_, thread)| thread).collect()))
}

/// Describes a thread; `None` if it has just ended.
fn thread(folder: &Path) -> Option<(u64, Json)> {
    let read = |file: &str| fs::read_to_string(folder.join(file)).ok();
    let id = folder.file_name()?.to_str()?.parse().ok()?;
    let counts = read("schedstat")?;
    let mut counts = counts.split_whitespace().map(str::parse::<u64>);
    let mut count = || counts.next()?.ok();
    let (busy, waited, turns) = (count()?, count()?, count()?);
    // The 39th field; a name in brackets is the second, and may have anything in it.
    let stat = read("stat")?;
    let processor: u64 = stat.rsplit_once(')')?.1.split_whitespace().nth(36)?.parse().ok()?;
    let name = read("comm")?;
    let thread = json!({
        "id": id,
        "name": name.trim_end(),
        "processor": processor,
        "busy": busy,
        "waited": waited,
        "turns": turns,
    });
    Some((id, thread))
}
