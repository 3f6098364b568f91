//! Middleware of a node, as `[ros2]` says.

use slate_network::NetworkEndpoint;
use slate_runtime::configuration::{Span, Table};
use slate_topics::{RosError, TableReader};

/// Default router of `rmw_zenoh`.
const ROUTER: &str = "tcp/localhost:7447";

/// Middleware that carries a node.
#[derive(Clone, Debug, Default, PartialEq)]
pub enum RosWireSettings {
    /// DDS, as of `rmw_fastrtps` and `rmw_cyclonedds`.
    #[default]
    Dds,
    /// Zenoh, as of `rmw_zenoh`.
    Zenoh {
        /// Router of which the node is a client.
        router: NetworkEndpoint,
    },
}

impl RosWireSettings {
    /// Creates the settings of Zenoh through a router, such as `tcp/localhost:7447`.
    /// A router on another machine needs a trusted network.
    ///
    /// # Errors
    /// Reason why the endpoint is invalid, and help.
    pub fn zenoh(router: &str, trusted: bool) -> Result<Self, (String, &'static str)> {
        const LOCAL: &str = "connect to a router on this machine, which reaches others by `quic/` or `tls/`";
        let router = NetworkEndpoint::parse(router)?;
        if router.carrier() != "tcp" {
            return Err((format!("`{router}` is not an endpoint of `tcp/`"), LOCAL));
        }
        if !trusted && !router.is_loopback() {
            let message = format!("`{router}` is on another machine, and what goes there is clear text");
            return Err((
                message,
                "connect to a router on this machine, which reaches others by `quic/` or `tls/`; or declare the network trusted: trusted = true",
            ));
        }
        Ok(Self::Zenoh { router })
    }

    /// Returns the settings of Zenoh through the router on this machine.
    pub fn local_zenoh() -> Self {
        Self::Zenoh { router: NetworkEndpoint { text: ROUTER.into(), place: None } }
    }

    /// Returns name and features of the middleware, and whether this program has it.
    fn built_in(&self) -> (&'static str, &'static str, bool) {
        match self {
            Self::Dds => ("DDS", "ros2", cfg!(feature = "dds")),
            Self::Zenoh { .. } => ("Zenoh", "ros2,zenoh", cfg!(feature = "zenoh")),
        }
    }

    fn check(&self) -> Result<(), RosError> {
        if self.built_in().2 { Ok(()) } else { Err(self.is_missing()) }
    }

    /// Returns the error of a program without it.
    pub(crate) fn is_missing(&self) -> RosError {
        let (name, features, _) = self.built_in();
        RosError::Network {
            network: format!("ROS 2 over {name}"),
            reason: format!("this program is built without the features `{features}`"),
            help: match self {
                Self::Dds => "build it with DDS: cargo build --release --features ros2",
                Self::Zenoh { .. } => "build it with Zenoh: cargo build --release --features ros2,zenoh",
            },
        }
    }

    /// Says where a table names a middleware that this program lacks.
    fn check_in(&self, reader: &mut TableReader<'_>, place: Option<Span>) {
        // A program without any only reads configurations.
        if cfg!(feature = "wire")
            && let Err(error) = self.check()
        {
            reader.add(place, error.to_string(), error.help());
        }
    }

    /// Reads the keys `wire` and `router` of a table.
    pub(crate) fn of(reader: &mut TableReader<'_>, table: &Table, trusted: bool) -> Self {
        const WIRES: &str = "write wire = \"dds\" or wire = \"zenoh\"";
        const EXAMPLE: &str = "write router = \"tcp/localhost:7447\"";
        let is_zenoh = match reader.text(table, "wire", WIRES) {
            None => false,
            Some((name, span)) if name == "dds" => {
                Self::Dds.check_in(reader, span.into());
                false
            }
            Some((name, span)) if name == "zenoh" => {
                Self::local_zenoh().check_in(reader, span.into());
                true
            }
            Some((name, span)) => {
                reader.add(span, format!("expected `wire` to be dds or zenoh, found {name:?}"), WIRES);
                return Self::Dds;
            }
        };
        let Some((router, span)) = reader.text(table, "router", EXAMPLE) else {
            return if is_zenoh { Self::local_zenoh() } else { Self::Dds };
        };
        if !is_zenoh {
            let help = "write wire = \"zenoh\", too; or take `router` away";
            reader.add(span, "DDS has no router, and `router` names one", help);
            return Self::Dds;
        }
        match Self::zenoh(&router, trusted) {
            Ok(Self::Zenoh { router }) => {
                Self::Zenoh { router: NetworkEndpoint { place: Some(span), ..router } }
            }
            Ok(other) => other,
            Err((message, help)) => {
                reader.add(span, message, help);
                Self::Dds
            }
        }
    }
}
