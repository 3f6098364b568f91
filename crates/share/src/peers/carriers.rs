//! The carriers of an agent, by the beginnings of their endpoints.

use std::collections::BTreeMap;
use std::sync::Arc;

use crate::carrier::local::Local;
use crate::carrier::{Carrier, CarrierError};

/// The carriers of an agent: its own, and those that are built in.
pub(crate) struct KnownCarriers(BTreeMap<String, Arc<dyn Carrier>>);

impl KnownCarriers {
    /// Those that the agent gives go before those that are built in.
    pub fn new(mut own: BTreeMap<String, Arc<dyn Carrier>>) -> Self {
        own.entry("local".into()).or_insert_with(|| Arc::new(Local));
        #[cfg(feature = "tls")]
        own.entry("tls".into()).or_insert_with(|| Arc::new(crate::carrier::tls::Tls::default()));
        #[cfg(feature = "zenoh")]
        own.entry("zenoh".into()).or_insert_with(|| Arc::new(crate::carrier::zenoh::Zenoh));
        Self(own)
    }

    /// The carrier of an endpoint.
    pub fn of(&self, endpoint: &str) -> Result<&Arc<dyn Carrier>, CarrierError> {
        let scheme = endpoint.split(':').next().unwrap_or_default();
        self.0.get(scheme).ok_or_else(|| CarrierError::NoEndpoint {
            endpoint: endpoint.into(),
            expected: match scheme {
                "tls" => {
                    "this program was built without TLS: build it with the feature `tls`, as in \
                     `cargo build --release --features tls`"
                }
                "zenoh" if endpoint.starts_with("zenoh:tls") => {
                    "there is no TLS of Zenoh: it has a carrier of its own, such as tls:192.168.1.5:7447"
                }
                "zenoh" => {
                    "this program was built without Zenoh: build it with the feature `zenoh`, as in \
                     `cargo build --release --features zenoh`"
                }
                _ => "it begins with the name of a carrier and a colon, such as local:base",
            },
        })
    }
}
