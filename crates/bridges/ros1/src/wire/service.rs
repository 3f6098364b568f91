//! Services, both ends.

use std::io;
use std::sync::{Arc, Mutex, PoisonError};
use std::time::Duration;

use serde_json::Value as Json;
use slate_topics::ServiceType;
use tokio::io::{AsyncReadExt, AsyncWriteExt};
use tokio::net::TcpStream;
use tokio::time::{sleep, timeout};

use super::context::NodeContext;
use super::header::{ConnectionHeader, length, read_message};
use super::http::TIMEOUT;
use crate::checksum::service_checksum;

/// Bytes that a request or a response may have.
const MAX_MESSAGE_BYTES: u32 = 1 << 20;

/// Timeout of a non-persistent client's request.
const REQUEST_TIMEOUT: Duration = Duration::from_secs(30);

/// Period of the check whether an agent has begun.
const POLL_PERIOD: Duration = Duration::from_millis(2);

/// Answers a request, or tells why it does not.
pub type RequestHandler = Box<dyn Fn(&Json) -> Result<Json, String> + Send>;

/// Service that a node offers.
pub struct RosrpcServer {
    pub service: String,
    of: ServiceType,
    checksum: String,
    handler: Arc<Mutex<RequestHandler>>,
}

impl RosrpcServer {
    /// Creates a service of a type.
    ///
    /// # Errors
    /// A definition that lacks a message, in words.
    pub fn new(service: &str, of: &ServiceType, handler: RequestHandler) -> Result<Self, String> {
        let checksum = checksum(of)?;
        Ok(Self { service: service.into(), of: of.clone(), checksum, handler: Arc::new(Mutex::new(handler)) })
    }

    /// Answers requests of a client whose header has come.
    ///
    /// # Errors
    /// When the connection is lost; or a text for the log, when the client means another service.
    pub async fn serve(
        &self,
        mut stream: TcpStream,
        header: &ConnectionHeader,
        node: &NodeContext,
    ) -> io::Result<Option<String>> {
        if ![self.checksum.as_str(), "*"].contains(&header.get("md5sum")) {
            let [client, of, sum] = ["callerid", "type", "md5sum"].map(|name| header.shown(name));
            let error = format!(
                "{}: a client, {client}, has type {of} ({sum}) and this agent {} ({}): use another service",
                self.service,
                self.of.name(),
                self.checksum
            );
            ConnectionHeader::of([("error", error.as_str())]).write(&mut stream).await?;
            return Ok(Some(error));
        }
        let (request, response) = (self.of.request().name(), self.of.response().name());
        let own = [
            ("callerid", node.name()),
            ("md5sum", &self.checksum),
            ("request_type", request),
            ("response_type", response),
            ("service", &self.service),
            ("type", self.of.name()),
        ];
        ConnectionHeader::of(own).write(&mut stream).await?;
        if header.get("probe") == "1" {
            return Ok(None);
        }
        loop {
            let is_persistent = header.get("persistent") == "1";
            let request = read_message(&mut stream, MAX_MESSAGE_BYTES);
            let read = if is_persistent { request.await } else { timeout(REQUEST_TIMEOUT, request).await? };
            let message = match read {
                Ok(message) => message,
                Err(error) if error.kind() == io::ErrorKind::UnexpectedEof => return Ok(None),
                Err(error) => return Err(error),
            };
            // A rerun sends messages after the cycle in which they came.
            while node.composer.is_lockstep() && node.composer.cycles() == 0 {
                sleep(POLL_PERIOD).await;
            }
            let (is_done, body) = match self.answer(&message).await {
                Ok(response) => (1, response),
                Err(reason) => (0, reason.into_bytes()),
            };
            let answer = [&[is_done][..], &length(body.len())?, &body].concat();
            timeout(TIMEOUT, stream.write_all(&answer)).await??;
            if !is_persistent {
                return Ok(None);
            }
        }
    }

    async fn answer(&self, message: &[u8]) -> Result<Vec<u8>, String> {
        let request = self.of.request().decode(message)?;
        let handler = Arc::clone(&self.handler);
        // It waits for a cycle of the agent.
        let answer = move || {
            let handler = handler.lock().unwrap_or_else(PoisonError::into_inner);
            (*handler)(&request)
        };
        let response = tokio::task::spawn_blocking(answer).await.map_err(|error| error.to_string())??;
        self.of.response().encode(&response)
    }
}

/// Returns the checksum of a service.
///
/// # Errors
/// A definition that lacks a message, in words.
fn checksum(of: &ServiceType) -> Result<String, String> {
    service_checksum(of.name(), of.request().definition(), of.response().definition())
}

/// Calls a service, and returns its response.
/// On failure, the reason that its server gives.
///
/// # Errors
/// Reason why no response came, in words.
pub async fn call_service(
    node: &NodeContext,
    service: &str,
    of: &ServiceType,
    request: &Json,
) -> Result<Result<Json, String>, String> {
    let request = of.request().encode(request)?;
    let found = node.master.call("lookupService", vec![service.into()]).await;
    let found = found.map_err(|error| format!("{service} has no server: {error}"))?;
    let authority = found.as_text().and_then(|own| own.strip_prefix("rosrpc://")).unwrap_or_default();
    let authority = authority.trim_end_matches('/');
    let lost = |error: io::Error| format!("the server of {service} at {authority} is not reached: {error}");
    node.check_reach(authority).await.map_err(lost)?;
    let mut stream = TcpStream::connect(authority).await.map_err(lost)?;
    stream.set_nodelay(true).map_err(lost)?;
    let checksum = checksum(of)?;
    let own = [("callerid", node.name()), ("md5sum", &checksum), ("service", service), ("type", of.name())];
    ConnectionHeader::of(own).write(&mut stream).await.map_err(lost)?;
    let theirs = ConnectionHeader::read(&mut stream).await.map_err(lost)?;
    if !theirs.get("error").is_empty() {
        let theirs = theirs.shown("error");
        return Err(format!("{service} is not a {} ({checksum}): {theirs}", of.name()));
    }
    let bytes = [&length(request.len()).map_err(lost)?[..], &request].concat();
    stream.write_all(&bytes).await.map_err(lost)?;
    let is_done = stream.read_u8().await.map_err(lost)? == 1;
    let answer = read_message(&mut stream, MAX_MESSAGE_BYTES).await.map_err(lost)?;
    if is_done {
        return of.response().decode(&answer).map(Ok);
    }
    Ok(Err(String::from_utf8_lossy(&answer).into_owned()))
}
