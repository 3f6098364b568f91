//! An agent that runs, on a network of the test.
#![allow(clippy::disallowed_methods, reason = "real agents go by the machine's clock")]

pub mod modules;

use std::net::TcpListener;
use std::sync::Arc;
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

use serde_json::Value as Json;
use slate_blackboard::interface::Value;
use slate_control::ControlSurface;
use slate_network::{AgentNetwork, NetworkError, NetworkSettings};
use slate_runtime::configuration::{Configuration, Database, Options as Sources};
use slate_runtime::log::MemoryTarget;
use slate_runtime::sharing::Sharing;
use slate_runtime::{Agent, Control, Options, Stopper};
use slate_share::agent::AgentSharing;
use zenoh::query::Reply;
use zenoh::{Config, Session, Wait};

/// The longest that a test waits for something.
const TIMEOUT: Duration = Duration::from_secs(20);

/// An agent that runs until this is dropped.
pub struct Running {
    pub network: Option<AgentNetwork>,
    pub surface: Arc<ControlSurface>,
    pub configuration: Arc<Configuration>,
    pub log: MemoryTarget,
    stopper: Stopper,
    thread: Option<JoinHandle<()>>,
}

impl Running {
    /// An agent of a name with a table `[network]`.
    pub fn start(name: &str, network: &str) -> Self {
        let mut running = Self::load(name, network);
        running.connect().unwrap();
        running
    }

    /// An agent that is not connected yet.
    pub fn load(name: &str, network: &str) -> Self {
        Self::load_with(name, "", network)
    }

    /// The same with links beside its own.
    pub fn load_with(name: &str, links: &str, network: &str) -> Self {
        let text = modules::configuration(name, links, network);
        let sources = Sources { extra_tables: vec![slate_network::TABLE.into()], ..Sources::default() };
        let database = Database::from_text("test.toml", &text, sources).unwrap();
        let log = MemoryTarget::default();
        let sharing: Option<Box<dyn Sharing>> = match database.current().share() {
            Some(_) => Some(Box::new(AgentSharing::default())),
            None => None,
        };
        let options = Options { log: vec![Box::new(log.clone())], sharing, ..Options::default() };
        let mut agent = Agent::load_with(&database, &modules::plugins(), options).unwrap();
        let surface = Arc::new(ControlSurface::new(&agent).unwrap());
        let stopper = agent.stopper();
        let thread = std::thread::spawn(move || {
            agent.run(Box::new(|_| Control::Continue)).unwrap();
        });
        let thread = Some(thread);
        Self { network: None, surface, configuration: database.current(), log, stopper, thread }
    }

    /// Connects it.
    pub fn connect(&mut self) -> Result<(), NetworkError> {
        slate_network::log_rejections();
        let settings = NetworkSettings::of(&self.configuration).unwrap().unwrap();
        self.network = Some(AgentNetwork::start(&self.surface, &settings)?);
        Ok(())
    }

    pub fn network(&self) -> &AgentNetwork {
        self.network.as_ref().unwrap()
    }

    /// A number on the board; NaN without one.
    pub fn number(&self, path: &str) -> f64 {
        let found = self.surface.board().read(path).unwrap();
        found.and_then(|(value, _): (Value, _)| value.as_f64()).unwrap_or(f64::NAN)
    }

    pub fn has_logged(&self, word: &str) -> bool {
        self.log.lines().iter().any(|line| line.to_string().contains(word))
    }
}

impl Drop for Running {
    fn drop(&mut self) {
        self.network = None;
        self.stopper.stop();
        let ended = self.thread.take().map(JoinHandle::join);
        assert!(std::thread::panicking() || ended.is_none_or(|ended| ended.is_ok()));
    }
}

/// Why an agent does not start.
pub fn refused(configuration: &str) -> String {
    let sources = Sources { extra_tables: vec![slate_network::TABLE.into()], ..Sources::default() };
    let database = Database::from_text("test.toml", configuration, sources).unwrap();
    match Agent::load_with(&database, &modules::plugins(), Options::default()) {
        Ok(_) => panic!("it should be refused"),
        Err(error) => format!("{error}"),
    }
}

/// Free ports.
pub fn ports<const N: usize>() -> [u16; N] {
    let listeners = [(); N].map(|()| TcpListener::bind("127.0.0.1:0").unwrap());
    listeners.map(|listener| listener.local_addr().unwrap().port())
}

/// Waits until something holds.
pub fn eventually(what: &str, mut holds: impl FnMut() -> bool) {
    let start = Instant::now();
    while !holds() {
        assert!(start.elapsed() < TIMEOUT, "waited in vain for: {what}");
        std::thread::sleep(Duration::from_millis(10));
    }
}

/// A program of Zenoh that is not an agent, at ports for TCP.
pub fn session(mode: &str, listen: &[u16], connect: &[u16]) -> Session {
    let texts = |ports: &[u16]| ports.iter().map(|port| format!("tcp/127.0.0.1:{port}")).collect::<Vec<_>>();
    session_with(mode, &texts(listen), &texts(connect), &[])
}

/// A program of Zenoh that is not an agent, at endpoints, with more entries of Zenoh's configuration.
pub fn session_with(
    mode: &str,
    listen: &[String],
    connect: &[String],
    more: &[(&'static str, Json)],
) -> Session {
    let mut config = Config::default();
    let retry =
        serde_json::json!({ "period_init_ms": 100, "period_max_ms": 500, "period_increase_factor": 1.5 });
    let entries = [
        ("mode", mode.into()),
        ("listen/endpoints", listen.into()),
        ("connect/endpoints", connect.into()),
        ("connect/retry", retry),
        ("scouting/multicast/enabled", false.into()),
    ];
    for (path, value) in entries.iter().chain(more) {
        let value = value.to_string();
        config.insert_json5(path, &value).unwrap();
    }
    zenoh::open(config).wait().unwrap()
}

/// The replies to a query, a payload with its encoding being one that changes something.
pub fn ask(
    session: &Session,
    key: &str,
    payload: Option<(&[u8], &str)>,
) -> Vec<Result<zenoh::sample::Sample, Json>> {
    let get = session.get(key).timeout(Duration::from_secs(5));
    let get = match payload {
        Some((bytes, encoding)) => get.payload(bytes).encoding(encoding),
        None => get,
    };
    let replies = get.wait().unwrap();
    replies
        .iter()
        .map(|reply: Reply| reply.into_result().map_err(|error| json(&error.payload().to_bytes())))
        .collect()
}

pub fn json(bytes: &[u8]) -> Json {
    serde_json::from_slice(bytes)
        .unwrap_or_else(|error| panic!("{error}: {}", String::from_utf8_lossy(bytes)))
}

/// The JSON of the one reply.
pub fn ask_json(session: &Session, key: &str, payload: Option<(&[u8], &str)>) -> Result<Json, Json> {
    let mut replies = ask(session, key, payload);
    assert_eq!(replies.len(), 1, "{key}: {replies:?}");
    replies.remove(0).map(|sample| json(&sample.payload().to_bytes()))
}

/// Waits until an agent answers.
pub fn wait_for_agent(session: &Session, name: &str) {
    eventually("the agent", || ask(session, &slate_network::tree_key(name), None).iter().any(Result::is_ok));
}
