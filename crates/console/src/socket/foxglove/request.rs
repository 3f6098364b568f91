//! Requests of clients.

use serde::Deserialize;
use serde_json::Value as Json;

/// Request of a client.
#[derive(Debug)]
pub(super) enum FoxgloveRequest {
    /// Numbers, each with that of a channel.
    Subscribe(Vec<(u32, u32)>),
    Unsubscribe(Vec<u32>),
    Advertise(Vec<(u32, Advertised)>),
    Unadvertise(Vec<u32>),
    Message {
        channel: u32,
        payload: Vec<u8>,
    },
    GetParameters {
        names: Vec<String>,
        id: Option<String>,
    },
    SetParameters {
        values: Vec<(String, Json)>,
        id: Option<String>,
    },
    WatchParameters(Vec<String>),
    UnwatchParameters(Vec<String>),
    Graph(bool),
    Call(Call),
}

/// Channel that a client publishes.
#[derive(Debug)]
pub(super) struct Advertised {
    pub topic: String,
    pub encoding: String,
}

/// Call of a service.
#[derive(Debug)]
pub(super) struct Call {
    pub service: u32,
    pub id: u32,
    pub encoding: String,
    pub payload: Vec<u8>,
}

#[derive(Deserialize)]
#[serde(tag = "op", rename_all = "camelCase", rename_all_fields = "camelCase")]
enum RequestText {
    Subscribe { subscriptions: Vec<SubscriptionPair> },
    Unsubscribe { subscription_ids: Vec<u32> },
    Advertise { channels: Vec<ClientChannel> },
    Unadvertise { channel_ids: Vec<u32> },
    GetParameters { parameter_names: Vec<String>, id: Option<String> },
    SetParameters { parameters: Vec<ClientParameter>, id: Option<String> },
    SubscribeParameterUpdates { parameter_names: Vec<String> },
    UnsubscribeParameterUpdates { parameter_names: Vec<String> },
    SubscribeConnectionGraph,
    UnsubscribeConnectionGraph,
}

#[derive(Deserialize)]
#[serde(rename_all = "camelCase")]
struct SubscriptionPair {
    id: u32,
    channel_id: u32,
}

#[derive(Deserialize)]
struct ClientChannel {
    id: u32,
    topic: String,
    encoding: String,
}

#[derive(Deserialize)]
struct ClientParameter {
    name: String,
    #[serde(default)]
    value: Json,
}

impl FoxgloveRequest {
    pub fn parse(text: &str) -> Result<Self, String> {
        let text: RequestText =
            serde_json::from_str(text).map_err(|error| format!("this can't be understood: {error}"))?;
        Ok(match text {
            RequestText::Subscribe { subscriptions } => {
                Self::Subscribe(subscriptions.into_iter().map(|pair| (pair.id, pair.channel_id)).collect())
            }
            RequestText::Unsubscribe { subscription_ids } => Self::Unsubscribe(subscription_ids),
            RequestText::Advertise { channels } => {
                let one = |channel: ClientChannel| {
                    (channel.id, Advertised { topic: channel.topic, encoding: channel.encoding })
                };
                Self::Advertise(channels.into_iter().map(one).collect())
            }
            RequestText::Unadvertise { channel_ids } => Self::Unadvertise(channel_ids),
            RequestText::GetParameters { parameter_names, id } => {
                Self::GetParameters { names: parameter_names, id }
            }
            RequestText::SetParameters { parameters, id } => {
                let values =
                    parameters.into_iter().map(|parameter| (parameter.name, parameter.value)).collect();
                Self::SetParameters { values, id }
            }
            RequestText::SubscribeParameterUpdates { parameter_names } => {
                Self::WatchParameters(parameter_names)
            }
            RequestText::UnsubscribeParameterUpdates { parameter_names } => {
                Self::UnwatchParameters(parameter_names)
            }
            RequestText::SubscribeConnectionGraph => Self::Graph(true),
            RequestText::UnsubscribeConnectionGraph => Self::Graph(false),
        })
    }

    pub fn parse_bytes(bytes: &[u8]) -> Result<Self, String> {
        let mut reader = ByteReader(bytes);
        match reader.byte() {
            Some(1) => {
                let channel = reader.number();
                let message = channel.map(|channel| Self::Message { channel, payload: reader.0.to_vec() });
                message.ok_or_else(|| "a message has no channel".into())
            }
            Some(2) => reader.call().map(Self::Call).ok_or_else(|| "a call of a service is cut off".into()),
            Some(kind) => Err(format!("this can't be understood: bytes that begin with {kind}")),
            None => Err("this can't be understood: a message without a byte".into()),
        }
    }
}

struct ByteReader<'b>(&'b [u8]);

impl ByteReader<'_> {
    fn byte(&mut self) -> Option<u8> {
        let (first, rest) = self.0.split_first()?;
        self.0 = rest;
        Some(*first)
    }

    fn number(&mut self) -> Option<u32> {
        let (number, rest) = self.0.split_first_chunk::<4>()?;
        self.0 = rest;
        Some(u32::from_le_bytes(*number))
    }

    fn call(&mut self) -> Option<Call> {
        let (service, id, length) = (self.number()?, self.number()?, self.number()? as usize);
        let encoding = String::from_utf8(self.0.get(..length)?.to_vec()).ok()?;
        Some(Call { service, id, encoding, payload: self.0[length..].to_vec() })
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::panic, reason = "a test that fails panics")]

    use proptest::prelude::*;

    use super::*;

    proptest! {
        /// Property: any bytes are parsed, or refused in words.
        #[test]
        fn any_bytes_are_read_or_refused(bytes in proptest::collection::vec(any::<u8>(), 0..40), kind in 0u8..4) {
            let mut message = vec![kind];
            message.extend(&bytes);
            let _ = FoxgloveRequest::parse_bytes(&message);
            let _ = FoxgloveRequest::parse(&String::from_utf8_lossy(&bytes));
        }

        /// Property: a call equals the one that was packed.
        #[test]
        fn a_call_is_what_was_packed(service: u32, id: u32, encoding in "[a-z]{0,8}", payload in proptest::collection::vec(any::<u8>(), 0..20)) {
            let mut bytes = vec![2];
            bytes.extend(service.to_le_bytes());
            bytes.extend(id.to_le_bytes());
            bytes.extend((encoding.len() as u32).to_le_bytes());
            bytes.extend(encoding.as_bytes());
            bytes.extend(&payload);
            let Ok(FoxgloveRequest::Call(call)) = FoxgloveRequest::parse_bytes(&bytes) else { panic!("no call") };
            prop_assert_eq!((call.service, call.id, call.encoding, call.payload), (service, id, encoding, payload));
        }
    }
}
