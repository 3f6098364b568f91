//! Unix socket of an agent.

use std::future::Future;
use std::path::Path;
use std::sync::{Arc, Mutex, PoisonError};
use std::thread::{Builder, JoinHandle};
use std::time::Duration;

use hyper::body::Incoming;
use hyper::header::HeaderMap;
use hyper::server::conn::http1;
use hyper::service::service_fn;
use hyper::{Request, Response};
use hyper_util::rt::{TokioIo, TokioTimer};
use slate_runtime::Agent;
use slate_runtime::directory::AgentSocket;
use slate_runtime::stop_line::StopLine;
use tokio::net::{UnixListener, UnixStream};
use tokio::sync::Notify;

use crate::answer::ResponseBody;
use crate::connection::{ConnectionEnd, ConnectionSlot, Connections, TimedStream};
use crate::dispatcher::Dispatcher;
use crate::lease::LEASE_CHECK_PERIOD;
use crate::operation::Caller;
use crate::operations::{is_stop, of_request};
use crate::problem::Problem;
use crate::query::Query;
use crate::reserve::DescriptorReserve;
use crate::role::Role;
use crate::surface::ControlSurface;

/// Header with the party for which a caller acts.
pub const CALLER: &str = "slate-caller";

/// Header with the role in which a caller with more rights acts.
pub const ROLE: &str = "slate-role";

/// Maximum number of slow requests at work.
const MAX_SLOW_REQUESTS: usize = 32;

/// Threads for requests; some are kept for those that never take long.
const MAX_THREADS: usize = MAX_SLOW_REQUESTS + 8;

/// Timeout for the arrival of a request's head.
const HEAD_TIMEOUT: Duration = Duration::from_secs(10);

/// Time in which callers learn from an agent that ends how their traces went.
pub const TRACE_END_TIMEOUT: Duration = Duration::from_secs(1);

/// Maximum length of a caller's name, letters.
const MAX_NAME_LENGTH: usize = 80;

/// Reason why an agent has no socket.
#[derive(Debug, thiserror::Error, miette::Diagnostic)]
#[error("the agent can't be reached by tools: {0}")]
#[diagnostic(help("let XDG_RUNTIME_DIR be a short path of a folder that is yours alone"))]
pub struct OpenError(#[from] std::io::Error);

/// Socket of an agent, which exists as long as this value lives.
/// Requests are answered on separate threads, so the agent never waits for one.
pub struct Server {
    /// Dropped first, as its socket lies beside that of the entry.
    _stop_line: StopLine,
    entry: AgentSocket,
    host: Arc<SocketHost>,
    end: Arc<Notify>,
    thread: Option<JoinHandle<()>>,
}

impl std::fmt::Debug for Server {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Server").field("socket", &self.entry.socket()).finish_non_exhaustive()
    }
}

/// State that the connections of the socket share.
struct SocketHost {
    dispatcher: Dispatcher,
    connections: Arc<Connections>,
    /// Name under which the agent is reached.
    name: String,
    reserve: Mutex<DescriptorReserve>,
}

impl Server {
    /// Opens the socket of an agent that nothing else serves.
    /// When an agent of that name runs already, it is reached by a name with a number, such as `exp1-2`.
    ///
    /// # Errors
    /// When the socket can't be made, or no thread is left.
    pub fn open(agent: &Agent) -> Result<Self, OpenError> {
        Self::open_on(Arc::new(ControlSurface::new(agent)?))
    }

