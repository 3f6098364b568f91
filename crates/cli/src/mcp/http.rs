//! Protocol over HTTP, for callers with tokens of the agent.

use std::collections::HashMap;
use std::convert::Infallible;
use std::io::Error;
use std::net::{IpAddr, SocketAddr};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::Duration;

use http_body_util::combinators::BoxBody;
use http_body_util::{BodyExt, Full};
use hyper::body::{Bytes, Incoming};
use hyper::header::{AUTHORIZATION, CONTENT_TYPE, HeaderMap, HeaderValue, WWW_AUTHENTICATE};
use hyper::server::conn::http1;
use hyper::service::service_fn;
use hyper::{Request, Response, StatusCode};
use hyper_util::rt::{TokioIo, TokioTimer};
use rmcp::transport::streamable_http_server::session::never::NeverSessionManager;
use rmcp::transport::streamable_http_server::{StreamableHttpServerConfig, StreamableHttpService};
use serde_json::json;
use slate::control::Role;
use slate::control::client::Access;
use tokio::net::{TcpListener, TcpStream};
use tokio::sync::Semaphore;

use super::agent::AgentAccess;
use super::serve::ModelServer;
use crate::connection::AgentOption;
use crate::failure::Failure;
use crate::output;

/// Path of the protocol.
const ENDPOINT_PATH: &str = "/mcp";

/// Connections at once; further ones wait.
const MAX_CONNECTIONS: usize = 64;

/// Time that a connection may be silent before the head of a request.
const HEAD_TIMEOUT: Duration = Duration::from_secs(60);

/// Maximum size of a request's body, bytes.
const MAX_BODY_SIZE: usize = 1 << 20;

/// Tokens whose callers are remembered.
const MAX_TOKENS: usize = 16;

type ModelResponse = Response<BoxBody<Bytes, Infallible>>;

/// Serves until the program is interrupted.
pub fn serve(option: &AgentOption, limit: Role, address: SocketAddr) -> Result<bool, Failure> {
    let gate = Arc::new(TokenGate::new(option, limit)?);
    let failed = |error: Error| Failure::Mcp {
        reason: format!("nothing can be served at {address}: {error}"),
        help: "name another address, or port 0 for any that is free: slate mcp --http 127.0.0.1:0".into(),
    };
    let runtime = tokio::runtime::Builder::new_current_thread().enable_all().build().map_err(failed)?;
    let served = runtime.block_on(async {
        let listener = TcpListener::bind(address).await?;
        let address = listener.local_addr()?;
        output::line(format!("http://{address}{ENDPOINT_PATH}"));
        if !address.ip().is_loopback() {
            eprintln!("warning: tokens cross the network unencrypted: put a proxy with TLS before {address}");
        }
        accept(&listener, &gate, &settings(address.ip())).await
    });
    served.map_err(failed)
}

async fn accept(
    listener: &TcpListener,
    gate: &Arc<TokenGate>,
    settings: &StreamableHttpServerConfig,
) -> Result<bool, Error> {
    let places = Arc::new(Semaphore::new(MAX_CONNECTIONS));
    loop {
        let place = Arc::clone(&places).acquire_owned().await.map_err(Error::other)?;
        let Ok((stream, _)) = listener.accept().await else {
            // No descriptor is left; connections that end give theirs back.
            tokio::time::sleep(Duration::from_millis(10)).await;
            continue;
        };
        let (gate, settings) = (Arc::clone(gate), settings.clone());
        tokio::spawn(async move {
            converse(stream, gate, settings).await;
            drop(place);
        });
    }
}

async fn converse(stream: TcpStream, gate: Arc<TokenGate>, settings: StreamableHttpServerConfig) {
    let service = service_fn(move |request| {
        let (gate, settings) = (Arc::clone(&gate), settings.clone());
        async move { Ok::<_, Infallible>(answer(gate, settings, request).await) }
    });
    let mut server = http1::Builder::new();
    server.timer(TokioTimer::new()).header_read_timeout(HEAD_TIMEOUT);
    // A caller that is gone misses nothing.
    let _ = server.serve_connection(TokioIo::new(stream), service).await;
}

/// Returns settings without sessions: each request has its token.
/// Nothing is kept between two requests. Pages of browsers are not admitted.
fn settings(ip: IpAddr) -> StreamableHttpServerConfig {
    let settings = StreamableHttpServerConfig::default()
        .with_legacy_session_mode(false)
        .with_json_response(true)
        .with_max_request_body_bytes(MAX_BODY_SIZE)
        .enforce_origin_validation();
    if ip.is_loopback() {
        return settings;
    }
    // Others know this machine by names that it doesn't know.
    settings.disable_allowed_hosts()
}

