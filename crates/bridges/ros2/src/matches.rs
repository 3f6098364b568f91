//! Matched and incompatible endpoints of an agent's topics.

use std::collections::{BTreeMap, BTreeSet};
use std::sync::{Mutex, OnceLock};

use rustdds::policy::{Durability, Reliability};
use rustdds::{DomainParticipantStatusEvent as Event, EndpointDescription, GUID, QosPolicies};
use slate_module::Level;
use slate_runtime::Composer;

use crate::inbound::locked;
use crate::name::message_name;

/// An endpoint of the agent.
pub struct OwnEndpoint {
    /// As ROS calls it.
    pub topic: String,
    /// As DDS calls both.
    pub wire: (String, String),
    pub message: String,
    pub is_reader: bool,
    /// Hash of its type, if that is compared.
    pub type_hash: Option<String>,
}

/// The other ends of an agent's topics.
#[derive(Default)]
pub struct Matches {
    own: OnceLock<BTreeMap<GUID, OwnEndpoint>>,
    state: Mutex<MatchState>,
}

#[derive(Default)]
struct MatchState {
    /// By own endpoint.
    others: BTreeMap<GUID, BTreeSet<GUID>>,
    /// Texts that were logged.
    logged: BTreeSet<(GUID, String)>,
}

impl Matches {
    /// Sets the endpoints of the agent; once, before events are noted.
    pub fn set_own(&self, own: BTreeMap<GUID, OwnEndpoint>) {
        // Set only once.
        let _ = self.own.set(own);
    }

    fn own(&self) -> impl Iterator<Item = (&GUID, &OwnEndpoint)> {
        self.own.get().into_iter().flatten()
    }

    fn endpoint(&self, guid: &GUID) -> Option<&OwnEndpoint> {
        self.own.get()?.get(guid)
    }

    /// How many there are for an endpoint of the agent.
    pub fn count(&self, own: GUID) -> usize {
        locked(&self.state).others.get(&own).map_or(0, BTreeSet::len)
    }

    /// Whether another endpoint is the other end of one of the agent.
    pub fn has(&self, own: GUID, other: GUID) -> bool {
        locked(&self.state).others.get(&own).is_some_and(|others| others.contains(&other))
    }

    /// Takes note of what has happened in the domain, and logs what can't work.
    pub fn note(&self, event: &Event, composer: &Composer) {
        let mut state = locked(&self.state);
        match event {
            Event::RemoteReaderMatched { local_writer: own, remote_reader: other }
            | Event::RemoteWriterMatched { local_reader: own, remote_writer: other }
                if self.endpoint(own).is_some() =>
            {
                state.others.entry(*own).or_default().insert(*other);
            }
            Event::ReaderLost { guid, .. } | Event::WriterLost { guid, .. } => {
                for others in state.others.values_mut() {
                    others.remove(guid);
                }
                state.logged.retain(|(other, _)| other != guid);
            }
            Event::ParticipantLost { id, .. } => {
                let is_lost = |guid: &GUID| guid.prefix == *id;
                state.others.values_mut().for_each(|others| others.retain(|other| !is_lost(other)));
                state.logged.retain(|(other, _)| !is_lost(other));
            }
            Event::RemoteReaderQosIncompatible {
                local_writer: own,
                remote_reader: other,
                requested_qos,
                offered_qos,
            }
            | Event::RemoteWriterQosIncompatible {
                local_reader: own,
                remote_writer: other,
                requested_qos,
                offered_qos,
            } => {
                let Some(endpoint) = self.endpoint(own) else { return };
                let text = incompatible(endpoint, requested_qos, offered_qos);
                log_once(&mut state, composer, *other, text);
            }
            Event::ReaderDetected { reader: other } => self.note_type(&mut state, other, false, composer),
            Event::WriterDetected { writer: other } => self.note_type(&mut state, other, true, composer),
            _ => {}
        }
    }

