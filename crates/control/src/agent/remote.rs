//! Queries of clients to another agent, through one that knows it.

use std::io::{BufWriter, Write};
use std::path::Path;
use std::time::Duration;

use serde_json::json;
use slate_blackboard::{Access, nearest_names, nearest_paths};
use slate_sorted::SortedSet;

use super::refusal::{Done, reading, refusal, result};
use crate::entries::{PropertyEntry, Refusal, RemoteSnapshotEntry};
use slate_runtime::directory::agents;
use slate_runtime::replacement::Replacement;
use slate_runtime::sharing::{Newest, RemotePath, RemoteProperty, TEAM, Unread};
use slate_runtime::{Composer, NewLink, RemoteEnd};
use slate_runtime::{ErrorCode, Message};

/// Timeout for an answer of the other agent.
const ANSWER_TIMEOUT: Duration = Duration::from_secs(1);

/// Returns the agent and the path or pattern of a whole URL.
pub(super) fn split(url: &str) -> Option<(&str, &str)> {
    let rest = url.strip_prefix("slate://")?;
    Some(rest.split_once('/').unwrap_or((rest, "**")))
}

/// Other agents, queried through one that knows them.
#[derive(Clone)]
pub(crate) struct RemoteAgents {
    composer: Composer,
}

impl RemoteAgents {
    /// Creates the view on the agents that an agent knows.
    pub fn new(composer: &Composer) -> Self {
        Self { composer: composer.clone() }
    }

