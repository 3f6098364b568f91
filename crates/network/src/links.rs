//! Peers at the other end of links with certificates.

use std::sync::Arc;
use std::time::Duration;

use slate_module::Level;
use slate_share::carrier::tls::{Credentials, Files};
use zenoh::Wait;
use zenoh::sample::SampleKind;
use zenoh::session::{LinkEvent, LinkEventsListener};

use crate::error::NetworkError;
use crate::settings::NetworkSecurity;
use crate::shared::{NetworkShared, locked, refused};

/// Period of checks of the files and endpoints.
const CHECK_PERIOD: Duration = Duration::from_secs(60);

/// Time after which a link that was never established is logged.
const CONNECT_TIMEOUT: Duration = Duration::from_secs(5);

/// Number of strangers that are remembered, so that each is logged once.
const MAX_STRANGERS: usize = 64;

/// Reads the certificates of an agent.
///
/// # Errors
/// When a file is missing or invalid, the certificate is another agent's or not valid now, or others may read the key.
pub fn load(agent: &str, security: &NetworkSecurity) -> Result<Credentials, NetworkError> {
    use slate_runtime::sharing::About;
    let files = Files {
        certificate: &security.certificate.path,
        key: &security.key.path,
        authority: &security.authority.path,
    };
    Credentials::load(files, agent).map_err(|error| {
        let file = match error.about {
            About::Key => &security.key,
            About::Authority => &security.authority,
            _ => &security.certificate,
        };
        NetworkError::Security {
            reason: error.message,
            help: error.help.unwrap_or_default(),
            place: file.place,
        }
    })
}

/// Periodic check of the agent's own certificates and its endpoints.
/// It belongs to the network's thread.
pub struct LinkWatch {
    shared: Arc<NetworkShared>,
    credentials: Option<Credentials>,
    warning: Option<String>,
    /// Time of the next check of certificates and endpoints, ns.
    next: u64,
    deadline: Option<u64>,
}

impl LinkWatch {
    pub fn new(shared: Arc<NetworkShared>, credentials: Option<Credentials>) -> Self {
        let deadline = credentials.is_some().then(|| steady_now(&shared) + CONNECT_TIMEOUT.as_nanos() as u64);
        Self { shared, credentials, warning: None, next: 0, deadline }
    }

    /// Logs a certificate that expires soon, and endpoints that no link reaches.
    pub fn check(&mut self) {
        let Some(credentials) = &self.credentials else { return };
        let now = steady_now(&self.shared);
        if now >= self.next {
            self.next = now + CHECK_PERIOD.as_nanos() as u64;
            let warning = credentials.warning();
            if let Some(text) = warning.as_ref().filter(|_| self.warning.is_none()) {
                self.shared.log(Level::Warn, text);
            }
            self.warning = warning;
        }
        if self.deadline.is_some_and(|deadline| now >= deadline) {
            self.deadline = None;
            self.log_missing();
        }
    }

    fn log_missing(&self) {
        let links: Vec<_> = self.shared.session.info().links().wait().collect();
        let encrypted = self.shared.settings.connect.iter().filter(|endpoint| endpoint.is_encrypted());
        for endpoint in encrypted {
            let is_reached =
                |link: &zenoh::session::Link| link.dst().address().as_str() == endpoint.address();
            if !links.iter().any(is_reached) {
                let text = format!(
                    "no link to `{endpoint}`: no agent listens there, or one end refuses the other's certificate; both need one \
                     of the same authority that has not expired; the connection is retried"
                );
                self.shared.log(Level::Warn, &text);
            }
        }
    }
}

fn steady_now(shared: &NetworkShared) -> u64 {
    shared.surface.agent.composer().steady_now()
}

/// Logs the names that certificates prove, and strangers without rights.
pub fn log_strangers(shared: &Arc<NetworkShared>) -> Result<Option<LinkEventsListener<()>>, NetworkError> {
    if shared.settings.security.is_none() {
        return Ok(None);
    }
    let known = Arc::clone(shared);
    let listener = shared
        .session
        .info()
        .link_events_listener()
        .history(true)
        .callback(move |event| log_stranger(&known, &event))
        .wait()
        .map_err(refused)?;
    Ok(Some(listener))
}

fn log_stranger(shared: &NetworkShared, event: &LinkEvent) {
    let Some(security) = &shared.settings.security else { return };
    let link = event.link();
    let is_encrypted = link.dst().protocol().as_str() == "quic";
    if !is_encrypted || event.kind() != SampleKind::Put {
        return;
    }
    let name = link.auth_identifier();
    if name.is_some_and(|name| security.allow.contains_key(name)) {
        return;
    }
    let subject = match name {
        Some(name) => format!("agent `{}` is", slate_runtime::printable_text(name)),
        None => "a certificate without a common name is".into(),
    };
    let mut strangers = locked(&shared.strangers);
    if strangers.len() < MAX_STRANGERS && strangers.insert(subject.clone()) {
        let text = format!(
            "rejected: {}: {subject} not in [network.security.allow], and may do nothing",
            link.dst().address()
        );
        shared.log(Level::Warn, &text);
    }
}
