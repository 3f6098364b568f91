//! Deployment: the agents of one file, each in its own process, and a supervisor.
//! The supervisor starts them and restarts those that crash.

mod lines;
mod member;
mod supervisor_connection;

use std::path::{Path, PathBuf};
use std::sync::mpsc::{Receiver, RecvTimeoutError, Sender, channel};
use std::time::{Duration, Instant};

use serde_json::json;
use slate::runtime::configuration::{Configuration, Spanned};
use slate::runtime::isolation::{Supervisor, describe};
use slate_sorted::SortedMap;

use slate_run::Application;

use crate::clock::now;
use crate::failure::Failure;
use crate::interrupt::DEBOUNCE;
use crate::run_options::RunVerb;
use crate::{examples, output};
use member::{MemberProcess, TeamMember, code};
pub use supervisor_connection::{SupervisorConnection, end_later};

/// Time that an agent may take to end on request.
const TIMEOUT: Duration = Duration::from_secs(10);

/// Exit code of a process that was interrupted twice.
const INTERRUPTED: u8 = 130;

/// Exit codes of a run that ended by itself, not by a crash.
/// Success, failure or refusal; or an interruption by a person, by SIGHUP, SIGINT or SIGTERM before it caught them.
const ORDERLY_CODES: [u8; 6] = [0, 1, 2, 129, INTERRUPTED, 143];

/// Exit codes of a run that was asked to end.
const STOP_CODES: [u8; 4] = [1, 129, INTERRUPTED, 143];

/// Event of the supervisor.
pub enum MemberEvent {
    /// Agent at this index that can start, or has ended.
    Ready(usize),
    Ended(usize),
    /// Request to end: Ctrl-C, or another signal.
    Interrupted,
}

/// Runs all agents of a file until they have ended.
/// Returns the worst of their exit codes.
pub fn run(verb: &RunVerb, names: &[String]) -> Result<u8, Failure> {
    let options = &verb.options;
    if options.resume.is_some() {
        return Err(Failure::SeveralResumed { agents: names.to_vec() });
    }
    let members = members(verb, names)?;
    let (sender, events) = channel();
    let interrupted = sender.clone();
    let handled = ctrlc::set_handler(move || {
        let _ = interrupted.send(MemberEvent::Interrupted);
    });
    if let Err(error) = handled {
        say(format_args!("Ctrl-C will end the agents without their reports: {error}"));
    }
    let mut deployment = Deployment {
        members,
        sender,
        start: now(),
        ready: 0,
        stopping: None,
        refused: None,
        interrupted: None,
        killed: false,
    };
    say(format_args!("agents: {}", names.join(", ")));
    deployment.begin()?;
    deployment.follow(&events);
    if options.common.json {
        output::document("slate.deployment/1", &deployment.summary());
    }
    Ok(deployment.code())
}

/// Returns the agents, if all their configurations are valid.
fn members(verb: &RunVerb, names: &[String]) -> Result<Vec<TeamMember>, Failure> {
    let width = names.iter().map(|name| name.chars().count()).max().unwrap_or_default();
    let options = &verb.options;
    let file = verb.name.as_deref().unwrap_or_default();
    let mut files: SortedMap<PathBuf, &str> = SortedMap::new();
    let mut applications = Vec::new();
    for name in names {
        let (sets, host) = (options.common.set.clone(), options.common.host.as_deref());
        let application = examples::find(file, Some(name), Vec::new(), sets, host)?;
        let configuration = &application.configuration;
        for path in output_files(configuration) {
            if let Some(other) = files.insert(canonical_path(&path.value), name) {
                let message = format!("`{other}` and `{name}` would write the same file");
                let help = format!("give `{name}` one of its own, in [agents.{name}]");
                return Err(Failure::Configuration(
                    configuration.diagnostic(path.span, message, Some(help)).into(),
                ));
            }
        }
        applications.push((name, application));
    }
    // One page is enough: that of the agent which has the mission, or of the first.
    let has_mission = |(_, application): &(&String, Application)| {
        application.configuration.mission().is_some_and(|mission| mission.outcome.agent().is_none())
    };
    let shown = applications.iter().position(has_mission).unwrap_or(0);
    let member = |(index, (name, application)): (usize, &(&String, Application))| {
        TeamMember::new(verb, (index, name), width, application, index == shown)
    };
    Ok(applications.iter().enumerate().map(member).collect())
}

