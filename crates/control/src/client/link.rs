//! Connection of HTTP/1.1 for a blocking thread.

use std::error::Error as _;
use std::io::{Error, ErrorKind, Result};
use std::pin::Pin;
use std::sync::{Arc, Mutex, PoisonError};
use std::task::{Context, Poll};
use std::time::Duration;

use http_body_util::{BodyExt, Full};
use hyper::body::{Bytes, Incoming};
use hyper::client::conn::http1::{self, SendRequest};
use hyper::header::{ACCEPT, AUTHORIZATION, CONTENT_TYPE, HOST, HeaderValue};
use hyper_util::rt::TokioIo;
use serde_json::Value as Json;
use tokio::io::{AsyncRead, AsyncWrite, ReadBuf};
use tokio::net::{TcpStream, UnixStream};
use tokio::runtime::Runtime;

use super::{Access, AccessFailure, Request};
use crate::Role;
use crate::server::{CALLER, ROLE};

/// Timeout for connecting to one of the addresses of a name.
const CONNECT_TIMEOUT: Duration = Duration::from_secs(5);

/// Maximum size of an answer to a call, bytes.
/// The limit is higher than that of requests, as a client trusts its agent.
const MAX_BODY_SIZE: usize = 1 << 28;

/// First byte of a TLS alert.
const TLS_ALERT: u8 = 0x15;

/// Connection with the thread's own runtime, which runs during requests.
pub(super) struct ClientLink {
    runtime: Runtime,
    sender: SendRequest<Full<Bytes>>,
    host: String,
    authorization: Option<HeaderValue>,
    caller: Option<HeaderValue>,
    role: Option<Role>,
    first: Arc<Mutex<Vec<u8>>>,
}

impl std::fmt::Debug for ClientLink {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("ClientLink").field("host", &self.host).finish_non_exhaustive()
    }
}

/// Reason why an answer is missing.
#[derive(Debug)]
pub(super) enum LinkFailure {
    /// Other side without HTTP.
    InvalidAnswer(String),
    /// Timeout of the answer.
    Timeout,
    /// The connection was closed before the request was sent.
    Unsent,
    /// The connection is lost.
    Lost(Error),
}

impl ClientLink {
    /// Creates the link over the socket of an agent.
    pub fn unix(stream: std::os::unix::net::UnixStream) -> Result<Self> {
        stream.set_nonblocking(true)?;
        let runtime = runtime()?;
        let first = Arc::<Mutex<Vec<u8>>>::default();
        let recorded = Arc::clone(&first);
        let sender = runtime.block_on(async {
            let stream = RecordingStream { stream: UnixStream::from_std(stream)?, first: recorded };
            handshake(stream).await.map_err(Error::other)
        })?;
        Ok(Self {
            runtime,
            sender,
            host: "localhost".into(),
            authorization: None,
            caller: None,
            role: None,
            first,
        })
    }

    /// Creates the link over TCP, with TLS or to this machine.
    pub fn tcp(access: &Access) -> std::result::Result<Self, AccessFailure> {
        let address = &access.address;
        let unreached = |error: &dyn std::fmt::Display| AccessFailure::Unreached {
            address: address.to_string(),
            reason: error.to_string(),
        };
        let found = address.resolve().map_err(|error| unreached(&error))?;
        if !address.is_secure && !found.iter().all(|found| found.ip().is_loopback()) {
            return Err(AccessFailure::Open { address: address.to_string() });
        }
        let bearer = HeaderValue::from_str(&format!("Bearer {}", access.token));
        let mut bearer = bearer.map_err(|error| unreached(&error))?;
        bearer.set_sensitive(true);
        let runtime = runtime().map_err(|error| unreached(&error))?;
        let first = Arc::<Mutex<Vec<u8>>>::default();
        let recorded = Arc::clone(&first);
        let sender = runtime.block_on(async {
            let stream = connect(found).await.map_err(|error| unreached(&error))?;
            // Commands are small, and must not be delayed.
            stream.set_nodelay(true).map_err(|error| unreached(&error))?;
            if !address.is_secure {
                return handshake(RecordingStream { stream, first: recorded })
                    .await
                    .map_err(|error| unreached(&error));
            }
            #[cfg(feature = "tls")]
            {
                let stream = super::secure::connect(stream, address, access.certificate.as_deref()).await?;
                handshake(RecordingStream { stream, first: recorded })
                    .await
                    .map_err(|error| unreached(&error))
            }
            #[cfg(not(feature = "tls"))]
            Err(AccessFailure::WithoutTls { address: address.to_string() })
        })?;
        let host = address.authority();
        Ok(Self { runtime, sender, host, authorization: Some(bearer), caller: None, role: None, first })
    }

