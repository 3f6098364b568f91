//! Subscriptions of inputs.

use zenoh::pubsub::Subscriber;
use zenoh::sample::Sample;
use zenoh::{Session, Wait};
use zenoh_ext::{AdvancedSubscriber, AdvancedSubscriberBuilderExt, RecoveryConfig};

use crate::error::NetworkError;
use crate::options::ReadMode;
use crate::shared::refused;

/// A subscription, until this is dropped.
pub enum InputSubscriber {
    /// Takes what comes.
    Plain { _subscriber: Subscriber<()> },
    /// Asks again for what was lost.
    Recovering { _subscriber: AdvancedSubscriber<()> },
}

impl InputSubscriber {
    /// Subscribes; `take` runs in threads of Zenoh.
    ///
    /// # Errors
    /// When Zenoh refuses it.
    pub fn new(
        session: &Session,
        key: String,
        mode: ReadMode,
        take: impl Fn(Sample) + Send + Sync + 'static,
    ) -> Result<Self, NetworkError> {
        let subscriber = session.declare_subscriber(key).callback(take);
        Ok(match mode {
            ReadMode::Reliable => {
                let recovery = RecoveryConfig::default().heartbeat();
                let subscriber = subscriber.advanced().recovery(recovery).wait().map_err(refused)?;
                Self::Recovering { _subscriber: subscriber }
            }
            _ => Self::Plain { _subscriber: subscriber.wait().map_err(refused)? },
        })
    }
}
