//! Client of an agent: over its Unix socket, or over TCP with TLS.

mod access_failure;
mod address;
mod calls;
mod link;
#[cfg(feature = "tls")]
mod secure;

use std::io::{ErrorKind, Read};
use std::os::unix::net::UnixStream;
use std::path::PathBuf;
use std::time::Duration;

use hyper::body::Bytes;
use serde::de::DeserializeOwned;
use serde_json::Value as Json;
use slate_runtime::{directory, stop_line};

use crate::Role;
use crate::entries::Refusal;
use crate::operation::BASE;
use crate::operations::API_VERSION;
pub use access_failure::AccessFailure;
pub use address::Address;
use link::{ClientLink, LinkFailure, closed};

/// Timeout for the first answer of an agent.
const GREETING_TIMEOUT: Duration = Duration::from_secs(5);

/// Timeout for an answer.
/// A module may be slow to let itself be exchanged.
const ANSWER: Duration = Duration::from_secs(60);

/// Timeout for the confirmation of a stop over the stop line.
/// After it, requests continue as before.
const STOP_LINE: Duration = Duration::from_secs(2);

/// Address of an agent over TCP, with the secret for its requests.
#[derive(Clone, Debug)]
pub struct Access {
    /// Address of the agent.
    pub address: Address,
    /// Address for a browser, which demands more of a certificate.
    pub browser: String,
    /// Secret of a role.
    pub token: String,
    /// File of the certificates to trust, instead of those that the system trusts.
    pub certificate: Option<PathBuf>,
}

/// Request to an agent.
#[derive(Clone, Copy, Debug, Default)]
pub struct Request<'r> {
    /// Method, such as `GET`.
    pub method: &'r str,
    /// Path and the query.
    pub path: &'r str,
    /// Wanted kind of answer.
    pub accept: Option<&'r str>,
    /// JSON.
    pub body: Option<&'r str>,
}

/// Response of an agent.
#[derive(Debug)]
pub struct Response {
    /// Status of HTTP.
    pub status: u16,
    /// Body, read as it arrives.
    pub body: BodyReader,
}

/// Body of an answer.
pub struct BodyReader {
    link: ClientLink,
    incoming: hyper::body::Incoming,
    piece: Bytes,
}

impl std::fmt::Debug for BodyReader {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("BodyReader").finish_non_exhaustive()
    }
}

impl Read for BodyReader {
    fn read(&mut self, buffer: &mut [u8]) -> std::io::Result<usize> {
        if self.piece.is_empty() {
            match self.link.next_chunk(&mut self.incoming)? {
                Some(piece) => self.piece = piece,
                None => return Ok(0),
            }
        }
        let length = self.piece.len().min(buffer.len());
        buffer[..length].copy_from_slice(&self.piece.split_to(length));
        Ok(length)
    }
}

/// Refusal of an agent over HTTP.
#[derive(Debug, thiserror::Error)]
#[error("{detail}")]
pub struct HttpRefusal {
    /// Status of HTTP.
    pub status: u16,
    /// Message.
    pub detail: String,
    /// Advice.
    pub help: String,
    /// Code of its kind.
    pub code: Option<String>,
    /// File, line and caret of errors in a configuration.
    pub report: Option<String>,
}

impl HttpRefusal {
    fn read(status: u16, problem: &Json) -> Self {
        let field = |name: &str| problem.get(name).and_then(Json::as_str).map(str::to_owned);
        // Of a refusal that was requested with status 200 the body has the status.
        let status = problem
            .get("status")
            .and_then(Json::as_u64)
            .and_then(|own| u16::try_from(own).ok())
            .unwrap_or(status);
        let detail = field("detail").unwrap_or_else(|| format!("the agent answers with status {status}"));
        let help = match status {
            401 => "let SLATE_TOKEN be the secret of this run: it stands behind `#token=` in the link that the agent \
                    prints"
                .into(),
            _ => field("help").unwrap_or_default(),
        };
        Self { status, detail, help, code: field("code"), report: field("report") }
    }

    fn refusal(self) -> Refusal {
        Refusal { message: self.detail, help: self.help, code: self.code, report: self.report }
    }
}

