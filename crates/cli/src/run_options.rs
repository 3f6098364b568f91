//! Options of the verb that runs an application.

use clap::Args;
use clap_complete::ArgValueCompleter;
use slate_run::RunOptions;

use crate::complete;

#[derive(Debug, Args)]
pub struct RunVerb {
    /// Example or configuration file [default with --resume: that of the snapshot]
    #[arg(required_unless_present = "resume", add = ArgValueCompleter::new(complete::of_configurations))]
    pub name: Option<String>,

    /// Agent of the file [default: all]
    #[arg(long, value_name = "NAME", requires = "name")]
    pub agent: Option<String>,

    #[command(flatten)]
    pub options: RunOptions,

    /// Start as one of several agents: wait for the others, and end with the supervisor
    #[arg(long, hide = true)]
    pub supervised: bool,

    /// Serve the web console of several agents
    #[arg(long, hide = true)]
    pub watched: bool,
}
