//! The WebSockets, which the document names as far as it can.

use hyper::StatusCode;
use serde_json::json;

use super::TOKEN;
use crate::Role;
use crate::operation::{Operation, Pace};
use crate::problem::Problem;

pub(super) const LIVE: Operation = Operation {
    path: "/live",
    name: "live",
    summary: "A WebSocket: values as they come, of many properties",
    role: Role::Viewer,
    ..SOCKET
};

pub(super) const TELEOPERATION: Operation = Operation {
    path: "/teleoperation",
    name: "teleoperation",
    summary: "A WebSocket: a person drives",
    role: Role::Operator,
    ..SOCKET
};

/// What they have in common. Whoever asks for one as for any other operation is told what it is.
const SOCKET: Operation = Operation {
    method: "GET",
    path: "",
    name: "",
    summary: "",
    role: Role::Viewer,
    pace: Pace::Slow,
    parameters: &[TOKEN],
    body: None,
    answer: || json!({}),
    kinds: &[],
    handler: |_, _| {
        let help = "open it with a handshake for a WebSocket, subprotocol slate.v1";
        Err(Problem::new(StatusCode::UPGRADE_REQUIRED, "this is a WebSocket", help)
            .with("upgrade", "websocket"))
    },
};

/// Whether an operation opens one.
pub(super) fn is_socket(operation: &Operation) -> bool {
    [LIVE.name, TELEOPERATION.name].contains(&operation.name)
}
