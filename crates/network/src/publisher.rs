//! Publisher that knows whether it has readers.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

use slate_blackboard::Stamp;
use slate_blackboard::interface::{Descriptor, Kind};
use slate_blackboard::wake::Wake;
use slate_ros_messages as ros;
use zenoh::bytes::Encoding;
use zenoh::matching::{MatchingListener, MatchingStatus};
use zenoh::pubsub::Publisher;
use zenoh::qos::{CongestionControl, Reliability};
use zenoh::{Session, Wait};
use zenoh_ext::{AdvancedPublisher, AdvancedPublisherBuilderExt, CacheConfig, MissDetectionConfig};

use crate::attachment::SampleAttachment;
use crate::error::NetworkError;
use crate::options::ReadMode;
use crate::shared::refused;

/// Memory for values that are kept for reliable readers, bytes.
/// Also the minimum and maximum number of these values.
const CACHE_SIZE: usize = 8 << 20;
const MIN_CACHED: usize = 8;
const MAX_CACHED: usize = 512;

/// Period at which reliable readers receive the last value's number.
/// So they notice that it was lost.
const HEARTBEAT_PERIOD: Duration = Duration::from_millis(100);

/// Publishes values at a key, each with its stamp and number.
pub struct ValuePublisher {
    /// Goes before its publisher.
    _listener: MatchingListener<()>,
    publisher: AnyPublisher,
    is_read: Arc<AtomicBool>,
    number: u64,
    /// Bytes of the last message.
    length: usize,
}

enum AnyPublisher {
    Plain(Publisher<'static>),
    /// Keeps the last values.
    Caching(AdvancedPublisher<'static>),
}

impl ValuePublisher {
    /// Declares a publisher of values of about `size` bytes at a key.
    /// `wake` is notified when its first reader comes or its last one goes.
    ///
    /// # Errors
    /// When Zenoh refuses it.
    pub fn new(
        session: &Session,
        (key, size): (String, usize),
        mode: ReadMode,
        wake: &Arc<Wake>,
    ) -> Result<Self, NetworkError> {
        // Else one peer that does not read stops all.
        let publisher = session.declare_publisher(key).congestion_control(CongestionControl::Drop);
        let is_read = Arc::new(AtomicBool::new(false));
        let (known, woken) = (Arc::clone(&is_read), Arc::clone(wake));
        let note = move |status: MatchingStatus| {
            known.store(status.matching(), Ordering::Release);
            woken.notify(1);
        };
        let (publisher, listener, status) = match mode {
            ReadMode::Usual | ReadMode::BestEffort => {
                let reliability = match mode {
                    ReadMode::BestEffort => Reliability::BestEffort,
                    _ => Reliability::Reliable,
                };
                let publisher = publisher.reliability(reliability).wait().map_err(refused)?;
                let listener = publisher.matching_listener().callback(note).wait().map_err(refused)?;
                let status = publisher.matching_status().wait().map_err(refused)?;
                (AnyPublisher::Plain(publisher), listener, status)
            }
            ReadMode::Reliable => {
                let publisher = publisher
                    .reliability(Reliability::Reliable)
                    .advanced()
                    .cache(
                        CacheConfig::default()
                            .max_samples((CACHE_SIZE / size.max(1)).clamp(MIN_CACHED, MAX_CACHED)),
                    )
                    .sample_miss_detection(MissDetectionConfig::default().heartbeat(HEARTBEAT_PERIOD))
                    .wait()
                    .map_err(refused)?;
                let listener = publisher.matching_listener().callback(note).wait().map_err(refused)?;
                let status = publisher.matching_status().wait().map_err(refused)?;
                (AnyPublisher::Caching(publisher), listener, status)
            }
        };
        if status.matching() {
            is_read.store(true, Ordering::Release);
        }
        Ok(Self { _listener: listener, publisher, is_read, number: 0, length: 0 })
    }

    /// Returns whether the publisher has readers.
    pub fn is_read(&self) -> bool {
        self.is_read.load(Ordering::Acquire)
    }

    /// Sends a value of an interface: its bytes and the items of its tail.
    ///
    /// # Errors
    /// When it can't be encoded or sent, in words.
    pub fn put(
        &mut self,
        descriptor: &Descriptor,
        encoding: &Encoding,
        (bytes, items, stamp): (&[u8], usize, Stamp),
    ) -> Result<(), String> {
        // Zenoh takes the buffer without a copy.
        let mut message = Vec::with_capacity(self.length);
        let value = unpadded(descriptor, bytes, items);
        ros::encode(descriptor, value, &mut message).map_err(|error| error.to_string())?;
        self.length = message.len();
        self.number += 1;
        let attachment = SampleAttachment { stamp, hash: descriptor.hash, number: self.number }.encode();
        let (encoding, attachment) = (encoding.clone(), &attachment[..]);
        let sent = match &self.publisher {
            AnyPublisher::Plain(own) => own.put(message).encoding(encoding).attachment(attachment).wait(),
            AnyPublisher::Caching(own) => own.put(message).encoding(encoding).attachment(attachment).wait(),
        };
        sent.map_err(|error| error.to_string())
    }
}

/// Returns the bytes of a value without the padding to its alignment.
pub fn unpadded<'a>(descriptor: &Descriptor, bytes: &'a [u8], items: usize) -> &'a [u8] {
    let item = descriptor.tail().map_or(0, Kind::size);
    bytes.get(..descriptor.size + items * item).unwrap_or(bytes)
}
