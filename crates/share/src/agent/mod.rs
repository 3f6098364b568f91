//! Sharing for an agent of the runtime.
//! Links to other agents become subscriptions and messages.
//!
//! ```
//! use slate_runtime::Options;
//! use slate_share::agent::AgentSharing;
//!
//! let options = Options { sharing: Some(Box::new(AgentSharing::default())), ..Options::default() };
//! ```

mod bridge;
mod inspector;
mod outbox;
mod reading;
mod subscriptions;

use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex};
use std::thread::JoinHandle;
use std::time::{SystemTime, UNIX_EPOCH};

use slate_blackboard::wake::Wake;
use slate_module::Level;
use slate_runtime::configuration::{Configuration, Report};
use slate_runtime::sharing::{
    About, Inspection, RemoteDemand, RemotePath, Sharing, SharingError, Site, TEAM, TeamExchange,
};
use slate_sorted::{SortedMap, SortedSet};

use crate::carrier::{Carrier, CarrierError};
use crate::peers::{KnownCarriers, Notice, PeerEvent, Peers, Rights, Setup, lock};
use crate::session::{Identity, Limits};
use crate::team::{Team, TeamEvent, TeamInbox, TeamRoute};
use bridge::Bridge;
use inspector::Inspector;

/// Requested properties and mailboxes, by their paths.
type Demands = SortedMap<RemotePath, RemoteDemand>;

/// Check that returns a warning about conditions that will prevent links.
type Warning = Box<dyn Fn() -> Option<String> + Send>;

/// Sharing for an agent, as one of its options.
#[derive(Default)]
pub struct AgentSharing {
    /// Limits of a session.
    pub limits: Limits,
    /// Carriers in addition to `local`, by the prefix of their endpoints.
    pub carriers: SortedMap<String, Arc<dyn Carrier>>,
    running: Option<RunningSharing>,
    inspector: Option<Arc<Inspector>>,
    inbox: Option<Arc<TeamInbox>>,
}

type Carriers = SortedMap<String, Arc<dyn Carrier>>;

/// Running thread of the bridge, and the team.
struct RunningSharing {
    requests: Arc<SharingRequests>,
    thread: Option<JoinHandle<()>>,
    team: Option<Team>,
}

/// Requests to the thread.
struct SharingRequests {
    wake: Arc<Wake>,
    demands: Mutex<Option<Demands>>,
    ended: AtomicBool,
}

/// Wake bit of new values or messages.
const UPDATE_BIT: u64 = 1;
/// Wake bit of every other event.
const CHANGE_BIT: u64 = 2;

impl std::fmt::Debug for AgentSharing {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("AgentSharing").field("limits", &self.limits).finish_non_exhaustive()
    }
}

impl Sharing for AgentSharing {
    fn start(&mut self, site: Site) -> Result<(), SharingError> {
        let inbox = site.knowledge.as_ref().map(|_| Arc::new(TeamInbox::default()));
        let notice = notice(&site, inbox.clone());
        let instance = instance();
        let (carriers, warning) = self.carriers(&site)?;
        let identity = Identity { agent: site.board.agent().into(), instance };
        let setup = Setup {
            limits: self.limits,
            listen: site.listen.clone(),
            rights: rights(&site),
            carriers,
            poll: None,
            time: Some(Arc::clone(&site.time)),
            updated: Some(Arc::clone(&site.wake)),
            notice: Some(notice),
            ..Setup::new(identity, Arc::clone(&site.steady))
        };
        let peers = Peers::start(&site.board, setup).map_err(|error| SharingError {
            message: error.to_string(),
            help: help(&error),
            about: About::Listen(error.endpoint().into()),
        })?;
        check_agents(&peers, &site)?;
        let peers = Arc::new(peers);
        self.inbox.clone_from(&inbox);
        self.inspector = Some(Arc::new(Inspector::new(&peers, site.agents.clone())));
        let notifier = peers.notifier();
        site.host.after_tick(Box::new(move || notifier.notify()));
        let requests = Arc::new(SharingRequests {
            wake: Arc::clone(&site.wake),
            demands: Mutex::default(),
            ended: AtomicBool::new(false),
        });
        // Mixed, as two starts may be close to each other.
        let random = xxhash_rust::xxh3::xxh3_64(&instance.to_le_bytes()) as u32;
        let team = site
            .knowledge
            .clone()
            .zip(inbox)
            .map(|(knowledge, inbox)| Team::start(&site, knowledge, Arc::clone(&peers), inbox, random));
        let team = team.transpose()?;
        let mut bridge = Bridge::new(peers, site, warning);
        let mail = Arc::clone(&requests);
        let thread = std::thread::Builder::new().name("sharing".into()).spawn(move || bridge.run(&mail));
        let thread = Some(thread.map_err(|error| format!("a thread can't be started: {error}"))?);
        self.running = Some(RunningSharing { requests, thread, team });
        Ok(())
    }

