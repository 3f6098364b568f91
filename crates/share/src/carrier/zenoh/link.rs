use std::io;
use std::sync::Arc;
use std::time::Duration;

use zenoh_buffers::ZBuf;
use zenoh_protocol::core::{CongestionControl, Priority, Reliability, WireExpr};
use zenoh_protocol::network::{NetworkBodyMut, NetworkMessageMut, Push, push};
use zenoh_protocol::zenoh::{PushBody, Put};
use zenoh_runtime::ZRuntime;
use zenoh_transport::unicast::TransportUnicast;

use super::endpoint::ZenohAddress;
use super::inbox::ZenohInbox;
use super::socket::Socket;
use super::station::{Begun, Station, end, words};
use crate::carrier::{CarrierError, Link};

/// The largest packet over a stream, bytes. Both ends agree on how much Zenoh takes at once, at most 64 KiB and at least
/// half of that, whatever the network takes: this fits in any case, so it is never cut. TCP cuts it to what fits there.
const LARGEST: usize = 31 << 10;

/// And over UDP, which is for one machine, whose loopback takes datagrams of 64 KiB: a dozen of these fit into a
/// socket's buffer, and a lost one costs little.
const LARGEST_DATAGRAM: usize = 16 << 10;

/// How long a link that is closed goes on sending what it has.
const FAREWELL: Duration = Duration::from_millis(20);

/// A link to one agent.
#[derive(Debug)]
pub(super) struct ZenohLink {
    transport: TransportUnicast,
    inbox: Arc<ZenohInbox>,
    /// A stream's; what datagrams have no room for is lost.
    socket: Option<Socket>,
    largest: usize,
    /// A link that was dialled has a station of its own, which goes with it.
    _station: Option<Station>,
}

impl ZenohLink {
    pub fn new(begun: Begun, station: Option<Station>) -> io::Result<Self> {
        let socket = if begun.wire.is_streamed { Some(Socket::of(&begun.wire)?) } else { None };
        let largest = socket.as_ref().map_or(LARGEST_DATAGRAM, |socket| socket.largest().min(LARGEST));
        Ok(Self { transport: begun.transport, inbox: begun.inbox, socket, largest, _station: station })
    }

    pub fn dial(place: &ZenohAddress) -> Result<Arc<Self>, CarrierError> {
        let system = |reason: String| CarrierError::System {
            endpoint: place.text.clone(),
            error: io::Error::other(reason),
        };
        let station = Station::new().map_err(|error| system(words(&error)))?;
        let begun = match station.dial(&place.locator()) {
            Ok(begun) => begun.ok_or_else(|| system("the link ended at once".into()))?,
            Err(error) => {
                let reason = words(&error);
                if reason.contains("Connection refused") {
                    return Err(CarrierError::Nobody { endpoint: place.text.clone() });
                }
                return Err(system(reason));
            }
        };
        let link = Self::new(begun, Some(station)).map_err(|error| system(error.to_string()))?;
        Ok(Arc::new(link))
    }
}

impl Link for ZenohLink {
    fn send(&self, packet: &[u8]) -> io::Result<bool> {
        self.inbox.closed()?;
        let is_full = |socket: &Socket| Ok::<_, io::Error>(!socket.wait_for_room(Duration::ZERO)?);
        if self.socket.as_ref().map_or(Ok(false), is_full)? {
            return Ok(false);
        }
        let reliability = if self.socket.is_some() { Reliability::Reliable } else { Reliability::BestEffort };
        let mut push = Push {
            wire_expr: WireExpr::empty(),
            ext_qos: push::ext::QoSType::new(Priority::DEFAULT, CongestionControl::Drop, true),
            ext_tstamp: None,
            ext_nodeid: push::ext::NodeIdType::DEFAULT,
            ext_ts_stack: None,
            payload: PushBody::Put(Put {
                timestamp: None,
                encoding: zenoh_protocol::core::Encoding::empty(),
                ext_sinfo: None,
                ext_attachment: None,
                ext_unknown: Vec::new(),
                payload: ZBuf::from(packet.to_vec()),
            }),
        };
        let message = NetworkMessageMut { body: NetworkBodyMut::Push(&mut push), reliability };
        self.transport
            .schedule(message)
            .map_err(|error| io::Error::new(io::ErrorKind::ConnectionAborted, error.to_string()))
    }

    fn wait_for_room(&self, limit: Duration) -> io::Result<()> {
        if let Some(socket) = &self.socket {
            socket.wait_for_room(limit)?;
        }
        self.inbox.closed()
    }

    fn receive(&self, packet: &mut [u8], limit: Duration) -> io::Result<Option<usize>> {
        self.inbox.take(packet, limit)
    }

    fn largest(&self) -> usize {
        self.largest
    }

    fn close(&self) {
        self.inbox.close("the link was closed");
        let transport = self.transport.clone();
        ZRuntime::Net.spawn(async move {
            // What was sent last may say why.
            tokio::time::sleep(FAREWELL).await;
            end(&transport).await;
        });
    }
}

impl Drop for ZenohLink {
    fn drop(&mut self) {
        self.close();
    }
}
