//! Access to the agent for a language model, in a role.

use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Mutex, MutexGuard, PoisonError};
use std::time::Duration;

use serde_json::{Map, Value, json};
use slate::control::client::Access;
use slate::control::operations::{DRIVE, STOP};
use slate::control::{Client, ClientError, Operation, Role};

use super::tools::{EXPLAIN_TOOL, MAX_DRIVE_DURATION, operation, request};
use crate::clock::now;
use crate::codes::explained;
use crate::connection::AgentOption;
use crate::failure::Failure;

/// Name of the caller in the agent's log.
const CLIENT_NAME: &str = "mcp";

/// Period at which a command is repeated; it holds for 150 ms.
const COMMAND_PERIOD: Duration = Duration::from_millis(50);

/// Unused connections that are kept for the next calls.
const MAX_IDLE_CONNECTIONS: usize = 4;

/// Route to an agent.
enum AgentRoute {
    /// Agent as selected on the command line.
    Option(AgentOption),
    /// Over HTTP, with the token of a caller.
    Token(Access),
}

/// Access to an agent.
pub struct AgentAccess {
    route: AgentRoute,
    role: Role,
    /// Name that the agent gives itself.
    name: String,
    /// Name under which the agent is reached on this machine, if it is local.
    local: Option<String>,
    /// Connections that no tool uses at the moment.
    idle: Mutex<Vec<Client>>,
    /// Closed flag: the client has gone.
    is_over: AtomicBool,
}

impl AgentAccess {
    /// Creates the access to a running agent.
    pub fn new(option: &AgentOption, role: Role) -> Result<Self, Failure> {
        let mut option = AgentOption { agent: option.name_or_address() };
        let (client, role) = set_identity(option.connect()?, role)?;
        let name = client.name().to_owned();
        // The same agent, also when another one is started beside it.
        let said = option.agent.get_or_insert_with(|| name.clone());
        let local = Some(said.clone()).filter(|said| !said.contains("://"));
        Ok(Self::with(AgentRoute::Option(option), role, client, local))
    }

    /// Creates the access of a caller over HTTP, by its token of an agent's role.
    /// `local` is the agent's name on this machine.
    pub fn by_token(access: Access, limit: Role, local: Option<String>) -> Result<Self, Failure> {
        let (client, role) = set_identity(Client::at(&access)?, limit)?;
        Ok(Self::with(AgentRoute::Token(access), role, client, local))
    }

    fn with(route: AgentRoute, role: Role, client: Client, local: Option<String>) -> Self {
        let name = client.name().to_owned();
        Self { route, role, name, local, idle: Mutex::new(vec![client]), is_over: AtomicBool::new(false) }
    }

    /// Returns the rights of the model.
    pub fn role(&self) -> Role {
        self.role
    }

    /// Returns the name of the agent.
    pub fn name(&self) -> &str {
        &self.name
    }

    /// Ends the calls in progress.
    pub fn end(&self) {
        self.is_over.store(true, Ordering::Release);
        self.idle().clear();
    }

    fn idle(&self) -> MutexGuard<'_, Vec<Client>> {
        self.idle.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Runs a tool.
    pub fn call(
        &self,
        tool: &str,
        arguments: &Map<String, Value>,
        is_cancelled: impl Fn() -> bool,
    ) -> Result<Value, String> {
        match tool {
            STOP => self.stop(arguments),
            DRIVE => self.drive(arguments, || is_cancelled() || self.is_over.load(Ordering::Acquire)),
            EXPLAIN_TOOL => {
                let code = arguments.get("code").and_then(Value::as_str).unwrap_or_default();
                explained(code).ok_or_else(|| format!("no error has the code `{code}`"))
            }
            _ => match operation(tool) {
                Some(operation) => self.carry_out(operation, arguments),
                None => Err(format!("unknown tool `{tool}`")),
            },
        }
    }

    fn connect(&self) -> Result<Client, String> {
        let connected = match &self.route {
            AgentRoute::Option(option) => option.connect(),
            AgentRoute::Token(access) => Client::at(access).map_err(Failure::from),
        };
        let introduced = connected.and_then(|client| set_identity(client, self.role));
        introduced.map(|(client, _)| client).map_err(|failure| failure.to_string())
    }