    /// Sets the party on whose behalf it sends requests.
    pub fn set_caller(&mut self, who: &str) {
        let plain: String = who.chars().map(|c| if c.is_ascii_graphic() { c } else { ' ' }).collect();
        self.caller = HeaderValue::from_str(&plain).ok();
    }

    /// Limits the requests to the rights of a role.
    pub fn set_role(&mut self, role: Role) {
        self.role = Some(role);
    }

    /// Copies the caller and the role of another link.
    pub fn copy_identity(&mut self, other: &Self) {
        self.caller.clone_from(&other.caller);
        self.role = other.role;
    }

    /// Sends a request, and returns when the head of the answer has arrived.
    pub fn send(
        &mut self,
        request: &Request<'_>,
        within: Duration,
    ) -> std::result::Result<hyper::Response<Incoming>, LinkFailure> {
        let request = self.request(request)?;
        let sender = &mut self.sender;
        let answered = self.runtime.block_on(async {
            let sent = async {
                sender.ready().await?;
                sender.send_request(request).await
            };
            tokio::time::timeout(within, sent).await
        });
        answered.map_err(|_| LinkFailure::Timeout)?.map_err(|error| self.broken(&error))
    }

    /// Sends a request and returns the whole answer as JSON.
    pub fn request_json(
        &mut self,
        request: &Request<'_>,
        within: Duration,
    ) -> std::result::Result<(u16, Json), LinkFailure> {
        let response = self.send(request, within)?;
        let status = response.status().as_u16();
        let body = http_body_util::Limited::new(response.into_body(), MAX_BODY_SIZE);
        let collected = self.runtime.block_on(async { tokio::time::timeout(within, body.collect()).await });
        let collected = collected.map_err(|_| LinkFailure::Timeout)?;
        let bytes = collected
            .map_err(|error| match error.downcast::<hyper::Error>() {
                Ok(error) => self.broken(&error),
                Err(error) => LinkFailure::InvalidAnswer(error.to_string()),
            })?
            .to_bytes();
        if bytes.is_empty() {
            return Ok((status, Json::Null));
        }
        let value =
            serde_json::from_slice(&bytes).map_err(|error| LinkFailure::InvalidAnswer(error.to_string()))?;
        Ok((status, value))
    }

    /// Returns the next chunk of a body, which may arrive slowly.
    pub fn next_chunk(&mut self, body: &mut Incoming) -> Result<Option<Bytes>> {
        loop {
            match self.runtime.block_on(body.frame()) {
                None => return Ok(None),
                Some(Err(error)) => {
                    return Err(match self.broken(&error) {
                        LinkFailure::Lost(error) => error,
                        LinkFailure::InvalidAnswer(problem) => Error::new(ErrorKind::InvalidData, problem),
                        LinkFailure::Timeout => ErrorKind::TimedOut.into(),
                        LinkFailure::Unsent => closed(),
                    });
                }
                Some(Ok(frame)) => {
                    if let Ok(piece) = frame.into_data()
                        && !piece.is_empty()
                    {
                        return Ok(Some(piece));
                    }
                }
            }
        }
    }

    fn request(
        &self,
        content: &Request<'_>,
    ) -> std::result::Result<hyper::Request<Full<Bytes>>, LinkFailure> {
        let body = content.body.unwrap_or_default().to_owned();
        let mut request =
            hyper::Request::builder().method(content.method).uri(content.path).header(HOST, &self.host);
        for (name, value) in [(AUTHORIZATION, &self.authorization)] {
            if let Some(value) = value {
                request = request.header(name, value);
            }
        }
        if let Some(who) = &self.caller {
            request = request.header(CALLER, who);
        }
        if let Some(role) = self.role {
            request = request.header(ROLE, role.name());
        }
        if let Some(accept) = content.accept {
            request = request.header(ACCEPT, accept);
        }
        if content.body.is_some() {
            request = request.header(CONTENT_TYPE, "application/json");
        }
        request
            .body(Full::new(Bytes::from(body)))
            .map_err(|error| LinkFailure::InvalidAnswer(error.to_string()))
    }

