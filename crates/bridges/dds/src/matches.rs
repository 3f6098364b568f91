//! Matched and incompatible endpoints of an agent's topics.

use std::collections::{BTreeMap, BTreeSet};
use std::sync::{Mutex, MutexGuard, OnceLock, PoisonError};

use rustdds::policy::{Durability, Reliability, XCDR_DATA_REPRESENTATION, XCDR2_DATA_REPRESENTATION};
use rustdds::{DomainParticipantStatusEvent as Event, EndpointDescription, GUID, QosPolicies};
use slate_module::Level;
use slate_runtime::Composer;

use crate::settings::TABLE;

/// An endpoint of the agent.
pub struct OwnEndpoint {
    pub topic: String,
    pub type_name: String,
    pub has_key: bool,
    pub is_reader: bool,
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

    /// A topic of another type, or with a key here alone, is never matched, and nobody says so.
    fn note_type(
        &self,
        state: &mut MatchState,
        other: &EndpointDescription,
        writes: bool,
        composer: &Composer,
    ) {
        let same_topic = |own: &&OwnEndpoint| own.is_reader == writes && own.topic == other.topic_name;
        for own in self.own().map(|(_, own)| own).filter(same_topic) {
            let (who, there) = (role(writes), other.type_name.chars().take(120).collect::<String>());
            let text = if own.type_name != other.type_name {
                format!(
                    "{}: a {who} has type {there} and this agent {}, so they exchange nothing: give the topic that type",
                    own.topic, own.type_name
                )
            } else if own.has_key != has_key(other.guid) {
                let (there, here) = if own.has_key { ("no key", "one") } else { ("a key", "none") };
                format!(
                    "{}: {} has {there} in a {who} and {here} here, so they exchange nothing: write the same @key in both IDL files",
                    own.topic, own.type_name
                )
            } else {
                continue;
            };
            log_once(state, composer, other.guid, text);
        }
    }
}

/// Whether the topic of an endpoint has a key, which the kind of its entity tells.
fn has_key(endpoint: GUID) -> bool {
    let [.., kind] = endpoint.to_bytes();
    matches!(kind & 0x0f, 0x02 | 0x07)
}

/// Locks data that stays intact when another thread panics with the lock.
fn locked<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

fn role(writes: bool) -> &'static str {
    if writes { "writer" } else { "reader" }
}

fn log_once(state: &mut MatchState, composer: &Composer, other: GUID, text: String) {
    if state.logged.insert((other, text.clone())) {
        composer.log(Level::Warn, &format!("{TABLE}: {text}"));
    }
}

/// Which policy keeps two ends from each other, in the words of DDS.
fn incompatible(own: &OwnEndpoint, requested: &QosPolicies, offered: &QosPolicies) -> String {
    let (who, verb, effect) = match own.is_reader {
        true => ("writer", "offers", "nothing is received from it"),
        false => ("reader", "requests", "nothing is sent to it"),
    };
    let policy = offered.compliance_failure_wrt(requested).map(|policy| format!("{policy:?}"));
    let policy = policy.unwrap_or_else(|| "unknown".into()).to_uppercase();
    let [requested, offered] = [requested, offered].map(|qos| match policy.as_str() {
        "RELIABILITY" => reliability(qos).to_owned(),
        "DURABILITY" => durability(qos).to_owned(),
        "DEADLINE" => format!("{:?}", qos.deadline()),
        "LIVELINESS" => format!("{:?}", qos.liveliness()),
        "REPRESENTATION" => representations(qos),
        _ => "another".to_owned(),
    });
    let help = match (policy.as_str(), own.is_reader) {
        ("RELIABILITY", true) => "; reliable = false reads it",
        ("RELIABILITY", false) => "; take reliable = false away",
        ("DURABILITY", true) => "; take transient_local = true away",
        ("DURABILITY", false) => "; transient_local = true offers it",
        ("REPRESENTATION", false) => "; representation says which is written",
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

/// None is the first version.
fn representations(qos: &QosPolicies) -> String {
    let listed = qos.data_representation().map(|own| own.value).unwrap_or_default();
    let names = listed.iter().map(|own| match *own {
        XCDR_DATA_REPRESENTATION => "XCDR1".to_owned(),
        XCDR2_DATA_REPRESENTATION => "XCDR2".to_owned(),
        other => other.to_string(),
    });
    let names: Vec<_> = names.collect();
    if names.is_empty() { "XCDR1".into() } else { names.join(" or ") }
}
