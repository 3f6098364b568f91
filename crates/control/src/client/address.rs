//! Network addresses of agents.

use std::fmt;
use std::net::{SocketAddr, ToSocketAddrs};
use std::str::FromStr;

/// Reason why a host is refused.
const INVALID_HOST: &str =
    "its host is invalid; write a name, an IPv4 address, or an IPv6 address in brackets such as [::1]";

/// Network address of an agent, such as `https://robot.local:7878`.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Address {
    /// Use of TLS.
    pub is_secure: bool,
    /// Host; in brackets when it is an IPv6 address.
    host: String,
    port: u16,
}

impl Address {
    /// Returns the host and port, as requests name them.
    pub fn authority(&self) -> String {
        format!("{}:{}", self.host, self.port)
    }

    /// Returns the host as certificates name it.
    pub fn host(&self) -> &str {
        self.host.trim_start_matches('[').trim_end_matches(']')
    }

    /// Resolves the name to at least one address.
    ///
    /// # Errors
    /// When it stands for none.
    pub fn resolve(&self) -> std::io::Result<Vec<SocketAddr>> {
        let found: Vec<_> = (self.host(), self.port).to_socket_addrs()?.collect();
        match found.is_empty() {
            true => Err(std::io::Error::other(format!(
                "the host `{}` has no IP address; check the name, or write the IP address",
                self.host()
            ))),
            false => Ok(found),
        }
    }

    /// Returns whether two addresses lead to one agent.
    /// This computer has several names.
    pub fn is_same(&self, other: &Self) -> bool {
        let is_here = |address: &Self| matches!(address.host(), "127.0.0.1" | "::1" | "localhost");
        (self.is_secure, self.port) == (other.is_secure, other.port)
            && (self.host == other.host || is_here(self) && is_here(other))
    }
}

impl fmt::Display for Address {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let scheme = if self.is_secure { "https" } else { "http" };
        write!(f, "{scheme}://{}:{}", self.host, self.port)
    }
}

impl FromStr for Address {
    type Err = &'static str;

    fn from_str(text: &str) -> Result<Self, Self::Err> {
        let (scheme, rest) =
            text.split_once("://").ok_or("it has no scheme; begin it with http:// or https://")?;
        let (is_secure, usual) = match scheme.to_ascii_lowercase().as_str() {
            "http" => (false, 80),
            "https" => (true, 443),
            _ => return Err("its scheme is neither http nor https; begin it with http:// or https://"),
        };
        let (authority, path) = rest.split_at(rest.find(['/', '?', '#']).unwrap_or(rest.len()));
        if path.contains("token=") {
            return Err("a secret in a command is seen by others: put it into SLATE_TOKEN");
        }
        if !matches!(path, "" | "/") {
            return Err("it has a path; remove all after host and port");
        }
        let end = if authority.starts_with('[') {
            authority.find(']').map(|end| end + 1)
        } else {
            authority.find(':')
        };
        let (host, port) = authority.split_at(end.unwrap_or(authority.len()));
        let port = match port.strip_prefix(':') {
            Some(port) => port
                .parse()
                .ok()
                .filter(|port| *port > 0)
                .ok_or("its port is not a number from 1 to 65535")?,
            None if port.is_empty() => usual,
            None => return Err(INVALID_HOST),
        };
        let is_name = |c: char| c.is_ascii_alphanumeric() || matches!(c, '.' | '-' | '_');
        let is_good = match host.strip_prefix('[').and_then(|host| host.strip_suffix(']')) {
            Some(host) => host.parse::<std::net::Ipv6Addr>().is_ok(),
            None => !host.is_empty() && host.chars().all(is_name),
        };
        match is_good {
            true => Ok(Self { is_secure, host: host.to_ascii_lowercase(), port }),
            false => Err(INVALID_HOST),
        }
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used, reason = "a test that fails panics")]
mod tests {
    use proptest::prelude::*;

    use super::*;

    #[test]
    fn an_address_has_a_scheme_a_host_and_perhaps_a_port() {
        for (text, whole, host) in [
            ("http://127.0.0.1:7878", "http://127.0.0.1:7878", "127.0.0.1"),
            ("HTTPS://Robot.local:7878/", "https://robot.local:7878", "robot.local"),
            ("https://robot", "https://robot:443", "robot"),
            ("http://[::1]:7", "http://[::1]:7", "::1"),
            ("http://[::1]", "http://[::1]:80", "::1"),
        ] {
            let address: Address = text.parse().unwrap();
            assert_eq!((address.to_string().as_str(), address.host()), (whole, host), "{text}");
        }
        for (text, words) in [
            ("robot:7878", "scheme"),
            ("ws://robot", "neither"),
            ("http://", "host"),
            ("http://robot:0", "port"),
            ("http://robot:70000", "port"),
            ("http://a b", "host"),
            ("http://me@robot", "host"),
            ("http://[robot]", "host"),
            ("http://[::1]x", "host"),
            ("http://robot\r\nX-Evil", "host"),
            ("http://robot/api", "path"),
            ("http://robot/#token=0123", "SLATE_TOKEN"),
        ] {
            assert!(text.parse::<Address>().unwrap_err().contains(words), "{text}");
        }
    }

    #[test]
    fn this_computer_has_several_names() {
        let same = |a: &str, b: &str| a.parse::<Address>().unwrap().is_same(&b.parse().unwrap());
        assert!(same("http://localhost:7878", "http://127.0.0.1:7878"));
        assert!(same("https://robot.local:7878", "https://ROBOT.local:7878"));
        assert!(!same("http://localhost:7878", "http://127.0.0.1:7879"));
        assert!(!same("http://localhost:7878", "https://localhost:7878"));
        assert!(!same("https://robot:7878", "https://localhost:7878"));
    }

    proptest! {
        /// Property: an accepted address has no characters that end a line of a request.
        #[test]
        fn invalid_address_is_refused(text in "(http|https)://[ -~\\r\\n]{0,20}") {
            if let Ok(address) = text.parse::<Address>() {
                let again: Address = address.to_string().parse().unwrap();
                prop_assert_eq!(&again, &address);
                prop_assert!(address.authority().chars().all(|c| c.is_ascii_graphic()));
            }
        }
    }
}