    fn carry_out(&self, operation: &Operation, arguments: &Map<String, Value>) -> Result<Value, String> {
        let (path, body) = request(operation, &self.name, arguments)?;
        let idle = self.idle().pop();
        let mut client = match idle {
            Some(client) => client,
            None => self.connect()?,
        };
        let done: Result<Value, ClientError> = client.call(operation.method, &path, body.as_ref());
        // A lost agent is searched for again, as it may have been restarted.
        let mut idle = self.idle();
        let is_kept = idle.len() < MAX_IDLE_CONNECTIONS && !self.is_over.load(Ordering::Acquire);
        if is_kept && matches!(done, Ok(_) | Err(ClientError::Refused(_))) {
            idle.push(client);
        }
        drop(idle);
        done.map_err(|error| self.error_text(error))
    }

    /// Stops over a connection of its own, so that it waits for nothing.
    fn stop(&self, arguments: &Map<String, Value>) -> Result<Value, String> {
        let reason = arguments.get("reason").and_then(Value::as_str).filter(|reason| !reason.is_empty());
        let reason =
            reason.map_or_else(|| format!("by {CLIENT_NAME}"), |reason| format!("{CLIENT_NAME}: {reason}"));
        let stopped = json!({ "stopped": true, "reason": reason });
        let trouble = match self.connect() {
            Ok(mut client) => match client.stop(&reason) {
                Ok(()) => return Ok(stopped),
                Err(error) => self.error_text(error),
            },
            Err(trouble) => trouble,
        };
        // An agent that does not answer has a line for it.
        match self.local.as_ref().map(|agent| Client::stop_at_once(agent, &reason)) {
            Some(Ok(())) => Ok(stopped),
            _ => Err(trouble),
        }
    }

    /// Drives for a while.
    /// The lease is bound to a connection of its own, so it ends in any case.
    fn drive(&self, arguments: &Map<String, Value>, is_over: impl Fn() -> bool) -> Result<Value, String> {
        let actuator =
            arguments.get("actuator").and_then(Value::as_str).ok_or("`actuator` is missing, a text")?;
        let command = arguments.get("command").ok_or("`command` is missing, an object")?;
        let seconds = arguments.get("seconds").map_or(Some(1.0), Value::as_f64);
        let seconds = seconds.filter(|seconds| *seconds > 0.0 && *seconds <= MAX_DRIVE_DURATION);
        let seconds =
            seconds.ok_or_else(|| format!("`seconds` is above 0 and at most {MAX_DRIVE_DURATION}"))?;
        let mut client = self.connect()?;
        let taken = client.take_controls(actuator, "a language model");
        taken.map_err(|error| self.error_text(error))?;
        let until = now() + Duration::from_secs_f64(seconds);
        let mut done = client.command(command.clone());
        while done.is_ok() && now() < until && !is_over() {
            std::thread::sleep(COMMAND_PERIOD.min(until.saturating_duration_since(now())));
            done = client.command(command.clone());
        }
        // Without an end the command would hold a little longer.
        let released = client.release().and_then(|_| client.leave_controls());
        let gate = done.map_err(|error| self.error_text(error))?;
        released.map_err(|error| self.error_text(error))?;
        Ok(json!({ "actuator": actuator, "seconds": seconds, "gate": gate }))
    }

    /// Returns a problem with its help.
    fn error_text(&self, error: ClientError) -> String {
        let ClientError::Refused(refusal) = error else { return error.to_string() };
        let mut text = refusal.message;
        let mut add = |what: &str, more: &str| {
            if !more.is_empty() {
                text = format!("{text}\n{what}: {more}");
            }
        };
        add("help", &refusal.help);
        add("code", refusal.code.as_deref().unwrap_or_default());
        add("report", refusal.report.as_deref().unwrap_or_default());
        if self.role < Role::Developer {
            let source = match self.route {
                AgentRoute::Option(_) => "`slate mcp --role`",
                AgentRoute::Token(_) => "its token and `slate mcp --role`",
            };
            add("role", &format!("the caller is {}, by {source}", self.role.with_article()));
        }
        text
    }
}

/// Marks a connection as a model's, limited to a role.
/// Returns it with the role that the agent grants.
fn set_identity(mut client: Client, limit: Role) -> Result<(Client, Role), Failure> {
    client.on_behalf_of(CLIENT_NAME);
    client.in_role(limit);
    let agent: Value = client.call("GET", "/agent", None)?;
    let granted = agent.get("role").and_then(Value::as_str).and_then(Role::by_name);
    match granted.filter(|own| *own <= limit) {
        Some(role) => Ok((client, role)),
        // An agent of another version would let the model do all.
        None => Err(Failure::Mcp {
            reason: format!("the agent does not know the role of a model, {limit}"),
            help: "start the agent by this version of slate".into(),
        }),
    }
}
