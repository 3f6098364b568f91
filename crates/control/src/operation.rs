//! Operations, the common source of the server and the OpenAPI document.

use std::sync::Arc;

use hyper::StatusCode;
use serde::de::DeserializeOwned;
use serde_json::Value as Json;

use crate::Role;
use crate::agent::own_url;
use crate::answer::OperationAnswer;
use crate::connection::ConnectionSlot;
use crate::problem::Problem;
use crate::query::{Query, decode};
use crate::route::{self, PathParts};
use crate::surface::ControlSurface;

/// Prefix of the paths of all operations.
pub const BASE: &str = "/api/v1";

/// Operation of the API.
#[derive(Clone, Debug)]
pub struct Operation {
    /// Method of HTTP.
    pub method: &'static str,
    /// Path after [`BASE`].
    /// A name in braces is a part, and at the end the rest of the path.
    pub path: &'static str,
    /// Name in the document.
    pub name: &'static str,
    /// Summary in a line.
    pub summary: &'static str,
    /// Required role.
    pub role: Role,
    /// Duration class, and whether it changes the agent.
    pub pace: Pace,
    /// Query parameters of its own; [`Operation::parameters`] has the token, too.
    pub own_parameters: &'static [Parameter],
    /// Schema of the body, if it takes one.
    pub body: Option<fn() -> Json>,
    /// Schema of the answer as JSON.
    pub answer: fn() -> Json,
    /// The other kinds of answers.
    pub kinds: &'static [&'static str],
    /// True if it has an effect only while the run continues.
    pub needs_run: bool,
    /// Carries it out.
    pub handler: fn(&Arc<ControlSurface>, &OperationRequest) -> Result<OperationAnswer, Problem>,
}

/// An operation before its answer is known.
pub(crate) struct OperationDraft {
    method: &'static str,
    path: &'static str,
    name: &'static str,
    role: Role,
    summary: &'static str,
    pace: Pace,
    parameters: &'static [Parameter],
    body: Option<fn() -> Json>,
    kinds: &'static [&'static str],
    needs_run: bool,
}

/// Token in the query of any operation that reads.
pub(crate) const TOKEN: Parameter = Parameter {
    name: "token",
    doc: "The token, where a browser can set no header.",
    schema: || serde_json::json!({ "type": "string" }),
};

impl Operation {
    /// Creates an operation that reads.
    pub(crate) const fn get(
        path: &'static str,
        name: &'static str,
        role: Role,
        summary: &'static str,
    ) -> OperationDraft {
        OperationDraft::new("GET", path, name, role, summary)
    }

    /// Returns whether it accepts the token in the query.
    /// A browser can set no header for images, downloads and WebSockets, all of which read.
    pub fn accepts_token(&self) -> bool {
        self.method == "GET"
    }

    /// Returns its query parameters, the token as the last one where it is accepted.
    pub fn parameters(&self) -> impl Iterator<Item = &'static Parameter> {
        self.own_parameters.iter().chain(self.accepts_token().then_some(&TOKEN))
    }

    /// Carries it out.
    ///
    /// # Errors
    /// When the operation needs a run that is over, or the agent refuses.
    pub fn carry_out(
        &self,
        surface: &Arc<ControlSurface>,
        request: &OperationRequest,
    ) -> Result<OperationAnswer, Problem> {
        match surface.run_end().filter(|_| self.needs_run) {
            Some(how) => Err(Problem::run_over(surface.name(), how, "it would have no effect")),
            None => (self.handler)(surface, request),
        }
    }

    /// Returns the names of the variable parts of its path, in order.
    pub fn part_names(&self) -> impl Iterator<Item = &'static str> {
        route::part_names(self.path)
    }

    /// Returns the variable parts of its path, from a caller that names them.
    /// The part `agent` is `agent` unless given.
    ///
    /// # Errors
    /// When a part is missing or empty, or its path has no part of a given name.
    pub fn capture(&self, agent: &str, given: &[(&str, &str)]) -> Result<PathParts, Problem> {
        route::capture(self.path, agent, given)
    }

    /// Creates an operation that begins an activity.
    pub(crate) const fn post(
        path: &'static str,
        name: &'static str,
        role: Role,
        summary: &'static str,
        pace: Pace,
    ) -> OperationDraft {
        OperationDraft::new("POST", path, name, role, summary).pace(pace)
    }

    /// Creates an operation that sets a value as a whole.
    pub(crate) const fn put(
        path: &'static str,
        name: &'static str,
        role: Role,
        summary: &'static str,
        pace: Pace,
    ) -> OperationDraft {
        OperationDraft::new("PUT", path, name, role, summary).pace(pace)
    }

    /// Creates an operation that sets parts of a value.
    pub(crate) const fn patch(
        path: &'static str,
        name: &'static str,
        role: Role,
        summary: &'static str,
        pace: Pace,
    ) -> OperationDraft {
        OperationDraft::new("PATCH", path, name, role, summary).pace(pace)
    }

    /// Creates an operation that ends an activity.
    pub(crate) const fn delete(
        path: &'static str,
        name: &'static str,
        role: Role,
        summary: &'static str,
        pace: Pace,
    ) -> OperationDraft {
        OperationDraft::new("DELETE", path, name, role, summary).pace(pace)
    }
}

