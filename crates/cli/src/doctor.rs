//! Whether this computer is fit to run a robot.

use std::fs;
use std::io::Write;
use std::os::unix::fs::MetadataExt;
use std::path::{Path, PathBuf};
use std::time::Duration;

use clap::Args;
use serde::Serialize;
use serde_json::json;
use slate::control::{Client, ClientError};
use slate::runtime::directory::folder;

use crate::connection::ask_all;
use crate::failure::{ASSERTION_FALSE, Failure};
use crate::watch::now;
use crate::{duration, examples, output};

#[derive(Debug, Args)]
pub struct DoctorOptions {
    /// An example or a configuration file that is checked too.
    name: Option<String>,

    /// The folder whose disk is measured.
    #[arg(long, value_name = "FOLDER", default_value = ".")]
    folder: PathBuf,

    /// Prints the findings as JSON.
    #[arg(long)]
    json: bool,
}

/// How something is.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
enum State {
    Good,
    /// It runs, with less than there could be.
    Warning,
    /// It will not run.
    Bad,
}

/// What was looked at.
#[derive(Debug, Serialize)]
struct Finding {
    what: &'static str,
    state: State,
    found: String,
    /// What to do about it.
    hint: Option<String>,
}

impl Finding {
    fn good(what: &'static str, found: impl Into<String>) -> Self {
        Self { what, state: State::Good, found: found.into(), hint: None }
    }

    fn warning(what: &'static str, found: impl Into<String>, hint: impl Into<String>) -> Self {
        Self { what, state: State::Warning, found: found.into(), hint: Some(hint.into()) }
    }

    fn bad(what: &'static str, found: impl Into<String>, hint: impl Into<String>) -> Self {
        Self { what, state: State::Bad, found: found.into(), hint: Some(hint.into()) }
    }
}

/// A sleep may be late by that much before a loop of 20 ms feels it.
const LATE: Duration = Duration::from_millis(2);

/// What recordings need, bytes a second.
const DISK: f64 = 20e6;

/// Looks at all of it; returns what the process ends with.
pub fn doctor(options: &DoctorOptions) -> Result<u8, Failure> {
    let mut findings = vec![clock(), sleeping(), sockets()];
    findings.extend(agents());
    findings.extend([realtime(), memory_locks(), files(), disk(&options.folder), shared_memory(), ports()]);
    findings.extend(options.name.as_deref().map(configuration));
    let has_bad = findings.iter().any(|finding| finding.state == State::Bad);
    if options.json {
        output::json(&json!({"schema": "slate.doctor/1", "ok": !has_bad, "findings": findings}));
    } else {
        let row = |finding: &Finding| {
            let sign = match finding.state {
                State::Good => "ok",
                State::Warning => "!",
                State::Bad => "BAD",
            };
            [sign.into(), finding.what.into(), finding.found.clone()]
        };
        let lines = output::aligned(findings.iter().map(row));
        for (line, finding) in lines.iter().zip(&findings) {
            output::line(line);
            if let Some(hint) = &finding.hint {
                output::line(format_args!("       {hint}"));
            }
        }
    }
    Ok(if has_bad { ASSERTION_FALSE } else { 0 })
}

fn clock() -> Finding {
    let source = fs::read_to_string("/sys/devices/system/clocksource/clocksource0/current_clocksource");
    let source = source.map(|text| text.trim().to_owned()).unwrap_or_default();
    // The smallest step that is seen, and what a look costs.
    let (begin, looks) = (now(), 10_000_u32);
    for _ in 0..looks {
        std::hint::black_box(now());
    }
    let cost = begin.elapsed().as_nanos() as f64 / f64::from(looks);
    let name = if source.is_empty() { "unknown" } else { &source };
    let found = format!("{name}, {cost:.0} ns to look at");
    if cost > 1000.0 {
        let hint =
            "a slow clock makes each tick slower: let the system use the processor's own (clocksource=tsc)";
        return Finding::warning("clock", found, hint);
    }
    Finding::good("clock", found)
}