    fn set_demands(&mut self, demands: Demands) {
        if let Some(running) = &self.running {
            let (of_team, demands): (Demands, Demands) =
                demands.into_iter().partition(|(path, _)| path.agent == TEAM);
            if let Some(team) = &running.team {
                let topic = |(path, demand): (RemotePath, RemoteDemand)| match demand {
                    RemoteDemand::Values { interface, .. } => {
                        Some((path.path, interface.map(|found| found.0)))
                    }
                    RemoteDemand::Messages => None,
                };
                team.set_topics(of_team.into_iter().filter_map(topic).collect());
            }
            *lock(&running.requests.demands) = Some(demands);
            running.requests.wake.notify(CHANGE_BIT);
        }
    }

    fn carriers(&self) -> SortedSet<String> {
        let built_in = ["local"].into_iter();
        let built_in = built_in.chain(cfg!(feature = "tls").then_some("tls"));
        self.carriers.keys().cloned().chain(built_in.map(Into::into)).collect()
    }

    fn has_jpeg(&self) -> bool {
        cfg!(feature = "jpeg")
    }

    fn team(&self) -> Option<Arc<dyn TeamExchange>> {
        self.inbox.clone().map(|inbox| inbox as Arc<dyn TeamExchange>)
    }

    fn inspection(&self) -> Option<Arc<dyn Inspection>> {
        Some(Arc::clone(self.inspector.as_ref()?) as Arc<dyn Inspection>)
    }
}

impl AgentSharing {
    /// Checks that the endpoints of a configuration can be listened at and dialed.
    /// It covers errors that are known beforehand: it opens nothing and reads no certificate.
    ///
    /// # Errors
    /// The first endpoint that can't.
    pub fn check(&self, configuration: &Configuration) -> Result<(), Report> {
        let Some(share) = configuration.share() else { return Ok(()) };
        let carriers = KnownCarriers::new(self.carriers.clone());
        let has_certificate = share.security.as_ref().is_some_and(|security| security.credentials.is_some());
        let check = |endpoint: &str| {
            let carrier = carriers.of(endpoint)?;
            match has_certificate && endpoint.starts_with("tls:") {
                true => Ok(()),
                false => carrier.check(endpoint),
            }
        };
        let listen = share.listen.iter().map(|at| (About::Listen(at.value.clone()), &at.value));
        let agents = share.agents.iter().map(|(agent, at)| (About::Agent(agent.clone()), &at.value));
        for (about, endpoint) in listen.chain(agents) {
            let refused =
                |error: CarrierError| SharingError { message: error.to_string(), help: help(&error), about };
            check(endpoint).map_err(refused).map_err(|error| error.report(configuration))?;
        }
        Ok(())
    }

