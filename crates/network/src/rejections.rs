//! Log of refused links.
//! Zenoh reports the reasons to `tracing` alone.

use std::fmt::Debug;
use std::sync::{Arc, Mutex, Weak};

use slate_module::Level;
use tracing::field::{Field, Visit};
use tracing::level_filters::LevelFilter;
use tracing::span::{Attributes, Id, Record};
use tracing::subscriber::Interest;
use tracing::{Event, Metadata, Subscriber};

use crate::shared::{NetworkShared, locked};

/// `tracing` targets of Zenoh with refused peers and failed links.
const TARGETS: [&str; 2] = ["zenoh_link_commons::quic::unicast", "zenoh::net::runtime::orchestrator"];

/// Period after which the same text is logged again, ns, and the number of texts.
/// At most so many are logged in the meantime.
const REPEAT_LIMIT: (u64, usize) = (60_000_000_000, 16);

/// Agents with certificates in this process.
static AGENTS: Mutex<Vec<Weak<NetworkShared>>> = Mutex::new(Vec::new());

/// Logs why certificates were refused, at both ends of a link.
/// Zenoh reports it to `tracing` alone, so this becomes the subscriber of the process. A process that has one already
/// keeps it.
pub fn log_rejections() {
    // The process may have this subscriber already.
    let _ = tracing::subscriber::set_global_default(RejectionSubscriber);
}

/// Lets an agent log them.
pub fn add(shared: &Arc<NetworkShared>) {
    if shared.settings.security.is_some() {
        let mut agents = locked(&AGENTS);
        agents.retain(|agent| agent.strong_count() > 0);
        agents.push(Arc::downgrade(shared));
    }
}

/// Subscriber of `tracing` that takes only the events of [`TARGETS`].
struct RejectionSubscriber;

impl Subscriber for RejectionSubscriber {
    fn register_callsite(&self, metadata: &'static Metadata<'static>) -> Interest {
        if self.enabled(metadata) { Interest::always() } else { Interest::never() }
    }

    fn max_level_hint(&self) -> Option<LevelFilter> {
        Some(LevelFilter::DEBUG)
    }

    fn enabled(&self, metadata: &Metadata<'_>) -> bool {
        metadata.is_event() && TARGETS.contains(&metadata.target())
    }

    fn event(&self, event: &Event<'_>) {
        let mut message = EventText(String::new());
        event.record(&mut message);
        if let Some(text) = rejection(&message.0) {
            let agents: Vec<_> = locked(&AGENTS).iter().filter_map(Weak::upgrade).collect();
            agents.iter().for_each(|agent| log_once(agent, &text));
        }
    }

    fn new_span(&self, _: &Attributes<'_>) -> Id {
        Id::from_u64(1)
    }

    fn record(&self, _: &Id, _: &Record<'_>) {}

    fn record_follows_from(&self, _: &Id, _: &Id) {}

    fn enter(&self, _: &Id) {}

    fn exit(&self, _: &Id) {}
}

struct EventText(String);

impl Visit for EventText {
    fn record_debug(&mut self, field: &Field, value: &dyn Debug) {
        if field.name() == "message" {
            self.0 = format!("{value:?}");
        }
    }
}

/// Returns the log text of a Zenoh message; `None` unless about certificates.
fn rejection(message: &str) -> Option<String> {
    if message.contains("QUIC acceptor failed") {
        return Some(format!("rejected: {}", reason(message)?));
    }
    let endpoint = message.strip_prefix("Unable to connect to configured peer ")?.split(['!', '?']).next()?;
    Some(format!("no link to `{endpoint}`: {}", reason(message)?))
}

fn reason(message: &str) -> Option<String> {
    let known = [
        ("peer sent no certificates", "the peer shows no certificate"),
        ("expired", "the certificate there has expired"),
        ("not valid yet", "the certificate there is not valid yet"),
        ("UnknownIssuer", "the certificate there was not signed by the authority"),
        ("BadSignature", "the certificate there was not signed by the authority"),
        ("invalid peer certificate", "the certificate there is not valid"),
        ("QUIC acceptor failed: TimedOut", "a handshake went no further, and kept new links out"),
    ];
    known.iter().find(|(words, _)| message.contains(words)).map(|(_, text)| (*text).to_owned())
}

fn log_once(shared: &NetworkShared, text: &str) {
    let now = shared.surface.agent.composer().steady_now();
    let (again, most) = REPEAT_LIMIT;
    let mut logged = locked(&shared.rejections);
    logged.retain(|_, time| now.saturating_sub(*time) < again);
    if logged.len() < most && !logged.contains_key(text) {
        logged.insert(text.to_owned(), now);
        drop(logged);
        shared.log(Level::Warn, text);
    }
}
