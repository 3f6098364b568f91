//! Connections to all other agents.

use std::collections::BTreeMap;
use std::io;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex};
use std::thread::{self, JoinHandle};

use slate_blackboard::wake::Wake;

use super::Peer;
use super::context::{PeerContext, locked};
use super::line::PeerLine;

/// Largest number of other agents.
const AGENTS: usize = 256;

/// The lines by the names of agents.
pub(super) type LinesByAgent = BTreeMap<String, ServedLine>;

/// Connection with its two threads.
pub(super) struct ServedLine {
    pub line: Arc<PeerLine>,
    pub sends: JoinHandle<()>,
    pub receives: JoinHandle<()>,
}

/// Connections to other agents, created and ended on demand.
pub(super) struct LineTable {
    pub context: PeerContext,
    lines: Mutex<LinesByAgent>,
    /// Flag of a wake-up request that did not wait for the lock.
    missed: AtomicBool,
}

impl LineTable {
    pub fn new(context: PeerContext) -> Self {
        Self { context, lines: Mutex::default(), missed: AtomicBool::new(false) }
    }

    /// Runs `call` with the connections locked.
    pub fn with_lines<T>(&self, call: impl FnOnce(&mut LinesByAgent) -> T) -> T {
        let result = call(&mut locked(&self.lines));
        if self.missed.load(Ordering::SeqCst) {
            self.notify();
        }
        result
    }

    /// Wakes the sending threads without blocking.
    /// If the lock is held, its holder does it.
    pub fn notify(&self) {
        self.missed.store(true, Ordering::SeqCst);
        // Who does not get the lock here has said so before its owner gives it back and looks.
        if let Ok(lines) = self.lines.try_lock() {
            self.missed.store(false, Ordering::SeqCst);
            lines.values().for_each(|served| served.line.wake.notify(1));
        }
    }

    pub fn line(&self, agent: &str) -> Option<Arc<PeerLine>> {
        self.with_lines(|lines| lines.get(agent).map(|served| Arc::clone(&served.line)))
    }

    /// Returns the connection to an agent, which is created if missing.
    pub fn line_to(self: &Arc<Self>, agent: &str) -> io::Result<Arc<PeerLine>> {
        self.with_lines(|lines| self.line_in(lines, agent, |_| ()))
    }

    /// Ends unused connections; their threads end by themselves.
    pub fn end_idle(&self) {
        self.with_lines(|lines| drop(end_idle(lines, self.context.now())));
    }

    /// Returns the line to an agent; `how` sets the endpoint that is dialled.
    /// A new line knows the endpoint before it shows its state.
    pub fn line_in(
        self: &Arc<Self>,
        lines: &mut LinesByAgent,
        agent: &str,
        how: impl FnOnce(&PeerLine),
    ) -> io::Result<Arc<PeerLine>> {
        if let Some(served) = lines.get(agent) {
            how(&served.line);
            return Ok(Arc::clone(&served.line));
        }
        // Tools come and go, each under a name of its own.
        drop(end_idle(lines, self.context.now()));
        if self.context.ended.load(Ordering::Acquire) {
            return Err(io::Error::other("the agent ends"));
        }
        if lines.len() >= AGENTS {
            return Err(io::Error::other(format!("no more than {AGENTS} agents are connected")));
        }
        let wake = Arc::new(Wake::new());
        let PeerContext { board, identity, limits, rights, .. } = &self.context;
        let allowance = rights.of(&identity.agent, agent).map_err(io::Error::other)?.cloned();
        let peer = Peer::new(board, identity.clone(), agent, *limits, &wake).allow(allowance);
        let line = Arc::new(PeerLine::new(peer, wake));
        how(&line);
        let start = |name: &str, run: fn(&PeerLine, &Self)| {
            let (table, line) = (Arc::clone(self), Arc::clone(&line));
            thread::Builder::new().name(format!("{name} {agent}")).spawn(move || run(&line, &table))
        };
        let sends = start("to", |line, table| line.send(&table.context, &|| table.end_idle()))?;
        let receives = start("from", |line, table| line.receive(&table.context));
        let receives = receives.inspect_err(|_| line.end())?;
        let served = ServedLine { line: Arc::clone(&line), sends, receives };
        lines.insert(agent.into(), served);
        Ok(line)
    }
}

/// Ends unused connections and removes them.
pub(super) fn end_idle(lines: &mut LinesByAgent, now: u64) -> Vec<ServedLine> {
    let idle = lines.extract_if(.., |_, served| served.line.is_idle(now)).map(|(_, served)| served);
    idle.inspect(|served| served.line.end()).collect()
}
