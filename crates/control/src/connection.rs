//! Connections of a server, their limit, and the choice of the one to close.

use std::io::{Error, ErrorKind, Result};
use std::pin::Pin;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::task::{Context, Poll, ready};
use std::time::Duration;

use slate_sorted::SortedMap;
use tokio::io::{AsyncRead, AsyncWrite, ReadBuf};
use tokio::sync::Notify;
use tokio::time::{Instant, Sleep};

use crate::agent::ToolTrace;

/// Period at which the end of the traces is polled.
const TRACE_POLL_PERIOD: Duration = Duration::from_millis(5);

/// Maximum number of connections.
/// For one more, the connection that has been idle for the longest is closed.
const MAX_CONNECTIONS: usize = 64;

/// Maximum number of additional connections when none of those is idle.
/// They can only stop the actuators; for one more, the oldest is closed.
const MAX_STOP_CONNECTIONS: usize = 16;

/// Maximum number of WebSockets among them.
pub const MAX_SOCKETS: usize = 24;

/// Time after which a blocked write closes the connection.
pub const WRITE_TIMEOUT: Duration = Duration::from_secs(5);

/// Connections of a server.
#[derive(Default)]
pub struct Connections {
    present: Mutex<(u64, SortedMap<u64, PresentConnection>)>,
    /// Shutdown flag, set once the agent ends.
    ends: AtomicBool,
}

impl std::fmt::Debug for Connections {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Connections").field("count", &self.present().1.len()).finish_non_exhaustive()
    }
}

struct PresentConnection {
    /// Activity counter of all connections, as of this one's last activity.
    last: u64,
    /// Requests that are being answered.
    busy: usize,
    /// Restriction to stopping the actuators.
    only_stops: bool,
    is_socket: bool,
    /// Mark of the console's page in a browser.
    is_page: bool,
    close_notice: Arc<Notify>,
    resources: Arc<Mutex<ConnectionResources>>,
}

impl PresentConnection {
    /// Returns whether the connection may be closed as idle.
    fn is_idle(&self) -> bool {
        let is_in_use = || self.resources.lock().unwrap_or_else(PoisonError::into_inner).are_in_use();
        self.busy == 0 && !self.is_socket && !is_in_use()
    }
}

/// Resources that end with a connection.
#[derive(Default)]
struct ConnectionResources {
    trace: ToolTrace,
    leases: Vec<String>,
    /// Closed state, in which nothing may be bound to the connection any more.
    is_closed: bool,
}

impl ConnectionResources {
    fn are_in_use(&self) -> bool {
        self.trace.is_under_way() || !self.leases.is_empty()
    }
}

/// Slot of a connection, which counts until dropped.
pub struct ConnectionSlot {
    connections: Arc<Connections>,
    number: u64,
    /// Restriction to stopping the actuators, as all regular slots are taken.
    pub only_stops: bool,
    /// Notified when the connection must close.
    pub close_notice: Arc<Notify>,
    resources: Arc<Mutex<ConnectionResources>>,
}

impl std::fmt::Debug for ConnectionSlot {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("ConnectionSlot").field("number", &self.number).finish_non_exhaustive()
    }
}

impl Connections {
    fn present(&self) -> MutexGuard<'_, (u64, SortedMap<u64, PresentConnection>)> {
        self.present.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Admits a connection.
    /// When all slots are taken by busy connections, it gets one that can only stop the actuators.
    pub fn admit(self: &Arc<Self>) -> ConnectionSlot {
        let mut present = self.present();
        let of = |connections: &SortedMap<u64, PresentConnection>, stopping: bool| {
            connections.values().filter(|connection| connection.only_stops == stopping).count()
        };
        let is_full = of(&present.1, false) >= MAX_CONNECTIONS;
        let only_stops = is_full
            && !close_idle(&mut present.1, |connection| connection.is_idle() && !connection.only_stops);
        if only_stops && of(&present.1, true) >= MAX_STOP_CONNECTIONS {
            close_idle(&mut present.1, |connection| connection.only_stops);
        }
        present.0 += 1;
        let number = present.0;
        let (close_notice, resources) = (Arc::new(Notify::new()), Arc::default());
        let connection = PresentConnection {
            last: number,
            busy: 0,
            only_stops,
            is_socket: false,
            is_page: false,
            close_notice: Arc::clone(&close_notice),
            resources: Arc::clone(&resources),
        };
        present.1.insert(number, connection);
        ConnectionSlot { connections: Arc::clone(self), number, only_stops, close_notice, resources }
    }

