//! Actions of ROS: inboxes that are servers, and outboxes that call.

mod client;
mod server;

use serde_json::{Value as Json, json};

use slate_dds::TopicQuality;

pub use client::ActionClient;
pub use server::ActionServer;

/// Quality of service of feedback.
const FEEDBACK: TopicQuality = TopicQuality { reliable: true, transient_local: false, depth: 10 };

/// Quality of service of states: late clients receive the last ones.
const STATUS: TopicQuality = TopicQuality { reliable: true, transient_local: true, depth: 1 };

/// State of a goal, as `action_msgs/msg/GoalStatus` has it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u8)]
enum GoalState {
    Executing = 2,
    Canceling = 3,
    Succeeded = 4,
    Canceled = 5,
    Aborted = 6,
}

/// Returns the name of a service or a topic of an action.
fn part(action: &str, part: &str) -> String {
    format!("{action}/_action/{part}")
}

/// Converts the identity of a goal to a message.
fn uuid(id: [u8; 16]) -> Json {
    json!({ "uuid": id })
}

/// Returns the identity in the field `goal_id` of a message.
fn goal_id(message: &Json) -> [u8; 16] {
    let mut id = [0; 16];
    let given = message["goal_id"]["uuid"].as_array().into_iter().flatten();
    for (own, given) in id.iter_mut().zip(given) {
        *own = given.as_u64().and_then(|byte| u8::try_from(byte).ok()).unwrap_or_default();
    }
    id
}
