//! Agents on networks.

#[cfg(feature = "zenoh")]
mod agent;
#[cfg(feature = "zenoh")]
mod cable;
#[cfg(feature = "zenoh")]
mod certificates;
#[cfg(feature = "zenoh")]
mod hostile;
mod layout;
#[cfg(feature = "zenoh")]
mod links;
#[cfg(feature = "zenoh")]
mod options;
#[cfg(feature = "zenoh")]
mod presence;
#[cfg(feature = "external-tools")]
mod python;
#[cfg(feature = "zenoh")]
mod quic;
#[cfg(feature = "zenoh")]
mod reading;
#[cfg(feature = "zenoh")]
mod recovery;
#[cfg(feature = "zenoh")]
mod replay;
#[cfg(feature = "zenoh")]
mod rights;
#[cfg(feature = "zenoh")]
mod serving;
#[cfg(feature = "zenoh")]
mod setting;
mod settings;
#[cfg(feature = "zenoh")]
mod team;