/// Returns the files that an agent writes by its configuration.
fn output_files(configuration: &Configuration) -> impl Iterator<Item = &Spanned<PathBuf>> {
    let log = configuration.log().targets.file.as_ref().map(|file| &file.path);
    let snapshot = configuration.snapshot().map(|snapshot| &snapshot.file);
    let memories = configuration.modules().iter().filter_map(|module| module.memory.as_ref());
    log.into_iter().chain(snapshot).chain(memories)
}

/// Returns a path that is equal for all paths of one file.
fn canonical_path(path: &Path) -> PathBuf {
    let (folder, name) = (path.parent().unwrap_or(path), path.file_name().unwrap_or_default());
    let folder = if folder.as_os_str().is_empty() { Path::new(".") } else { folder };
    // A folder that is not there has no other names but those that are written.
    let folder = folder.canonicalize().or_else(|_| std::path::absolute(folder));
    folder.map_or_else(|_| path.to_owned(), |folder| folder.join(name))
}

struct Deployment {
    members: Vec<TeamMember>,
    sender: Sender<MemberEvent>,
    start: Instant,
    /// Number of agents that are ready; they start when all are.
    ready: usize,
    /// Time since which they are to end.
    stopping: Option<Instant>,
    /// Exit code of an agent that could not start.
    refused: Option<u8>,
    /// Time at which a person requested the end.
    interrupted: Option<Instant>,
    /// Second request for the end.
    killed: bool,
}

impl Deployment {
    /// Starts all processes, or none.
    fn begin(&mut self) -> Result<(), Failure> {
        for index in 0..self.members.len() {
            if let Err(source) = self.members[index].start(false, &self.sender) {
                let agent = self.members[index].name.clone();
                self.each_running(MemberProcess::kill);
                for member in &mut self.members {
                    let _ = member.reap();
                }
                return Err(Failure::Process { agent, source });
            }
        }
        Ok(())
    }

    /// Handles events until all agents have ended.
    fn follow(&mut self, events: &Receiver<MemberEvent>) {
        while self.members.iter().any(|member| member.code.is_none()) {
            let event = match self.due() {
                Some(due) => events.recv_timeout(due.saturating_duration_since(now())),
                None => events.recv().map_err(RecvTimeoutError::from),
            };
            match event {
                Ok(MemberEvent::Ready(index)) => self.ready(index),
                Ok(MemberEvent::Ended(index)) => self.ended(index),
                Ok(MemberEvent::Interrupted) => self.interrupted(),
                Err(_) => self.handle_due(),
            }
        }
    }

    /// Returns the time of the next action, unless an event comes before.
    fn due(&self) -> Option<Instant> {
        let waiting = self.members.iter().filter(|member| member.code.is_none());
        let restarts = waiting.filter_map(|member| member.supervisor.due());
        let restart = restarts.min().map(|due| self.start + Duration::from_nanos(due));
        self.stopping.map(|since| since + TIMEOUT).or(restart)
    }

    fn nanoseconds(&self) -> u64 {
        now().duration_since(self.start).as_nanos() as u64
    }

    fn is_started(&self) -> bool {
        self.ready >= self.members.len()
    }

    fn ready(&mut self, index: usize) {
        let was_started = self.is_started();
        self.ready += 1;
        if self.stopping.is_some() || !self.is_started() {
            return;
        }
        let starting = if was_started { index..index + 1 } else { 0..self.members.len() };
        for member in &mut self.members[starting] {
            if let Some(running) = &mut member.running {
                running.release();
            }
        }
    }

    fn ended(&mut self, index: usize) {
        let (is_started, at) = (self.is_started(), self.nanoseconds());
        let member = &mut self.members[index];
        let Some(status) = member.reap() else { return };
        let name = &member.name;
        let is_ending = member.is_ending;
        let code = match code(status) {
            // It was asked to end, and its run is judged where its mission is.
            code if is_ending && STOP_CODES.contains(&code) => 0,
            code => code,
        };
        if self.stopping.is_some() {
            member.code = Some(code);
            if self.refused.is_none() {
                say(format_args!("{name} {}", describe(status)));
            }
        } else if !is_started {
            say(format_args!("{name} {} before it was ready: no agent is started", describe(status)));
            member.code = Some(code.max(1));
            self.refused = Some(code.max(1));
            self.stop();
        } else if is_ending || ORDERLY_CODES.contains(&code) {
            say(format_args!("{name} {}", describe(status)));
            member.code = Some(code);
            let agent_name = member.agent_name.clone();
            self.end_mission_of(&agent_name);
        } else {
            Self::handle_crash(member, at, &describe(status), code);
            self.end_missions_of_ended();
        }
    }