    /// A topic of another type is never matched, and nobody says so; one of another definition is, but can't be read.
    fn note_type(
        &self,
        state: &mut MatchState,
        other: &EndpointDescription,
        writes: bool,
        composer: &Composer,
    ) {
        let same_topic = |own: &&OwnEndpoint| own.is_reader == writes && own.wire.0 == other.topic_name;
        let (who, theirs) = (role(writes), sent_type_hash(&other.user_data));
        for own in self.own().map(|(_, own)| own).filter(same_topic) {
            let (topic, message) = (&own.topic, &own.message);
            let text = match (&own.type_hash, &theirs) {
                _ if own.wire.1 != other.type_name => format!(
                    "{topic}: a {who} has type {} and this agent {message}, so they exchange nothing: use another topic or interface",
                    message_name(&other.type_name)
                ),
                (Some(ours), Some(theirs)) if ours != theirs => format!(
                    "{topic}: a {who} defines {message} otherwise (type hash {theirs}, here {ours}), so messages can't be read: give both the same .msg file"
                ),
                _ => continue,
            };
            log_once(state, composer, other.guid, text);
        }
    }
}

/// The type hash that an endpoint sends with its announcement, as `rmw` puts it there.
pub fn sent_type_hash(user_data: &[u8]) -> Option<String> {
    let text = String::from_utf8_lossy(user_data);
    let mut entries = text.split(';').filter_map(|entry| entry.trim_matches('\0').split_once('='));
    let (_, hash) = entries.find(|(key, _)| key.ends_with("typehash"))?;
    let is_hash = hash.len() < 100 && hash.bytes().all(|byte| byte.is_ascii_alphanumeric() || byte == b'_');
    is_hash.then(|| hash.to_owned())
}

fn role(writes: bool) -> &'static str {
    if writes { "publisher" } else { "subscription" }
}

fn log_once(state: &mut MatchState, composer: &Composer, other: GUID, text: String) {
    if state.logged.insert((other, text.clone())) {
        composer.log(Level::Warn, &format!("ros2: {text}"));
    }
}

/// Which policy keeps two ends from each other, in the words of ROS.
fn incompatible(own: &OwnEndpoint, requested: &QosPolicies, offered: &QosPolicies) -> String {
    let (who, verb, effect) = match own.is_reader {
        true => ("publisher", "offers", "nothing is received from it"),
        false => ("subscription", "requests", "nothing is sent to it"),
    };
    let policy = offered.compliance_failure_wrt(requested).map(|policy| format!("{policy:?}"));
    let policy = policy.unwrap_or_else(|| "unknown".into()).to_uppercase();
    let [requested, offered] = [requested, offered].map(|qos| match policy.as_str() {
        "RELIABILITY" => reliability(qos).to_owned(),
        "DURABILITY" => durability(qos).to_owned(),
        "DEADLINE" => format!("{:?}", qos.deadline()),
        "LIVELINESS" => format!("{:?}", qos.liveliness()),
        _ => "another".to_owned(),
    });
    let help = match (policy.as_str(), own.is_reader) {
        ("RELIABILITY", true) => "; reliable = false reads it",
        ("RELIABILITY", false) => "; take reliable = false away",
        ("DURABILITY", true) => "; take transient_local = true away",
        ("DURABILITY", false) => "; transient_local = true offers it",
        _ => "",
    };
    format!(
        "{}: a {who} {verb} incompatible QoS, so {effect}: {policy} (offered {offered}, requested {requested}){help}",
        own.topic
    )
}

fn reliability(qos: &QosPolicies) -> &'static str {
    match qos.reliability() {
        Some(Reliability::Reliable { .. }) => "RELIABLE",
        _ => "BEST_EFFORT",
    }
}

fn durability(qos: &QosPolicies) -> &'static str {
    match qos.durability() {
        Some(Durability::TransientLocal) => "TRANSIENT_LOCAL",
        Some(Durability::Transient) => "TRANSIENT",
        Some(Durability::Persistent) => "PERSISTENT",
        _ => "VOLATILE",
    }
}
