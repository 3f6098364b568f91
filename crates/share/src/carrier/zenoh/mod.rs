//! Agents of one machine, over the transports of [Zenoh](https://zenoh.io): TCP and UDP.
//!
//! Endpoints are `zenoh:tcp/HOST:PORT` and `zenoh:udp/HOST:PORT`. Nothing is listened at and nobody is looked for but what
//! they name. What leaves the machine has to be encrypted: [`tls`](super::tls) does that. (Zenoh's own TLS, as of 1.10.2,
//! lets two threads into one connection at once, which breaks links and may do worse:
//! <https://github.com/eclipse-zenoh/zenoh/issues/2557>.)
//!
//! Of Zenoh this uses the transports and not the publications above them. Thus each link belongs to one agent, and no other
//! one can write to it or read from it; a sender knows whether there was room; and there is nothing to discover, to route,
//! or to switch off.

mod endpoint;
mod inbox;
mod link;
mod listener;
mod socket;
mod station;

use std::net::SocketAddr;
use std::sync::Arc;
use std::time::Duration;

use super::{Carrier, CarrierError, Link, Listener, first_of};
use endpoint::Endpoint;
use link::ZenohLink;
use listener::ZenohListener;

/// How long an address, a handshake, or both ends of a new link may take together. The thread of the agent that is
/// dialled waits for it, and nobody else.
const PATIENCE: Duration = Duration::from_secs(1);

/// Carries packets over TCP and UDP.
#[derive(Clone, Debug, Default)]
pub struct Zenoh;

/// What leaves the machine has to be encrypted, and both ends have to be known.
fn refuse(endpoint: &str, is_here: bool) -> Result<(), CarrierError> {
    if is_here {
        return Ok(());
    }
    let reason =
        "it is not on this machine: there it has to be tls:HOST:PORT, with certificates in [share.security]";
    Err(CarrierError::Unsafe { endpoint: endpoint.into(), reason: reason.into() })
}

fn find(endpoint: &str) -> Result<(Endpoint, Vec<SocketAddr>), CarrierError> {
    let named = Endpoint::parse(endpoint)?;
    let addresses = named.resolve()?;
    refuse(endpoint, addresses.iter().all(|address| address.ip().is_loopback()))?;
    Ok((named, addresses))
}

impl Carrier for Zenoh {
    fn listen(&self, endpoint: &str) -> Result<Box<dyn Listener>, CarrierError> {
        let (named, addresses) = find(endpoint)?;
        let listen = |address| ZenohListener::new(&named.at(address));
        Ok(Box::new(first_of(&addresses[..1], endpoint, listen)?))
    }

    fn check(&self, endpoint: &str) -> Result<(), CarrierError> {
        refuse(endpoint, Endpoint::parse(endpoint)?.address.may_be_here())
    }

    fn dial(&self, endpoint: &str) -> Result<Arc<dyn Link>, CarrierError> {
        let (named, addresses) = find(endpoint)?;
        first_of(&addresses, endpoint, |address| Ok(ZenohLink::dial(&named.at(address))? as Arc<dyn Link>))
    }
}
