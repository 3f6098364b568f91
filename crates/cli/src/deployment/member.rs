//! Process of one of several agents.

use std::ffi::OsString;
use std::io::{self, Read, Write};
use std::net::Shutdown;
use std::os::fd::OwnedFd;
use std::os::unix::net::UnixStream;
use std::os::unix::process::{CommandExt, ExitStatusExt};
use std::process::{Child, Command, ExitStatus, Stdio};
use std::sync::mpsc::Sender;

use rustix::io::Errno;
use rustix::process::{Pid, Signal, WaitId, WaitIdOptions, kill_process, waitid};
use serde_json::Value;
use slate::runtime::Rate;
use slate::runtime::isolation::Supervisor;
use slate_run::{Application, ApplicationOptions, RunOptions};

use super::MemberEvent;
use super::lines::{OutputStream, Relay};
use crate::run_options::RunVerb;

/// Agent of the deployment, running or not.
pub struct TeamMember {
    /// Name of its table in the file.
    pub name: String,
    /// Name under which tools find it.
    pub agent_name: String,
    /// Agent with its mission, with which it ends.
    pub mission_of: Option<String>,
    /// End of the mission of that agent.
    pub is_ending: bool,
    pub supervisor: Supervisor,
    pub running: Option<MemberProcess>,
    /// Number of restarts.
    pub restarts: u32,
    /// Exit code, once the agent has ended for good.
    pub code: Option<u8>,
    /// Summary of its last run, if requested as JSON.
    pub summary: Option<Value>,
    arguments: Vec<OsString>,
    index: usize,
    /// Length of the longest name.
    width: usize,
    json: bool,
    /// Disarmed start: its actuators wait for a person.
    disarmed: bool,
}

/// Process of an agent.
pub struct MemberProcess {
    child: Child,
    /// Stream whose other end is the agent's standard input.
    stream: UnixStream,
    lines: [Relay; 2],
}

impl TeamMember {
    /// Creates an agent that does not run yet.
    /// The one that `has_console` has a web console.
    pub fn new(
        verb: &RunVerb,
        (index, name): (usize, &str),
        width: usize,
        application: &Application,
        has_console: bool,
    ) -> Self {
        let configuration = &application.configuration;
        let mission_of = configuration.mission().and_then(|mission| mission.outcome.agent());
        Self {
            name: name.into(),
            agent_name: configuration.agent_name().into(),
            mission_of: mission_of.map(str::to_owned),
            is_ending: false,
            supervisor: Supervisor::default(),
            running: None,
            restarts: 0,
            code: None,
            summary: None,
            arguments: arguments(verb, name, application, has_console),
            index,
            width,
            json: verb.options.common.json,
            disarmed: verb.options.disarmed,
        }
    }

    /// Starts its process, which sends events.
    pub fn start(&mut self, is_restart: bool, events: &Sender<MemberEvent>) -> io::Result<()> {
        let (stream, child_stream) = UnixStream::pair()?;
        let (mut ready, index) = (stream.try_clone()?, self.index);
        // This is the program as it runs, also when its file was replaced meanwhile.
        let mut command = Command::new("/proc/self/exe");
        command
            .arg0("slate")
            .arg("run")
            .args((is_restart || self.disarmed).then_some("--disarmed"))
            .args(&self.arguments);
        command.stdin(Stdio::from(OwnedFd::from(child_stream))).stdout(Stdio::piped()).stderr(Stdio::piped());
        // Ctrl-C reaches it through its supervisor, once.
        command.process_group(0);
        let mut child = command.spawn()?;
        let id = Pid::from_child(&child);
        let events = events.clone();
        let watch = move || {
            if ready.read_exact(&mut [0]).is_ok() {
                let _ = events.send(MemberEvent::Ready(index));
            }
            // It is left to the supervisor to take note of the end, so that the number is that of no other process
            // before.
            let options = WaitIdOptions::EXITED | WaitIdOptions::NOWAIT;
            while matches!(waitid(WaitId::Pid(id), options), Err(Errno::INTR)) {}
            let _ = events.send(MemberEvent::Ended(index));
        };
        let started = std::thread::Builder::new()
            .name("agent".into())
            .spawn(watch)
            .and_then(|_| self.relay(&mut child));
        match started {
            Ok(lines) => self.running = Some(MemberProcess { child, stream, lines }),
            Err(error) => {
                // It does nothing yet.
                let _ = child.kill().and_then(|()| child.wait());
                return Err(error);
            }
        }
        self.restarts += u32::from(is_restart);
        Ok(())
    }

