use std::io;
use std::net::{TcpListener, UdpSocket};
use std::sync::Arc;
use std::time::Duration;

use super::endpoint::{Protocol, ZenohAddress};
use super::link::ZenohLink;
use super::station::{Station, words};
use crate::carrier::{CarrierError, Link, Listener};

/// Listens at one endpoint.
#[derive(Debug)]
pub(super) struct ZenohListener(Station);

impl ZenohListener {
    pub fn new(place: &ZenohAddress) -> Result<Self, CarrierError> {
        let system = |reason: String| CarrierError::System {
            endpoint: place.text.clone(),
            error: io::Error::other(reason),
        };
        let station = Station::new().map_err(|error| system(words(&error)))?;
        station.listen(&place.locator()).map_err(|error| match bind(place) {
            Err(error) if error.kind() == io::ErrorKind::AddrInUse => {
                CarrierError::InUse { endpoint: place.text.clone(), process: None }
            }
            Err(error) => CarrierError::System { endpoint: place.text.clone(), error },
            Ok(()) => system(words(&error)),
        })?;
        Ok(Self(station))
    }
}

/// What the system says of the place, whose words are clearer than Zenoh's.
fn bind(place: &ZenohAddress) -> io::Result<()> {
    match place.protocol {
        Protocol::Udp => UdpSocket::bind(place.address).map(drop),
        Protocol::Tcp => TcpListener::bind(place.address).map(drop),
    }
}

impl Listener for ZenohListener {
    fn accept(&self, limit: Duration) -> io::Result<Option<Arc<dyn Link>>> {
        let link = self.0.accept(limit).map(|begun| ZenohLink::new(begun, None));
        // One that has ended meanwhile is none.
        Ok(link.and_then(Result::ok).map(|link| Arc::new(link) as Arc<dyn Link>))
    }
}
