//! From topics to inputs.

use std::sync::Arc;
use std::time::Duration;

use roslibrust_common::GraphProvider;
use roslibrust_ros1::{NodeHandle, SubscriberAny};
use slate_topics::InboundTopics;
use tokio::time::{Instant, timeout};

use crate::message::Ros1Message;

/// How often the master is asked what the type of a topic is.
const ASK: Duration = Duration::from_secs(5);

/// Takes the messages of the topic at a place, until the node ends.
pub async fn receive(
    node: NodeHandle,
    mut subscriber: SubscriberAny,
    message: Ros1Message,
    topics: Arc<InboundTopics>,
    place: usize,
) {
    let topic = &topics.topics()[place];
    // A subscription to any type gets bytes without their type: who publishes has told it to the master.
    let mut asked: Option<Instant> = None;
    let mut misfit: Option<String> = None;
    loop {
        let bytes = match timeout(ASK, subscriber.next()).await {
            Err(_) => continue,
            Ok(None) => return,
            // Raw messages have one error: more came than were taken. The crate does not publish its type, which tells how many.
            Ok(Some(Err(_))) => {
                topic.note_dropped(1);
                continue;
            }
            Ok(Some(Ok(bytes))) => bytes,
        };
        if asked.is_none_or(|asked| asked.elapsed() > ASK) {
            misfit = type_misfit(&node, topic.topic(), message.name()).await;
            asked = Some(Instant::now());
        }
        let value = match &misfit {
            Some(reason) => Err(reason.clone()),
            None => decode(&message, &bytes),
        };
        topics.push(place, value);
    }
}

/// The value of a message with its length before it.
fn decode(message: &Ros1Message, bytes: &[u8]) -> Result<Vec<u8>, String> {
    let body = bytes.get(4..).ok_or("it has no length")?;
    message.decode(body).map_err(|error| error.to_string())
}

/// Why messages of a topic can't be read, when the master says that they have another type.
async fn type_misfit(node: &NodeHandle, topic: &str, expected: &str) -> Option<String> {
    let topics = match node.list_topics().await {
        Ok(topics) => topics,
        Err(error) => return Some(format!("the master does not tell its type: {error}")),
    };
    let found = topics.into_iter().find(|other| other.name == topic)?.type_name;
    (found != expected && found != "*").then(|| format!("it is a {found}, and the input takes {expected}"))
}
