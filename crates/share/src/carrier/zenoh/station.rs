use std::any::Any;
use std::sync::mpsc::{Receiver, SyncSender, sync_channel};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::Duration;

use zenoh_buffers::buffer::{Buffer, SplitBuffer};
use zenoh_link::Link as Wire;
use zenoh_protocol::core::EndPoint;
use zenoh_protocol::network::{NetworkBodyMut, NetworkMessageMut};
use zenoh_protocol::zenoh::PushBody;
use zenoh_result::ZResult;
use zenoh_runtime::ZRuntime;
use zenoh_transport::multicast::TransportMulticast;
use zenoh_transport::unicast::TransportUnicast;
use zenoh_transport::{
    TransportEventHandler, TransportManager, TransportMulticastEventHandler, TransportPeer,
    TransportPeerEventHandler,
};

use super::PATIENCE;
use super::inbox::ZenohInbox;

/// How many links may wait until they are accepted.
const BACKLOG: usize = 64;

/// How many links one endpoint has at most.
const LINKS: usize = 512;

/// After that time without any sign of the other end Zenoh gives a link up. Sessions notice it far earlier.
const LEASE: Duration = Duration::from_secs(4);

/// How long a packet waits for room in a queue of Zenoh, which wakes it then, before its sender looks for something else
/// to do.
const ROOM: Duration = Duration::from_micros(100);

/// A link that has begun.
#[derive(Debug)]
pub(super) struct Begun {
    pub transport: TransportUnicast,
    pub wire: Wire,
    pub inbox: Arc<ZenohInbox>,
}

/// Zenoh's transports of one endpoint, dialled or listened at.
pub(super) struct Station {
    manager: TransportManager,
    begun: Mutex<Receiver<Begun>>,
}

impl std::fmt::Debug for Station {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Station").finish_non_exhaustive()
    }
}

impl Station {
    pub fn new() -> ZResult<Self> {
        let (sender, begun) = sync_channel(BACKLOG);
        let unicast = TransportManager::config_unicast()
            .lease(LEASE)
            .open_timeout(PATIENCE)
            .accept_timeout(PATIENCE)
            .accept_pending(BACKLOG)
            .max_sessions(LINKS)
            // The thread that sends writes to the socket itself. Otherwise a thread of Zenoh does, which has to be woken.
            .lowlatency(true)
            // Agents use one priority.
            .qos(false);
        let manager = TransportManager::builder()
            .unicast(unicast)
            .wait_before_drop(ROOM)
            .max_wait_before_drop_fragments(ROOM)
            .build(Arc::new(StationDoor(sender)))?;
        Ok(Self { manager, begun: Mutex::new(begun) })
    }

    pub fn listen(&self, locator: &str) -> ZResult<()> {
        let endpoint: EndPoint = locator.parse()?;
        ZRuntime::Net.block_in_place(self.manager.add_listener_unicast(endpoint)).map(drop)
    }

    pub fn dial(&self, locator: &str) -> ZResult<Option<Begun>> {
        let endpoint: EndPoint = locator.parse()?;
        ZRuntime::Net.block_in_place(self.manager.open_transport_unicast(endpoint))?;
        Ok(self.accept(Duration::ZERO))
    }

    /// The next link that has begun.
    pub fn accept(&self, limit: Duration) -> Option<Begun> {
        self.begun.lock().unwrap_or_else(PoisonError::into_inner).recv_timeout(limit).ok()
    }

    /// Ends all, some time later.
    pub fn close(&self) {
        let manager = self.manager.clone();
        ZRuntime::Net.spawn(async move {
            for transport in manager.get_transports_unicast().await {
                end(&transport).await;
            }
            manager.close().await;
        });
    }
}

impl Drop for Station {
    fn drop(&mut self) {
        self.close();
    }
}

/// Ends a link.
pub(super) async fn end(transport: &TransportUnicast) {
    for link in transport.get_links().unwrap_or_default() {
        if link.is_streamed {
            // To say that it ends would wait for room, and there is none if the other end does not read.
            let _ = transport.close_link(link).await;
        } else {
            // Nothing but a datagram tells the other end, and there is always room for one.
            let _ = transport.close().await;
        }
    }
}

/// Why something failed, without the lines of Zenoh's code.
pub(super) fn words(error: &zenoh_result::Error) -> String {
    let mut text = error.to_string();
    while let Some(end) = text.find(".rs:") {
        let Some(begin) = text[..end].rfind(" at ") else { break };
        let digits =
            text[end + 4..].find(|c: char| !c.is_ascii_digit()).map_or(text.len(), |at| end + 4 + at);
        let dot = usize::from(text[digits..].starts_with('.'));
        text.replace_range(begin..digits + dot, "");
    }
    text
}

/// Hears of links that begin.
struct StationDoor(SyncSender<Begun>);

impl TransportEventHandler for StationDoor {
    fn new_unicast(
        &self,
        mut peer: TransportPeer,
        transport: TransportUnicast,
    ) -> ZResult<Arc<dyn TransportPeerEventHandler>> {
        let wire = peer.links.pop().ok_or_else(|| zenoh_result::zerror!("a transport without a link"))?;
        let inbox = Arc::new(ZenohInbox::default());
        let begun = Begun { transport, wire, inbox: Arc::clone(&inbox) };
        self.0.try_send(begun).map_err(|_| zenoh_result::zerror!("too many links wait to be accepted"))?;
        Ok(Arc::new(Ear(inbox)))
    }

    fn new_multicast(&self, _: TransportMulticast) -> ZResult<Arc<dyn TransportMulticastEventHandler>> {
        Err(zenoh_result::zerror!("there is no multicast here").into())
    }
}

/// Hears what comes over a link.
struct Ear(Arc<ZenohInbox>);

impl TransportPeerEventHandler for Ear {
    fn handle_message(&self, message: NetworkMessageMut<'_>) -> ZResult<()> {
        // Agents send nothing else.
        if let NetworkBodyMut::Push(push) = message.body
            && let PushBody::Put(put) = &push.payload
        {
            self.0.put(put.payload.len(), put.payload.slices());
        }
        Ok(())
    }

    fn new_link(&self, _: Wire) {}

    fn del_link(&self, _: Wire) {
        self.closed();
    }

    fn closed(&self) {
        self.0.close("the other end closed the link");
    }

    fn as_any(&self) -> &dyn Any {
        self
    }
}
