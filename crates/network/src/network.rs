//! Agent on its network.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread::{Builder, JoinHandle};
use std::time::{Duration, Instant};

use slate_blackboard::wake::Wake;
use slate_control::ControlSurface;
use slate_module::Level;
use zenoh::liveliness::LivelinessToken;
use zenoh::pubsub::Subscriber;
use zenoh::query::Queryable;
use zenoh::sample::{Sample, SampleKind};
use zenoh::session::LinkEventsListener;
use zenoh::{Session, Wait};

use crate::check::check_properties;
use crate::duplicate_name::DuplicateNameCheck;
use crate::error::NetworkError;
use crate::key::{
    InputSource, alive_agent, alive_key, property_key, read_key, schema_key, set_key, tree_key, tree_key_of,
};
use crate::links::{self, LinkWatch};
use crate::messages::InboxMessages;
use crate::publishing::Publishing;
use crate::reading::{InputReader, InputReaders, ReadingStatus};
use crate::rejections;
use crate::requests::QueryThread;
use crate::session;
use crate::settings::NetworkSettings;
use crate::shared::{NetworkShared, locked, refused};
use crate::streams::Streams;
use crate::subscriber::InputSubscriber;
use crate::team::NetworkTeam;

/// Period at which changes without a notice are polled.
const POLL_PERIOD: Duration = Duration::from_millis(500);

/// Period below which consecutive cycles are handled together, ns.
/// After each pass, the thread sleeps.
const FAST_PERIOD: u64 = 500_000;
const FAST_PAUSE: Duration = Duration::from_millis(1);

/// Period at which the end of a thread is polled.
const JOIN_POLL_PERIOD: Duration = Duration::from_millis(2);

/// Timeout for an agent's answer to a query for its newest value.
const ANSWER_TIMEOUT: Duration = Duration::from_secs(2);

/// Participation of an agent in a network of Zenoh, until dropped.
/// Others read its properties, and set those that they may; its inputs read theirs. All of it runs in threads of its
/// own: no tick waits for the network.
pub struct AgentNetwork {
    shared: Arc<NetworkShared>,
    readers: Arc<InputReaders>,
    requests: QueryThread,
    threads: Vec<JoinHandle<()>>,
    declared: Option<Declared>,
}

/// Declarations by which others see the agent; its token is dropped first.
struct Declared {
    _token: LivelinessToken,
    _team: Option<NetworkTeam>,
    _links: Option<LinkEventsListener<()>>,
    _agents: Subscriber<()>,
    _inputs: Vec<InputSubscriber>,
    _queryables: Vec<Queryable<()>>,
}

impl std::fmt::Debug for AgentNetwork {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("AgentNetwork").field("agent", &self.shared.board().agent()).finish_non_exhaustive()
    }
}

impl AgentNetwork {
    /// Connects an agent.
    ///
    /// # Errors
    /// When a session can't be opened, or an input can't read. The agent is as before then.
    pub fn start(surface: &Arc<ControlSurface>, settings: &NetworkSettings) -> Result<Self, NetworkError> {
        let composer = surface.agent.composer();
        check_properties(composer, settings)?;
        let agent = composer.board().agent();
        let security = settings.security.as_ref();
        let credentials = security.map(|security| links::load(agent, security)).transpose()?;
        let session = session::open(agent, settings)?;
        let wake = Arc::new(Wake::new());
        let readers = Arc::new(InputReaders::new(surface, settings, &wake));
        let shared = Arc::new(NetworkShared {
            surface: Arc::clone(surface),
            settings: settings.clone(),
            session,
            wake: Arc::clone(&wake),
            ended: AtomicBool::new(false),
            agents: std::sync::Mutex::default(),
            strangers: std::sync::Mutex::default(),
            wanted: std::sync::Mutex::default(),
            streams: std::sync::Mutex::default(),
            rejections: std::sync::Mutex::default(),
        });
        rejections::add(&shared);
        let mut publishing = Publishing::new(Arc::clone(&shared))?;
        let requests = QueryThread::start(Arc::clone(&shared))?;
        let declared = declare(&shared, &readers, &requests)?;
        if !composer.after_tick(Box::new(move || wake.notify(1))) {
            let text = format!(
                "values are looked at every {} ms only, as the agent was connected often before",
                POLL_PERIOD.as_millis()
            );
            shared.log(Level::Warn, &text);
        }
        let (own, inputs) = (Arc::clone(&shared), Arc::clone(&readers));
        let mut duplicate = DuplicateNameCheck::new(Arc::clone(&shared));
        let mut streams = Streams::new(Arc::clone(&shared));
        let mut watch = LinkWatch::new(Arc::clone(&shared), credentials);
        let mut last = 0;
        let thread = Builder::new().name("network".into()).spawn(move || {
            while !own.ended.load(Ordering::Acquire) {
                publishing.follow();
                publishing.send();
                let mut pause = streams.step(POLL_PERIOD);
                let now = own.surface.agent.composer().steady_now();
                for reader in &inputs.readers {
                    query_newest(&own.session, reader, now);
                    let missing = reader.recovery().and_then(|recovery| recovery.query_missing(&own.session));
                    pause = missing.map_or(pause, |next| pause.min(Duration::from_nanos(next)));
                    if let Some(next) = reader.release(now) {
                        pause = pause.min(Duration::from_nanos(next.saturating_sub(now)));
                    }
                }
                duplicate.check();
                watch.check();
                let is_fast = now.saturating_sub(std::mem::replace(&mut last, now)) < FAST_PERIOD;
                if is_fast {
                    // Wake-ups are skipped during the rest: one takes longer than the cycle itself.
                    std::thread::sleep(FAST_PAUSE);
                }
                own.wake.wait_timeout(pause);
            }
        })?;
        let mut threads = vec![thread];
        if readers.delivery.is_some() {
            let own = Arc::clone(&readers);
            threads.push(Builder::new().name("network-set".into()).spawn(move || own.deliver())?);
        }
        for reader in readers.readers.iter().filter(|reader| reader.inbox().is_some()) {
            let own = Arc::clone(reader);
            threads.push(Builder::new().name("network-send".into()).spawn(move || own.send_messages())?);
        }
        Ok(Self { shared, readers, requests, threads, declared: Some(declared) })
    }

