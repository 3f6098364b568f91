//! The Unix socket of an agent.

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

use crate::answer::Body;
use crate::connection::{Guests, Patient, Place};
use crate::context::{Context, Document};
use crate::lease::LOOK;
use crate::operation::Caller;
use crate::problem::Problem;
use crate::query::Query;
use crate::role::Role;
use crate::service::{Found, Service, too_many};

/// The header by which a caller says for whom it asks.
pub const CALLER: &str = "slate-caller";

/// The header that says in which role a caller asks that may do more.
pub const ROLE: &str = "slate-role";

/// How many requests may be at work that can take long.
const WORKING: usize = 32;

/// Threads for requests; some are kept for those that never take long.
const THREADS: usize = WORKING + 8;

/// How long the head of a request may take to come.
const REQUEST: Duration = Duration::from_secs(10);

/// How long an agent that ends waits for callers to ask how their traces go.
const HEARING: Duration = Duration::from_secs(1);

/// The longest name of a caller, letters.
const NAME: usize = 80;

/// Why an agent has no socket.
#[derive(Debug, thiserror::Error, miette::Diagnostic)]
#[error("the agent can't be reached by tools: {0}")]
#[diagnostic(help("let XDG_RUNTIME_DIR be a short path of a folder that is yours alone"))]
pub struct OpenError(#[from] std::io::Error);

/// The socket of an agent, which exists as long as this lives. Requests are answered on threads of their own, so the agent never
/// waits for one.
pub struct Server {
    /// Dropped first, as its socket lies beside that of the entry.
    _stop_line: StopLine,
    entry: AgentSocket,
    hall: Arc<Hall>,
    end: Arc<Notify>,
    thread: Option<JoinHandle<()>>,
}

impl std::fmt::Debug for Server {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Server").field("socket", &self.entry.socket()).finish_non_exhaustive()
    }
}

/// What connections share.
struct Hall {
    service: Service,
    guests: Arc<Guests>,
    /// The name under which the agent is reached.
    name: String,
    reserve: Mutex<Reserve>,
}

impl Server {
    /// Opens the socket of an agent. When an agent of that name runs already, it is reached by a name with a number,
    /// such as `exp1-2`.
    ///
    /// # Errors
    /// When the socket can't be made, or there is no thread left.
    pub fn open(agent: &Agent) -> Result<Self, OpenError> {
        Self::open_with(agent, Vec::new())
    }

    /// As [`open`](Server::open), with what the program tells beside the blackboard.
    ///
    /// # Errors
    /// As [`open`](Server::open).
    pub fn open_with(agent: &Agent, documents: Vec<Document>) -> Result<Self, OpenError> {
        let (entry, listener) = AgentSocket::take(agent.board().agent())?;
        listener.set_nonblocking(true)?;
        let composer = agent.composer();
        let stop_line = StopLine::open(entry.socket(), move |reason| composer.stop_actuators(reason))?;
        let context = Arc::new(Context::new(agent)?.with_documents(documents));
        let hall = Arc::new(Hall {
            service: Service::new(context, WORKING, false),
            guests: Arc::default(),
            name: entry.name().to_owned(),
            reserve: Mutex::new(Reserve::take()),
        });
        let runtime = tokio::runtime::Builder::new_current_thread()
            .enable_all()
            .thread_name("remote tool")
            .max_blocking_threads(THREADS)
            // A thread that exists needs none to be made.
            .thread_keep_alive(Duration::from_secs(u64::from(u32::MAX)))
            .build()?;
        let end = Arc::new(Notify::new());
        let (ended, shared) = (Arc::clone(&end), Arc::clone(&hall));
        let thread = Builder::new().name("remote".into()).spawn(move || {
            runtime.block_on(async move {
                let Ok(listener) = UnixListener::from_std(listener) else { return };
                tokio::task::spawn_blocking(|| {});
                let (receives, ends) =
                    (std::pin::pin!(serve(listener, shared)), std::pin::pin!(ended.notified()));
                first_of(receives, ends).await;
            });
            // What still runs for somebody is no reason to wait.
            runtime.shutdown_background();
        })?;
        Ok(Self { _stop_line: stop_line, entry, hall, end, thread: Some(thread) })
    }

    /// The name under which the agent is reached.
    pub fn name(&self) -> &str {
        self.entry.name()
    }

    /// The path of the socket.
    pub fn socket(&self) -> &Path {
        self.entry.socket()
    }
}