    fn relay(&self, child: &mut Child) -> io::Result<[Relay; 2]> {
        let lost = || io::Error::from(io::ErrorKind::BrokenPipe);
        let (stdout, stderr) = (child.stdout.take().ok_or_else(lost)?, child.stderr.take().ok_or_else(lost)?);
        let prefix = |to: OutputStream| to.prefix(self.index, &self.name, self.width);
        Ok([
            Relay::start(stdout, OutputStream::Stdout, prefix(OutputStream::Stdout), self.json)?,
            Relay::start(stderr, OutputStream::Stderr, prefix(OutputStream::Stderr), false)?,
        ])
    }

    /// Takes note that its process has ended, and how, when its last lines are out.
    pub fn reap(&mut self) -> Option<ExitStatus> {
        let MemberProcess { mut child, lines, .. } = self.running.take()?;
        let [stdout, stderr] = lines.map(Relay::finish);
        self.summary = stdout.or(stderr).or(self.summary.take());
        child.wait().ok()
    }
}

impl MemberProcess {
    /// Lets the agent run, which is ready to.
    pub fn release(&mut self) {
        // It fails when the process has just ended, which is noticed.
        let _ = self.stream.write_all(&[0]);
    }

    /// Asks it to end, also while it waits to be released.
    pub fn interrupt(&self) {
        self.signal(Signal::INT);
        // It fails when the process has ended.
        let _ = self.stream.shutdown(Shutdown::Both);
    }

    /// Ends it at once.
    pub fn kill(&self) {
        self.signal(Signal::KILL);
    }

    fn signal(&self, signal: Signal) {
        // It is there until it is reaped.
        let _ = kill_process(Pid::from_child(&self.child), signal);
    }
}

/// Returns the exit code as a shell reports it.
pub fn code(status: ExitStatus) -> u8 {
    let code = status.code().or_else(|| status.signal().map(|signal| 128 + signal));
    code.and_then(|code| u8::try_from(code).ok()).unwrap_or(2)
}

/// Returns the arguments of the agent's process.
fn arguments(verb: &RunVerb, name: &str, application: &Application, has_console: bool) -> Vec<OsString> {
    // All are named, so that none that comes later is forgotten.
    let RunVerb { name: file, agent: _, options, supervised: _, watched: _ } = verb;
    let RunOptions { common, headless, open, stay, rate, seed, resume: _, out, disarmed: _ } = options;
    let ApplicationOptions { mode, workers, set, host, json } = common;
    let mut arguments: Vec<OsString> = vec!["--supervised".into(), "--headless".into()];
    let mut add = |option: &str, value: Option<OsString>| {
        if let Some(value) = value {
            // In one piece, as a value may begin with a dash.
            let mut argument = OsString::from(format!("--{option}="));
            argument.push(value);
            arguments.push(argument);
        }
    };
    add("agent", Some(name.into()));
    add("mode", Some(mode.name().into()));
    add("workers", Some(workers.to_string().into()));
    set.iter().for_each(|set| add("set", Some(set.into())));
    add("host", host.as_ref().map(Into::into));
    // One without a simulator goes with the wall clock, whatever the pace of the others.
    let rate = rate.filter(|_| application.configuration.time_source().is_some());
    add(
        "rate",
        rate.map(|rate| match rate {
            Rate::Max => "max".into(),
            Rate::Times(factor) => factor.to_string().into(),
        }),
    );
    add("seed", seed.map(|seed| seed.to_string().into()));
    add("out", out.as_ref().map(|out| out.join(name).into()));
    arguments.extend(json.then(|| "--json".into()));
    arguments.extend(stay.then(|| "--stay".into()));
    arguments.extend((has_console && !headless).then(|| "--watched".into()));
    arguments.extend((has_console && *open).then(|| "--open".into()));
    arguments.push("--".into());
    arguments.extend(file.as_ref().map(Into::into));
    arguments
}