    /// Closes the connection that was idle for the longest; false if none is idle.
    pub fn close_idle(&self) -> bool {
        close_idle(&mut self.present().1, PresentConnection::is_idle)
    }

    /// Returns the number of pages open in browsers.
    pub fn pages(&self) -> usize {
        self.present().1.values().filter(|connection| connection.is_page).count()
    }

    /// Ends the traces of all connections, as the agent ends.
    /// Traces of callers that poll their progress within `timeout` end first, so that these callers learn of it.
    pub fn end_traces(&self, timeout: Duration) {
        self.ends.store(true, Ordering::Release);
        let under_way = || -> Vec<Arc<Mutex<ConnectionResources>>> {
            let present = self.present();
            let all = present.1.values().map(|connection| Arc::clone(&connection.resources));
            all.filter(|own| own.lock().unwrap_or_else(PoisonError::into_inner).trace.is_under_way())
                .collect()
        };
        let mut waited = Duration::ZERO;
        let had_traces = !under_way().is_empty();
        while waited < timeout && !under_way().is_empty() {
            std::thread::sleep(TRACE_POLL_PERIOD);
            waited += TRACE_POLL_PERIOD;
        }
        for own in under_way() {
            own.lock().unwrap_or_else(PoisonError::into_inner).trace.finish();
        }
        if had_traces {
            // The last answer needs time to be sent.
            std::thread::sleep(4 * TRACE_POLL_PERIOD);
        }
    }
}

fn close_idle(
    present: &mut SortedMap<u64, PresentConnection>,
    may_close: impl Fn(&PresentConnection) -> bool,
) -> bool {
    let candidates = present.iter().filter(|(_, connection)| may_close(connection));
    let oldest = candidates.min_by_key(|(_, connection)| connection.last).map(|(number, _)| *number);
    let dismissed = oldest.and_then(|oldest| present.remove(&oldest));
    dismissed.inspect(|connection| connection.close_notice.notify_one()).is_some()
}

impl ConnectionSlot {
    /// Counts as busy until the returned value is dropped.
    pub fn begin_request(self: &Arc<Self>) -> BusyConnection {
        let mut present = self.connections.present();
        present.0 += 1;
        let now = present.0;
        if let Some(connection) = present.1.get_mut(&self.number) {
            (connection.last, connection.busy) = (now, connection.busy + 1);
        }
        BusyConnection(Arc::clone(self))
    }

    /// Turns the connection into a WebSocket; false if there are too many.
    /// `is_page` marks that of a browser's page.
    pub fn upgrade(&self, is_page: bool) -> bool {
        let mut present = self.connections.present();
        let sockets = present.1.values().filter(|connection| connection.is_socket).count();
        match present.1.get_mut(&self.number) {
            Some(connection) if sockets < MAX_SOCKETS => {
                (connection.is_socket, connection.is_page) = (true, is_page);
                true
            }
            _ => false,
        }
    }
}

impl ConnectionSlot {
    /// Accesses the trace of this connection.
    pub(crate) fn with_trace<R>(&self, act: impl FnOnce(&mut ToolTrace) -> R) -> R {
        let mut own = self.resources();
        if self.connections.ends.load(Ordering::Acquire) {
            own.trace.finish();
        }
        act(&mut own.trace)
    }

    /// Returns the number of the server's connections that record a trace.
    pub(crate) fn traces(&self) -> usize {
        let own: Vec<_> = self
            .connections
            .present()
            .1
            .values()
            .map(|connection| Arc::clone(&connection.resources))
            .collect();
        own.iter()
            .filter(|own| own.lock().unwrap_or_else(PoisonError::into_inner).trace.is_under_way())
            .count()
    }

    /// Binds a lease to this connection, with which it ends.
    /// Returns false if the connection is closed.
    pub(crate) fn bind_lease(&self, lease: &str) -> bool {
        let mut own = self.resources();
        if !own.is_closed {
            own.leases.push(lease.to_owned());
        }
        !own.is_closed
    }

