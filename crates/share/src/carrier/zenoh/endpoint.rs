use std::io;
use std::net::{IpAddr, SocketAddr};

use zenoh_runtime::ZRuntime;

use super::PATIENCE;
use crate::carrier::CarrierError;

const EXPECTED: &str = "zenoh carries tcp, udp and tls: zenoh:tcp/HOST:PORT, zenoh:udp/HOST:PORT or \
                        zenoh:tls/HOST:PORT, such as zenoh:tcp/127.0.0.1:7447";

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Protocol {
    Tcp,
    Udp,
    Tls,
}

/// Where an agent is, as it was written.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Endpoint {
    pub text: String,
    pub protocol: Protocol,
    host: String,
    port: u16,
}

/// Where that is.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Place {
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
                "tls" => Protocol::Tls,
                _ => return None,
            };
            let (host, port) = address.rsplit_once(':')?;
            let port = port.parse().ok().filter(|port| *port != 0)?;
            let inner = host.strip_prefix('[').and_then(|host| host.strip_suffix(']'));
            let good = match inner {
                Some(inner) => inner.parse::<std::net::Ipv6Addr>().is_ok(),
                // Zenoh would take other characters for options of its own.
                None => host.bytes().all(|c| c.is_ascii_alphanumeric() || c == b'.' || c == b'-'),
            };
            (good && !host.is_empty()).then(|| (protocol, host.to_owned(), port))
        };
        let (protocol, host, port) =
            parts().ok_or_else(|| CarrierError::NoEndpoint { endpoint: text.into(), expected: EXPECTED })?;
        Ok(Self { text: text.into(), protocol, host, port })
    }

    /// The address, if it is one and not a name.
    pub fn address(&self) -> Option<IpAddr> {
        self.host.trim_matches(['[', ']']).parse().ok()
    }

    /// Looks for the host, for a while.
    pub fn resolve(&self) -> Result<Place, CarrierError> {
        let address = format!("{}:{}", self.host, self.port);
        let found = ZRuntime::Net.block_in_place(async {
            // The names of the system's resolver may take far longer; that goes on without this thread.
            tokio::time::timeout(PATIENCE, tokio::net::lookup_host(&address)).await
        });
        let unknown = |reason: String| CarrierError::System {
            endpoint: self.text.clone(),
            error: io::Error::new(
                io::ErrorKind::NotFound,
                format!("host `{}` is not found: {reason}", self.host),
            ),
        };
        let mut found = match found {
            Ok(found) => found.map_err(|error| unknown(error.to_string()))?,
            Err(_) => return Err(unknown(format!("no answer within {} ms", PATIENCE.as_millis()))),
        };
        let address = found.next().ok_or_else(|| unknown("it has no address".into()))?;
        Ok(Place { text: self.text.clone(), protocol: self.protocol, address })
    }
}

impl Place {
    /// As Zenoh writes it.
    pub fn locator(&self) -> String {
        let protocol = match self.protocol {
            Protocol::Tcp => "tcp",
            Protocol::Udp => "udp",
            Protocol::Tls => "tls",
        };
        format!("{protocol}/{}", self.address)
    }
}
