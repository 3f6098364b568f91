use std::net::SocketAddr;

use super::PATIENCE;
use crate::carrier::CarrierError;
use crate::carrier::address::Address;

const EXPECTED: &str = "zenoh carries tcp and udp: zenoh:tcp/HOST:PORT or zenoh:udp/HOST:PORT, such as \
                        zenoh:tcp/127.0.0.1:7447; TLS has a carrier of its own, such as tls:192.168.1.5:7447";

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Protocol {
    Tcp,
    Udp,
}

/// Where an agent is, as it was written.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Endpoint {
    pub text: String,
    pub protocol: Protocol,
    pub address: Address,
}

/// Where that is.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct ZenohAddress {
    pub text: String,
    pub protocol: Protocol,
    pub address: SocketAddr,
}

impl Endpoint {
    pub fn parse(text: &str) -> Result<Self, CarrierError> {
        let parts = || {
            let (protocol, address) = text.strip_prefix("zenoh:")?.split_once('/')?;
            let protocol = match protocol {
                "tcp" => Protocol::Tcp,
                "udp" => Protocol::Udp,
                _ => return None,
            };
            // Zenoh takes other characters for options of its own.
            Some((protocol, Address::parse(address)?))
        };
        let (protocol, address) =
            parts().ok_or_else(|| CarrierError::NoEndpoint { endpoint: text.into(), expected: EXPECTED })?;
        Ok(Self { text: text.into(), protocol, address })
    }

    /// Looks for the host, for a while.
    pub fn resolve(&self) -> Result<Vec<SocketAddr>, CarrierError> {
        self.address.resolve(&self.text, PATIENCE)
    }

    /// One of its addresses.
    pub fn at(&self, address: SocketAddr) -> ZenohAddress {
        ZenohAddress { text: self.text.clone(), protocol: self.protocol, address }
    }
}

impl ZenohAddress {
    /// As Zenoh writes it.
    pub fn locator(&self) -> String {
        let protocol = match self.protocol {
            Protocol::Tcp => "tcp",
            Protocol::Udp => "udp",
        };
        format!("{protocol}/{}", self.address)
    }
}
