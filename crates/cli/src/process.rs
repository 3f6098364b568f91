//! Process of an agent, as the system shows it.

use std::fmt;
use std::fs;

use serde::Serialize;
use slate::runtime::directory::{Lock, folder};

use crate::duration;

/// Process that runs an agent.
#[derive(Clone, Debug, Serialize)]
pub struct ProcessInfo {
    /// Number.
    pub id: u32,
    /// Memory in use, bytes; `None` where the system does not report it.
    pub memory: Option<u64>,
    /// Time since the start of the process, s.
    pub uptime: Option<f64>,
    /// Number of threads.
    pub threads: Option<u64>,
}

impl ProcessInfo {
    /// Returns the process of the agent with that name.
    pub fn of(agent: &str) -> Option<Self> {
        let id = Lock::holder(&folder().join(format!("{agent}.lock")))?;
        let status = fs::read_to_string(format!("/proc/{id}/status")).unwrap_or_default();
        let number = |name: &str| {
            let line = status.lines().find_map(|line| line.strip_prefix(name)?.strip_prefix(':'))?;
            line.split_whitespace().next()?.parse::<u64>().ok()
        };
        Some(Self {
            id,
            memory: number("VmRSS").map(|kibibytes| kibibytes * 1024),
            uptime: uptime(id),
            threads: number("Threads"),
        })
    }
}

fn uptime(id: u32) -> Option<f64> {
    let stat = fs::read_to_string(format!("/proc/{id}/stat")).ok()?;
    // The name may have blanks and parentheses; what follows has not. The start is the 22nd of all.
    let ticks: f64 = stat.rsplit_once(')')?.1.split_whitespace().nth(19)?.parse().ok()?;
    let system: f64 = fs::read_to_string("/proc/uptime").ok()?.split_whitespace().next()?.parse().ok()?;
    Some(system - ticks / rustix::param::clock_ticks_per_second() as f64)
}

impl fmt::Display for ProcessInfo {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "process {}", self.id)?;
        if let Some(memory) = self.memory {
            write!(f, ", {}", duration::bytes(memory as f64))?;
        }
        if let Some(threads) = self.threads {
            write!(f, ", {threads} threads")?;
        }
        self.uptime.map_or(Ok(()), |uptime| write!(f, ", up {uptime:.0} s"))
    }
}