    fn broken(&self, error: &hyper::Error) -> LinkFailure {
        if error.is_parse() {
            let first = self.first.lock().unwrap_or_else(PoisonError::into_inner);
            let text = String::from_utf8_lossy(&first);
            return LinkFailure::InvalidAnswer(match first.first() {
                None => "it closes the connection".into(),
                Some(&TLS_ALERT) => "it speaks TLS".into(),
                Some(_) => {
                    format!("it answers `{}`", text.lines().next().unwrap_or_default().escape_default())
                }
            });
        }
        if error.is_canceled() {
            return LinkFailure::Unsent;
        }
        let mut source = error.source();
        while let Some(cause) = source {
            if let Some(error) = cause.downcast_ref::<Error>() {
                return LinkFailure::Lost(Error::new(error.kind(), error.to_string()));
            }
            source = cause.source();
        }
        LinkFailure::Lost(closed())
    }
}

pub(super) fn closed() -> Error {
    Error::new(ErrorKind::UnexpectedEof, "it has closed the connection")
}

fn runtime() -> Result<Runtime> {
    tokio::runtime::Builder::new_current_thread().enable_all().build()
}

async fn connect(found: Vec<std::net::SocketAddr>) -> Result<TcpStream> {
    let mut last = None;
    for found in found {
        match tokio::time::timeout(CONNECT_TIMEOUT, TcpStream::connect(found)).await {
            Ok(Ok(stream)) => return Ok(stream),
            Ok(Err(error)) => last = Some(error),
            Err(_) => last = Some(Error::new(ErrorKind::TimedOut, "connection timed out")),
        }
    }
    Err(last.unwrap_or_else(|| Error::other("there is no address")))
}

async fn handshake<S>(stream: S) -> hyper::Result<SendRequest<Full<Bytes>>>
where
    S: AsyncRead + AsyncWrite + Unpin + Send + 'static,
{
    let (sender, connection) = http1::handshake(TokioIo::new(stream)).await?;
    // The connection runs while a request waits for its answer.
    tokio::spawn(async {
        // The pending request gets the error.
        let _ = connection.await;
    });
    Ok(sender)
}

/// Size of the recorded beginning of the answer, bytes.
const MAX_RECORDED_BYTES: usize = 80;

/// Stream that records the first bytes of the answer.
struct RecordingStream<S> {
    stream: S,
    first: Arc<Mutex<Vec<u8>>>,
}

impl<S: AsyncRead + Unpin> AsyncRead for RecordingStream<S> {
    fn poll_read(
        mut self: Pin<&mut Self>,
        task: &mut Context<'_>,
        buffer: &mut ReadBuf<'_>,
    ) -> Poll<Result<()>> {
        let before = buffer.filled().len();
        let read = Pin::new(&mut self.stream).poll_read(task, buffer);
        let mut first = self.first.lock().unwrap_or_else(PoisonError::into_inner);
        if first.len() < MAX_RECORDED_BYTES {
            let new = buffer.filled().get(before..).unwrap_or_default();
            let capacity = MAX_RECORDED_BYTES - first.len();
            first.extend_from_slice(&new[..new.len().min(capacity)]);
        }
        drop(first);
        read
    }
}

impl<S: AsyncWrite + Unpin> AsyncWrite for RecordingStream<S> {
    fn poll_write(mut self: Pin<&mut Self>, task: &mut Context<'_>, bytes: &[u8]) -> Poll<Result<usize>> {
        Pin::new(&mut self.stream).poll_write(task, bytes)
    }

    fn poll_flush(mut self: Pin<&mut Self>, task: &mut Context<'_>) -> Poll<Result<()>> {
        Pin::new(&mut self.stream).poll_flush(task)
    }

    fn poll_shutdown(mut self: Pin<&mut Self>, task: &mut Context<'_>) -> Poll<Result<()>> {
        Pin::new(&mut self.stream).poll_shutdown(task)
    }
}
