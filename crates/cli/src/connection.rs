//! Finding the agent that a command is for.

use clap::Args;
use slate::runtime::remote::{Client, agents};

use crate::failure::Failure;

/// Which agent is asked.
#[derive(Debug, Args)]
pub struct AgentOption {
    /// The agent, by name; needed when several run.
    #[arg(long, value_name = "NAME")]
    pub agent: Option<String>,
}

impl AgentOption {
    /// Connects to it.
    pub fn connect(&self) -> Result<Client, Failure> {
        if let Some(name) = &self.agent {
            return Ok(Client::connect(name)?);
        }
        let running = agents();
        match &running[..] {
            [] => Err(Failure::NoAgent),
            [name] => Ok(Client::connect(name)?),
            _ => Err(Failure::SeveralAgents { running }),
        }
    }
}
