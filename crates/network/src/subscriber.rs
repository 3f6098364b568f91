//! Subscriptions of inputs.

use std::sync::Arc;

use slate_blackboard::wake::Wake;
use zenoh::pubsub::Subscriber;
use zenoh::sample::Sample;
use zenoh::{Session, Wait};

use crate::error::NetworkError;
use crate::reading::InputReader;
use crate::shared::refused;

/// Subscription of an input, until dropped.
pub struct InputSubscriber {
    _samples: Subscriber<()>,
    /// Numbers of publishers' last samples, with recovery.
    _heartbeats: Option<Subscriber<()>>,
}

impl InputSubscriber {
    /// Subscribes to the reader's key.
    /// Values are taken in threads of Zenoh, and `wake` is notified when the network's thread must act.
    ///
    /// # Errors
    /// When Zenoh refuses it.
    pub fn new(session: &Session, reader: &Arc<InputReader>, wake: &Arc<Wake>) -> Result<Self, NetworkError> {
        let subscribe = |key: String, take: Box<dyn Fn(Sample) + Send + Sync>| {
            session.declare_subscriber(key).callback(take).wait().map_err(refused)
        };
        let Some(recovery) = reader.recovery() else {
            let (own, wake) = (Arc::clone(reader), Arc::clone(wake));
            let take = move |sample: Sample| {
                if own.take(&sample, false) {
                    wake.notify(1);
                }
            };
            return Ok(Self { _samples: subscribe(reader.key(), Box::new(take))?, _heartbeats: None });
        };
        let (received, announced) = (Arc::clone(recovery), Arc::clone(recovery));
        let heartbeats =
            subscribe(recovery.cache_key(), Box::new(move |sample| announced.announce(&sample)))?;
        let samples = subscribe(reader.key(), Box::new(move |sample| received.take(sample)))?;
        Ok(Self { _samples: samples, _heartbeats: Some(heartbeats) })
    }
}