/// Reason why a remote agent is not reached, or refuses.
#[derive(Debug, thiserror::Error)]
pub enum RequestError {
    /// Unreachable agent.
    #[error(transparent)]
    AccessFailure(#[from] AccessFailure),
    /// Refusal.
    #[error(transparent)]
    HttpRefusal(#[from] HttpRefusal),
}

impl Access {
    /// Sends a request, and returns when the head of the answer has arrived.
    ///
    /// # Errors
    /// When the agent is not reached.
    pub fn request(&self, request: &Request<'_>) -> Result<Response, AccessFailure> {
        let mut link = ClientLink::tcp(self)?;
        let response = link.send(request, ANSWER).map_err(|broken| self.access_failure(broken))?;
        let status = response.status().as_u16();
        Ok(Response {
            status,
            body: BodyReader { link, incoming: response.into_body(), piece: Bytes::new() },
        })
    }

    /// Sends a request as [`request`](Access::request); returns the answer as JSON.
    ///
    /// # Errors
    /// When the agent is not reached, or refuses.
    pub fn value(&self, request: &Request<'_>) -> Result<Json, RequestError> {
        let mut response = self.request(request)?.well()?;
        let mut text = String::new();
        let address = self.address.to_string();
        let lost = |error: std::io::Error| AccessFailure::Unreached { address, reason: error.to_string() };
        response.body.read_to_string(&mut text).map_err(lost)?;
        Ok(serde_json::from_str(&text).unwrap_or_default())
    }

    fn access_failure(&self, broken: LinkFailure) -> AccessFailure {
        let address = self.address.to_string();
        match broken {
            LinkFailure::InvalidAnswer(reason) if !self.address.is_secure => {
                AccessFailure::NoHttp { address, reason }
            }
            LinkFailure::InvalidAnswer(reason) => AccessFailure::Unreached { address, reason },
            LinkFailure::Timeout => {
                AccessFailure::Unreached { address, reason: "no answer within 60 s".into() }
            }
            LinkFailure::Lost(error) => AccessFailure::Unreached { address, reason: error.to_string() },
            LinkFailure::Unsent => AccessFailure::Unreached { address, reason: closed().to_string() },
        }
    }
}

impl Response {
    /// Returns the answer, or the refusal of the agent.
    ///
    /// # Errors
    /// Why it does not.
    pub fn well(mut self) -> Result<Self, HttpRefusal> {
        if self.status < 400 {
            return Ok(self);
        }
        let mut text = String::new();
        // A partial answer is better than none.
        let _ = self.body.read_to_string(&mut text);
        Err(HttpRefusal::read(self.status, &serde_json::from_str(&text).unwrap_or_default()))
    }
}

/// Reason why an agent is not reached, or refuses.
#[derive(Debug, thiserror::Error)]
pub enum ClientError {
    /// No agent of that name runs.
    #[error("no agent `{name}` runs here")]
    NoAgent {
        /// Name that was given.
        name: String,
        /// Agents that run.
        running: Vec<String>,
    },
    /// Agent refuses.
    #[error("{}", .0.message)]
    Refused(Refusal),
    /// Other version of the operations.
    #[error("agent `{name}` speaks version {found} of the protocol, this program version {API_VERSION}")]
    Version {
        /// Agent.
        name: String,
        /// Version.
        found: u64,
    },
    /// Answer that makes no sense.
    #[error("agent `{name}` sent what can't be understood: {problem}")]
    InvalidAnswer {
        /// Agent.
        name: String,
        /// Error in it.
        problem: String,
    },
    /// Broken connection, or an agent that does not answer.
    #[error("agent `{name}` does not answer: {error}")]
    Lost {
        /// Agent.
        name: String,
        /// Error.
        error: std::io::Error,
    },
}

/// Connection to an agent.
#[derive(Debug)]
pub struct Client {
    name: String,
    /// Name that the agent gives itself.
    agent: String,
    is_local: bool,
    link: ClientLink,
    /// Access for reconnecting when an idle connection was closed.
    access: Option<Access>,
    /// Controls that it has.
    lease: Option<String>,
}

impl Client {
    /// Connects to the agent that is reached by that name.
    ///
    /// # Errors
    /// When no agent runs, or it does not answer as expected.
    pub fn connect(name: &str) -> Result<Self, ClientError> {
        let mut client = Self::to_socket(name)?;
        client.check_agent()?;
        Ok(client)
    }

    /// Connects to an agent elsewhere.
    ///
    /// # Errors
    /// When it is not reached, or the secret is of no role.
    pub fn at(access: &Access) -> Result<Self, RequestError> {
        let mut client = Self {
            name: access.address.to_string(),
            agent: String::new(),
            is_local: false,
            link: ClientLink::tcp(access)?,
            access: Some(access.clone()),
            lease: None,
        };
        let path = format!("{BASE}/agent");
        let request = Request { method: "GET", path: &path, ..Request::default() };
        let (status, agent) =
            client.link.request_json(&request, ANSWER).map_err(|broken| access.access_failure(broken))?;
        if status >= 400 {
            return Err(HttpRefusal::read(status, &agent).into());
        }
        client.agent = agent.get("name").and_then(Json::as_str).unwrap_or_default().to_owned();
        client.name.clone_from(&client.agent);
        Ok(client)
    }

    /// Stops all actuators of the named agent until `reset` and `arm`.
    /// The request is sent before any reply is read, so that an agent that hangs finds it when it continues, even if
    /// the caller waits no longer.
    ///
    /// # Errors
    /// When no such agent runs, or it does not answer.
    pub fn stop_at_once(name: &str, reason: &str) -> Result<(), ClientError> {
        // The stop line works without a free descriptor, thread or slot of the agent.
        let socket = directory::socket(name);
        if socket.and_then(|socket| stop_line::stop(&socket, reason, STOP_LINE)).is_ok() {
            return Ok(());
        }
        Self::to_socket(name)?.stop(reason)
    }

    fn to_socket(name: &str) -> Result<Self, ClientError> {
        let lost = |error| ClientError::Lost { name: name.into(), error };
        let connected = directory::socket(name).and_then(UnixStream::connect);
        let stream = connected.map_err(|error| match error.kind() {
            // Refused by a socket without a listener.
            ErrorKind::NotFound | ErrorKind::ConnectionRefused => {
                ClientError::NoAgent { name: name.into(), running: directory::agents() }
            }
            _ => lost(error),
        })?;
        let link = ClientLink::unix(stream).map_err(lost)?;
        Ok(Self { name: name.into(), agent: name.into(), is_local: true, link, access: None, lease: None })
    }

    /// Checks that the agent runs and has the same operations.
    fn check_agent(&mut self) -> Result<(), ClientError> {
        let agent: Json = self.call_within("GET", "/agent", None, GREETING_TIMEOUT)?;
        if let Some(name) = agent.get("name").and_then(Json::as_str) {
            self.agent = name.to_owned();
        }
        match agent.get("api").and_then(Json::as_u64).unwrap_or_default() {
            API_VERSION => Ok(()),
            found => Err(ClientError::Version { name: self.name.clone(), found }),
        }
    }

    /// Returns the name under which the agent is reached, or that it has said.
    pub fn name(&self) -> &str {
        &self.name
    }

    /// Returns whether it is reached by a socket of this machine.
    pub fn is_local(&self) -> bool {
        self.is_local
    }

    /// Sets the party for which it asks, such as a language model.
    /// The agent's log then has each of its operations.
    pub fn on_behalf_of(&mut self, who: &str) {
        self.link.set_caller(who);
    }

    /// Limits the requests to the rights of a role, whatever else this client may do.
    pub fn in_role(&mut self, role: Role) {
        self.link.set_role(role);
    }

    /// Carries out an operation at a `path` after `/api/v1`.
    ///
    /// # Errors
    /// When the agent refuses, or the connection is lost.
    pub fn call<T: DeserializeOwned>(
        &mut self,
        method: &str,
        path: &str,
        body: Option<&Json>,
    ) -> Result<T, ClientError> {
        self.call_within(method, path, body, ANSWER)
    }

    /// Sends a request, and returns at the head of the answer.
    /// The connection ends with the answer.
    ///
    /// # Errors
    /// When the connection is lost.
    pub fn request(mut self, request: &Request<'_>) -> Result<Response, ClientError> {
        let response = self.link.send(request, ANSWER).map_err(|broken| self.broken(broken, ANSWER))?;
        let status = response.status().as_u16();
        let body = BodyReader { link: self.link, incoming: response.into_body(), piece: Bytes::new() };
        Ok(Response { status, body })
    }

    fn call_within<T: DeserializeOwned>(
        &mut self,
        method: &str,
        path: &str,
        body: Option<&Json>,
        within: Duration,
    ) -> Result<T, ClientError> {
        let (path, body) = (format!("{BASE}{path}"), body.map(ToString::to_string));
        let request = Request { method, path: &path, body: body.as_deref(), ..Request::default() };
        let mut answer = self.link.request_json(&request, within);
        if let (Err(LinkFailure::Unsent), Some(access)) = (&answer, &self.access) {
            // An agent closes a connection that is idle for long.
            let mut link = ClientLink::tcp(access).map_err(|access_failure| {
                self.broken(LinkFailure::Lost(std::io::Error::other(access_failure.to_string())), within)
            })?;
            link.copy_identity(&self.link);
            self.link = link;
            answer = self.link.request_json(&request, within);
        }
        let (status, answer) = answer.map_err(|broken| self.broken(broken, within))?;
        if status >= 400 {
            return Err(ClientError::Refused(HttpRefusal::read(status, &answer).refusal()));
        }
        serde_json::from_value(answer).map_err(|error| self.invalid_answer(error.to_string()))
    }

    fn broken(&self, broken: LinkFailure, within: Duration) -> ClientError {
        let lost = |error| ClientError::Lost { name: self.name.clone(), error };
        match broken {
            LinkFailure::InvalidAnswer(problem) => self.invalid_answer(problem),
            LinkFailure::Lost(error) => lost(error),
            LinkFailure::Unsent => lost(closed()),
            LinkFailure::Timeout => {
                let message =
                    format!("no answer within {} s; the request may still be in progress", within.as_secs());
                lost(std::io::Error::new(ErrorKind::TimedOut, message))
            }
        }
    }

    fn invalid_answer(&self, problem: String) -> ClientError {
        ClientError::InvalidAnswer { name: self.name.clone(), problem }
    }
}

/// Percent-encodes a part of a path, including separators.
/// All but the unreserved characters of RFC 3986 are encoded. Own, as the decoder in `query.rs` must be, and the crate
/// `percent-encoding` would be there for these five lines alone.
pub fn percent_encoded(text: &str) -> String {
    let percent_encoded = |byte: u8| match byte {
        byte if byte.is_ascii_alphanumeric() || b"-_.~".contains(&byte) => char::from(byte).to_string(),
        byte => format!("%{byte:02X}"),
    };
    text.bytes().map(percent_encoded).collect()
}