    /// Opens the socket on a control surface that may be served elsewhere too.
    /// Otherwise as [`open`](Server::open).
    ///
    /// # Errors
    /// As [`open`](Server::open).
    pub fn open_on(surface: Arc<ControlSurface>) -> Result<Self, OpenError> {
        let (entry, listener) = AgentSocket::take(surface.name())?;
        listener.set_nonblocking(true)?;
        let composer = surface.agent.composer().clone();
        let stop_line = StopLine::open(entry.socket(), move |reason| composer.stop_actuators(reason))?;
        let host = Arc::new(SocketHost {
            dispatcher: Dispatcher::new(surface, MAX_SLOW_REQUESTS, false),
            connections: Arc::default(),
            name: entry.name().to_owned(),
            reserve: Mutex::new(DescriptorReserve::take()),
        });
        let runtime = tokio::runtime::Builder::new_current_thread()
            .enable_all()
            .thread_name("remote tool")
            .max_blocking_threads(MAX_THREADS)
            // A thread that exists needs none to be made.
            .thread_keep_alive(Duration::from_secs(u64::from(u32::MAX)))
            .build()?;
        let end = Arc::new(Notify::new());
        let (ended, shared) = (Arc::clone(&end), Arc::clone(&host));
        let thread = Builder::new().name("remote".into()).spawn(move || {
            runtime.block_on(async move {
                let Ok(listener) = UnixListener::from_std(listener) else { return };
                tokio::task::spawn_blocking(|| {});
                let (receives, ends) =
                    (std::pin::pin!(serve(listener, shared)), std::pin::pin!(ended.notified()));
                first_of(receives, ends).await;
            });
            // Requests that still run do not delay the end.
            runtime.shutdown_background();
        })?;
        Ok(Self { _stop_line: stop_line, entry, host, end, thread: Some(thread) })
    }

    /// Returns the name under which the agent is reached.
    pub fn name(&self) -> &str {
        self.entry.name()
    }

    /// Returns the path of the socket.
    pub fn socket(&self) -> &Path {
        self.entry.socket()
    }
}

impl Drop for Server {
    fn drop(&mut self) {
        self.host.connections.end_traces(TRACE_END_TIMEOUT);
        self.end.notify_one();
        if let Some(thread) = self.thread.take() {
            // It has nothing that panics.
            let _ = thread.join();
        }
    }
}

/// Waits for the first of two.
async fn first_of(
    mut a: std::pin::Pin<&mut impl Future<Output = ()>>,
    mut b: std::pin::Pin<&mut impl Future<Output = ()>>,
) {
    std::future::poll_fn(|task| {
        let is_over = a.as_mut().poll(task).is_ready() || b.as_mut().poll(task).is_ready();
        if is_over { std::task::Poll::Ready(()) } else { std::task::Poll::Pending }
    })
    .await;
}

async fn serve(listener: UnixListener, host: Arc<SocketHost>) {
    let shared = Arc::clone(&host);
    let leases = async move {
        loop {
            tokio::time::sleep(LEASE_CHECK_PERIOD).await;
            shared.dispatcher.surface().end_old_leases();
            shared.reserve().refill();
        }
    };
    let receives = receive(listener, host);
    first_of(std::pin::pin!(leases), std::pin::pin!(receives)).await;
}

async fn receive(listener: UnixListener, host: Arc<SocketHost>) {
    loop {
        match listener.accept().await {
            Ok((stream, _)) => accept(stream, &host),
            // No descriptor is left. An idle connection gives its own; else the reserve serves one caller.
            Err(_) => {
                if !host.connections.close_idle() {
                    host.reserve().give();
                }
                tokio::time::sleep(Duration::from_millis(2)).await;
            }
        }
    }
}

fn accept(stream: UnixStream, host: &Arc<SocketHost>) {
    let place = Arc::new(host.connections.admit());
    let is_last = host.reserve().is_given();
    let host = Arc::clone(host);
    tokio::spawn(async move {
        let leave = Arc::clone(&place.close_notice);
        let closing = ConnectionEnd::new(host.dispatcher.surface(), &place);
        let conversation = converse(stream, host, place, is_last);
        first_of(std::pin::pin!(conversation), std::pin::pin!(leave.notified())).await;
        drop(closing);
    });
}