impl OperationDraft {
    /// Creates an operation that is slow and takes no parameters by default.
    const fn new(
        method: &'static str,
        path: &'static str,
        name: &'static str,
        role: Role,
        summary: &'static str,
    ) -> Self {
        Self {
            method,
            path,
            name,
            role,
            summary,
            pace: Pace::Slow,
            parameters: &[],
            body: None,
            kinds: &[],
            needs_run: false,
        }
    }

    /// Sets the duration class.
    pub const fn pace(self, pace: Pace) -> Self {
        Self { pace, ..self }
    }

    /// Sets the query parameters, beside the token.
    pub const fn parameters(self, parameters: &'static [Parameter]) -> Self {
        Self { parameters, ..self }
    }

    /// Sets the schema of the body.
    pub const fn body(self, schema: fn() -> Json) -> Self {
        Self { body: Some(schema), ..self }
    }

    /// Sets the kinds of answers beside JSON.
    pub const fn kinds(self, kinds: &'static [&'static str]) -> Self {
        Self { kinds, ..self }
    }

    /// Refuses the operation after the end of the run, when it would have no effect.
    pub const fn needs_run(self) -> Self {
        Self { needs_run: true, ..self }
    }

    /// Sets the schema of the answer as JSON, and the handler.
    pub const fn answers(
        self,
        answer: fn() -> Json,
        handler: fn(&Arc<ControlSurface>, &OperationRequest) -> Result<OperationAnswer, Problem>,
    ) -> Operation {
        let Self { method, path, name, role, summary, pace, parameters, body, kinds, needs_run } = self;
        Operation {
            method,
            path,
            name,
            summary,
            role,
            pace,
            own_parameters: parameters,
            body,
            answer,
            kinds,
            needs_run,
            handler,
        }
    }
}

/// Duration class of an operation, which decides how it is scheduled.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Pace {
    /// Short: runs no module's code and waits for none, so it always has a permit.
    Prompt,
    /// Possibly slow.
    Slow,
    /// Change, which may run modules' code; one such operation runs at a time.
    Change,
}

/// Query parameter.
#[derive(Clone, Copy, Debug)]
pub struct Parameter {
    /// Name.
    pub name: &'static str,
    /// Description.
    pub doc: &'static str,
    /// Schema of its value.
    pub schema: fn() -> Json,
}

/// Request of one operation with its caller.
pub struct OperationRequest {
    /// Caller.
    pub caller: Caller,
    /// Parts of the path.
    pub captured: PathParts,
    /// Query.
    pub query: Query,
    /// Accepted media types.
    pub accept: String,
    /// Expected version of the value to change.
    pub if_match: Option<String>,
    /// Position at which an interrupted stream continues.
    pub last_event: Option<u64>,
    /// Body.
    pub body: Option<Json>,
}

/// Caller of an operation.
#[derive(Clone)]
pub struct Caller {
    /// Role of the caller.
    pub role: Role,
    /// Display name of the caller, such as `operator at 127.0.0.1:4711`.
    pub who: String,
    /// Name under which a caller on this machine reaches the agent.
    /// `None` over the network, where a caller may name no file of the agent's computer.
    pub local: Option<String>,
    /// Logging of every operation, including those that only read.
    pub is_told: bool,
    /// Connection, to which traces and some leases are bound.
    pub connection: Arc<ConnectionSlot>,
}

impl std::fmt::Debug for Caller {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Caller").field("who", &self.who).finish_non_exhaustive()
    }
}

impl Caller {
    /// The caller for people; one on this machine that gives itself no name is a tool.
    pub(crate) fn name(&self) -> &str {
        if self.who.is_empty() { "a tool" } else { &self.who }
    }
}

