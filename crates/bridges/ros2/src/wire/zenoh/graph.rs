//! Nodes and endpoints of a domain, by their liveliness tokens.

use std::collections::VecDeque;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Arc, Mutex};

use slate_module::Level;
use slate_runtime::Composer;
use slate_sorted::{SortedMap, SortedSet};

use super::queue::locked;
use super::token::{EndpointKind, Entity, GraphEndpoint};
use crate::name::message_name;

/// Maximum number of others' entities that are kept, and of their tokens' bytes.
/// Announcements of others must not fill the memory.
const MAX_ENTITIES: usize = 100_000;
const MAX_BYTES: usize = 16 << 20;
/// Maximum number of mismatches that are remembered, so that each is logged once.
const MAX_LOGGED: usize = 1_000;

/// Graph of the nodes and endpoints of a domain.
pub struct Graph {
    domain: u16,
    /// Session whose endpoints match each other without an announcement.
    session: String,
    state: Mutex<GraphState>,
}

#[derive(Default)]
struct GraphState {
    /// Entities by token.
    entities: SortedMap<String, Entity>,
    /// Bytes of the tokens.
    bytes: usize,
    /// Mismatches that were logged.
    logged: SortedSet<String>,
    /// Endpoints by kind and key.
    counts: SortedMap<(EndpointKind, String), Arc<AtomicUsize>>,
    /// Endpoints of this node.
    own: Vec<GraphEndpoint>,
    /// Endpoints of others that were not compared with those.
    new: VecDeque<GraphEndpoint>,
}

impl Graph {
    pub fn new(domain: u16, session: &str) -> Self {
        Self { domain, session: session.into(), state: Mutex::default() }
    }

    /// Adds an endpoint of this node.
    /// Returns the number of its other ends, which follows the graph.
    pub fn add_own(&self, endpoint: &GraphEndpoint) -> Arc<AtomicUsize> {
        let mut state = locked(&self.state);
        state.own.push(endpoint.clone());
        let others = state.entities.values().filter(|other| other.session != self.session);
        let is_end =
            |other: &&GraphEndpoint| other.kind == endpoint.kind.other() && other.name == endpoint.name;
        let found: Vec<_> =
            others.filter_map(|other| other.endpoint.as_ref()).filter(is_end).cloned().collect();
        state.new.extend(found);
        count_of(&mut state, endpoint.kind.other(), endpoint.key(self.domain))
    }

    /// Takes note of a token that has come or gone.
    pub fn note(&self, token: &str, is_here: bool) {
        let mut state = locked(&self.state);
        if !is_here {
            let gone = state.entities.remove(token);
            if gone.is_some() {
                state.bytes -= token.len();
            }
            if let Some(Entity { endpoint: Some(endpoint), .. }) = gone {
                let place = (endpoint.kind, endpoint.key(self.domain));
                let count = state.counts.get(&place);
                let left = count.map_or(0, |count| count.fetch_sub(1, Ordering::AcqRel) - 1);
                if left == 0 && count.is_some_and(|count| Arc::strong_count(count) == 1) {
                    state.counts.remove(&place);
                }
            }
            return;
        }
        let Some(entity) = Entity::parse(token) else { return };
        let is_full = state.entities.len() >= MAX_ENTITIES || state.bytes + token.len() > MAX_BYTES;
        if is_full || state.entities.contains_key(token) {
            return;
        }
        if let Some(endpoint) = &entity.endpoint {
            count_of(&mut state, endpoint.kind, endpoint.key(self.domain)).fetch_add(1, Ordering::AcqRel);
            let is_end = |own: &GraphEndpoint| own.kind == endpoint.kind.other() && own.name == endpoint.name;
            if entity.session != self.session && state.own.iter().any(is_end) {
                state.new.push_back(endpoint.clone());
            }
        }
        state.bytes += token.len();
        state.entities.insert(token.into(), entity);
    }

    /// Logs new endpoints that can't match those of this node, each mismatch once.
    pub fn log_mismatches(&self, scheme: &str, composer: &Composer) {
        for text in self.take_mismatches() {
            composer.log(Level::Warn, &format!("{scheme}: {text}"));
        }
    }

    fn take_mismatches(&self) -> Vec<String> {
        let mut state = locked(&self.state);
        let new = std::mem::take(&mut state.new);
        let GraphState { own, logged, .. } = &mut *state;
        let ends = new.iter().flat_map(|other| {
            let ends = own.iter().filter(|own| own.kind == other.kind.other() && own.name == other.name);
            ends.filter_map(|own| mismatch(own, other))
        });
        ends.filter(|text| logged.len() < MAX_LOGGED && logged.insert(text.clone())).collect()
    }

    /// Returns all entities.
    pub fn entities(&self) -> Vec<Entity> {
        locked(&self.state).entities.values().cloned().collect()
    }
}

fn count_of(state: &mut GraphState, kind: EndpointKind, key: String) -> Arc<AtomicUsize> {
    Arc::clone(state.counts.entry((kind, key)).or_default())
}

/// Returns the reason why two ends of one name exchange nothing.
/// Zenoh delivers by the key, which has type and hash.
fn mismatch(own: &GraphEndpoint, other: &GraphEndpoint) -> Option<String> {
    let (name, word) = (&own.name, other.kind.word());
    let (here, there) = (message_name(&own.type_name), message_name(&other.type_name));
    if here != there {
        return Some(format!(
            "{name}: a {word} has type {there} and this agent {here}, so they exchange nothing: use another topic or interface"
        ));
    }
    let theirs: String = other.hash.chars().take(100).collect();
    (own.hash != other.hash).then(|| {
        format!(
            "{name}: a {word} defines {there} differently (type hash {theirs}, here {}), so they exchange nothing: give both the same definition",
            own.hash
        )
    })
}