    /// Splits a URL of another agent into that agent and the path in it.
    /// `None` for this agent; the state of the team is local.
    pub fn of<'u>(&self, url: &'u str) -> Option<(&'u str, &'u str)> {
        split(url).filter(|(agent, _)| *agent != TEAM && *agent != self.composer.board().agent())
    }

    /// Returns the properties of another agent that a pattern matches, at least one.
    pub fn list(&self, agent: &str, pattern: &str) -> Result<Vec<PropertyEntry>, Refusal> {
        let entry = |property: RemoteProperty| PropertyEntry {
            path: property.path,
            interface: property.descriptor.name.into(),
            doc: property.doc,
            access: String::new(),
        };
        let properties = self.list_matching(agent, pattern, false)?;
        Ok(properties.into_iter().map(entry).collect())
    }

    /// Returns the newest value of a property of another agent.
    pub fn read(&self, agent: &str, path: &str) -> Done {
        let Some((property, field)) = self.property(agent, path, true)? else {
            return Err(self.unknown_property(agent, path));
        };
        let value = property.value(field);
        let value = value.map_err(|error| {
            let text = format!("slate://{agent}/{}: {error}", property.path);
            let error_code = matches!(error, Unread::Field(_)).then_some(ErrorCode::Name);
            refusal(Message { text, error_code }, &list_help(agent))
        })?;
        result(value.map(reading))
    }

    /// Returns the property that a path of another agent leads to, and the field.
    /// The rest of the path behind the property is the field; only the other agent knows where it begins.
    fn property<'p>(
        &self,
        agent: &str,
        path: &'p str,
        values: bool,
    ) -> Result<Option<(RemoteProperty, &'p str)>, Refusal> {
        let ends = path.rmatch_indices('/').map(|(end, _)| end);
        for end in [path.len()].into_iter().chain(ends) {
            let (property, field) = (&path[..end], path[end..].trim_start_matches('/'));
            if let Some(property) = self.query(agent, property, values)?.into_iter().next() {
                return Ok(Some((property, field)));
            }
        }
        Ok(None)
    }

    /// Checks that a link to another agent would deliver values.
    /// An absent agent is no reason against the link.
    pub fn check_link(&self, link: &NewLink) -> Result<(), Refusal> {
        let board = self.composer.board();
        let ends = [link.from.as_str(), link.to.as_str()].into_iter().filter_map(split);
        let Some((agent, path)) = ends.into_iter().find(|(agent, _)| *agent != board.agent()) else {
            return Ok(());
        };
        let wanted = RemotePath { agent: agent.into(), path: path.into() };
        let fits = |path: &str, descriptor, takes_messages| {
            let property = RemoteEnd { path, descriptor, takes_messages };
            match self.composer.mismatch(link, wanted.clone(), &property).map_err(Refusal::from)? {
                Some((message, help)) => Err(refusal(message, &help)),
                None => Ok(()),
            }
        };
        let missing = |message: String| {
            let help = "the link can be made, and waits until that is there";
            Err(refusal(ErrorCode::Name.of(message), help))
        };
        if agent == TEAM {
            // The state of the team is local.
            return match board.find(&wanted.mirror_path()) {
                Ok((property, _)) => {
                    let topic = property.path().strip_prefix("team/").unwrap_or_default();
                    fits(topic, property.descriptor(), false)
                }
                Err(error) => missing(error.to_string()),
            };
        }
        match self.property(agent, path, false) {
            Ok(Some((property, _))) => {
                fits(&property.path, property.descriptor, property.access == Access::Messages)
            }
            Ok(None) => missing(self.unknown_property(agent, path).message),
            // An absent agent may start later, unless its name is a misspelt known one.
            Err(_) => match self.nearest_agents(agent) {
                near if near.is_empty() => Ok(()),
                near => missing(format!("no agent `{agent}` is known; nearest: {}", near.join(", "))),
            },
        }
    }

    /// Returns the known agents with names similar to an unknown one.
    fn nearest_agents(&self, agent: &str) -> Vec<String> {
        let peers = super::peers::peers(&self.composer).peers.into_iter().map(|peer| peer.agent);
        let known: SortedSet<String> =
            agents().into_iter().chain(self.composer.named_agents()).chain(peers).collect();
        if known.contains(agent) {
            return Vec::new();
        }
        let own = self.composer.board().agent();
        nearest_names(agent, known.iter().map(String::as_str).filter(|known| *known != own))
    }

    /// Writes the newest values of properties into a file, completely or not at all.
    pub fn snapshot(&self, url: &str, file: &Path) -> Done {
        let Some((agent, pattern)) = self.of(url) else {
            let message = format!("`{url}` names no other agent");
            return Err(refusal(message, "such as slate://other/**; without it all of this agent is saved"));
        };
        let properties = self.list_matching(agent, pattern, true)?;
        let count = |is: fn(&Newest) -> bool| properties.iter().filter(|one| is(&one.newest)).count();
        let entry = RemoteSnapshotEntry {
            agent: agent.into(),
            properties: properties.len(),
            values: count(|newest| matches!(newest, Newest::Value(..))),
            unavailable: count(|newest| matches!(newest, Newest::TooLarge(_) | Newest::NotAllowed)),
        };
        write(agent, &properties, file).map_err(|error| {
            let message = format!("{} can't be written: {error}", slate_runtime::printable(file));
            refusal(message, "name a file in a folder that can be written to")
        })?;
        result(entry)
    }

    /// Returns the properties that match a pattern, at least one.
    fn list_matching(
        &self,
        agent: &str,
        pattern: &str,
        values: bool,
    ) -> Result<Vec<RemoteProperty>, Refusal> {
        let found = self.query(agent, pattern, values)?;
        if !found.is_empty() {
            return Ok(found);
        }
        let beginning: Vec<_> = pattern.split('/').take_while(|name| !name.starts_with('*')).collect();
        Err(self.unknown_property(agent, &beginning.join("/")))
    }

    fn query(&self, agent: &str, pattern: &str, values: bool) -> Result<Vec<RemoteProperty>, Refusal> {
        // An invalid pattern would match nothing at the other agent.
        slate_blackboard::Pattern::parse(pattern).map_err(|error| {
            refusal(error.to_string(), "such as slate://robot/planner/* or slate://robot/**")
        })?;
        let inspection = self.composer.inspection().ok_or_else(|| {
            let message = format!("this agent has no sharing, so it knows no agent `{agent}`");
            refusal(message, "give it a [share] table, or ask the other agent itself with --agent")
        })?;
        let known = "`slate peers` shows the known agents, and why one is not connected";
        inspection.list(agent, pattern, values, ANSWER_TIMEOUT).map_err(|reason| refusal(reason, known))
    }

    /// Creates the refusal of an unknown property.
    fn unknown_property(&self, agent: &str, path: &str) -> Refusal {
        let all = self.query(agent, "**", false).unwrap_or_default();
        let near = nearest_paths(path, '/', all.iter().map(|property| property.path.as_str()));
        let modules = || -> SortedSet<&str> {
            all.iter().filter_map(|property| property.path.split('/').next()).take(100).collect()
        };
        let near = match (near.is_empty(), modules()) {
            (false, _) => format!("; nearest: {}", near.join(", ")),
            (true, modules) if modules.is_empty() => String::new(),
            (true, modules) => format!("; available: {}", modules.into_iter().collect::<Vec<_>>().join(", ")),
        };
        refusal(ErrorCode::Name.of(format!("no property at slate://{agent}/{path}{near}")), &list_help(agent))
    }
}

fn list_help(agent: &str) -> String {
    format!("`slate list slate://{agent}/**` shows the properties")
}

/// Writes the properties one by one.
/// The text of a value takes far more memory than the value.
fn write(agent: &str, properties: &[RemoteProperty], file: &Path) -> std::io::Result<()> {
    let mut out = BufWriter::new(Replacement::create(file)?);
    write!(out, "{{\"agent\":{},\"properties\":[", json!(agent))?;
    for (index, property) in properties.iter().enumerate() {
        let (newest, unavailable) = match property.value("") {
            Ok(value) => (value.map(reading), None),
            Err(reason) => (None, Some(reason.to_string())),
        };
        let entry = json!({
            "path": property.path,
            "interface": property.descriptor.name,
            "schema": format!("{:016x}", property.descriptor.hash),
            "newest": newest,
            "unavailable": unavailable,
        });
        write!(out, "{}\n{entry}", if index == 0 { "" } else { "," })?;
    }
    out.write_all(b"\n]}\n")?;
    out.into_inner().map_err(|error| error.into_error())?.keep()
}
