//! Session of a node, in the background.
//! The agent runs whether a router is available or not.

use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex};
use std::thread::{Builder, JoinHandle};
use std::time::Duration;

use serde_json::{Value as Json, json};
use slate_blackboard::wake::Wake;
use slate_module::Level;
use slate_network::{NetworkEndpoint, NetworkError, open_client};
use slate_runtime::Composer;
use slate_topics::join_threads;
use zenoh::liveliness::LivelinessToken;
use zenoh::pubsub::Subscriber;
use zenoh::sample::{Sample, SampleKind};
use zenoh::session::{LinkEvent, LinkEventsListener, ZenohId};
use zenoh::{Session, Wait};

use super::graph::Graph;
use super::queue::locked;
use super::session_endpoint::SessionEndpoint;
use super::token::tokens_of;
use crate::settings::TABLE;

/// Delay before the next attempt.
const RETRY: Duration = Duration::from_millis(500);

/// Advice for an unreachable router.
pub const HELP: &str = "start it, as by `ros2 run rmw_zenoh_cpp rmw_zenohd`; or name another one in [ros2]: router = \"tcp/localhost:7447\"";

/// Declarations of a session.
pub struct NodeSession {
    pub identity: ZenohId,
    pub router: NetworkEndpoint,
    pub domain: u16,
    pub node_token: String,
    /// Endpoints with their tokens.
    pub endpoints: Vec<(String, Arc<dyn SessionEndpoint>)>,
    pub graph: Arc<Graph>,
    pub composer: Composer,
}

/// Connection that keeps the node on the network.
struct Joined {
    session: Session,
    _graph: Subscriber<()>,
    _links: LinkEventsListener<()>,
    _tokens: Vec<LivelinessToken>,
}

/// Session, which ends when dropped.
pub struct RouterConnection {
    joined: Arc<Mutex<Option<Joined>>>,
    ended: Arc<AtomicBool>,
    wake: Arc<Wake>,
    threads: Vec<JoinHandle<()>>,
}

impl RouterConnection {
    /// Connects in a thread, and retries until a router is available.
    /// Zenoh itself restores later losses.
    ///
    /// # Errors
    /// When no thread is left.
    pub fn start(link: NodeSession) -> std::io::Result<Self> {
        let (joined, ended, wake) =
            (Arc::new(Mutex::new(None)), Arc::new(AtomicBool::new(false)), Arc::new(Wake::new()));
        let own = (Arc::clone(&joined), Arc::clone(&ended), Arc::clone(&wake));
        let connect = move || {
            let (joined, ended, wake) = own;
            let mut reported = None;
            while !ended.load(Ordering::Acquire) {
                match link.join(&ended) {
                    Ok(session) => {
                        let session = locked(&joined).insert(session).session.clone();
                        if ended.load(Ordering::Acquire) {
                            close(&session);
                        }
                        return;
                    }
                    Err(reason) if reported.as_ref() != Some(&reason) => {
                        link.log(
                            Level::Warn,
                            &format!("{reason}; the node joins when the router runs: {HELP}"),
                        );
                        reported = Some(reason);
                    }
                    Err(_) => {}
                }
                wake.wait_timeout(RETRY);
            }
        };
        let threads = vec![Builder::new().name("ros2-connect".into()).spawn(connect)?];
        Ok(Self { joined, ended, wake, threads })
    }
}

impl Drop for RouterConnection {
    fn drop(&mut self) {
        self.ended.store(true, Ordering::Release);
        self.wake.notify(1);
        // A thread that still waits for a router ends by itself.
        if let Some(joined) = locked(&self.joined).take() {
            close(&joined.session);
            join_threads(&mut self.threads);
        }
    }
}

/// Others learn at once that the node has gone.
fn close(session: &Session) {
    // One that has closed already is what is wanted.
    let _ = session.close().wait();
}

impl NodeSession {
    fn log(&self, level: Level, text: &str) {
        self.composer.log(level, &format!("{TABLE}: {text}"));
    }

    fn join(&self, ended: &Arc<AtomicBool>) -> Result<Joined, String> {
        let session = open_session(&self.router, self.identity).map_err(|error| error.to_string())?;
        let graph = follow(&session, self.domain, &self.graph).map_err(|error| error.to_string())?;
        let links = self.follow_router(&session, ended).map_err(|error| error.to_string())?;
        let mut tokens = Vec::new();
        let mut declare = |token: &String| {
            let declared = session.liveliness().declare_token(token.clone()).wait();
            declared.map(|declared| tokens.push(declared))
        };
        declare(&self.node_token).map_err(|error| error.to_string())?;
        for (token, endpoint) in &self.endpoints {
            // The token last: a node that sees it may use the endpoint.
            if let Err(error) = endpoint.declare(&session).and_then(|()| declare(token)) {
                self.log(Level::Error, &format!("`{token}` can't be declared: {error}"));
            }
        }
        self.log(Level::Info, &format!("the node has joined, through the router at {}", self.router));
        Ok(Joined { session, _graph: graph, _links: links, _tokens: tokens })
    }

    /// Logs when the router goes and comes back.
    fn follow_router(
        &self,
        session: &Session,
        ended: &Arc<AtomicBool>,
    ) -> zenoh::Result<LinkEventsListener<()>> {
        let (composer, router, ended) = (self.composer.clone(), self.router.clone(), Arc::clone(ended));
        let note = move |event: LinkEvent| {
            let (level, text) = match event.kind() {
                SampleKind::Put => (Level::Info, "is back, and the node has joined again"),
                SampleKind::Delete => (Level::Warn, "is lost; the node joins again when the router is back"),
            };
            if !ended.load(Ordering::Acquire) {
                composer.log(level, &format!("{TABLE}: the router at {router} {text}"));
            }
        };
        session.info().link_events_listener().history(false).callback(note).wait()
    }
}

/// Opens a session as `rmw_zenoh` has it.
///
/// # Errors
/// When the router is not reached within 3 s.
pub fn open_session(router: &NetworkEndpoint, identity: ZenohId) -> Result<Session, NetworkError> {
    let more: [(&str, Json); 3] = [
        ("id", json!(identity.to_string())),
        // Caches of publishers go by it.
        ("timestamping/enabled", json!(true)),
        ("queries_default_timeout", json!(600_000)),
    ];
    open_client(router, &more)
}

/// Makes a graph follow the tokens of a domain.
///
/// # Errors
/// When Zenoh refuses.
pub fn follow(session: &Session, domain: u16, graph: &Arc<Graph>) -> zenoh::Result<Subscriber<()>> {
    let graph = Arc::clone(graph);
    let note = move |sample: Sample| graph.note(sample.key_expr().as_str(), sample.kind() == SampleKind::Put);
    session.liveliness().declare_subscriber(tokens_of(domain)).history(true).callback(note).wait()
}
