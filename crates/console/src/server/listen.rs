use std::io;
use std::net::{IpAddr, SocketAddr, TcpListener};

use super::StartError;
use crate::settings::Settings;

/// Default port, if it is free.
const DEFAULT_PORT: u16 = 7878;

/// Listens at all addresses, with one port.
pub(super) fn listen(settings: &Settings) -> Result<Vec<TcpListener>, StartError> {
    let ports = match settings.port {
        Some(port) => vec![port],
        None => vec![DEFAULT_PORT, 0],
    };
    let mut last = None;
    for port in ports {
        match listen_at(settings, port) {
            Ok(listeners) => return Ok(listeners),
            Err(error) => last = Some(error),
        }
    }
    Err(last.unwrap_or_else(|| io::Error::other("there is no port").into()))
}

fn listen_at(settings: &Settings, port: u16) -> Result<Vec<TcpListener>, StartError> {
    let mut listeners: Vec<TcpListener> = Vec::new();
    let mut port = port;
    let is_default = settings.addresses == Settings::default().addresses;
    for ip in &settings.addresses {
        let address = SocketAddr::new(*ip, port);
        match bind(address) {
            Ok(listener) => {
                // Any port for the first one is the same for the others.
                port = listener.local_addr()?.port();
                listeners.push(listener);
            }
            // Without IPv6 the other address does.
            Err(_) if is_default && !listeners.is_empty() => {}
            Err(error) => return Err(StartError::Listen { address, reason: error.to_string() }),
        }
    }
    Ok(listeners)
}

fn bind(address: SocketAddr) -> io::Result<TcpListener> {
    let listener = TcpListener::bind(address)?;
    listener.set_nonblocking(true)?;
    Ok(listener)
}

/// Local names of this machine.
const LOCAL_HOSTS: [&str; 3] = ["127.0.0.1", "localhost", "[::1]"];

/// Returns the host names of the console, each with the port.
/// The first is displayed unless a certificate holds another.
pub(super) fn hosts(addresses: &[SocketAddr], names: &[String]) -> Vec<String> {
    let mut hosts = Vec::new();
    for address in addresses {
        // A client that reaches all addresses of a machine uses one of its names.
        if !address.ip().is_unspecified() {
            hosts.push(address.to_string());
        }
        let local = match address.ip() {
            ip if ip.is_loopback() || ip.is_unspecified() => true,
            IpAddr::V4(_) | IpAddr::V6(_) => false,
        };
        hosts.extend(names.iter().map(|name| format!("{name}:{}", address.port())));
        if local {
            hosts.extend(LOCAL_HOSTS.map(|name| format!("{name}:{}", address.port())));
        }
    }
    hosts
}

/// Returns the host name for browsers, among those that a certificate holds.
/// If only this machine reaches the console, one of its local names if there is one.
pub(super) fn display_host(
    addresses: &[SocketAddr],
    hosts: &[String],
    holds: impl Fn(&str) -> bool,
) -> Option<String> {
    let name = |host: &str| host.rsplit_once(':').map_or(host, |(name, _)| name).to_owned();
    let is_local = addresses.iter().all(|address| address.ip().is_loopback());
    let held = hosts.iter().filter(|host| holds(name(host).trim_matches(['[', ']'])));
    held.min_by_key(|host| is_local && !LOCAL_HOSTS.contains(&name(host).as_str())).cloned()
}
