//! Opens sessions of Zenoh.

use std::net::{TcpListener, TcpStream, ToSocketAddrs, UdpSocket};
use std::time::Duration;

use serde_json::{Value as Json, json};
use zenoh::{Config, Session, Wait};

use crate::endpoint::NetworkEndpoint;
use crate::error::NetworkError;
use crate::settings::{NetworkMode, NetworkSettings};

/// How long a client waits for its router, ms.
const ROUTER: u64 = 3_000;

/// After so long without a packet a peer counts as gone, ms.
const LEASE: u64 = 3_000;

/// The largest message that is received, bytes: what others send must not fill the memory.
const LARGEST: usize = 64 << 20;

/// How long it is looked why a router is not reached.
const LOOK: Duration = Duration::from_millis(500);

/// Opens a session. A peer or router connects later to what is not there yet; a client needs its router at once.
///
/// # Errors
/// When an endpoint can't be listened at, or a client reaches no router.
pub fn open(settings: &NetworkSettings) -> Result<Session, NetworkError> {
    let config = config(settings)?;
    zenoh::open(config).wait().map_err(|error| diagnosis(settings, &error.to_string()))
}

fn config(settings: &NetworkSettings) -> Result<Config, NetworkError> {
    let texts = |endpoints: &[NetworkEndpoint]| {
        Json::from_iter(endpoints.iter().map(|endpoint| endpoint.text.clone()))
    };
    let is_client = settings.mode == NetworkMode::Client;
    let entries = [
        ("mode", json!(settings.mode.name())),
        ("listen/endpoints", texts(&settings.listen)),
        ("listen/exit_on_failure", json!(true)),
        ("connect/endpoints", texts(&settings.connect)),
        ("connect/timeout_ms", if is_client { json!(ROUTER) } else { json!(-1) }),
        ("connect/exit_on_failure", json!(is_client)),
        (
            "connect/retry",
            json!({ "period_init_ms": 100, "period_max_ms": 2_000, "period_increase_factor": 1.5 }),
        ),
        ("scouting/multicast/enabled", json!(settings.multicast)),
        // Else peers connect to endpoints that no file names.
        ("scouting/gossip/enabled", json!(false)),
        ("scouting/delay", json!(100)),
        ("transport/link/tx/lease", json!(LEASE)),
        ("transport/link/rx/max_message_size", json!(LARGEST)),
        ("adminspace/enabled", json!(false)),
    ];
    let mut config = Config::default();
    for (path, value) in entries {
        let wrong = |error: Box<dyn std::error::Error + Send + Sync>| {
            NetworkError::Session(format!("{path}: {error}"))
        };
        config.insert_json5(path, &value.to_string()).map_err(wrong)?;
    }
    Ok(config)
}

/// Which endpoint kept a session from opening. Zenoh's message names the lines of its own code.
fn diagnosis(settings: &NetworkSettings, message: &str) -> NetworkError {
    for endpoint in &settings.listen {
        if let Err(error) = listen(endpoint) {
            return NetworkError::Listen {
                endpoint: endpoint.text.clone(),
                reason: error.to_string(),
                place: endpoint.place,
            };
        }
    }
    if settings.mode == NetworkMode::Client {
        let texts: Vec<_> = settings.connect.iter().map(|endpoint| format!("`{endpoint}`")).collect();
        let reason = settings.connect.iter().find_map(|endpoint| connect(endpoint).err());
        return NetworkError::Connect {
            endpoints: texts.join(", "),
            reason: reason.map_or_else(
                || format!("nothing answers as a router within {} s", ROUTER / 1_000),
                |error| error.to_string(),
            ),
            place: settings.connect.first().and_then(|endpoint| endpoint.place),
        };
    }
    NetworkError::Session(message.into())
}

fn listen(endpoint: &NetworkEndpoint) -> std::io::Result<()> {
    match endpoint.carrier() {
        "udp" => UdpSocket::bind(endpoint.address()).map(drop),
        _ => TcpListener::bind(endpoint.address()).map(drop),
    }
}

fn connect(endpoint: &NetworkEndpoint) -> std::io::Result<()> {
    let addresses = endpoint.address().to_socket_addrs()?;
    if endpoint.carrier() == "udp" {
        return Ok(());
    }
    addresses.take(1).try_for_each(|address| TcpStream::connect_timeout(&address, LOOK).map(drop))
}