impl OperationRequest {
    /// Returns the value of a variable part of the path.
    ///
    /// # Errors
    /// When the operation's path has no such part.
    pub fn part(&self, name: &str) -> Result<&str, Problem> {
        route::value_of(&self.captured, name)
    }

    /// Returns the body, which must be present.
    pub fn body<T: DeserializeOwned>(&self) -> Result<T, Problem> {
        match &self.body {
            Some(body) => read(body),
            None => Err(Problem::bad(
                "the request has no body",
                "send JSON, as the document at /api/v1/openapi.json says",
            )),
        }
    }

    /// Reads the body; an empty one gives the default.
    pub fn body_or_default<T: DeserializeOwned + Default>(&self) -> Result<T, Problem> {
        self.body.as_ref().map_or_else(|| Ok(T::default()), read)
    }

    /// Returns a URL as the agent knows it.
    /// A URL that names the agent by the name under which it is reached is its own.
    pub fn own_url(&self, url: &str) -> String {
        self.caller.local.as_deref().map_or_else(|| url.to_owned(), |name| own_url(url, name))
    }

    /// Returns a [`part`](OperationRequest::part) as a path of the blackboard.
    /// It may begin with a slash.
    pub fn board_path(&self, name: &str) -> Result<&str, Problem> {
        self.part(name).map(without_slash)
    }

    /// Returns whether the request is a dry run.
    pub fn is_dry(&self) -> Result<bool, Problem> {
        self.query.flag("dry_run")
    }
}

/// Returns the path of a property, module or actuator without a leading slash.
pub fn without_slash(path: &str) -> &str {
    path.strip_prefix('/').unwrap_or(path)
}

fn read<T: DeserializeOwned>(body: &Json) -> Result<T, Problem> {
    T::deserialize(body).map_err(|error| {
        Problem::unfit(format!("the body does not fit: {error}"), "see /api/v1/openapi.json")
    })
}

/// Operation of a request, and the parts of its path.
#[derive(Debug)]
pub struct MatchedOperation {
    /// Operation.
    pub operation: &'static Operation,
    /// Parts of the path, by the names in braces.
    pub captured: PathParts,
}

impl MatchedOperation {
    /// Finds the operation of a method and a path in a table.
    ///
    /// # Errors
    /// When it has none.
    pub fn find(table: &'static [Operation], method: &str, path: &str) -> Result<Self, Problem> {
        let rest = path.strip_prefix(BASE).filter(|rest| rest.is_empty() || rest.starts_with('/'));
        let unknown = || Problem::not_found(format!("unknown path {path}"), "see /api/v1/openapi.json");
        let parts = rest.ok_or_else(unknown)?.split('/').skip(1);
        let parts = parts.map(decode).collect::<Result<Vec<_>, _>>()?;
        // The most specific route comes first.
        let mut path_found = None;
        let mut allowed: Vec<&str> = Vec::new();
        for operation in table {
            let Some(captured) = route::fits(operation.path, &parts) else { continue };
            if *path_found.get_or_insert(operation.path) != operation.path {
                continue;
            }
            if operation.method == method || (method == "HEAD" && operation.method == "GET") {
                return Ok(Self { operation, captured });
            }
            allowed.push(operation.method);
        }
        if allowed.is_empty() {
            return Err(unknown());
        }
        let allowed = allowed.join(", ");
        let message = format!("method {method} is not allowed for {path}");
        Err(Problem::new(StatusCode::METHOD_NOT_ALLOWED, message, format!("{allowed} can"))
            .with("allow", allowed))
    }
}

/// Refuses unknown query parameters.
pub fn check_query(operation: &Operation, query: &Query) -> Result<(), Problem> {
    let known = |name: &str| operation.parameters().any(|parameter| parameter.name == name);
    let Some(other) = query.names().find(|name| !known(name)) else { return Ok(()) };
    let names: Vec<_> = operation.parameters().map(|parameter| parameter.name).collect();
    let help = match names.is_empty() {
        true => "it takes none".into(),
        false => format!("it takes {}", names.join(", ")),
    };
    Err(Problem::bad(format!("`{other}` is not a parameter of this"), help))
}

/// Refuses a caller whose role is below the needed one.
pub(crate) fn check_role(needed: Role, role: Role) -> Result<(), Problem> {
    if role >= needed {
        return Ok(());
    }
    let message = format!("{} may not do this", role.with_article());
    let help = format!("ask with the token of {}", needed.with_article());
    Err(Problem::new(StatusCode::FORBIDDEN, message, help))
}
