//! Finding the agent that a command is for.

use std::path::{Path, PathBuf};

use clap::Args;
use clap_complete::ArgValueCompleter;
use slate::control::client::{Access, AccessFailure, Request, Response};
use slate::control::{Client, Role};
use slate::runtime::directory::agents;
use slate::runtime::sharing::TEAM;

use crate::complete;
#[cfg(feature = "mcp")]
use crate::endpoint::place_at;
use crate::endpoint::{access_at, access_of};
use crate::failure::Failure;
use crate::local_agents::{default_agent, query_all};

/// Option that selects the agent.
#[derive(Debug, Args)]
pub struct AgentOption {
    /// Name of the agent,
    /// or its address such as https://robot.local:7878 with the token in SLATE_TOKEN [default: SLATE_AGENT, or the only
    /// running agent]
    #[arg(long, value_name = "NAME|ADDRESS", add = ArgValueCompleter::new(complete::of_agents))]
    pub agent: Option<String>,
}

impl AgentOption {
    /// Returns the given name or address, if any.
    pub fn name_or_address(&self) -> Option<String> {
        self.agent.clone().or_else(default_agent)
    }

    /// Returns the given address, if it is not a name.
    fn address(&self) -> Option<String> {
        self.name_or_address().filter(|given| given.contains("://"))
    }

    /// Returns the agent over HTTP, if it is reached in no other way.
    pub fn elsewhere(&self) -> Result<Option<Access>, Failure> {
        self.address().map(|address| access_at(&address, None)).transpose()
    }

    /// Returns access to the agent over HTTP, with the secret of a role.
    /// Without one, of the highest role that is known.
    pub fn over_http(&self, role: Option<Role>) -> Result<Access, Failure> {
        match self.address() {
            Some(address) => access_at(&address, role),
            None => access_of(self.connect()?.name(), role),
        }
    }

    /// Sends a request in a role, or in the highest known one.
    /// It goes to the agent's socket, or over TCP to an address.
    pub fn request(&self, role: Option<Role>, request: &Request<'_>) -> Result<Response, Failure> {
        let response = match self.address() {
            Some(address) => access_at(&address, role)?.request(request)?,
            None => {
                let mut client = self.connect()?;
                if let Some(role) = role {
                    client.in_role(role);
                }
                client.request(request)?
            }
        };
        Ok(response.well()?)
    }

    /// Returns access over HTTP for callers with their own tokens.
    /// Also the agent's name if it is local.
    #[cfg(feature = "mcp")]
    pub fn place(&self) -> Result<(Access, Option<String>), Failure> {
        if let Some(address) = self.address() {
            return Ok((place_at(&address)?, None));
        }
        let name = self.connect()?.name().to_owned();
        Ok((Access { token: String::new(), ..access_of(&name, None)? }, Some(name)))
    }

    /// Returns a file's path as sent to the agent, whose working folder differs.
    /// An agent over HTTP has its files in a folder of its own.
    pub fn file(&self, path: &Path) -> Result<PathBuf, Failure> {
        if self.address().is_none() {
            return std::path::absolute(path).map_err(|source| Failure::File { path: path.into(), source });
        }
        match path.file_name() == Some(path.as_os_str()) {
            true => Ok(path.into()),
            false => Err(AccessFailure::FileHere { path: path.into() }.into()),
        }
    }

    /// Returns a plugin library's path as sent to the agent; see [`file`](Self::file).
    /// An agent over HTTP takes none; this is an error.
    pub fn library(&self, path: &Path) -> Result<PathBuf, Failure> {
        if self.address().is_some() { Ok(path.into()) } else { self.file(path) }
    }

    /// Connects to it.
    pub fn connect(&self) -> Result<Client, Failure> {
        if let Some(access) = self.elsewhere()? {
            return Ok(Client::at(&access)?);
        }
        if let Some(name) = self.name_or_address() {
            return Ok(Client::connect(&name)?);
        }
        let running = agents();
        match &running[..] {
            [] => Err(Failure::NoAgent),
            [name] => Ok(Client::connect(name)?),
            _ => Err(Failure::SeveralAgents { running }),
        }
    }

    /// Connects to the agent of a URL if it is local, else to one that knows it.
    /// For a path without an agent, to the only one that has such a property: a robot is found by its own name,
    /// whichever agent runs it.
    pub fn connect_for(&self, url: &str) -> Result<Client, Failure> {
        let owner = || self.owner(url).map_or_else(|| self.connect_beside(url), Ok);
        self.named(url).map_or_else(owner, |name| Ok(Client::connect(name)?))
    }

    /// Connects to the only agent of several with a property at a path.
    fn owner(&self, path: &str) -> Option<Client> {
        let running = agents();
        if self.name_or_address().is_some() || running.len() < 2 || path.contains("://") {
            return None;
        }
        let path = path.to_owned();
        let answers = query_all(move |name| {
            // One that ends just now has nothing.
            let mut client = Client::connect(name).ok()?;
            let has = if path.contains('*') {
                client.properties(Some(&path)).is_ok_and(|found| !found.is_empty())
            } else {
                client.read(&path).is_ok()
            };
            has.then_some(client)
        });
        let mut owners = answers.into_iter().filter_map(|(_, client)| client.flatten());
        let first = owners.next();
        first.filter(|_| owners.next().is_none())
    }

    /// Connects to an agent that knows the one that a URL names.
    pub fn connect_beside(&self, url: &str) -> Result<Client, Failure> {
        let (None, Some(name)) = (self.name_or_address(), named(url)) else { return self.connect() };
        let running = agents();
        if running.len() < 2 {
            return self.connect();
        }
        let wanted = name.to_owned();
        let answers = query_all(move |own| {
            // One that is ending knows no other agents.
            let mut client = Client::connect(own).ok().filter(|_| own != wanted)?;
            let knows = client.peers().is_ok_and(|peers| peers.peers.iter().any(|peer| peer.agent == wanted));
            knows.then_some(client)
        });
        if let Some(client) = answers.into_iter().find_map(|(_, client)| client.flatten()) {
            return Ok(client);
        }
        // An agent with sharing finds the agents of this machine.
        match running.iter().find(|own| *own != name) {
            Some(own) if running.iter().any(|own| own == name) => Ok(Client::connect(own)?),
            _ => Err(Failure::Unmet { name: name.into(), running }),
        }
    }

    /// Connects to the agent that owns a URL, as no other may change it.
    pub fn connect_to(&self, url: &str) -> Result<Client, Failure> {
        self.named(url).map_or_else(|| self.connect(), |name| Ok(Client::connect(name)?))
    }

    /// Returns the agent that a URL names, if it is local and none else is selected.
    fn named<'u>(&self, url: &'u str) -> Option<&'u str> {
        named(url).filter(|name| self.name_or_address().is_none() && agents().iter().any(|own| own == name))
    }
}

/// Returns the agent that a URL names, if any.
/// The team's state is known to each of its agents.
fn named(url: &str) -> Option<&str> {
    url.strip_prefix("slate://")?.split('/').next().filter(|name| !name.is_empty() && *name != TEAM)
}