fn sleeping() -> Finding {
    let late: Vec<Duration> = (0..50)
        .map(|_| {
            let begin = now();
            std::thread::sleep(Duration::from_millis(1));
            begin.elapsed().saturating_sub(Duration::from_millis(1))
        })
        .collect();
    let worst = late.iter().max().copied().unwrap_or_default();
    let mean = late.iter().sum::<Duration>() / late.len() as u32;
    let show = |time: Duration| duration::show(time.as_nanos() as f64);
    let found = format!("a sleep of 1 ms is {} late, at most {}", show(mean), show(worst));
    if worst > LATE {
        let hint =
            "other programs hold the processors up: end them, or run with --workers 0 on a quieter computer";
        return Finding::warning("wake-ups", found, hint);
    }
    Finding::good("wake-ups", found)
}

fn sockets() -> Finding {
    let folder = folder();
    let place = slate::runtime::printable(&folder);
    match fs::symlink_metadata(&folder) {
        Err(_) => {
            let above = folder.parent().unwrap_or(Path::new("/"));
            match rustix::fs::access(above, rustix::fs::Access::WRITE_OK) {
                Ok(()) => Finding::good("sockets", format!("{place}, made by the first agent")),
                Err(_) => Finding::bad(
                    "sockets",
                    format!("{place} can't be made"),
                    "let XDG_RUNTIME_DIR be a folder that is yours alone",
                ),
            }
        }
        Ok(metadata)
            if metadata.uid() != rustix::process::geteuid().as_raw() || metadata.mode() & 0o077 != 0 =>
        {
            Finding::bad(
                "sockets",
                format!("{place} may be entered by others"),
                format!("agents refuse it: chmod 700 {place}, or let XDG_RUNTIME_DIR be another folder"),
            )
        }
        // The longest path of a socket on Linux, with a name of an agent.
        Ok(_) if folder.as_os_str().len() > 80 => Finding::warning(
            "sockets",
            format!("{place} is long, and the path of a socket can have 107 bytes"),
            "let XDG_RUNTIME_DIR be a shorter path",
        ),
        Ok(_) => Finding::good("sockets", place),
    }
}

/// The agents that run, and whether they speak as this program does.
fn agents() -> Vec<Finding> {
    let asked = ask_all(|name| Client::connect(name).map(|_| ()));
    if asked.is_empty() {
        return vec![Finding::good("agents", "none runs")];
    }
    let finding = |(name, answer): (String, Option<Result<(), ClientError>>)| match answer {
        Some(Ok(())) => Finding::good("agents", format!("{name} answers")),
        Some(Err(error @ ClientError::Version { .. })) => {
            Finding::bad("agents", error.to_string(), "use the `slate` that runs the agent")
        }
        Some(Err(error)) => Finding::warning("agents", error.to_string(), "look at the agent's log"),
        None => Finding::warning(
            "agents",
            format!("{name} does not answer"),
            format!(
                "it hangs or is stopped; {}/{name}.lock has the number of its process",
                folder().display()
            ),
        ),
    };
    asked.into_iter().map(finding).collect()
}

/// A limit of the process, by its name in `/proc/self/limits`: soft, and nothing for none.
fn limit(name: &str) -> Option<Option<u64>> {
    let limits = fs::read_to_string("/proc/self/limits").ok()?;
    let line = limits.lines().find_map(|line| line.strip_prefix(name))?;
    let soft = line.split_whitespace().next()?;
    Some(soft.parse().ok())
}

fn realtime() -> Finding {
    let runtime = fs::read_to_string("/sys/kernel/realtime").is_ok_and(|text| text.trim() == "1");
    let kernel = if runtime { "a real-time kernel" } else { "a kernel for general use" };
    match limit("Max realtime priority") {
        Some(None) => Finding::good("real time", format!("{kernel}; any priority is allowed")),
        Some(Some(priority)) if priority > 0 => {
            Finding::good("real time", format!("{kernel}; priorities up to {priority} are allowed"))
        }
        _ if rustix::process::geteuid().is_root() => {
            Finding::good("real time", format!("{kernel}; root may take any priority"))
        }
        _ => Finding::warning(
            "real time",
            format!("{kernel}; this user may take no real-time priority"),
            "for loops faster than some 200 Hz, add `@realtime - rtprio 80` to /etc/security/limits.conf and yourself to \
             that group",
        ),
    }
}