    /// Returns the agents that are on the network now, including this one.
    pub fn agents(&self) -> Vec<String> {
        let mut agents = locked(&self.shared.agents).clone();
        // A client without its router does not see itself.
        agents.insert(self.shared.board().agent().to_owned());
        agents.into_iter().collect()
    }

    /// Returns the status of the inputs that read from the network, by path.
    pub fn readings(&self) -> Vec<ReadingStatus> {
        self.readers.readers.iter().map(|reader| reader.status()).collect()
    }
}

impl Drop for AgentNetwork {
    fn drop(&mut self) {
        self.declared = None;
        self.requests.end();
        self.shared.ended.store(true, Ordering::Release);
        self.shared.wake.notify(1);
        if let Some(delivery) = &self.readers.delivery {
            delivery.end();
        }
        self.readers.readers.iter().filter_map(|reader| reader.inbox()).for_each(InboxMessages::end);
        join(self.threads.drain(..));
        session::close(&self.shared.session, &self.shared.settings);
    }
}

/// Waits for threads, but not for one that waits for a cycle which does not end.
#[allow(clippy::disallowed_methods, reason = "threads end by the machine's clock")]
fn join(threads: impl Iterator<Item = JoinHandle<()>>) {
    let began = Instant::now();
    for thread in threads {
        while !thread.is_finished() && began.elapsed() < ANSWER_TIMEOUT {
            std::thread::sleep(JOIN_POLL_PERIOD);
        }
        if thread.is_finished() {
            // A thread that panicked has ended, too.
            let _ = thread.join();
        }
    }
}

fn declare(
    shared: &Arc<NetworkShared>,
    readers: &Arc<InputReaders>,
    requests: &QueryThread,
) -> Result<Declared, NetworkError> {
    let session = &shared.session;
    let agent = shared.board().agent();
    let own = [
        property_key(agent, "**"),
        set_key(agent, "**"),
        read_key(agent, "*", "**"),
        alive_key(agent),
        tree_key(agent),
        tree_key_of(agent, "*"),
        schema_key(agent, "*"),
    ];
    let outputs = shared.settings.write.iter().map(|output| output.key.clone());
    let keys: Vec<_> = own.into_iter().chain(outputs).collect();
    let queryable = |key: &String| session.declare_queryable(key).callback(requests.handler()).wait();
    let queryables = keys.iter().map(queryable).collect::<Result<_, _>>().map_err(refused)?;
    let mut inputs = Vec::new();
    for reader in &readers.readers {
        inputs.push(InputSubscriber::new(session, reader, &shared.wake)?);
    }
    let (known, read) = (Arc::clone(shared), Arc::clone(readers));
    let agents = session
        .liveliness()
        .declare_subscriber(alive_key("*"))
        .history(true)
        .callback(move |sample| note_agent(&known, &read, &sample))
        .wait()
        .map_err(refused)?;
    let links = links::log_strangers(shared)?;
    let team = NetworkTeam::start(shared)?;
    // The token comes last: peers query the rest as soon as it appears.
    let token = session.liveliness().declare_token(alive_key(agent)).wait().map_err(refused)?;
    Ok(Declared {
        _token: token,
        _team: team,
        _links: links,
        _agents: agents,
        _inputs: inputs,
        _queryables: queryables,
    })
}

/// Updates the present agents when one appears or vanishes.
fn note_agent(shared: &NetworkShared, readers: &InputReaders, sample: &Sample) {
    let Some(agent) = alive_agent(sample.key_expr().as_str()) else { return };
    let is_present = sample.kind() == SampleKind::Put;
    let changed = match is_present {
        true => locked(&shared.agents).insert(agent.into()),
        false => locked(&shared.agents).remove(agent),
    };
    if changed && agent != shared.board().agent() {
        let state = if is_present { "is on the network" } else { "has left the network" };
        shared.log(Level::Info, &format!("agent `{agent}` {state}"));
    }
    if is_present {
        for reader in &readers.readers {
            if matches!(&reader.source, InputSource::Property { agent: other, .. } if other == agent) {
                reader.restart();
            }
        }
        shared.wake.notify(1);
    }
}

/// Requests the newest value of an input's source, if it may have been missed.
fn query_newest(session: &Session, reader: &Arc<InputReader>, now: u64) {
    if !reader.needs_query(now) {
        return;
    }
    let own = Arc::clone(reader);
    let take = move |reply: zenoh::query::Reply| {
        if let Ok(sample) = reply.result() {
            own.take(sample, true);
        }
    };
    // If the query fails, the next write brings the value.
    let _ = session.get(reader.key()).timeout(ANSWER_TIMEOUT).callback(take).wait();
}