async fn answer(
    gate: Arc<TokenGate>,
    settings: StreamableHttpServerConfig,
    request: Request<Incoming>,
) -> ModelResponse {
    if request.uri().path() != ENDPOINT_PATH {
        return TokenRefusal::new(StatusCode::NOT_FOUND, "nothing is served here", ENDPOINT_PATH).response();
    }
    let Some(token) = bearer(request.headers()) else {
        return TokenRefusal::new(StatusCode::UNAUTHORIZED, "missing token", TOKEN_HELP).response();
    };
    let opened = tokio::task::spawn_blocking(move || gate.open(token)).await;
    match opened {
        Ok(Ok(access)) => {
            let service = move || Ok(ModelServer(Arc::clone(&access)));
            let sessions = Arc::new(NeverSessionManager::default());
            StreamableHttpService::new(service, sessions, settings).handle(request).await
        }
        Ok(Err(refusal)) => refusal.response(),
        Err(error) => TokenRefusal::new(StatusCode::INTERNAL_SERVER_ERROR, &error.to_string(), "").response(),
    }
}

fn bearer(headers: &HeaderMap) -> Option<String> {
    let (scheme, token) = headers.get(AUTHORIZATION)?.to_str().ok()?.split_once(' ')?;
    scheme.eq_ignore_ascii_case("bearer").then(|| token.trim().to_owned())
}

/// Hint for a caller without a token of the agent.
const TOKEN_HELP: &str =
    "send `Authorization: Bearer TOKEN` with a token of the agent; `slate console` prints one with its link";

/// Lets in callers whose token is of a role of the agent, which decides it.
struct TokenGate {
    /// Agent, without a token.
    access: Access,
    /// Agent's name, if it runs on this machine.
    local: Option<String>,
    limit: Role,
    /// Access by token, of those that the agent has accepted.
    /// The keys of its hashes are random, so the time of a search reveals nothing about the tokens.
    known: Mutex<HashMap<String, Arc<AgentAccess>>>,
}

impl TokenGate {
    fn new(option: &AgentOption, limit: Role) -> Result<Self, Failure> {
        let (access, local) = option.place()?;
        Ok(Self { access, local, limit, known: Mutex::default() })
    }

    /// Returns the agent for a caller with that token.
    fn open(&self, token: String) -> Result<Arc<AgentAccess>, TokenRefusal> {
        let known = || self.known.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some(access) = known().get(&token) {
            return Ok(Arc::clone(access));
        }
        let access = Access { token: token.clone(), ..self.access.clone() };
        let access =
            AgentAccess::by_token(access, self.limit, self.local.clone()).map_err(TokenRefusal::from)?;
        let access = Arc::new(access);
        let mut known = known();
        if known.len() >= MAX_TOKENS {
            // Tokens of runs that are over.
            known.drain().for_each(|(_, access)| access.end());
        }
        known.insert(token, Arc::clone(&access));
        Ok(access)
    }
}

/// Reason why a request does not reach the protocol.
struct TokenRefusal {
    status: StatusCode,
    detail: String,
    help: String,
}

impl TokenRefusal {
    fn new(status: StatusCode, detail: &str, help: &str) -> Self {
        Self { status, detail: detail.into(), help: help.into() }
    }

    fn response(&self) -> ModelResponse {
        let body = json!({ "status": self.status.as_u16(), "detail": self.detail, "help": self.help });
        let mut response = Response::new(Full::new(Bytes::from(body.to_string())).boxed());
        *response.status_mut() = self.status;
        let headers = response.headers_mut();
        headers.insert(CONTENT_TYPE, HeaderValue::from_static("application/problem+json"));
        if self.status == StatusCode::UNAUTHORIZED {
            headers.insert(WWW_AUTHENTICATE, HeaderValue::from_static("Bearer"));
        }
        response
    }
}

impl From<Failure> for TokenRefusal {
    fn from(failure: Failure) -> Self {
        match failure {
            Failure::Http { status: 401, .. } => {
                Self::new(StatusCode::UNAUTHORIZED, "the agent has no such token", TOKEN_HELP)
            }
            Failure::Http { status, detail, help, .. } => {
                let status = StatusCode::from_u16(status).unwrap_or(StatusCode::BAD_GATEWAY);
                Self::new(status, &detail, &help)
            }
            other => Self::new(StatusCode::BAD_GATEWAY, &other.to_string(), "see whether the agent runs"),
        }
    }
}
