//! Applications that are loaded without being run.

use std::collections::{BTreeMap, BTreeSet};

use slate::runtime::composition::Catalogue;
use slate::runtime::sharing::{RemotePath, Sharing, SharingError, Site, Want};
use slate::runtime::{Agent, Mode, Options};
use slate::share::agent::AgentSharing;

use crate::failure::Failure;
use slate_run::Application;

/// Sharing that opens no connection.
/// It checks the configuration, with its endpoints.
struct Offline(AgentSharing);

impl Sharing for Offline {
    fn start(&mut self, site: Site) -> Result<(), SharingError> {
        self.0.check(&site)
    }

    fn want(&mut self, _: BTreeMap<RemotePath, Want>) {}

    fn carriers(&self) -> BTreeSet<String> {
        self.0.carriers()
    }

    fn has_jpeg(&self) -> bool {
        self.0.has_jpeg()
    }
}

/// Loads an application as for a run, without sharing, sockets and report.
/// Other agents and tools can't reach it.
pub fn load(application: &Application) -> Result<Agent, Failure> {
    let options = Options {
        mode: Mode::Staged,
        sharing: Some(Box::new(Offline(AgentSharing::default()))),
        armed: false,
        ..Options::default()
    };
    Ok(Agent::load_with(&application.database, &application.plugins, options)?)
}

/// Returns the kinds of modules that an application can use, without an agent.
pub fn catalogue(application: &Application) -> Result<Catalogue, Failure> {
    let sharing = Offline(AgentSharing::default());
    Ok(slate::runtime::catalogue(&application.configuration, &application.plugins, Some(&sharing))?)
}

/// Settings that keep a loaded application from writing log files.
/// A run may be writing them.
pub const NO_LOG_SETTINGS: [&str; 3] =
    ["log.targets.console=false", "log.targets.file=false", "log.targets.syslog=false"];
