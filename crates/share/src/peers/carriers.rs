//! Carriers of an agent, by the prefix of their endpoints.

use std::sync::Arc;

use slate_sorted::SortedMap;

use crate::carrier::local::Local;
use crate::carrier::{Carrier, CarrierError};

/// Carriers of an agent: its own, and built-in ones.
pub(crate) struct KnownCarriers(SortedMap<String, Arc<dyn Carrier>>);

impl KnownCarriers {
    /// Adds the built-in carriers; those of the agent take precedence.
    pub fn new(mut own: SortedMap<String, Arc<dyn Carrier>>) -> Self {
        own.entry("local".into()).or_insert_with(|| Arc::new(Local));
        #[cfg(feature = "tls")]
        own.entry("tls".into()).or_insert_with(|| Arc::new(crate::carrier::tls::Tls::default()));
        Self(own)
    }

    /// Returns the carrier of an endpoint.
    pub fn of(&self, endpoint: &str) -> Result<&Arc<dyn Carrier>, CarrierError> {
        let scheme = endpoint.split(':').next().unwrap_or_default();
        self.0.get(scheme).ok_or_else(|| CarrierError::NoEndpoint {
            endpoint: endpoint.into(),
            expected: match scheme {
                "tls" => {
                    "this program was built without TLS: build it with the feature `tls`, as in \
                     `cargo build --release --features tls`"
                }
                "zenoh" => {
                    "Zenoh has a table of its own: put it into `listen` or `connect` of [network], such as \
                     [network] connect = [\"tcp/127.0.0.1:7447\"], and links to its agents into `read`"
                }
                _ => "it begins with the name of a carrier and a colon, such as local:base",
            },
        })
    }
}