    /// Returns the carriers; TLS uses the agent's certificate.
    fn carriers(&self, site: &Site) -> Result<(Carriers, Option<Warning>), SharingError> {
        #[cfg_attr(not(feature = "tls"), allow(unused_mut, reason = "nothing else adds to them"))]
        let (mut carriers, mut warning) = (self.carriers.clone(), None);
        let security = site.security.as_ref();
        if let Some(files) = security.and_then(|security| security.credentials.as_ref()) {
            #[cfg(feature = "tls")]
            if !carriers.contains_key("tls") {
                use crate::carrier::tls::{Credentials, Files, Tls};
                let files =
                    Files { certificate: &files.certificate, key: &files.key, authority: &files.authority };
                let credentials = Credentials::load(files, site.board.agent())?;
                // Otherwise every agent that the authority has signed could read and command everything.
                if !rights(site).is_restricted() {
                    return Err(SharingError {
                        message: "[share.security] has this agent's identity, but no rights of others".into(),
                        help: Some(
                            "add [share.security.allow.NAME] with `read` and `send` for each permitted agent; \
                             all others are refused"
                                .into(),
                        ),
                        about: About::Security,
                    });
                }
                let watched = credentials.clone();
                warning = Some(Box::new(move || watched.warning()) as Warning);
                let tls = Tls::new(credentials, rights(site).is_restricted());
                carriers.insert("tls".into(), Arc::new(tls));
            }
            #[cfg(not(feature = "tls"))]
            return Err(SharingError {
                message: format!(
                    "this program was built without TLS, so nothing uses the certificate {}",
                    files.certificate.display()
                ),
                help: Some("build it with the feature `tls`: cargo build --release --features tls".into()),
                about: About::Certificate,
            });
        }
        Ok((carriers, warning))
    }
}

/// Returns the callback for events of other agents.
/// It informs the log, the team and the thread.
fn notice(site: &Site, inbox: Option<Arc<TeamInbox>>) -> Notice {
    let (wake, host, rights) = (Arc::clone(&site.wake), site.host.clone(), rights(site));
    Arc::new(move |agent, happening| {
        if let Some(inbox) = &inbox {
            match happening {
                PeerEvent::Connected { .. } if rights.has_team(agent) => {
                    inbox.put(TeamEvent::Connected(agent.into(), TeamRoute::Session));
                }
                PeerEvent::Disconnected { .. } => {
                    inbox.put(TeamEvent::Disconnected(agent.into(), TeamRoute::Session));
                }
                PeerEvent::Knowledge { bytes } => inbox.put(TeamEvent::Message(agent.into(), bytes.clone())),
                _ => {}
            }
        }
        match happening {
            PeerEvent::Knowledge { .. } => return,
            PeerEvent::Rejected { reason } => {
                return host.log(Level::Warn, &format!("rejected: {reason}"));
            }
            PeerEvent::Connected { .. } => {
                host.log(Level::Info, &format!("agent `{agent}` is connected"));
            }
            PeerEvent::Disconnected { reason } => {
                host.log(Level::Info, &format!("agent `{agent}` is lost: {reason}"));
            }
            _ => {}
        }
        wake.notify(CHANGE_BIT);
    })
}

/// Checks that the other agents can be dialed, without a connection.
fn check_agents(peers: &Peers, site: &Site) -> Result<(), SharingError> {
    for (agent, endpoint) in &site.agents {
        peers.check(endpoint).map_err(|error| SharingError {
            message: error.to_string(),
            help: None,
            about: About::Agent(agent.clone()),
        })?;
    }
    Ok(())
}

/// Returns the access rights of other agents.
fn rights(site: &Site) -> Rights {
    let allow = site.security.as_ref().and_then(|security| security.allow.clone());
    allow.map_or_else(Rights::default, Rights::restricted)
}

fn help(error: &CarrierError) -> Option<String> {
    matches!(error, CarrierError::InUse { .. })
        .then(|| "another agent may have that name, or the endpoint is in use".into())
}

impl Drop for RunningSharing {
    fn drop(&mut self) {
        self.team = None;
        self.requests.ended.store(true, Ordering::Release);
        self.requests.wake.notify(CHANGE_BIT);
        // One that panicked has ended, too.
        let _ = self.thread.take().map(JoinHandle::join);
    }
}

/// Returns a number unique to this start of the agent: the time of its start.
#[allow(clippy::disallowed_methods, reason = "no clock of the agent distinguishes two of its starts")]
fn instance() -> u64 {
    let since = SystemTime::now().duration_since(UNIX_EPOCH).unwrap_or_default();
    u64::try_from(since.as_nanos()).unwrap_or(u64::MAX) ^ u64::from(std::process::id())
}
