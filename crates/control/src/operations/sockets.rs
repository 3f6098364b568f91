//! WebSockets, documented as far as OpenAPI can.

use std::sync::Arc;

use hyper::StatusCode;
use serde_json::json;

use crate::Role;
use crate::answer::OperationAnswer;
use crate::operation::{Operation, OperationRequest};
use crate::problem::Problem;
use crate::surface::ControlSurface;

pub(super) const LIVE: Operation =
    Operation::get("/live", "live", Role::Viewer, "WebSocket: new values of several properties")
        .answers(|| json!({}), explain);

pub(super) const TELEOPERATION: Operation =
    Operation::get("/teleoperation", "teleoperation", Role::Operator, "WebSocket: teleoperation by a person")
        .answers(|| json!({}), explain);

/// Explains a WebSocket to a caller that sends a plain request.
fn explain(_: &Arc<ControlSurface>, _: &OperationRequest) -> Result<OperationAnswer, Problem> {
    let help = "open it with a handshake for a WebSocket, subprotocol slate.v1";
    Err(Problem::new(StatusCode::UPGRADE_REQUIRED, "this is a WebSocket", help).with("upgrade", "websocket"))
}

/// Returns whether an operation opens a WebSocket.
pub(super) fn is_socket(operation: &Operation) -> bool {
    [LIVE.name, TELEOPERATION.name].contains(&operation.name)
}
