//! Carrier between machines: TLS 1.3 on TCP, with certificates of both ends.
//!
//! Endpoints are `tls:HOST:PORT`. Only configured endpoints are listened at and dialed; no discovery takes place. The
//! certificate identifies an agent, regardless of its address.

mod connection;
mod credentials;
mod link;
mod listener;
mod settings;

use std::net::SocketAddr;
use std::sync::Arc;
use std::time::Duration;

use super::address::Address;
use super::{Carrier, CarrierError, Link, Listener, first_success};
pub use credentials::{Credentials, Files};
use link::TlsLink;
use listener::TlsListener;

/// Timeout of name resolution, of connecting and of the handshake, each.
/// Only the thread of the dialed agent waits for it. A lost first packet is sent again after 1 s.
const CONNECT_TIMEOUT: Duration = Duration::from_secs(2);

const EXPECTED_ENDPOINT: &str = "tls:HOST:PORT, such as tls:192.168.1.5:7447 or tls:[::1]:7447";

/// Carrier over TLS.
#[derive(Clone, Debug, Default)]
pub struct Tls {
    credentials: Option<Credentials>,
    is_restricted: bool,
}

impl Tls {
    /// Creates the carrier with certificates.
    /// It reaches other machines only if `is_restricted`: if the rights of each agent are configured.
    pub fn new(credentials: Credentials, is_restricted: bool) -> Self {
        Self { credentials: Some(credentials), is_restricted }
    }

    /// Returns the credentials for an endpoint.
    /// Error without certificates, and for other machines if no rights are configured.
    fn credentials(&self, endpoint: &str, is_here: bool) -> Result<&Credentials, CarrierError> {
        let refuse = |reason: &str| CarrierError::Unsafe { endpoint: endpoint.into(), reason: reason.into() };
        let credentials = self.credentials.as_ref();
        let credentials = credentials
            .ok_or_else(|| refuse("TLS needs `certificate`, `key` and `authority` in [share.security]"))?;
        if !is_here && !self.is_restricted {
            return Err(refuse(
                "it is not on this machine: list in [share.security.allow] what each agent may read and send",
            ));
        }
        Ok(credentials)
    }

    fn resolve(&self, endpoint: &str) -> Result<(Vec<SocketAddr>, &Credentials), CarrierError> {
        let addresses = parse(endpoint)?.resolve(endpoint, CONNECT_TIMEOUT)?;
        let is_here = addresses.iter().all(|address| address.ip().is_loopback());
        Ok((addresses, self.credentials(endpoint, is_here)?))
    }
}

fn parse(endpoint: &str) -> Result<Address, CarrierError> {
    let wrong = || CarrierError::NoEndpoint { endpoint: endpoint.into(), expected: EXPECTED_ENDPOINT };
    endpoint.strip_prefix("tls:").and_then(Address::parse).ok_or_else(wrong)
}

impl Carrier for Tls {
    fn listen(&self, endpoint: &str) -> Result<Box<dyn Listener>, CarrierError> {
        let (addresses, credentials) = self.resolve(endpoint)?;
        let listen = |address| TlsListener::new(endpoint, address, credentials.clone());
        Ok(Box::new(first_success(&addresses[..1], endpoint, listen)?))
    }

    fn check(&self, endpoint: &str) -> Result<(), CarrierError> {
        self.credentials(endpoint, parse(endpoint)?.may_be_here()).map(drop)
    }

    fn dial(&self, endpoint: &str) -> Result<Arc<dyn Link>, CarrierError> {
        let (addresses, credentials) = self.resolve(endpoint)?;
        let dial = |address| TlsLink::dial(endpoint, address, credentials);
        Ok(Arc::new(first_success(&addresses, endpoint, dial)?))
    }
}
