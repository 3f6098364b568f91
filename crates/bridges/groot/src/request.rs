//! Requests of monitors: the protocol of Groot2, version 2.

use serde_json::{Map, Value};

use crate::message_pack::pack;
use crate::plan::{ShownPlan, ShownValue};

/// Version of the protocol.
const PROTOCOL: u8 = 2;

const NO_BREAKPOINTS: &str = "the tree of a robot has no breakpoints: no monitor may stop it";
const NO_RECORDING: &str = "transitions are not recorded here: record the agent with slate record";

/// Answers a request; the frames of an error are the word `error` and its text.
pub async fn answer(plan: &ShownPlan, request: &[Vec<u8>]) -> Vec<Vec<u8>> {
    match reply(plan, request).await {
        Ok(frames) => frames,
        Err(text) => vec![b"error".to_vec(), text.into_bytes()],
    }
}

async fn reply(plan: &ShownPlan, request: &[Vec<u8>]) -> Result<Vec<Vec<u8>>, String> {
    let (header, parts) = request.split_first().ok_or("expected a header")?;
    let [_, kind, a, b, c, d] = header[..] else { return Err("expected a header of 6 bytes".into()) };
    let id = [a, b, c, d];
    let shown = match kind {
        b'T' => plan.tree().await?,
        b'S' => statuses(plan.nodes().await?),
        b'B' => {
            let names = parts.first().ok_or("expected the names of blackboards in a second frame")?;
            blackboards(plan.blackboards().await?, &String::from_utf8_lossy(names))?
        }
        // It has no elements.
        b'D' => ShownValue { fingerprint: 0, content: b"[]".to_vec() },
        b'A' | b'X' => return Ok(vec![reply_header(plan, kind, id, 0)]),
        b'I' | b'R' | b'U' => return Err(NO_BREAKPOINTS.into()),
        b'r' | b't' => return Err(NO_RECORDING.into()),
        _ => return Err(format!("unknown request {kind}")),
    };
    Ok(vec![reply_header(plan, kind, id, shown.fingerprint), shown.content])
}

/// Returns the header of the request, and 16 bytes that change with the tree.
fn reply_header(plan: &ShownPlan, kind: u8, id: [u8; 4], fingerprint: u64) -> Vec<u8> {
    let mut own = 0xcbf2_9ce4_8422_2325_u64;
    plan.path.bytes().for_each(|byte| own = (own ^ u64::from(byte)).wrapping_mul(0x0100_0000_01b3));
    [&[PROTOCOL, kind][..], &id, &fingerprint.to_le_bytes(), &own.to_le_bytes()].concat()
}

/// Returns the number and status of each node, 3 bytes each.
fn statuses(shown: ShownValue) -> ShownValue {
    let node = |(index, status): (usize, &u8)| {
        let [low, high] = (index as u16 + 1).to_le_bytes();
        [low, high, *status]
    };
    let content = shown.content.iter().enumerate().flat_map(node).collect();
    ShownValue { content, ..shown }
}

/// Returns the blackboards of these names, separated by `;`.
/// All of them without a name.
fn blackboards(shown: ShownValue, names: &str) -> Result<ShownValue, String> {
    let entries: Vec<(String, String, Value)> =
        serde_json::from_slice(&shown.content).map_err(|error| error.to_string())?;
    let mut boards: Map<String, Value> = Map::new();
    for (board, name, value) in entries {
        if names.is_empty() || names.split(';').any(|wanted| wanted == board) {
            let own = boards.entry(board).or_insert_with(|| Map::new().into());
            if let Value::Object(own) = own {
                own.insert(name, value);
            }
        }
    }
    let mut content = Vec::new();
    pack(&boards.into(), &mut content);
    Ok(ShownValue { content, ..shown })
}
