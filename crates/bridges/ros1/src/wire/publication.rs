//! Topic that a node publishes.

use std::io;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::Duration;

use tokio::io::{AsyncReadExt, AsyncWriteExt};
use tokio::net::TcpStream;
use tokio::sync::broadcast;
use tokio::sync::broadcast::error::RecvError;
use tokio::time::timeout;

use super::header::{ConnectionHeader, length, mismatch};
use crate::checksum::message_checksum;

/// Time without progress of a message after which a subscriber is dropped.
const SEND_TIMEOUT: Duration = Duration::from_secs(30);

/// Topic, and the queues of its subscribers.
pub struct TopicPublication {
    pub topic: String,
    pub of: String,
    definition: String,
    checksum: String,
    is_latched: bool,
    messages: broadcast::Sender<Arc<[u8]>>,
    /// Last message with its length; only of a latched topic.
    last: Mutex<Option<Arc<[u8]>>>,
    /// Messages that went before a slow subscriber took them.
    lost: AtomicU64,
}

impl TopicPublication {
    /// Creates a topic of a type; `depth` messages wait for a slow subscriber.
    ///
    /// # Errors
    /// A definition that lacks a message, in words.
    pub fn new(
        topic: &str,
        (of, definition): (&str, &str),
        depth: usize,
        is_latched: bool,
    ) -> Result<Self, String> {
        Ok(Self {
            topic: topic.into(),
            of: of.into(),
            definition: definition.into(),
            checksum: message_checksum(of, definition)?,
            is_latched,
            messages: broadcast::Sender::new(depth.max(1)),
            last: Mutex::default(),
            lost: AtomicU64::new(0),
        })
    }

    /// Subscribers that are connected.
    pub fn subscribers(&self) -> usize {
        self.messages.receiver_count()
    }

    /// Returns whether a message would have a receiver.
    pub fn is_wanted(&self) -> bool {
        self.is_latched || self.subscribers() > 0
    }

    /// Messages that went before a slow subscriber took them.
    pub fn lost(&self) -> u64 {
        self.lost.load(Ordering::Relaxed)
    }

    /// Puts a message into the queue of each subscriber.
    ///
    /// # Errors
    /// When it is longer than a message can be, in words.
    pub fn publish(&self, message: &[u8]) -> Result<(), String> {
        let length = length(message.len()).map_err(|error| error.to_string())?;
        let bytes: Arc<[u8]> = [&length[..], message].concat().into();
        let mut last = self.last();
        if self.is_latched {
            *last = Some(Arc::clone(&bytes));
        }
        // There may be no subscriber.
        let _ = self.messages.send(bytes);
        Ok(())
    }

    fn last(&self) -> MutexGuard<'_, Option<Arc<[u8]>>> {
        self.last.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Sends messages to a subscriber whose header has come, until it leaves.
    ///
    /// # Errors
    /// When the connection is lost; or a text for the log, when the subscriber means another message.
    pub async fn serve(
        &self,
        mut stream: TcpStream,
        header: &ConnectionHeader,
        node: &str,
    ) -> io::Result<Option<String>> {
        if !header.takes(&self.of, &self.checksum) {
            let error = mismatch(&self.topic, "subscription", header, &self.of, &self.checksum);
            ConnectionHeader::of([("error", error.as_str())]).write(&mut stream).await?;
            return Ok(Some(error));
        }
        stream.set_nodelay(header.get("tcp_nodelay") == "1")?;
        let latching = if self.is_latched { "1" } else { "0" };
        let own = [
            ("callerid", node),
            ("latching", latching),
            ("md5sum", &self.checksum),
            ("message_definition", &self.definition),
            ("topic", &self.topic),
            ("type", &self.of),
        ];
        ConnectionHeader::of(own).write(&mut stream).await?;
        // Under one lock, so that no message comes twice.
        let (mut messages, last) = {
            let last = self.last();
            (self.messages.subscribe(), last.clone())
        };
        if let Some(last) = last {
            timeout(SEND_TIMEOUT, stream.write_all(&last)).await??;
        }
        let (mut from, mut to) = stream.split();
        let mut rest = [0; 64];
        loop {
            tokio::select! {
                // Subscribers say nothing more, but may leave.
                left = from.read(&mut rest) => if left? == 0 { return Ok(None) },
                message = messages.recv() => match message {
                    Ok(message) => timeout(SEND_TIMEOUT, to.write_all(&message)).await??,
                    Err(RecvError::Lagged(count)) => drop(self.lost.fetch_add(count, Ordering::Relaxed)),
                    Err(RecvError::Closed) => return Ok(None),
                },
            }
        }
    }
}
