//! Health check of the machine: its fitness to run a robot.

use std::fs;
use std::io::Write;
use std::os::unix::fs::MetadataExt;
use std::path::{Path, PathBuf};
use std::time::Duration;

use clap::Args;
use serde::Serialize;
use serde_json::json;
use slate::control::{Client, ClientError};
use slate::runtime::composition::LinkedConfiguration;
use slate::runtime::directory::folder;
use slate_run::Application;

use crate::clock::now;
use crate::failure::{ASSERTION_FALSE, Failure};
use crate::local_agents::query_all;
use crate::{duration, examples, offline, output};

#[derive(Debug, Args)]
pub struct DoctorOptions {
    /// Example or configuration file to check, too
    name: Option<String>,

    /// Folder whose disk is measured
    #[arg(long, value_name = "FOLDER", default_value = ".")]
    folder: PathBuf,

    /// Print the findings as JSON
    #[arg(long)]
    json: bool,
}

/// Fitness of a checked item.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
enum Fitness {
    Good,
    /// Works with limitations.
    Warning,
    /// Does not work.
    Bad,
}

/// Result of a check.
#[derive(Debug, Serialize)]
struct HealthFinding {
    what: &'static str,
    state: Fitness,
    found: String,
    /// Advice.
    hint: Option<String>,
}

impl HealthFinding {
    fn good(what: &'static str, found: impl Into<String>) -> Self {
        Self { what, state: Fitness::Good, found: found.into(), hint: None }
    }

    fn warning(what: &'static str, found: impl Into<String>, hint: impl Into<String>) -> Self {
        Self { what, state: Fitness::Warning, found: found.into(), hint: Some(hint.into()) }
    }

    fn bad(what: &'static str, found: impl Into<String>, hint: impl Into<String>) -> Self {
        Self { what, state: Fitness::Bad, found: found.into(), hint: Some(hint.into()) }
    }
}

/// Delay of a sleep that a loop of 20 ms tolerates.
const MAX_SLEEP_DELAY: Duration = Duration::from_millis(2);

/// Write rate that recordings need, bytes per second.
const MIN_WRITE_RATE: f64 = 20e6;

