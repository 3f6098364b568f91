//! Opens sessions of Zenoh.

use std::net::{TcpListener, TcpStream, ToSocketAddrs, UdpSocket};
use std::time::Duration;

use serde_json::{Value as Json, json};
use zenoh::{Config, Session, Wait};

use crate::access::agent_access_control;
use crate::endpoint::NetworkEndpoint;
use crate::error::NetworkError;
use crate::settings::NetworkSecurity;
use crate::settings::{NetworkMode, NetworkSettings};

/// Time that a client waits for its router, ms.
const ROUTER_TIMEOUT: u64 = 3_000;

/// After so long without a packet a peer counts as gone, ms.
const PEER_TIMEOUT: u64 = 3_000;

/// Maximum size of a received message, bytes.
/// Data of others must not fill the memory.
const MAX_MESSAGE_SIZE: usize = 64 << 20;

/// Maximum number of 64-KiB packets queued in a link.
/// As many as Zenoh allows, so that a large value seldom waits for room.
const QUEUED_PACKETS: u64 = 16;

/// Maximum time that a value of several packets waits for room in a link, us.
/// Then it is dropped: meanwhile, others wait for it.
const SEND_TIMEOUT: u64 = 40_000;

/// Timeout for a closed session, and the polling period.
const CLOSING: (Duration, Duration) = (Duration::from_secs(1), Duration::from_millis(5));

/// Duration of the diagnosis of an unreachable router.
const DIAGNOSIS_TIMEOUT: Duration = Duration::from_millis(500);

/// Opens a session.
/// A peer or router connects later to absent endpoints; a client needs its router at once.
///
/// # Errors
/// When an endpoint can't be listened at, or a client reaches no router.
pub fn open(agent: &str, settings: &NetworkSettings) -> Result<Session, NetworkError> {
    let config = config(agent, settings)?;
    zenoh::open(config).wait().map_err(|error| diagnosis(settings, &error.to_string()))
}

/// Opens a session of a program that is not an agent, as a client of a router.
/// `more` extends Zenoh's configuration, by key.
///
/// # Errors
/// When it reaches no router within 3 s, or Zenoh refuses a value.
pub fn open_client(router: &NetworkEndpoint, more: &[(&str, Json)]) -> Result<Session, NetworkError> {
    let (mode, connect) = (NetworkMode::Client, vec![router.clone()]);
    let settings = NetworkSettings { mode, connect, ..NetworkSettings::default() };
    let mut config = config("", &settings)?;
    more.iter().try_for_each(|(path, value)| insert(&mut config, path, value))?;
    zenoh::open(config).wait().map_err(|error| diagnosis(&settings, &error.to_string()))
}

fn insert(config: &mut Config, path: &str, value: &Json) -> Result<(), NetworkError> {
    let inserted = config.insert_json5(path, &value.to_string());
    inserted.map_err(|error| NetworkError::Session(format!("{path}: {error}")))
}

fn config(agent: &str, settings: &NetworkSettings) -> Result<Config, NetworkError> {
    let texts = |endpoints: &[NetworkEndpoint]| Json::from_iter(endpoints.iter().map(endpoint_text));
    let is_client = settings.mode == NetworkMode::Client;
    let mut entries = vec![
        ("mode", json!(settings.mode.name())),
        ("listen/endpoints", texts(&settings.listen)),
        ("listen/exit_on_failure", json!(true)),
        ("connect/endpoints", texts(&settings.connect)),
        ("connect/timeout_ms", if is_client { json!(ROUTER_TIMEOUT) } else { json!(-1) }),
        ("connect/exit_on_failure", json!(is_client)),
        (
            "connect/retry",
            json!({ "period_init_ms": 100, "period_max_ms": 2_000, "period_increase_factor": 1.5 }),
        ),
        ("scouting/multicast/enabled", json!(settings.multicast)),
        // Else peers connect to endpoints that no file names.
        ("scouting/gossip/enabled", json!(false)),
        ("scouting/delay", json!(100)),
        ("transport/link/tx/lease", json!(PEER_TIMEOUT)),
        ("transport/link/tx/queue/size/data", json!(QUEUED_PACKETS)),
        (
            "transport/link/tx/queue/congestion_control/drop/max_wait_before_drop_fragments",
            json!(SEND_TIMEOUT),
        ),
        ("transport/link/rx/max_message_size", json!(MAX_MESSAGE_SIZE)),
        ("adminspace/enabled", json!(false)),
    ];
    entries.extend(settings.security.as_ref().map(|security| ("transport/link/tls", certificates(security))));
    entries.extend(agent_access_control(agent, settings).map(|access| ("access_control", access)));
    let mut config = Config::default();
    entries.iter().try_for_each(|(path, value)| insert(&mut config, path, value))?;
    Ok(config)
}

/// Closes a session, and waits until its ports are free.
/// QUIC keeps them until the other ends know of it.
pub fn close(session: &Session, settings: &NetworkSettings) {
    // One that has closed already is what is wanted.
    let _ = session.close().wait();
    let (limit, pause) = CLOSING;
    let mut waited = Duration::ZERO;
    let is_open = |endpoint: &NetworkEndpoint| endpoint.is_encrypted() && listen(endpoint).is_err();
    while waited < limit && settings.listen.iter().any(is_open) {
        std::thread::sleep(pause);
        waited += pause;
    }
}

/// Returns an endpoint with the options of its transport.
/// Over QUIC, best effort uses datagrams if the other end has them, too.
fn endpoint_text(endpoint: &NetworkEndpoint) -> String {
    let options = if endpoint.is_encrypted() { "?mixed_rel=auto" } else { "" };
    format!("{endpoint}{options}")
}

fn certificates(security: &NetworkSecurity) -> Json {
    json!({
        "root_ca_certificate": security.authority.path,
        "listen_certificate": security.certificate.path,
        "listen_private_key": security.key.path,
        "connect_certificate": security.certificate.path,
        "connect_private_key": security.key.path,
        "enable_mtls": true,
        // The certificate names the agent, at any address. Zenoh also takes certificates of public authorities here:
        // these name hosts with a dot, which no agent has in its name, so access control lets them do nothing.
        "verify_name_on_connect": false,
        "close_link_on_expiration": true,
    })
}

/// Returns the error with the endpoint that kept a session from opening.
/// Zenoh's message names the lines of its own code.
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
                || {
                    let hint = if settings.security.is_some() {
                        ", or one end refuses the other's certificate"
                    } else {
                        ""
                    };
                    format!("nothing answers as a router within {} s{hint}", ROUTER_TIMEOUT / 1_000)
                },
                |error| error.to_string(),
            ),
            place: settings.connect.first().and_then(|endpoint| endpoint.place),
        };
    }
    NetworkError::Session(message.into())
}

fn listen(endpoint: &NetworkEndpoint) -> std::io::Result<()> {
    match endpoint.carrier() {
        "quic" | "udp" => UdpSocket::bind(endpoint.address()).map(drop),
        _ => TcpListener::bind(endpoint.address()).map(drop),
    }
}

fn connect(endpoint: &NetworkEndpoint) -> std::io::Result<()> {
    let addresses = endpoint.address().to_socket_addrs()?;
    if endpoint.carrier() != "tcp" {
        return Ok(());
    }
    addresses
        .take(1)
        .try_for_each(|address| TcpStream::connect_timeout(&address, DIAGNOSIS_TIMEOUT).map(drop))
}
