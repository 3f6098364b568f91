//! Other agents as an agent's board describes them.

use serde::{Deserialize, Serialize};
use slate_blackboard::Board;
use slate_blackboard::interface::Value;

use slate_runtime::Composer;

/// Peers of an agent.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct PeerList {
    /// Known peers, by their names.
    pub peers: Vec<PeerEntry>,
    /// Last rejected peers.
    pub rejected: Vec<RejectedEntry>,
}

/// Agent that was not admitted.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct RejectedEntry {
    /// Address or name, as far as known.
    pub from: String,
    /// Reason of the rejection.
    pub reason: String,
    /// Number of rejections.
    pub count: u64,
    /// Time since the last rejection, ns.
    pub ago: u64,
}

/// Another agent, as seen by an agent.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct PeerEntry {
    /// Name.
    pub agent: String,
    /// Address at which this agent dials it, or has dialed it.
    /// `None` if the other one did.
    pub endpoint: Option<String>,
    /// Duration of the connection, ns; `None` when not connected.
    pub connected: Option<u64>,
    /// Round-trip time, ns.
    pub round_trip: u64,
    /// Offset of its clock, nanoseconds.
    pub offset: i64,
    /// Reason why it is unreachable, where known.
    pub reason: String,
    /// Properties that are read of it.
    pub reads: Vec<ReadEntry>,
    /// Properties that it reads.
    pub serves: Vec<ServedEntry>,
}

/// Property of another agent that is read.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct ReadEntry {
    /// Path in the other agent.
    pub path: String,
    /// Delivery: true if its values arrive.
    pub served: bool,
    /// Number of values received.
    pub received: u64,
    /// Number of values lost from a queue.
    pub lost: u64,
    /// Reason why no values arrive, where known.
    pub reason: String,
}

/// Property that another agent reads.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct ServedEntry {
    /// Path in this agent.
    pub path: String,
    /// Number of values sent.
    pub sent: u64,
    /// Number of values that wait in a queue.
    pub lag: u64,
}

pub(super) fn peers(composer: &Composer) -> PeerList {
    let board = composer.board();
    let mut paths: Vec<String> =
        board.properties().iter().map(|property| property.path().to_owned()).collect();
    paths.sort_unstable();
    let agent = |path: &String| {
        let name = path.strip_prefix("peers/")?.strip_suffix("/link")?;
        (!name.contains('/')).then(|| name.to_owned())
    };
    let entry = |agent: String| {
        let own = format!("peers/{agent}");
        let below = |kind: &str| {
            let prefix = format!("{own}/{kind}/");
            paths
                .iter()
                .filter_map(|path| path.strip_prefix(&prefix).map(ToOwned::to_owned))
                .collect::<Vec<_>>()
        };
        let link = read(board, &format!("{own}/link"));
        let since = number(&link, "since");
        PeerEntry {
            endpoint: Some(text(&link, "endpoint")).filter(|endpoint| !endpoint.is_empty()),
            connected: flag(&link, "connected").then(|| composer.steady_now().saturating_sub(since)),
            round_trip: number(&link, "round_trip"),
            offset: link
                .get("offset")
                .and_then(Value::as_integer)
                .map_or(0, |n| i64::try_from(n).unwrap_or(0)),
            reason: text(&link, "reason"),
            reads: below("reads")
                .into_iter()
                .map(|path| {
                    let state = read(board, &format!("{own}/reads/{path}"));
                    ReadEntry {
                        served: flag(&state, "served"),
                        received: number(&state, "received"),
                        lost: number(&state, "lost"),
                        reason: text(&state, "reason"),
                        path,
                    }
                })
                .collect(),
            serves: below("serves")
                .into_iter()
                .map(|path| {
                    let state = read(board, &format!("{own}/serves/{path}"));
                    ServedEntry { sent: number(&state, "sent"), lag: number(&state, "lag"), path }
                })
                .collect(),
            agent,
        }
    };
    let peers = paths.iter().filter_map(agent).map(entry).collect();
    let rejected = paths.iter().filter(|path| path.starts_with("share/rejected/")).filter_map(|path| {
        let shown = read(board, path);
        Some(RejectedEntry {
            from: text(&shown, "from"),
            reason: text(&shown, "reason"),
            // One that has not been written yet is about to be.
            count: Some(number(&shown, "count")).filter(|count| *count > 0)?,
            ago: composer.steady_now().saturating_sub(number(&shown, "last")),
        })
    });
    PeerList { peers, rejected: rejected.collect() }
}

/// Returns the newest value; an empty one when the property has just left.
fn read(board: &Board, path: &str) -> Value {
    board.read(path).ok().flatten().map_or(Value::Table(Vec::new()), |(value, _)| value)
}

fn number(value: &Value, name: &str) -> u64 {
    value.get(name).and_then(Value::as_integer).and_then(|n| u64::try_from(n).ok()).unwrap_or(0)
}

fn flag(value: &Value, name: &str) -> bool {
    matches!(value.get(name), Some(Value::Bool(true)))
}

fn text(value: &Value, name: &str) -> String {
    match value.get(name) {
        Some(Value::Text(text)) => text.clone(),
        _ => String::new(),
    }
}
