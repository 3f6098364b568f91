//! Endpoints, as Zenoh writes them.

use std::net::IpAddr;

use slate_runtime::configuration::Span;

/// Endpoint at which a session listens or to which it connects.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct NetworkEndpoint {
    /// Endpoint in Zenoh's notation, such as `tcp/127.0.0.1:7447`.
    pub text: String,
    /// Place in the configuration.
    pub place: Option<Span>,
}

/// Carriers that Slate's sessions are built with.
const CARRIERS: [&str; 3] = ["quic", "tcp", "udp"];

impl NetworkEndpoint {
    /// Reads an endpoint.
    ///
    /// # Errors
    /// Reason why it is invalid, and help.
    pub fn parse(text: &str) -> Result<Self, (String, &'static str)> {
        const HELP: &str = "an endpoint is a carrier, a host and a port, such as \"tcp/127.0.0.1:7447\"";
        let wrong = |reason: String| Err((reason, HELP));
        let Some((carrier, address)) = text.split_once('/') else {
            return wrong(format!("`{text}` is not an endpoint"));
        };
        match carrier {
            "tls" => {
                let message = format!(
                    "`{text}` can't be used: Zenoh's TLS lets two threads into one connection at once"
                );
                return Err((message, "use `quic/`, which is encrypted with the same certificates"));
            }
            carrier if !CARRIERS.contains(&carrier) => {
                return Err((
                    format!("`{carrier}` is not a carrier of this program"),
                    "use `quic/`, `tcp/` or `udp/`",
                ));
            }
            _ => {}
        }
        if text.contains(['?', '#']) {
            return Err((
                format!("`{text}` has options"),
                "options of endpoints are not supported yet; leave out what follows the port",
            ));
        }
        let Some((host, port)) = address.rsplit_once(':').filter(|(host, _)| !host.is_empty()) else {
            return wrong(format!("`{text}` has no host and port"));
        };
        if port.parse::<u16>().is_err() {
            return wrong(format!("`{port}` is not a port"));
        }
        if host.contains(':') && !(host.starts_with('[') && host.ends_with(']')) {
            return Err((
                format!("`{host}` is not a host"),
                "an address of IPv6 stands in brackets, such as \"tcp/[::1]:7447\"",
            ));
        }
        Ok(Self { text: text.into(), place: None })
    }

    /// Returns the carrier, such as `tcp`.
    pub fn carrier(&self) -> &str {
        self.text.split('/').next().unwrap_or_default()
    }

    /// Returns the host and port.
    pub fn address(&self) -> &str {
        self.text.split_once('/').map_or("", |(_, address)| address)
    }

    /// Returns whether both ends authenticate by certificates.
    pub fn is_encrypted(&self) -> bool {
        self.carrier() == "quic"
    }

    /// Returns whether only programs of this machine are reached through it.
    pub fn is_loopback(&self) -> bool {
        let host = self.address().rsplit_once(':').map_or("", |(host, _)| host);
        let host = host.trim_start_matches('[').trim_end_matches(']');
        host == "localhost" || host.parse::<IpAddr>().is_ok_and(|address| address.is_loopback())
    }
}

impl std::fmt::Display for NetworkEndpoint {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(&self.text)
    }
}
