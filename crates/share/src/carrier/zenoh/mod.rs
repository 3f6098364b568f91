//! Agents of one machine or several, over the transports of [Zenoh](https://zenoh.io): TCP, UDP and TLS.
//!
//! Endpoints are `zenoh:tcp/HOST:PORT`, `zenoh:udp/HOST:PORT` and `zenoh:tls/HOST:PORT`. Nothing is listened at and
//! nobody is looked for but what they name. What leaves the machine has to be TLS with certificates of both ends.
//!
//! Of Zenoh this uses the transports and not the publications above them. Thus each link belongs to one agent, whose
//! certificate is known, and no other one can write to it or read from it; a sender knows whether there was room; and
//! there is nothing to discover, to route, or to switch off.

mod credentials;
mod endpoint;
mod inbox;
mod link;
mod listener;
mod socket;
mod station;

use std::sync::Arc;
use std::time::Duration;

use super::{Carrier, CarrierError, Link, Listener};
pub use credentials::{Credentials, Files};
use endpoint::{Endpoint, Place, Protocol};
use link::ZenohLink;
use listener::ZenohListener;

/// How long an address, a handshake, or both ends of a new link may take together. The thread of the agent that is
/// dialled waits for it, and nobody else.
const PATIENCE: Duration = Duration::from_secs(1);

/// Carries packets over TCP, UDP and TLS.
#[derive(Clone, Debug, Default)]
pub struct Zenoh {
    credentials: Option<Credentials>,
    is_restricted: bool,
}

impl Zenoh {
    /// Carries packets on this machine.
    pub fn new() -> Self {
        Self::default()
    }

    /// Carries packets over TLS too. It leaves this machine only when `is_restricted`: when it is said what each agent
    /// may do.
    pub fn with_credentials(credentials: Credentials, is_restricted: bool) -> Self {
        Self { credentials: Some(credentials), is_restricted }
    }

    fn place(&self, endpoint: &str) -> Result<Place, CarrierError> {
        let place = Endpoint::parse(endpoint)?.resolve()?;
        self.refuse(endpoint, place.protocol, place.address.ip().is_loopback())?;
        Ok(place)
    }

    /// What leaves the machine has to be encrypted, both ends have to be known, and what they may do has to be said.
    fn refuse(&self, endpoint: &str, protocol: Protocol, is_here: bool) -> Result<(), CarrierError> {
        let is_tls = protocol == Protocol::Tls;
        let reason = if is_tls && self.credentials.is_none() {
            "TLS needs `certificate`, `key` and `authority` in [share.security]"
        } else if is_here {
            return Ok(());
        } else if !is_tls {
            "it is not on this machine: there it has to be zenoh:tls/..., with certificates in [share.security]"
        } else if !self.is_restricted {
            "it is not on this machine: say in [share.security.allow] what each agent may read and send"
        } else {
            return Ok(());
        };
        Err(CarrierError::Unsafe { endpoint: endpoint.into(), reason: reason.into() })
    }
}

impl Carrier for Zenoh {
    fn listen(&self, endpoint: &str) -> Result<Box<dyn Listener>, CarrierError> {
        let place = self.place(endpoint)?;
        Ok(Box::new(ZenohListener::new(&place, self.credentials.as_ref())?))
    }

    fn check(&self, endpoint: &str) -> Result<(), CarrierError> {
        let parsed = Endpoint::parse(endpoint)?;
        // What a name stands for is seen when it is dialled.
        self.refuse(endpoint, parsed.protocol, parsed.address().is_none_or(|address| address.is_loopback()))
    }

    fn dial(&self, endpoint: &str) -> Result<Arc<dyn Link>, CarrierError> {
        let place = self.place(endpoint)?;
        Ok(ZenohLink::dial(&place, self.credentials.as_ref())?)
    }
}