async fn converse(stream: UnixStream, host: Arc<SocketHost>, place: Arc<ConnectionSlot>, is_last: bool) {
    let is_brief = is_last || place.only_stops;
    let service = service_fn(move |request| {
        let (host, place) = (Arc::clone(&host), Arc::clone(&place));
        // A stop is carried out as soon as its head is there, whatever becomes of the connection.
        let stopped = stop(&host, &place, &request);
        async move {
            let answer = match stopped {
                Some(answer) => answer,
                None => respond(&host, &place, request).await,
            };
            Ok::<_, std::convert::Infallible>(answer)
        }
    });
    let connection = http1::Builder::new()
        .timer(TokioTimer::new())
        .header_read_timeout(None)
        .keep_alive(!is_brief)
        .serve_connection(TokioIo::new(TimedStream::new(stream)), service);
    let connection = std::pin::pin!(async move {
        // The client may have disconnected.
        let _ = connection.await;
    });
    if is_brief {
        // It has the last descriptor, or place.
        let _ = tokio::time::timeout(HEAD_TIMEOUT, connection).await;
    } else {
        connection.await;
    }
}

/// Returns the role of a caller, which may request one with fewer rights.
/// An unknown role counts as the one with the fewest.
pub fn lower_role(role: Role, headers: &HeaderMap) -> Role {
    let Some(requested) = headers.get(ROLE) else { return role };
    let requested = requested.to_str().ok().and_then(Role::by_name).unwrap_or(Role::Viewer);
    role.min(requested)
}

/// Returns a caller for the log, with the name that it gives itself, if any.
/// The flag tells whether it gives one. Nothing verifies the name: it is in quotes and after the known part, so that it
/// can't be mistaken for that.
pub fn with_caller_name(known: String, headers: &HeaderMap) -> (String, bool) {
    match caller_name(headers) {
        Some(name) => (format!("{known} named {name:?}"), true),
        None => (known, false),
    }
}

/// Returns the name that a caller gives itself, safe for a line of the log.
fn caller_name(headers: &HeaderMap) -> Option<String> {
    let name = headers.get(CALLER)?.to_str().ok()?;
    let name: String = slate_runtime::printable_text(name).chars().take(MAX_NAME_LENGTH).collect();
    Some(name).filter(|name| !name.is_empty())
}

fn caller(host: &SocketHost, place: &Arc<ConnectionSlot>, request: &Request<Incoming>) -> Caller {
    let who = caller_name(request.headers()).unwrap_or_default();
    Caller {
        role: lower_role(Role::Developer, request.headers()),
        is_told: !who.is_empty(),
        who,
        local: Some(host.name.clone()),
        connection: Arc::clone(place),
    }
}

fn stop(
    host: &SocketHost,
    place: &Arc<ConnectionSlot>,
    request: &Request<Incoming>,
) -> Option<Response<ResponseBody>> {
    let found = of_request(request.method().as_str(), request.uri().path()).ok().filter(is_stop)?;
    let query = Query::parse_leniently(request.uri().query().unwrap_or_default());
    query.get("reason")?;
    Some(host.dispatcher.stop(found, caller(host, place, request), query, None))
}

async fn respond(
    host: &SocketHost,
    place: &Arc<ConnectionSlot>,
    request: Request<Incoming>,
) -> Response<ResponseBody> {
    let _work = place.begin_request();
    answer(host, place, request).await.unwrap_or_else(|problem| problem.response())
}

async fn answer(
    host: &SocketHost,
    place: &Arc<ConnectionSlot>,
    request: Request<Incoming>,
) -> Result<Response<ResponseBody>, Problem> {
    let caller = caller(host, place, &request);
    let (head, body) = request.into_parts();
    let path = head.uri.path();
    let found = of_request(head.method.as_str(), path)?;
    let query = head.uri.query().unwrap_or_default();
    let query = if is_stop(&found) { Query::parse_leniently(query) } else { Query::parse(query)? };
    if place.only_stops && !is_stop(&found) {
        return Err(Problem::too_many());
    }
    host.dispatcher.answer(found, caller, (path, &head.headers), query, body).await
}

impl SocketHost {
    fn reserve(&self) -> std::sync::MutexGuard<'_, DescriptorReserve> {
        self.reserve.lock().unwrap_or_else(PoisonError::into_inner)
    }
}