    /// Ends the traces and leases of a closed connection.
    fn close(&self, surface: &Arc<crate::surface::ControlSurface>) {
        let closed = ConnectionResources { is_closed: true, ..ConnectionResources::default() };
        let ConnectionResources { trace, leases, .. } = std::mem::replace(&mut *self.resources(), closed);
        for lease in &leases {
            // The lease may have expired.
            surface.leases.end(lease);
        }
        if trace.is_under_way() {
            let ends = self.connections.ends.load(Ordering::Acquire);
            let abandon = move || trace.abandon(ends);
            match tokio::runtime::Handle::try_current() {
                Ok(runtime) => drop(runtime.spawn_blocking(abandon)),
                Err(_) => abandon(),
            }
        }
    }

    fn resources(&self) -> MutexGuard<'_, ConnectionResources> {
        self.resources.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

/// Guard that ends the traces and leases of a connection when dropped.
pub struct ConnectionEnd {
    surface: Arc<crate::surface::ControlSurface>,
    slot: Arc<ConnectionSlot>,
}

impl std::fmt::Debug for ConnectionEnd {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("ConnectionEnd").field("slot", &self.slot).finish_non_exhaustive()
    }
}

impl ConnectionEnd {
    /// Creates the end of a connection to an agent.
    pub fn new(surface: &Arc<crate::surface::ControlSurface>, slot: &Arc<ConnectionSlot>) -> Self {
        Self { surface: Arc::clone(surface), slot: Arc::clone(slot) }
    }
}

impl Drop for ConnectionEnd {
    fn drop(&mut self) {
        self.slot.close(&self.surface);
    }
}

impl Drop for ConnectionSlot {
    fn drop(&mut self) {
        self.connections.present().1.remove(&self.number);
    }
}

/// Request that is being answered.
#[derive(Debug)]
pub struct BusyConnection(Arc<ConnectionSlot>);

impl Drop for BusyConnection {
    fn drop(&mut self) {
        if let Some(connection) = self.0.connections.present().1.get_mut(&self.0.number) {
            connection.busy -= 1;
        }
    }
}

/// Stream with a write timeout: it fails when the other side reads too slowly.
#[derive(Debug)]
pub struct TimedStream<S> {
    stream: S,
    timer: Option<Pin<Box<Sleep>>>,
}

impl<S> TimedStream<S> {
    /// Creates the stream around another one.
    pub fn new(stream: S) -> Self {
        Self { stream, timer: None }
    }

    fn check_timeout<T>(&mut self, task: &mut Context<'_>, done: Poll<Result<T>>) -> Poll<Result<T>> {
        if done.is_ready() {
            self.timer = None;
            return done;
        }
        let timer = self
            .timer
            .get_or_insert_with(|| Box::pin(tokio::time::sleep_until(Instant::now() + WRITE_TIMEOUT)));
        ready!(timer.as_mut().poll(task));
        Poll::Ready(Err(Error::new(ErrorKind::TimedOut, "the other side reads nothing")))
    }
}

impl<S: AsyncRead + Unpin> AsyncRead for TimedStream<S> {
    fn poll_read(
        mut self: Pin<&mut Self>,
        task: &mut Context<'_>,
        buffer: &mut ReadBuf<'_>,
    ) -> Poll<Result<()>> {
        Pin::new(&mut self.stream).poll_read(task, buffer)
    }
}

impl<S: AsyncWrite + Unpin> AsyncWrite for TimedStream<S> {
    fn poll_write(mut self: Pin<&mut Self>, task: &mut Context<'_>, bytes: &[u8]) -> Poll<Result<usize>> {
        let done = Pin::new(&mut self.stream).poll_write(task, bytes);
        self.check_timeout(task, done)
    }

    fn poll_flush(mut self: Pin<&mut Self>, task: &mut Context<'_>) -> Poll<Result<()>> {
        let done = Pin::new(&mut self.stream).poll_flush(task);
        // A flush without data does not show whether the other side reads.
        if done.is_ready() { done } else { self.check_timeout(task, done) }
    }

    fn poll_shutdown(mut self: Pin<&mut Self>, task: &mut Context<'_>) -> Poll<Result<()>> {
        let done = Pin::new(&mut self.stream).poll_shutdown(task);
        self.check_timeout(task, done)
    }
}
