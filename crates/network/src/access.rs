//! Access control of Zenoh, from the rights in configurations.

use serde_json::{Value as Json, json};
use slate_blackboard::Pattern;
use slate_sorted::{SortedMap, SortedSet};
use zenoh::key_expr::KeyExpr;

use crate::key::{
    InputSource, alive_key, property_key, read_key, schema_key, set_key, team_key, team_token_key, tree_key,
    tree_key_of,
};
use crate::options::ReadOptions;
use crate::settings::NetworkRights;
use crate::settings::NetworkSettings;

/// Wildcard for any agent, in a key.
const ANY_AGENT: &str = "*";

/// Agents and the rights in their configurations.
type Agents<'a> = [(&'a str, &'a NetworkSettings)];

/// Returns the access control of a Zenoh router between agents.
/// It is `access_control` in the router's configuration, made from the agents' names and settings. Each agent speaks
/// only for itself there, and receives what the others' files let it read.
pub fn router_access_control(agents: &Agents<'_>) -> Json {
    let named = agents.iter().flat_map(|(_, settings)| settings.security.iter());
    let named = named.flat_map(|security| security.allow.iter().filter(|(_, rights)| !rights.router));
    let names = agents.iter().map(|(name, _)| *name).chain(named.map(|(name, _)| name.as_str()));
    let mut access = AccessControl::default();
    for name in names.collect::<SortedSet<_>>() {
        access.add_agent(name, name, agents);
    }
    access.json()
}

/// Returns the access control of an agent's own session.
/// It limits what others may do with the agent, and lets each speak only for itself.
pub fn agent_access_control(agent: &str, settings: &NetworkSettings) -> Option<Json> {
    let security = settings.security.as_ref()?;
    let mut access = AccessControl::default();
    for (name, rights) in &security.allow {
        access.add_agent(name, if rights.router { ANY_AGENT } else { name }, &[(agent, settings)]);
    }
    if let Some(rights) = &security.unauthenticated {
        access.add_unauthenticated(agent, rights, settings);
    }
    Some(access.json())
}

/// Rules for subjects; a message that no rule allows is denied.
#[derive(Default)]
struct AccessControl {
    rules: Vec<Json>,
    subjects: Vec<Json>,
    policies: Vec<Json>,
}

/// Keys by the messages that may carry them.
#[derive(Default)]
struct MessageKeys {
    messages: SortedMap<&'static str, SortedSet<String>>,
}

impl MessageKeys {
    fn allow(&mut self, messages: &[&'static str], keys: impl IntoIterator<Item = String>) {
        let keys: Vec<_> = keys.into_iter().filter_map(canonical).collect();
        for message in messages {
            self.messages.entry(message).or_default().extend(keys.iter().cloned());
        }
    }
}

impl AccessControl {
    /// Adds the rules for the agent with a certificate of that name.
    /// It speaks for the agents that match `agents`.
    fn add_agent(&mut self, name: &str, agents: &str, origins: &Agents<'_>) {
        let (mut ingress, mut egress) = (MessageKeys::default(), MessageKeys::default());
        allow_own_messages(&mut ingress, agents);
        egress.allow(&["query", "declare_subscriber"], own_keys(agents));
        for (origin, settings) in origins.iter().filter(|(origin, _)| *origin != name) {
            let Some(rights) = settings.security.as_ref().and_then(|security| security.allow.get(name))
            else {
                continue;
            };
            allow_serving(&mut ingress, &mut egress, origin, rights, tree_key_of(origin, agents));
            if settings.team.is_some() && rights.team {
                allow_team_messages(&mut ingress, &mut egress, agents, origin);
            }
            allow_inputs(&mut ingress, &mut egress, settings);
            allow_outputs(&mut ingress, &mut egress, settings);
        }
        // Its own links, at a router: it writes their outputs and reads their inputs.
        if let Some((_, own)) = origins.iter().find(|(origin, _)| *origin == name) {
            allow_outputs(&mut egress, &mut ingress, own);
            allow_inputs(&mut egress, &mut ingress, own);
        }
        allow_discovery(&mut ingress, &mut egress);
        let subject = json!({ "id": name, "cert_common_names": [name], "link_protocols": ["quic"] });
        self.add(name, subject, ingress, egress);
    }

    /// Rules for programs in clear text, which have no name and so speak for no agent.
    fn add_unauthenticated(&mut self, agent: &str, rights: &NetworkRights, settings: &NetworkSettings) {
        let (mut ingress, mut egress) = (MessageKeys::default(), MessageKeys::default());
        allow_serving(&mut ingress, &mut egress, agent, rights, tree_key(agent));
        allow_inputs(&mut ingress, &mut egress, settings);
        allow_outputs(&mut ingress, &mut egress, settings);
        allow_discovery(&mut ingress, &mut egress);
        // No name of an agent has a space.
        let id = "in clear text";
        self.add(id, json!({ "id": id, "link_protocols": ["tcp", "udp"] }), ingress, egress);
    }

    fn add(&mut self, id: &str, subject: Json, ingress: MessageKeys, egress: MessageKeys) {
        let mut names = Vec::new();
        for (direction, flow) in [("ingress", ingress), ("egress", egress)] {
            for (message, keys) in flow.messages.into_iter().filter(|(_, keys)| !keys.is_empty()) {
                let name = format!("{id} {direction} {message}");
                self.rules.push(json!({
                    "id": name,
                    "messages": [message],
                    "flows": [direction],
                    "permission": "allow",
                    "key_exprs": keys,
                }));
                names.push(name);
            }
        }
        self.subjects.push(subject);
        self.policies.push(json!({ "rules": names, "subjects": [id] }));
    }

