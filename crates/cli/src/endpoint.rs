//! Where an agent is reached over HTTP, and with which secrets: it leaves both in a file that only its user can read.

use std::collections::BTreeMap;
use std::fs;

use serde::Deserialize;
use slate::runtime::remote::{Lock, folder};

use crate::failure::Failure;

/// The end of the names of these files.
const FILE: &str = ".console";

/// Where an agent is reached.
#[derive(Debug, Deserialize)]
pub struct Endpoint {
    /// Such as `http://127.0.0.1:7878`.
    pub address: String,
    /// By the names of roles, from the lowest.
    tokens: BTreeMap<String, String>,
    /// Whose file it is.
    process: u32,
}

/// What somebody may do who asks, from the least to the most.
#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum)]
pub enum Role {
    /// Looks, and stops the actuators.
    Viewer,
    /// Drives, too.
    Operator,
    /// Changes the agent, too.
    Developer,
}

impl Role {
    const ALL: [Self; 3] = [Self::Viewer, Self::Operator, Self::Developer];

    pub fn name(self) -> &'static str {
        match self {
            Self::Viewer => "viewer",
            Self::Operator => "operator",
            Self::Developer => "developer",
        }
    }
}

impl Endpoint {
    /// That of the agent which is reached by a name. What an agent left that was killed is of another process.
    pub fn of(agent: &str) -> Result<Self, Failure> {
        let process = Lock::holder(&folder().join(format!("{agent}.lock")));
        let files = fs::read_dir(folder()).into_iter().flatten().flatten();
        let files = files.filter(|file| file.file_name().to_string_lossy().ends_with(FILE));
        let mut endpoints = files.filter_map(|file| {
            let text = fs::read_to_string(file.path()).ok()?;
            serde_json::from_str::<Self>(&text).ok()
        });
        let found = endpoints.find(|endpoint| Some(endpoint.process) == process);
        found.ok_or_else(|| Failure::NoConsole { agent: agent.into() })
    }

    /// The secret of a role, or of the highest that there is.
    pub fn token(&self, role: Option<Role>) -> Option<(Role, &str)> {
        let own = |role: Role| Some((role, self.tokens.get(role.name())?.as_str()));
        match role {
            Some(role) => own(role),
            None => Role::ALL.into_iter().rev().find_map(own),
        }
    }
}