    /// Asks those to end whose mission was that of an agent which stays off.
    fn end_missions_of_ended(&mut self) {
        let ended = self.members.iter().filter(|member| member.code.is_some());
        let agent_name: Vec<_> = ended.map(|member| member.agent_name.clone()).collect();
        agent_name.iter().for_each(|agent_name| self.end_mission_of(agent_name));
    }

    /// Asks those to end whose mission was that of an agent which has ended.
    fn end_mission_of(&mut self, agent_name: &str) {
        for member in self.members.iter_mut() {
            if member.is_ending || member.mission_of.as_deref() != Some(agent_name) {
                continue;
            }
            member.is_ending = true;
            match &member.running {
                Some(running) => running.interrupt(),
                // It waits to be started anew, and never is.
                None => drop(member.code.get_or_insert(2)),
            }
        }
        let mut members = self.members.iter();
        if members.all(|member| member.is_ending || member.code.is_some()) {
            self.stopping.get_or_insert_with(now);
        }
    }

    /// Handles a crashed agent: it restarts, unless it crashed too often.
    fn handle_crash(member: &mut TeamMember, at: u64, how: &str, code: u8) {
        let TeamMember { name, agent_name, supervisor, code: ended, .. } = member;
        match supervisor.failed(at) {
            Some(delay) => say(format_args!(
                "{name} {how}; restarting in {} ms, disarmed: `slate arm --agent {agent_name}` arms its actuators",
                delay / 1_000_000
            )),
            None => {
                say(format_args!("{name} {how}; {}", Supervisor::too_often()));
                *ended = Some(code);
            }
        }
    }

    /// Restarts agents that are due, or ends those that should have ended.
    fn handle_due(&mut self) {
        if self.stopping.is_some_and(|since| now() >= since + TIMEOUT) {
            self.each_running(MemberProcess::kill);
            // It can't be held up.
            self.stopping = Some(now());
            return;
        }
        let at = self.nanoseconds();
        for member in &mut self.members {
            if member.code.is_none()
                && member.supervisor.take_due(at)
                && let Err(error) = member.start(true, &self.sender)
            {
                Self::handle_crash(member, at, &format!("can't be started: {error}"), 2);
            }
        }
        self.end_missions_of_ended();
    }

    fn interrupted(&mut self) {
        match self.interrupted {
            None => {
                self.interrupted = Some(now());
                self.stop();
            }
            Some(first) if first.elapsed() < DEBOUNCE => {}
            Some(_) => {
                self.killed = true;
                self.each_running(MemberProcess::kill);
            }
        }
    }

    /// Asks all to end.
    fn stop(&mut self) {
        if self.stopping.is_some() {
            return;
        }
        self.stopping = Some(now());
        self.each_running(MemberProcess::interrupt);
        // Those that wait to be started anew never are.
        for member in self.members.iter_mut().filter(|member| member.running.is_none()) {
            member.code.get_or_insert(2);
        }
    }

    fn each_running(&self, act: impl Fn(&MemberProcess)) {
        self.members.iter().filter_map(|member| member.running.as_ref()).for_each(act);
    }

    /// Returns the worst exit code of any agent.
    /// If agents were not started, that of the one that could not.
    fn code(&self) -> u8 {
        let interrupted = self.killed.then_some(INTERRUPTED);
        let worst = self.members.iter().filter_map(|member| member.code).max();
        interrupted.or(self.refused).or(worst).unwrap_or_default()
    }

    /// Returns the summary of how each agent ended, as JSON.
    fn summary(&self) -> serde_json::Value {
        let agents = self.members.iter().map(|member| {
            let TeamMember { name, code, restarts, summary, .. } = member;
            (name.clone(), json!({ "code": code, "restarts": restarts, "summary": summary }))
        });
        json!({ "agents": agents.collect::<serde_json::Map<_, _>>() })
    }
}

/// Prints a line to stderr; a closed terminal is ignored.
fn say(text: std::fmt::Arguments<'_>) {
    use std::io::Write;
    let _ = std::io::stderr().lock().write_all(format!("{text}\n").as_bytes());
}
