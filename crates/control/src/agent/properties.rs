//! Properties, as tools query them.

use std::sync::Arc;

use slate_blackboard::{Access, Board, BoardError, Pattern, Property, Url};
use slate_module::Direction;

use super::refusal::{Done, KNOWN, reading, refusal, result};
use super::remote::{self, RemoteAgents};
use crate::entries::{PropertyEntry, Refusal};
use slate_runtime::Composer;
use slate_runtime::sharing::{RemotePath, TEAM};
use slate_runtime::{ErrorCode, Message};

/// Properties of an agent, and through it those of others.
#[derive(Clone)]
pub(crate) struct PropertyDirectory {
    composer: Composer,
    /// Other agents.
    pub remote: RemoteAgents,
}

impl PropertyDirectory {
    /// Creates the directory of an agent.
    pub fn new(composer: &Composer) -> Self {
        Self { composer: composer.clone(), remote: RemoteAgents::new(composer) }
    }

    /// Returns the agent.
    pub fn composer(&self) -> &Composer {
        &self.composer
    }

    /// Returns the blackboard.
    pub fn board(&self) -> &Board {
        self.composer.board()
    }

    /// Returns the properties that match a pattern, of this agent or another one.
    /// Without a pattern, all of this agent.
    pub fn list(&self, pattern: Option<&str>) -> Result<Vec<PropertyEntry>, Refusal> {
        if let Some((agent, pattern)) = pattern.and_then(|pattern| self.remote.of(pattern)) {
            return self.remote.list(agent, pattern);
        }
        // That of this agent or the team as a whole URL.
        let here = |pattern: &str| match remote::split(pattern) {
            Some((agent, path)) if agent == TEAM => place(agent, path),
            Some((_, path)) => path.to_owned(),
            None => pattern.to_owned(),
        };
        let pattern = pattern.map(|pattern| Pattern::parse(&here(pattern))).transpose();
        let pattern = pattern.map_err(|error| {
            refusal(ErrorCode::Value.of(error.to_string()), "such as /r2/planner/* or /**/timing")
        })?;
        let entry = |property: &Arc<Property>| PropertyEntry {
            path: property.path().into(),
            interface: property.descriptor().name.to_string(),
            doc: property.doc().to_string(),
            access: self.access(property).into(),
        };
        let properties = self.board().properties();
        let wanted = properties
            .iter()
            .filter(|property| pattern.as_ref().is_none_or(|pattern| pattern.matches(property.path())));
        let mut entries: Vec<_> = wanted.map(entry).collect();
        if let Some(pattern) = pattern.as_ref().filter(|_| entries.is_empty()) {
            self.check_beginning(pattern)?;
        }
        entries.sort_unstable_by(|a, b| a.path.cmp(&b.path));
        Ok(entries)
    }

    /// Returns the writer of a property, as [`PropertyEntry::access`] names it.
    pub fn access(&self, property: &Property) -> &'static str {
        match property.access() {
            Access::Output => "output",
            Access::Messages => "messages",
            Access::Setting if self.is_queue(property.path()) => "queue",
            Access::Setting => "setting",
        }
    }

    /// Returns whether an input is a queue, which takes every value of its link.
    fn is_queue(&self, path: &str) -> bool {
        self.composer.port(path).is_some_and(|port| port.direction == Direction::Queue)
    }

    /// Checks that the part before the first star begins some path.
    fn check_beginning(&self, pattern: &Pattern) -> Result<(), Refusal> {
        let text = pattern.to_string();
        let names: Vec<_> = text.split('/').take_while(|name| !name.starts_with('*')).collect();
        let beginning = names.join("/");
        let below = |property: &Arc<Property>| {
            property.path().strip_prefix(&beginning).is_some_and(|rest| rest.starts_with('/'))
        };
        if names.is_empty() || self.board().properties().iter().any(below) {
            return Ok(());
        }
        let unknown = self.board().find(&beginning).err();
        unknown.map_or(Ok(()), |error| Err(refusal(Message::from(&error), KNOWN)))
    }

    /// Returns the local path of a URL, which must exist.
    fn path(&self, url: &Url) -> Result<String, Refusal> {
        let unknown = |error: BoardError| refusal(Message::from(&error), KNOWN);
        let path = url.path_in("");
        if url.agent() == Some(TEAM) {
            let path = place(TEAM, &path);
            return self.board().find(&path).map(|_| path).map_err(unknown);
        }
        self.board().resolve(url).map(|_| path).map_err(unknown)
    }

    pub fn read(&self, url: &str) -> Done {
        parse(url)?;
        if let Some((agent, path)) = self.remote.of(url) {
            return self.remote.read(agent, path);
        }
        let read = self.board().read(&self.value_path(url)?);
        result(read.map_err(|error| refusal(Message::from(&error), KNOWN))?.map(reading))
    }

    /// Returns the local path of a URL, which must exist.
    pub fn path_of(&self, url: &str) -> Result<String, Refusal> {
        self.path(&parse(url)?)
    }

    /// Returns the local path of a URL that leads to a property with values.
    pub fn value_path(&self, url: &str) -> Result<String, Refusal> {
        let path = self.path_of(url)?;
        if let Some((property, _)) = self.board().get(&path)
            && property.access() == Access::Messages
        {
            let message =
                ErrorCode::Messages.of(format!("/{} takes messages, and has no value", property.path()));
            return Err(refusal(message, KNOWN));
        }
        Ok(path)
    }
}

fn parse(url: &str) -> Result<Url, Refusal> {
    Url::parse(url)
        .map_err(|error| refusal(ErrorCode::Value.of(error.to_string()), "such as /module/property"))
}

/// Returns the path on the board.
fn place(agent: &str, path: &str) -> String {
    RemotePath { agent: agent.into(), path: path.into() }.mirror_path()
}
