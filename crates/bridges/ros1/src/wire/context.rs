//! State of a node that its parts share.

use std::io;
use std::net::{IpAddr, UdpSocket};
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Mutex, PoisonError};

use slate_blackboard::wake::Wake;
use slate_module::Level;
use slate_runtime::Composer;
use slate_sorted::SortedSet;
use tokio::net::lookup_host;

use super::header::wrong;
use super::master::MasterClient;
use crate::settings::SCHEME;

/// Different reasons that are logged.
const MAX_LOGGED: usize = 256;

/// Addresses of a node, with its master and agent.
pub struct NodeContext {
    pub master: MasterClient,
    /// Address of its API.
    pub api: String,
    /// Host name of the machine, as others reach it.
    pub host: String,
    /// Port of topics and services.
    pub port: u16,
    pub composer: Composer,
    /// Trusted network: it communicates with other machines.
    pub trusted: bool,
    logged: Mutex<SortedSet<String>>,
    /// Number of registrations.
    registrations: AtomicU64,
    /// Number of changes to the node's parameters on the master.
    parameter_changes: AtomicU64,
    /// Wake of the parameter synchronization.
    pub parameter_wake: Wake,
}

/// Returns whether an address is one of this machine.
fn is_own(address: IpAddr) -> bool {
    // Sockets have no others.
    address.is_loopback() || UdpSocket::bind((address, 0)).is_ok()
}

impl NodeContext {
    /// Creates a node of a master, at a host with ports for calls and connections.
    pub fn new(
        master: MasterClient,
        host: String,
        ports: [u16; 2],
        composer: Composer,
        trusted: bool,
    ) -> Self {
        Self {
            master,
            api: format!("http://{host}:{}/", ports[0]),
            host,
            port: ports[1],
            composer,
            trusted,
            logged: Mutex::default(),
            registrations: AtomicU64::new(0),
            parameter_changes: AtomicU64::new(0),
            parameter_wake: Wake::new(),
        }
    }

    /// Returns its name, from the root.
    pub fn name(&self) -> &str {
        &self.master.node
    }

    /// Checks thon another machine is reached only if the configuration permits it.
    ///
    /// # Errors
    /// When the address is on another machine, or unknown.
    pub async fn check_reach(&self, authority: &str) -> io::Result<()> {
        if self.trusted {
            return Ok(());
        }
        let mut all = lookup_host(authority).await?;
        match all.all(|own| is_own(own.ip())) {
            true => Ok(()),
            false => {
                let shown: String = authority.chars().filter(char::is_ascii_graphic).take(100).collect();
                Err(wrong(&format!(
                    "{shown} is on another machine: write trusted = true in [ros1] to speak with it"
                )))
            }
        }
    }

    /// Logs a text once.
    pub fn log_once(&self, level: Level, text: &str) {
        let mut logged = self.logged.lock().unwrap_or_else(PoisonError::into_inner);
        if logged.len() < MAX_LOGGED && logged.insert(text.into()) {
            self.composer.log(level, &format!("{SCHEME}: {text}"));
        }
    }

    /// Takes note that a parameter of the node has changed on the master.
    pub fn parameters_changed(&self) {
        self.parameter_changes.fetch_add(1, Ordering::Release);
        self.parameter_wake.notify(1);
    }

    /// Returns the numbers of parameter changes on the master, and of registrations.
    pub fn parameter_changes(&self) -> (u64, u64) {
        (self.parameter_changes.load(Ordering::Acquire), self.registrations.load(Ordering::Acquire))
    }

    /// Takes note that the master has all of the node anew.
    pub fn registered(&self) {
        self.registrations.fetch_add(1, Ordering::Release);
        self.parameter_wake.notify(1);
    }
}
