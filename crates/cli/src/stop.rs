//! Software stop of agents that run.

use std::sync::mpsc::channel;
use std::sync::{Arc, Mutex, PoisonError};
use std::thread;
use std::time::Duration;

use clap::Args;
use serde::Serialize;
use serde_json::json;
use slate::control::{Client, ClientError};
use slate::runtime::directory::agents;

use crate::clock::now;
use crate::connection::AgentOption;
use crate::failure::{Failure, UNREACHED};
use crate::output;
use slate::control::BASE;
use slate::control::client::{Access, AccessFailure, Request, RequestError};

#[derive(Debug, Args)]
pub struct StopOptions {
    /// Reason, which is logged and shown
    // Unknown words are part of the reason (see `words`): a stop is not refused for a word.
    #[arg(value_name = "REASON")]
    reason: Vec<String>,

    /// Print the result as JSON
    #[arg(long)]
    json: bool,

    #[command(flatten)]
    agent: AgentOption,
}

#[derive(Debug, Args)]
pub struct ResetOptions {
    /// Print the result as JSON
    #[arg(long)]
    json: bool,

    #[command(flatten)]
    agent: AgentOption,
}

#[derive(Debug, Args)]
pub struct ArmOptions {
    /// Actuator, such as `r2/wheels` [default: all]
    actuator: Option<String>,

    /// Print the result as JSON
    #[arg(long)]
    json: bool,

    #[command(flatten)]
    agent: AgentOption,
}

/// Timeout for the confirmation of a stop.
/// It needs a few milliseconds; a person must not be left without an answer.
const TIMEOUT: Duration = Duration::from_secs(4);

/// Retries of a stop, and the pause between them.
/// An agent without free descriptors closes the connection of a stop.
const MAX_RETRIES: u32 = 5;
const RETRY_PAUSE: Duration = Duration::from_millis(50);

/// Result of stopping an agent.
#[derive(Debug, Serialize)]
struct StopResult {
    agent: String,
    /// Neither this nor trouble is with one that has ended meanwhile.
    stopped: bool,
    /// Time until the stop was confirmed, ms.
    after_ms: f64,
    /// Reason why the stop is not confirmed.
    trouble: Option<String>,
}

/// Tells an agent to stop, for a reason.
type StopCall = Box<dyn FnOnce(&str) -> Result<(), Failure> + Send>;

/// Agent, and the way in which it receives the stop.
struct StopTarget {
    name: String,
    stop: StopCall,
}

impl StopTarget {
    /// Creates the target of a local agent, by its name.
    fn local(name: String) -> Self {
        let agent = name.clone();
        Self { name, stop: Box::new(move |reason| Ok(Client::stop_at_once(&agent, reason)?)) }
    }

    /// Creates the target of a stop over HTTP.
    /// It uses a request of its own, for which a connection is always reserved.
    fn remote(access: Access) -> Self {
        let name = access.address.to_string();
        let stop = move |reason: &str| {
            let (path, body) = (format!("{BASE}/stop"), json!({ "reason": reason }).to_string());
            let request = Request { method: "POST", path: &path, body: Some(&body), ..Request::default() };
            let mut retries = 0..MAX_RETRIES;
            loop {
                match access.value(&request) {
                    Err(RequestError::AccessFailure(AccessFailure::Unreached { .. }))
                        if retries.next().is_some() =>
                    {
                        thread::sleep(RETRY_PAUSE);
                    }
                    outcome => return Ok(outcome.map(drop)?),
                }
            }
        };
        Self { name, stop: Box::new(stop) }
    }
}