/// Runs all checks; returns the exit code.
pub fn doctor(options: &DoctorOptions) -> Result<u8, Failure> {
    let mut findings = vec![clock(), sleeping(), sockets()];
    findings.extend(agents());
    findings.extend([realtime(), memory_locks(), files(), disk(&options.folder), shared_memory(), ports()]);
    findings.extend(options.name.as_deref().map(configuration));
    let has_bad = findings.iter().any(|finding| finding.state == Fitness::Bad);
    if options.json {
        output::json(&json!({"schema": "slate.doctor/1", "ok": !has_bad, "findings": findings}));
    } else {
        let row = |finding: &HealthFinding| {
            let sign = match finding.state {
                Fitness::Good => "ok",
                Fitness::Warning => "!",
                Fitness::Bad => "BAD",
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

fn clock() -> HealthFinding {
    let source = fs::read_to_string("/sys/devices/system/clocksource/clocksource0/current_clocksource");
    let source = source.map(|text| text.trim().to_owned()).unwrap_or_default();
    // The smallest step that is seen, and what a look costs.
    let (begin, looks) = (now(), 10_000_u32);
    for _ in 0..looks {
        std::hint::black_box(now());
    }
    let cost = begin.elapsed().as_nanos() as f64 / f64::from(looks);
    let name = if source.is_empty() { "unknown" } else { &source };
    let found = format!("{name}, {cost:.0} ns per read");
    if cost > 1000.0 {
        let hint = "a slow clock slows each tick: use the clock of the processor (clocksource=tsc)";
        return HealthFinding::warning("clock", found, hint);
    }
    HealthFinding::good("clock", found)
}

fn sleeping() -> HealthFinding {
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
    if worst > MAX_SLEEP_DELAY {
        let hint = "other programs load the processors: end them, or use --workers 0";
        return HealthFinding::warning("wake-ups", found, hint);
    }
    HealthFinding::good("wake-ups", found)
}

fn sockets() -> HealthFinding {
    let folder = folder();
    let place = slate::runtime::printable(&folder);
    match fs::symlink_metadata(&folder) {
        Err(_) => {
            let above = folder.parent().unwrap_or(Path::new("/"));
            match rustix::fs::access(above, rustix::fs::Access::WRITE_OK) {
                Ok(()) => HealthFinding::good("sockets", format!("{place}, created by the first agent")),
                Err(_) => HealthFinding::bad(
                    "sockets",
                    format!("{place} can't be created"),
                    "set XDG_RUNTIME_DIR to a folder that only you can enter",
                ),
            }
        }
        Ok(metadata)
            if metadata.uid() != rustix::process::geteuid().as_raw() || metadata.mode() & 0o077 != 0 =>
        {
            HealthFinding::bad(
                "sockets",
                format!("{place} is accessible to other users"),
                format!("agents refuse it: chmod 700 {place}, or set XDG_RUNTIME_DIR to another folder"),
            )
        }
        // The longest path of a socket on Linux, with a name of an agent.
        Ok(_) if folder.as_os_str().len() > 80 => HealthFinding::warning(
            "sockets",
            format!("{place} is long, and the path of a socket can have 107 bytes"),
            "set XDG_RUNTIME_DIR to a shorter path",
        ),
        Ok(_) => HealthFinding::good("sockets", place),
    }
}

/// Checks the running agents and the versions of their operations.
fn agents() -> Vec<HealthFinding> {
    let answers = query_all(|name| Client::connect(name).map(|_| ()));
    if answers.is_empty() {
        return vec![HealthFinding::good("agents", "none runs")];
    }
    let finding = |(name, answer): (String, Option<Result<(), ClientError>>)| match answer {
        Some(Ok(())) => HealthFinding::good("agents", format!("{name} answers")),
        Some(Err(error @ ClientError::Version { .. })) => {
            HealthFinding::bad("agents", error.to_string(), "use the `slate` that runs the agent")
        }
        Some(Err(error)) => HealthFinding::warning("agents", error.to_string(), "see the agent's log"),
        None => HealthFinding::warning(
            "agents",
            format!("{name} does not answer"),
            format!("it hangs or is suspended; {}/{name}.lock contains its process id", folder().display()),
        ),
    };
    answers.into_iter().map(finding).collect()
}

/// Returns a limit of the process, by its name in `/proc/self/limits`.
/// It is the soft one; the inner `None` stands for no limit.
fn limit(name: &str) -> Option<Option<u64>> {
    let limits = fs::read_to_string("/proc/self/limits").ok()?;
    let line = limits.lines().find_map(|line| line.strip_prefix(name))?;
    let soft = line.split_whitespace().next()?;
    Some(soft.parse().ok())
}

fn realtime() -> HealthFinding {
    let runtime = fs::read_to_string("/sys/kernel/realtime").is_ok_and(|text| text.trim() == "1");
    let kernel = if runtime { "a real-time kernel" } else { "a general-purpose kernel" };
    match limit("Max realtime priority") {
        Some(None) => HealthFinding::good("real time", format!("{kernel}; any priority is allowed")),
        Some(Some(priority)) if priority > 0 => {
            HealthFinding::good("real time", format!("{kernel}; priorities up to {priority} are allowed"))
        }
        _ if rustix::process::geteuid().is_root() => {
            HealthFinding::good("real time", format!("{kernel}; root may take any priority"))
        }
        _ => HealthFinding::warning(
            "real time",
            format!("{kernel}; this user may take no real-time priority"),
            "for loops faster than some 200 Hz, add `@realtime - rtprio 80` to /etc/security/limits.conf and yourself to \
             that group",
        ),
    }
}

fn memory_locks() -> HealthFinding {
    match limit("Max locked memory") {
        Some(Some(bytes)) if bytes < 64 << 20 => HealthFinding::warning(
            "memory",
            format!("{} may be locked", duration::bytes(bytes as f64)),
            "pages may be swapped out: add `- memlock unlimited` for this user to /etc/security/limits.conf",
        ),
        Some(Some(bytes)) => {
            HealthFinding::good("memory", format!("{} may be locked", duration::bytes(bytes as f64)))
        }
        _ => HealthFinding::good("memory", "no limit on locked memory"),
    }
}

fn files() -> HealthFinding {
    match limit("Max open files") {
        Some(Some(count)) if count < 512 => HealthFinding::warning(
            "files",
            format!("{count} may be open at once"),
            "an agent with many tools and peers needs more: ulimit -n 4096",
        ),
        Some(Some(count)) => HealthFinding::good("files", format!("{count} may be open at once")),
        _ => HealthFinding::good("files", "any number may be open"),
    }
}

/// Measures the rate at which a file grows on disk, as a recording does.
fn disk(folder: &Path) -> HealthFinding {
    let path = folder.join(format!(".slate-doctor-{}", std::process::id()));
    let measured = write(&path);
    let _ = fs::remove_file(&path);
    let place = slate::runtime::printable(folder);
    match measured {
        Ok(speed) if speed < MIN_WRITE_RATE => HealthFinding::warning(
            "disk",
            format!("{place}: {}/s", duration::bytes(speed)),
            "recordings with images lose values: record fewer properties, or on another disk",
        ),
        Ok(speed) => HealthFinding::good("disk", format!("{place}: {}/s", duration::bytes(speed))),
        Err(error) => HealthFinding::bad(
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

fn shared_memory() -> HealthFinding {
    let place = Path::new("/dev/shm");
    match rustix::fs::statvfs(place) {
        Ok(stat) => {
            let free = stat.f_bavail as f64 * stat.f_frsize as f64;
            let found = format!("{} free in /dev/shm", duration::bytes(free));
            if free < 64e6 {
                let hint =
                    "agents of one machine share large values there: give a container more (--shm-size=1g)";
                return HealthFinding::warning("shared memory", found, hint);
            }
            HealthFinding::good("shared memory", found)
        }
        Err(error) => HealthFinding::warning(
            "shared memory",
            format!("/dev/shm can't be read: {error}"),
            "values between agents of one machine go through sockets, which is slower",
        ),
    }
}

fn ports() -> HealthFinding {
    match std::net::UdpSocket::bind(("127.0.0.1", 0))
        .and_then(|_| std::net::TcpListener::bind(("127.0.0.1", 0)))
    {
        Ok(_) => HealthFinding::good("ports", "can be listened at"),
        Err(error) => HealthFinding::bad(
            "ports",
            error.to_string(),
            "agents can't listen for others: look at the firewall or sandbox",
        ),
    }
}

fn configuration(name: &str) -> HealthFinding {
    let found = examples::find(name, None, Vec::new(), Vec::new(), None).map_err(Failure::from);
    match found.and_then(|application| modules_of(&application)) {
        Ok(modules) => HealthFinding::good("configuration", format!("{name} fits, with {modules} modules")),
        Err(failure) => {
            let text = failure.to_string();
            let first = text.lines().next().unwrap_or_default().to_owned();
            HealthFinding::bad("configuration", first, format!("`slate check {name}` shows all of it"))
        }
    }
}

/// Returns the number of modules that an agent of an application would start with.
fn modules_of(application: &Application) -> Result<usize, Failure> {
    let catalogue = offline::catalogue(application)?;
    let linked = LinkedConfiguration::new(&application.configuration, &catalogue, &|_| false);
    let composition = linked.composition(&catalogue)?;
    offline::check(&composition, &catalogue)?;
    Ok(composition.survey().modules.len())
}