fn memory_locks() -> Finding {
    match limit("Max locked memory") {
        Some(Some(bytes)) if bytes < 64 << 20 => Finding::warning(
            "memory",
            format!("{} may be locked", duration::bytes(bytes as f64)),
            "pages may be swapped out: add `- memlock unlimited` for this user to /etc/security/limits.conf",
        ),
        Some(Some(bytes)) => {
            Finding::good("memory", format!("{} may be locked", duration::bytes(bytes as f64)))
        }
        _ => Finding::good("memory", "as much as there is may be locked"),
    }
}

fn files() -> Finding {
    match limit("Max open files") {
        Some(Some(count)) if count < 512 => Finding::warning(
            "files",
            format!("{count} may be open at once"),
            "an agent with many tools and peers needs more: ulimit -n 4096",
        ),
        Some(Some(count)) => Finding::good("files", format!("{count} may be open at once")),
        _ => Finding::good("files", "any number may be open"),
    }
}

/// How fast a file grows whose bytes reach the disk, as those of a recording.
fn disk(folder: &Path) -> Finding {
    let path = folder.join(format!(".slate-doctor-{}", std::process::id()));
    let measured = write(&path);
    let _ = fs::remove_file(&path);
    let place = slate::runtime::printable(folder);
    match measured {
        Ok(speed) if speed < DISK => Finding::warning(
            "disk",
            format!("{place}: {}/s", duration::bytes(speed)),
            "recordings with images lose values: record fewer properties, or on another disk",
        ),
        Ok(speed) => Finding::good("disk", format!("{place}: {}/s", duration::bytes(speed))),
        Err(error) => Finding::bad(
            "disk",
            format!("{place} can't be written: {error}"),
            "reports and recordings go below the folder that `slate run` is called in",
        ),
    }
}

fn write(path: &Path) -> std::io::Result<f64> {
    let (block, count) = (vec![0x5a_u8; 1 << 20], 32);
    let mut file = fs::File::options().write(true).create_new(true).open(path)?;
    let begin = now();
    for _ in 0..count {
        file.write_all(&block)?;
    }
    file.sync_data()?;
    Ok((count << 20) as f64 / begin.elapsed().as_secs_f64())
}

fn shared_memory() -> Finding {
    let place = Path::new("/dev/shm");
    match rustix::fs::statvfs(place) {
        Ok(stat) => {
            let free = stat.f_bavail as f64 * stat.f_frsize as f64;
            let found = format!("{} free in /dev/shm", duration::bytes(free));
            if free < 64e6 {
                let hint =
                    "agents of one machine share large values there: give a container more (--shm-size=1g)";
                return Finding::warning("shared memory", found, hint);
            }
            Finding::good("shared memory", found)
        }
        Err(error) => Finding::warning(
            "shared memory",
            format!("/dev/shm can't be looked at: {error}"),
            "values between agents of one machine go through sockets, which is slower",
        ),
    }
}

fn ports() -> Finding {
    match std::net::UdpSocket::bind(("127.0.0.1", 0))
        .and_then(|_| std::net::TcpListener::bind(("127.0.0.1", 0)))
    {
        Ok(_) => Finding::good("ports", "can be listened at"),
        Err(error) => Finding::bad(
            "ports",
            error.to_string(),
            "agents can't listen for others: look at the firewall or sandbox",
        ),
    }
}

fn configuration(name: &str) -> Finding {
    let sets = crate::check::QUIET.map(String::from).to_vec();
    let found = examples::find(name, None, Vec::new(), sets, None);
    match found.and_then(|application| crate::check::load(&application)) {
        Ok(agent) => {
            Finding::good("configuration", format!("{name} fits, with {} modules", agent.modules().len()))
        }
        Err(failure) => {
            let text = failure.to_string();
            let first = text.lines().next().unwrap_or_default().to_owned();
            Finding::bad("configuration", first, format!("`slate check {name}` shows all of it"))
        }
    }
}