/// Stops all actuators of the named agent, else of all local ones.
/// Returns the exit code.
pub fn stop(options: &StopOptions) -> Result<u8, Failure> {
    let json = options.json;
    let reason = match options.reason.join(" ") {
        empty if empty.trim().is_empty() => "by a person at the terminal".into(),
        reason => reason,
    };
    let targets: Vec<StopTarget> = match (options.agent.elsewhere()?, options.agent.name_or_address()) {
        (Some(access), _) => vec![StopTarget::remote(access)],
        (None, Some(name)) => vec![StopTarget::local(name)],
        (None, None) => agents().into_iter().map(StopTarget::local).collect(),
    };
    let answers = stop_all(targets, &reason, |answer| {
        if let (false, true) = (json, answer.stopped) {
            let StopResult { agent, after_ms, .. } = answer;
            output::line(format_args!("{agent} has stopped all actuators after {after_ms:.1} ms"));
        }
    })?;
    if answers.iter().all(|answer| !answer.stopped && answer.trouble.is_none()) {
        return Err(Failure::NoAgent);
    }
    if json {
        output::json(&json!({"schema": "slate.stop/1", "reason": reason, "agents": answers}));
    } else if answers.iter().any(|answer| answer.stopped) {
        output::line("the stop holds until `slate reset` and `slate arm`");
    }
    let silent = answers.into_iter().filter_map(|answer| Some((answer.agent, answer.trouble?)));
    let silent: Vec<_> = silent.collect();
    for (agent, trouble) in &silent {
        Failure::NotStopped { agent: agent.clone(), reason: trouble.clone() }.print();
    }
    Ok(if silent.is_empty() { 0 } else { UNREACHED })
}

/// Stops all agents concurrently, so that a hanging one delays no other.
/// `report` receives each answer at once.
fn stop_all(
    targets: Vec<StopTarget>,
    reason: &str,
    report: impl Fn(&StopResult),
) -> Result<Vec<StopResult>, Failure> {
    let waiting = |target: &StopTarget| StopResult {
        agent: target.name.clone(),
        stopped: false,
        after_ms: TIMEOUT.as_secs_f64() * 1e3,
        trouble: Some(format!("no answer within {} s", TIMEOUT.as_secs())),
    };
    let mut answers: Vec<StopResult> = targets.iter().map(waiting).collect();
    let is_single = answers.len() == 1;
    let (sender, outcomes) = channel();
    let begin = now();
    for (index, target) in targets.into_iter().enumerate() {
        let (sender, reason) = (sender.clone(), reason.to_owned());
        let work = Arc::new(Mutex::new(Some(move || {
            // By then the caller may have stopped waiting.
            let _ = sender.send((index, (target.stop)(&reason), begin.elapsed()));
        })));
        let take = |work: &Mutex<Option<_>>| work.lock().unwrap_or_else(PoisonError::into_inner).take();
        let queued = Arc::clone(&work);
        // One that hangs keeps its thread until the end of this program, which is near.
        let thread = thread::Builder::new().spawn(move || take(&queued).map(|work| work()));
        // Without a thread for it, this one does it.
        if thread.is_err()
            && let Some(work) = take(&work)
        {
            work();
        }
    }
    drop(sender);
    while let Ok((index, outcome, time)) = outcomes.recv_timeout(TIMEOUT.saturating_sub(begin.elapsed())) {
        let answer = &mut answers[index];
        answer.after_ms = time.as_secs_f64() * 1e3;
        answer.stopped = outcome.is_ok();
        answer.trouble = match outcome {
            Ok(()) => None,
            // A named agent that is missing or not queried is reported as by all verbs.
            Err(failure) if is_single && !matches!(failure, Failure::Agent(ClientError::Lost { .. })) => {
                return Err(failure);
            }
            // Of several, one that has ended meanwhile drives nothing.
            Err(Failure::Agent(ClientError::NoAgent { .. })) => None,
            Err(failure) => Some(failure.to_string()),
        };
        report(answer);
    }
    Ok(answers)
}

/// Ends a stop.
pub fn reset(options: &ResetOptions) -> Result<bool, Failure> {
    let mut client = options.agent.connect()?;
    let was_stopped = client.reset()?;
    if options.json {
        let agent = client.name();
        output::json(&json!({"schema": "slate.reset/1", "agent": agent, "was_stopped": was_stopped}));
        return Ok(true);
    }
    output::line(if was_stopped {
        "the stop is reset; `slate arm` arms the actuators"
    } else {
        "no stop was active; armed actuators stay armed"
    });
    Ok(true)
}

/// Arms all actuators, or one.
pub fn arm(options: &ArmOptions) -> Result<bool, Failure> {
    let mut client = options.agent.connect()?;
    client.arm(options.actuator.as_deref())?;
    match &options.actuator {
        actuator if options.json => {
            let agent = client.name();
            output::json(&json!({"schema": "slate.arm/1", "agent": agent, "actuator": actuator}));
        }
        Some(name) => output::line(format_args!("{name} is armed")),
        None => output::line("the actuators are armed"),
    }
    Ok(true)
}
