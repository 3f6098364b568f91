//! Matched and incompatible endpoints of an agent's topics.

use std::sync::{Mutex, MutexGuard, OnceLock, PoisonError};

use rustdds::policy::{Durability, Reliability, XCDR_DATA_REPRESENTATION, XCDR2_DATA_REPRESENTATION};
use rustdds::{DomainParticipantStatusEvent as Event, EndpointDescription, GUID, QosPolicies};
use slate_module::Level;
use slate_runtime::Composer;
use slate_sorted::{SortedMap, SortedSet};

/// Endpoint of the agent.
#[derive(Debug)]
pub struct OwnEndpoint {
    /// Topic's name for its users.
    pub topic: String,
    /// Topic and type as DDS calls them.
    pub wire: (String, String),
    /// Type's name for its users.
    pub message: String,
    /// Direction: true for a reader.
    pub is_reader: bool,
    /// Hash of its type, if that is compared.
    pub type_hash: Option<String>,
}

/// Terms of a middleware on DDS.
#[derive(Clone, Copy, Debug)]
pub struct MatchWords {
    /// Scheme of the bridge, for the log.
    pub scheme: &'static str,
    /// Words for the writing and the reading end.
    pub roles: [&'static str; 2],
    /// Conversion of a DDS type to the middleware's name of it.
    pub message_name: fn(&str) -> String,
    /// Advice for two ends of different types.
    pub help: &'static str,
}

/// Matched endpoints of an agent's topics.
#[derive(Debug)]
pub struct Matches {
    words: MatchWords,
    own: OnceLock<SortedMap<GUID, OwnEndpoint>>,
    state: Mutex<MatchState>,
}

#[derive(Debug, Default)]
struct MatchState {
    /// Matched endpoints by own endpoint.
    others: SortedMap<GUID, SortedSet<GUID>>,
    /// Texts that were logged.
    logged: SortedSet<(GUID, String)>,
}

impl Matches {
    /// Creates an empty list with the words of a middleware.
    pub fn new(words: MatchWords) -> Self {
        Self { words, own: OnceLock::new(), state: Mutex::default() }
    }

    /// Sets the endpoints of the agent; once, before events are noted.
    pub fn set_own(&self, own: SortedMap<GUID, OwnEndpoint>) {
        // Set only once.
        let _ = self.own.set(own);
    }

    fn own(&self) -> impl Iterator<Item = (&GUID, &OwnEndpoint)> {
        self.own.get().into_iter().flatten()
    }

    fn endpoint(&self, guid: &GUID) -> Option<&OwnEndpoint> {
        self.own.get()?.get(guid)
    }

    /// Returns the number of matches of the agent's endpoint.
    pub fn count(&self, own: GUID) -> usize {
        locked(&self.state).others.get(&own).map_or(0, SortedSet::len)
    }

    /// Returns whether two endpoints, one of them the agent's, are matched.
    pub fn has(&self, own: GUID, other: GUID) -> bool {
        locked(&self.state).others.get(&own).is_some_and(|others| others.contains(&other))
    }

    /// Reads the events of the domain, and logs endpoints that can't match.
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
                let text = self.incompatible(endpoint, requested_qos, offered_qos);
                self.log_once(&mut state, composer, *other, text);
            }
            Event::ReaderDetected { reader: other } => self.note_type(&mut state, other, false, composer),
            Event::WriterDetected { writer: other } => self.note_type(&mut state, other, true, composer),
            _ => {}
        }
    }

    /// Logs an endpoint whose topic type differs.
    /// A topic of another type, or with a key here alone, never matches, without a notice; one of another definition
    /// does, but can't be read.
    fn note_type(
        &self,
        state: &mut MatchState,
        other: &EndpointDescription,
        writes: bool,
        composer: &Composer,
    ) {
        let same_topic =
            |(_, own): &(&GUID, &OwnEndpoint)| own.is_reader == writes && own.wire.0 == other.topic_name;
        let hash = sent_type_hash(&other.user_data);
        for (guid, own) in self.own().filter(same_topic) {
            let (who, topic) = (self.role(writes), &own.topic);
            let there: String = (self.words.message_name)(&other.type_name).chars().take(120).collect();
            let text = if own.wire.1 != other.type_name {
                let (here, help) = (&own.message, self.words.help);
                format!(
                    "{topic}: a {who} has type {there} and this agent {here}, so they exchange nothing: {help}"
                )
            } else if has_key(*guid) != has_key(other.guid) {
                let (other, own) = if has_key(*guid) { ("no key", "one") } else { ("a key", "none") };
                format!(
                    "{topic}: {there} has {other} in a {who} and {own} here, so they exchange nothing: write the same @key in both IDL files"
                )
            } else if let (Some(ours), Some(theirs)) = (&own.type_hash, &hash)
                && ours != theirs
            {
                format!(
                    "{topic}: a {who} defines {there} differently (type hash {theirs}, here {ours}), so messages can't be read: give both the same .msg file"
                )
            } else {
                continue;
            };
            self.log_once(state, composer, other.guid, text);
        }
    }

    fn role(&self, writes: bool) -> &'static str {
        self.words.roles[usize::from(!writes)]
    }

    fn log_once(&self, state: &mut MatchState, composer: &Composer, other: GUID, text: String) {
        if state.logged.insert((other, text.clone())) {
            composer.log(Level::Warn, &format!("{}: {text}", self.words.scheme));
        }
    }

    /// Returns the QoS policy that keeps two endpoints apart, in the words of DDS.
    fn incompatible(&self, own: &OwnEndpoint, requested: &QosPolicies, offered: &QosPolicies) -> String {
        let who = self.role(own.is_reader);
        let (verb, effect) = match own.is_reader {
            true => ("offers", "nothing is received from it"),
            false => ("requests", "nothing is sent to it"),
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
            ("REPRESENTATION", false) => "; `representation` selects the written one",
            _ => "",
        };
        format!(
            "{}: a {who} {verb} incompatible QoS, so {effect}: {policy} (offered {offered}, requested {requested}){help}",
            own.topic
        )
    }
}

/// Returns the type hash in an endpoint's announcement, as `rmw` puts it there.
pub fn sent_type_hash(user_data: &[u8]) -> Option<String> {
    let text = String::from_utf8_lossy(user_data);
    let mut entries = text.split(';').filter_map(|entry| entry.trim_matches('\0').split_once('='));
    let (_, hash) = entries.find(|(key, _)| key.ends_with("typehash"))?;
    let is_hash = hash.len() < 100 && hash.bytes().all(|byte| byte.is_ascii_alphanumeric() || byte == b'_');
    is_hash.then(|| hash.to_owned())
}

/// Returns whether an endpoint's topic has a key.
/// The kind of its entity tells.
fn has_key(endpoint: GUID) -> bool {
    let [.., kind] = endpoint.to_bytes();
    matches!(kind & 0x0f, 0x02 | 0x07)
}

/// Locks data that stays intact when another thread panics with the lock.
fn locked<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
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

/// Returns the representations in words; none stands for the first version.
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
