//! Peers without a crate, run by scripts of `bench/peers`.
//! A script prints a line with the nanoseconds of each value.

use std::ops::Range;
use std::process::Command;

use crate::measure::{Contest, Effort};
use crate::table::{Role, Table};

/// A peer, and how it is run.
pub struct Script {
    pub name: &'static str,
    pub role: Role,
    /// Script with its first arguments.
    /// Size and number of values follow.
    pub command: &'static [&'static str],
    /// The values, by their size, that it carries in the way of its line.
    pub sizes: Range<usize>,
}

/// Values of every size.
pub const ALL: Range<usize> = 0..usize::MAX;

/// A peer of these fields.
pub const fn script(
    name: &'static str,
    role: Role,
    command: &'static [&'static str],
    sizes: Range<usize>,
) -> Script {
    Script { name, role, command, sizes }
}

impl Script {
    /// Adds the script as a contestant, or says why it can't run here.
    /// In a quick run it has one turn, as its processes take seconds to start.
    pub fn join(
        &'static self,
        contest: &mut Contest<'_>,
        work: &str,
        size: usize,
        effort: Effort,
        table: &mut Table,
    ) {
        if !self.sizes.contains(&size) {
            return;
        }
        let count = effort.count(if size > 1 << 16 { 150 } else { 500 });
        let mut first = match self.times(size, count) {
            Ok(times) => times,
            Err(reason) => return table.absent(work, self.name, reason),
        };
        let mut turn = 0;
        contest.with(self.name, self.role, move |samples| {
            turn += 1;
            let times = match turn {
                // It warms up, and has just done so.
                1 => Ok(Vec::new()),
                2 if effort.quick => Ok(std::mem::take(&mut first)),
                _ if effort.quick => Ok(Vec::new()),
                _ => self.times(size, count),
            };
            match times {
                Ok(times) => times.into_iter().for_each(|took| samples.add(took)),
                Err(reason) => eprintln!("{}: a turn is missing: {reason}", self.name),
            }
        });
    }

    fn times(&self, size: usize, count: usize) -> Result<Vec<u64>, String> {
        let [script, words @ ..] = self.command else { return Err("no script".into()) };
        let path = format!("{}/peers/{script}", env!("CARGO_MANIFEST_DIR"));
        let output = Command::new(&path).args(words).args([size.to_string(), count.to_string()]).output();
        let output = output.map_err(|error| format!("{path}: {error}"))?;
        let times = String::from_utf8_lossy(&output.stdout);
        let times: Vec<u64> = times.lines().filter_map(|line| line.parse().ok()).collect();
        let complaint = String::from_utf8_lossy(&output.stderr).trim().replace('\n', "; ");
        match output.status.code() {
            // It is not installed, whatever the size.
            Some(3) => Err(complaint),
            _ if times.is_empty() => Err(format!("{size} B: {complaint}")),
            _ => Ok(times),
        }
    }
}