    fn json(self) -> Json {
        json!({
            "enabled": true,
            "default_permission": "deny",
            "rules": self.rules,
            "subjects": self.subjects,
            "policies": self.policies,
        })
    }
}

/// Returns the keys of an agent; `**` leaves out names that begin with `@`.
fn own_keys(agent: &str) -> [String; 8] {
    [
        property_key(agent, "**"),
        read_key(agent, "*", "**"),
        cache_key(agent, "**"),
        alive_key(agent),
        tree_key(agent),
        tree_key_of(agent, "*"),
        schema_key(agent, "*"),
        set_key(agent, "**"),
    ]
}

/// Returns the key of an agent's cache, which repeats lost values.
/// It also announces the last one there.
fn cache_key(agent: &str, path: &str) -> String {
    format!("{}/@adv/pub/**", read_key(agent, "*", path))
}

/// Allows the messages that an agent sends in its own name.
fn allow_own_messages(ingress: &mut MessageKeys, agent: &str) {
    ingress.allow(&["put"], [property_key(agent, "**"), read_key(agent, "*", "**"), cache_key(agent, "**")]);
    ingress.allow(&["reply", "declare_queryable"], own_keys(agent));
    // It checks for another agent of its name.
    ingress.allow(&["liveliness_token", "query"], [alive_key(agent)]);
}

/// Allows the messages by which an agent serves a peer with these rights.
/// The list of its properties is at `tree`.
fn allow_serving(
    ingress: &mut MessageKeys,
    egress: &mut MessageKeys,
    agent: &str,
    rights: &NetworkRights,
    tree: String,
) {
    let keys = |patterns: &[Pattern], key: fn(&str, &str) -> String| {
        patterns.iter().map(|pattern| key(agent, &pattern.to_string())).collect::<Vec<_>>()
    };
    let open = [alive_key(agent), tree, schema_key(agent, "*")];
    let send = keys(&rights.send, set_key);
    let with_options = keys(&rights.read, |agent, path| read_key(agent, "*", path));
    let cached = keys(&rights.read, cache_key);
    ingress.allow(&["query", "declare_subscriber"], with_options.iter().chain(&cached).cloned());
    let read: Vec<_> =
        [keys(&rights.read, property_key), with_options, cached].into_iter().flatten().collect();
    // A query or subscription with wildcards receives the readable properties.
    ingress.allow(&["query"], [property_key(agent, "**")]);
    ingress.allow(&["query"], open.iter().chain(&send).cloned());
    egress.allow(&["put"], read.iter().cloned());
    egress.allow(&["reply"], open.into_iter().chain(read).chain(send));
    egress.allow(&["declare_queryable"], own_keys(agent));
    egress.allow(&["liveliness_token", "query"], [alive_key(agent)]);
}

/// Allows team messages between an agent and an origin that admits it to its team.
fn allow_team_messages(ingress: &mut MessageKeys, egress: &mut MessageKeys, agent: &str, origin: &str) {
    for (flow, sender, receiver) in [(&mut *ingress, agent, origin), (&mut *egress, origin, agent)] {
        flow.allow(&["put"], [team_key(sender, receiver)]);
        flow.allow(&["declare_subscriber"], [team_key(ANY_AGENT, sender)]);
        flow.allow(&["liveliness_token"], [team_token_key(sender)]);
        flow.allow(&["liveliness_query", "declare_liveliness_subscriber"], [team_token_key(ANY_AGENT)]);
    }
}

/// Allows every admitted agent to write the Zenoh keys of an agent's inputs.
fn allow_inputs(ingress: &mut MessageKeys, egress: &mut MessageKeys, settings: &NetworkSettings) {
    let sources = settings.read.values().map(|input| &input.source);
    let keys: Vec<_> = sources
        .filter(|source| matches!(source, InputSource::Key(_)))
        .map(|source| source.key(&ReadOptions::default()))
        .collect();
    ingress.allow(&["put", "reply", "declare_queryable"], keys.iter().cloned());
    egress.allow(&["query", "declare_subscriber"], keys);
}

/// Allows every admitted agent to read the Zenoh keys of an agent's links.
fn allow_outputs(ingress: &mut MessageKeys, egress: &mut MessageKeys, settings: &NetworkSettings) {
    let keys: Vec<_> = settings.write.iter().map(|output| output.key.clone()).collect();
    egress.allow(&["put", "reply", "declare_queryable"], keys.iter().cloned());
    ingress.allow(&["query", "declare_subscriber"], keys);
}

/// Allows the messages by which agents discover each other.
/// Delivery to a subscriber is decided for each value.
fn allow_discovery(ingress: &mut MessageKeys, egress: &mut MessageKeys) {
    ingress.allow(&["declare_subscriber"], ["**".to_owned()]);
    for flow in [ingress, egress] {
        flow.allow(&["liveliness_query", "declare_liveliness_subscriber"], [alive_key(ANY_AGENT)]);
    }
}

/// Returns a key in Zenoh's canonical form of wildcards.
/// `None` if the key is not valid; it then has no rights.
fn canonical(key: String) -> Option<String> {
    KeyExpr::autocanonize(key).ok().map(|key| key.as_str().to_owned())
}