impl Drop for Server {
    fn drop(&mut self) {
        self.hall.guests.end_traces(HEARING);
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

async fn serve(listener: UnixListener, hall: Arc<Hall>) {
    let shared = Arc::clone(&hall);
    let leases = async move {
        loop {
            tokio::time::sleep(LOOK).await;
            shared.service.context().end_old_leases();
            shared.reserve().refill();
        }
    };
    let receives = receive(listener, hall);
    first_of(std::pin::pin!(leases), std::pin::pin!(receives)).await;
}

async fn receive(listener: UnixListener, hall: Arc<Hall>) {
    loop {
        match listener.accept().await {
            Ok((stream, _)) => welcome(stream, &hall),
            // No descriptor is left. An idle connection gives its own; else the reserve serves one caller.
            Err(_) => {
                if !hall.guests.dismiss() {
                    hall.reserve().give();
                }
                tokio::time::sleep(Duration::from_millis(2)).await;
            }
        }
    }
}

fn welcome(stream: UnixStream, hall: &Arc<Hall>) {
    let place = Arc::new(hall.guests.admit());
    let is_last = hall.reserve().is_given();
    let hall = Arc::clone(hall);
    tokio::spawn(async move {
        let leave = Arc::clone(&place.leave);
        let closing = Closing(Arc::clone(hall.service.context()), Arc::clone(&place));
        let conversation = converse(stream, hall, place, is_last);
        first_of(std::pin::pin!(conversation), std::pin::pin!(leave.notified())).await;
        drop(closing);
    });
}

/// Ends what belongs to a connection with it.
struct Closing(Arc<Context>, Arc<Place>);

impl Drop for Closing {
    fn drop(&mut self) {
        self.1.close(&self.0);
    }
}

async fn converse(stream: UnixStream, hall: Arc<Hall>, place: Arc<Place>, is_last: bool) {
    let is_brief = is_last || place.only_stops;
    let service = service_fn(move |request| {
        let (hall, place) = (Arc::clone(&hall), Arc::clone(&place));
        // A stop is carried out as soon as its head is there, whatever becomes of the connection.
        let stopped = stop(&hall, &place, &request);
        async move {
            let answer = match stopped {
                Some(answer) => answer,
                None => respond(&hall, &place, request).await,
            };
            Ok::<_, std::convert::Infallible>(answer)
        }
    });
    let connection = http1::Builder::new()
        .timer(TokioTimer::new())
        .header_read_timeout(None)
        .keep_alive(!is_brief)
        .serve_connection(TokioIo::new(Patient::new(stream)), service);
    let connection = std::pin::pin!(async move {
        // Who is gone misses nothing.
        let _ = connection.await;
    });
    if is_brief {
        // It has the last descriptor, or place.
        let _ = tokio::time::timeout(REQUEST, connection).await;
    } else {
        connection.await;
    }
}

/// The role of a caller that may do so much, and may ask as one who may do less. A role of another name may do the least.
pub fn lowered(role: Role, headers: &HeaderMap) -> Role {
    let Some(asked) = headers.get(ROLE) else { return role };
    let asked = asked.to_str().ok().and_then(Role::by_name).unwrap_or(Role::Viewer);
    role.min(asked)
}

fn caller(hall: &Hall, place: &Arc<Place>, request: &Request<Incoming>) -> Caller {
    let who = request.headers().get(CALLER).and_then(|who| who.to_str().ok());
    let who: String = slate_runtime::printable_text(who.unwrap_or_default()).chars().take(NAME).collect();
    Caller {
        role: lowered(Role::Developer, request.headers()),
        is_told: !who.is_empty(),
        who,
        local: Some(hall.name.clone()),
        place: Arc::clone(place),
    }
}

fn stop(hall: &Hall, place: &Arc<Place>, request: &Request<Incoming>) -> Option<Response<Body>> {
    let found = Found::of(request.method().as_str(), request.uri().path()).ok().filter(Found::is_stop)?;
    let query = Query::parse(request.uri().query().unwrap_or_default()).unwrap_or_default();
    query.get("reason")?;
    Some(hall.service.stop(found, caller(hall, place, request), query, None))
}

async fn respond(hall: &Hall, place: &Arc<Place>, request: Request<Incoming>) -> Response<Body> {
    let _work = place.work();
    answer(hall, place, request).await.unwrap_or_else(|problem| problem.response())
}

async fn answer(
    hall: &Hall,
    place: &Arc<Place>,
    request: Request<Incoming>,
) -> Result<Response<Body>, Problem> {
    let caller = caller(hall, place, &request);
    let (head, body) = request.into_parts();
    let path = head.uri.path();
    let query = Query::parse(head.uri.query().unwrap_or_default())?;
    let found = Found::of(head.method.as_str(), path)?;
    if place.only_stops && !found.is_stop() {
        return Err(too_many());
    }
    hall.service.answer(found, caller, (path, &head.headers), query, body).await
}

impl Hall {
    fn reserve(&self) -> std::sync::MutexGuard<'_, Reserve> {
        self.reserve.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

/// A descriptor that is kept for a stop when the process has no other one left.
struct Reserve(Option<std::fs::File>);

impl Reserve {
    fn take() -> Self {
        Self(std::fs::File::open("/dev/null").ok())
    }

    fn give(&mut self) {
        self.0 = None;
    }

    fn is_given(&self) -> bool {
        self.0.is_none()
    }

    fn refill(&mut self) {
        if self.is_given() {
            *self = Self::take();
        }
    }
}
