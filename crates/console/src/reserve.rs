//! Connection by the descriptor in reserve.

use std::net::SocketAddr;
use std::time::Duration;

use slate_control::DescriptorReserve;
use tokio::net::{TcpListener, TcpStream};

/// Maximum duration of a connection that uses the reserve.
/// A stop takes some milliseconds.
pub(crate) const RESERVE_TIMEOUT: Duration = Duration::from_secs(1);

/// Accepts the next connection with the reserve.
/// `None` without a reserve, or if no connection is pending.
pub(crate) async fn accept_with(
    reserve: &mut DescriptorReserve,
    listener: &TcpListener,
) -> Option<(TcpStream, SocketAddr)> {
    if !reserve.give() {
        return None;
    }
    // A client that was just refused still waits.
    let accepted = tokio::time::timeout(RESERVE_TIMEOUT, listener.accept()).await;
    accepted.ok()?.ok()
}
