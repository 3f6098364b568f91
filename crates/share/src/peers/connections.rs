//! Connections to all other agents.

use std::io;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex};
use std::thread::{self, JoinHandle};

use slate_blackboard::wake::Wake;
use slate_sorted::SortedMap;

use super::Peer;
use super::connection::PeerConnection;
use super::context::{PeerContext, lock};

/// Largest number of other agents.
const MAX_AGENTS: usize = 256;

/// The connections by the names of agents.
pub(super) type ConnectionsByAgent = SortedMap<String, RunningConnection>;

/// Connection with its two threads.
pub(super) struct RunningConnection {
    pub connection: Arc<PeerConnection>,
    pub sends: JoinHandle<()>,
    pub receives: JoinHandle<()>,
}

/// Connections to other agents, created and ended on demand.
pub(super) struct ConnectionTable {
    pub context: PeerContext,
    connections: Mutex<ConnectionsByAgent>,
    /// Flag of a wake-up request that did not wait for the lock.
    wake_pending: AtomicBool,
}

impl ConnectionTable {
    pub fn new(context: PeerContext) -> Self {
        Self { context, connections: Mutex::default(), wake_pending: AtomicBool::new(false) }
    }

    /// Runs `call` with the connections locked.
    pub fn with_connections<T>(&self, call: impl FnOnce(&mut ConnectionsByAgent) -> T) -> T {
        let result = call(&mut lock(&self.connections));
        if self.wake_pending.load(Ordering::SeqCst) {
            self.notify();
        }
        result
    }

    /// Wakes the sending threads without blocking.
    /// If the lock is held, its holder does it.
    pub fn notify(&self) {
        self.wake_pending.store(true, Ordering::SeqCst);
        // The flag is set before the holder of the lock releases it and checks the flag.
        if let Ok(connections) = self.connections.try_lock() {
            self.wake_pending.store(false, Ordering::SeqCst);
            connections.values().for_each(|running| running.connection.wake.notify(1));
        }
    }

    pub fn connection(&self, agent: &str) -> Option<Arc<PeerConnection>> {
        self.with_connections(|connections| {
            connections.get(agent).map(|running| Arc::clone(&running.connection))
        })
    }

    /// Returns the connection to an agent, which is created if missing.
    pub fn connection_to(self: &Arc<Self>, agent: &str) -> io::Result<Arc<PeerConnection>> {
        self.with_connections(|connections| self.connection_in(connections, agent, |_| ()))
    }

    /// Ends unused connections; their threads end by themselves.
    pub fn end_idle(&self) {
        self.with_connections(|connections| drop(end_idle(connections, self.context.now())));
    }

    /// Returns the connection to an agent, created if it does not exist.
    /// `configure` sets the endpoint that is dialed; a new connection has it before it shows its state.
    pub fn connection_in(
        self: &Arc<Self>,
        connections: &mut ConnectionsByAgent,
        agent: &str,
        configure: impl FnOnce(&PeerConnection),
    ) -> io::Result<Arc<PeerConnection>> {
        if let Some(running) = connections.get(agent) {
            configure(&running.connection);
            return Ok(Arc::clone(&running.connection));
        }
        // Each tool connects under a name of its own.
        drop(end_idle(connections, self.context.now()));
        if self.context.ended.load(Ordering::Acquire) {
            return Err(io::Error::other("the agent ends"));
        }
        if connections.len() >= MAX_AGENTS {
            return Err(io::Error::other(format!("no more than {MAX_AGENTS} agents are connected")));
        }
        let wake = Arc::new(Wake::new());
        let PeerContext { board, identity, limits, rights, .. } = &self.context;
        let allowance = rights.of(&identity.agent, agent).map_err(io::Error::other)?.cloned();
        let peer = Peer::new(board, identity.clone(), agent, *limits, &wake).allow(allowance);
        let connection = Arc::new(PeerConnection::new(peer, wake));
        configure(&connection);
        let start = |name: &str, run: fn(&PeerConnection, &Self)| {
            let (table, connection) = (Arc::clone(self), Arc::clone(&connection));
            thread::Builder::new().name(format!("{name} {agent}")).spawn(move || run(&connection, &table))
        };
        let sends = start("to", |connection, table| connection.send(&table.context, &|| table.end_idle()))?;
        let receives = start("from", |connection, table| connection.receive(&table.context));
        let receives = receives.inspect_err(|_| connection.end())?;
        let running = RunningConnection { connection: Arc::clone(&connection), sends, receives };
        connections.insert(agent.into(), running);
        Ok(connection)
    }
}

/// Ends unused connections and removes them.
pub(super) fn end_idle(connections: &mut ConnectionsByAgent, now: u64) -> Vec<RunningConnection> {
    let idle = connections.extract_if(|_, running| running.connection.is_idle(now));
    idle.into_iter().map(|(_, running)| running).inspect(|running| running.connection.end()).collect()
}
