//! Values of many properties over one socket.
//!
//! The client says `{"subscribe": [{"id": 1, "url": "/r2/planner/state", "rate": 20, "form": "json"}]}` and
//! `{"unsubscribe": [1]}`. It gets `{"id", "interface", "schema", "url"}` for each, and then values: as text `{"id",
//! "sequence", "time", "value"}`, or in the form `binary` the bytes 1, id (u32), time (u64), sequence (u64), all little-endian,
//! and the value as it lies in memory. A slow reader gets the newest value of each; nothing is buffered for it.

use std::sync::Arc;
use std::time::Duration;

use serde::Deserialize;
use serde_json::{Value as Json, json};
use slate_blackboard::{Access, Url};
use slate_sorted::SortedMap;
use tokio::sync::mpsc;
use tokio::time::Instant;

use super::{ClientMessage, Listener, Sink, SocketClient, ping, send_bytes, send_text};
use slate_control::ControlSurface;
use slate_control::Problem;
use slate_control::Selection;
use slate_control::{Sample, Watcher, offload};

/// Minimum polling period for new values.
const POLL_PERIOD: Duration = Duration::from_millis(10);

/// Maximum number of subscriptions of a client.
const MAX_SUBSCRIPTIONS: usize = 512;

/// Size from which values are encoded in another thread, bytes.
const LARGE_SIZE: usize = 4096;

/// First byte of a value.
const VALUE_FRAME: u8 = 1;

#[derive(Deserialize)]
#[serde(rename_all = "lowercase", deny_unknown_fields)]
enum LiveRequest {
    Subscribe(Vec<LiveSubscribe>),
    Unsubscribe(Vec<u32>),
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct LiveSubscribe {
    id: u32,
    url: String,
    /// Hz.
    #[serde(default = "rate")]
    rate: f64,
    #[serde(default)]
    form: LiveForm,
    /// Delivery of every kept value, instead of the newest only.
    #[serde(default)]
    every: bool,
    #[serde(default)]
    pointer: Option<String>,
    #[serde(default)]
    select: Option<String>,
}

fn rate() -> f64 {
    10.0
}

#[derive(Clone, Copy, Default, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "lowercase")]
enum LiveForm {
    #[default]
    Json,
    Binary,
}

struct LiveSubscription {
    watcher: Watcher,
    period: Duration,
    due: Instant,
    form: LiveForm,
    every: bool,
    selection: Selection,
}

pub(super) async fn serve(client: SocketClient, mut sink: Sink, mut listener: Listener) {
    let (sender, mut requests) = mpsc::channel(16);
    let receiving = async move {
        while let Some(message) = listener.next().await {
            let ClientMessage::Text(text) = message else { continue };
            if sender.send(text).await.is_err() {
                return;
            }
        }
    };
    let surface = Arc::clone(&client.surface);
    let sending = async move {
        let mut subscriptions = SortedMap::new();
        let mut last_ping = Instant::now();
        loop {
            let received = tokio::time::timeout(POLL_PERIOD, requests.recv()).await;
            let is_connected = match received {
                Ok(None) => false,
                Ok(Some(text)) => {
                    let answers = handle(&surface, &mut subscriptions, &text);
                    send_all(&mut sink, answers).await
                }
                Err(_) => ping(&mut sink, &mut last_ping).await,
            };
            if !is_connected || !send_due(&surface, &mut subscriptions, &mut sink).await {
                return;
            }
        }
    };
    let (receiving, sending) = (std::pin::pin!(receiving), std::pin::pin!(sending));
    futures_util::future::select(receiving, sending).await;
}

async fn send_all(sink: &mut Sink, texts: Vec<Json>) -> bool {
    for text in texts {
        if !send_text(sink, text.to_string()).await {
            return false;
        }
    }
    true
}

/// Handles a request; returns its answer.
fn handle(
    surface: &Arc<ControlSurface>,
    subscriptions: &mut SortedMap<u32, LiveSubscription>,
    text: &str,
) -> Vec<Json> {
    let request: LiveRequest = match serde_json::from_str(text) {
        Ok(request) => request,
        Err(error) => {
            let help = "such as {\"subscribe\": [{\"id\": 1, \"url\": \"/module/property\"}]}";
            let problem = Problem::bad(format!("this can't be understood: {error}"), help);
            return vec![json!({ "problem": problem.json() })];
        }
    };
    match request {
        LiveRequest::Unsubscribe(ids) => {
            ids.iter().for_each(|id| drop(subscriptions.remove(id)));
            Vec::new()
        }
        LiveRequest::Subscribe(requested) => requested
            .into_iter()
            .map(|wanted| {
                let id = wanted.id;
                let has_room = subscriptions.len() < MAX_SUBSCRIPTIONS || subscriptions.contains_key(&id);
                let full = || {
                    Problem::unfit(
                        format!("at most {MAX_SUBSCRIPTIONS} subscriptions are possible"),
                        "end one",
                    )
                };
                let subscribed = if has_room { subscribe(surface, wanted) } else { Err(full()) };
                match subscribed {
                    Ok((subscription, answer)) => {
                        subscriptions.insert(id, subscription);
                        answer
                    }
                    Err(problem) => json!({ "id": id, "problem": problem.json() }),
                }
            })
            .collect(),
    }
}

fn subscribe(
    surface: &Arc<ControlSurface>,
    wanted: LiveSubscribe,
) -> Result<(LiveSubscription, Json), Problem> {
    let url = Url::parse(&wanted.url)
        .map_err(|error| Problem::bad(error.to_string(), "such as /module/property"))?;
    if url.agent().is_some_and(|agent| agent != surface.name()) {
        return Err(Problem::not_found(format!("{url} is of another agent"), "ask that agent"));
    }
    if !(0.01..=100.0).contains(&wanted.rate) {
        return Err(Problem::bad(format!("the rate is {}", wanted.rate), "it is from 0.01 to 100 Hz"));
    }
    let selection = Selection::parse(wanted.pointer.as_deref(), wanted.select.as_deref())?;
    let watcher = Watcher::new(surface, &url.path_in(""), 0)?;
    let Some(property) = watcher.property() else {
        return Err(Problem::not_found(format!("there is nothing at {url}"), "see /api/v1/properties"));
    };
    if property.access() == Access::Messages {
        return Err(Problem::unfit(
            format!("{url} takes messages, and has no value"),
            "subscribe to a value",
        ));
    }
    let descriptor = property.descriptor();
    let answer = json!({
        "id": wanted.id,
        "url": format!("slate://{}/{}", surface.name(), url.path_in("")),
        "interface": descriptor.name,
        "schema": format!("{:016x}", descriptor.hash),
    });
    let period = Duration::from_secs_f64(1.0 / wanted.rate);
    let (form, every) = (wanted.form, wanted.every);
    Ok((LiveSubscription { watcher, period, due: Instant::now(), form, every, selection }, answer))
}

/// Sends the new values that are due; false when the client is gone.
async fn send_due(
    surface: &Arc<ControlSurface>,
    subscriptions: &mut SortedMap<u32, LiveSubscription>,
    sink: &mut Sink,
) -> bool {
    let now = Instant::now();
    let due: Vec<u32> = subscriptions
        .iter_mut()
        .filter_map(|(id, subscription)| {
            (subscription.due <= now && subscription.watcher.has_update(surface)).then_some(*id)
        })
        .collect();
    for id in due {
        let Some(mut subscription) = subscriptions.remove(&id) else { continue };
        subscription.due = now + subscription.period;
        let large = subscription.watcher.size() > LARGE_SIZE;
        let encoded = offload(large, move || {
            let messages = encode(id, &mut subscription);
            (subscription, messages)
        });
        let Some((subscription, messages)) = encoded.await else { return false };
        subscriptions.insert(id, subscription);
        for message in messages {
            let is_connected = match message {
                Encoded::Text(text) => send_text(sink, text).await,
                Encoded::Bytes(bytes) => send_bytes(sink, bytes).await,
            };
            if !is_connected {
                return false;
            }
        }
    }
    true
}

enum Encoded {
    Text(String),
    Bytes(Vec<u8>),
}

fn encode(id: u32, subscription: &mut LiveSubscription) -> Vec<Encoded> {
    let watcher = &mut subscription.watcher;
    let samples = if subscription.every {
        watcher.take_all()
    } else {
        watcher.take().map(|sample| sample.into_iter().collect())
    };
    let one = |sample: Sample| match subscription.form {
        LiveForm::Binary => {
            let mut bytes = vec![VALUE_FRAME];
            bytes.extend(id.to_le_bytes());
            bytes.extend(sample.stamp.time.to_le_bytes());
            bytes.extend(sample.stamp.sequence.to_le_bytes());
            bytes.extend(sample.bytes);
            Encoded::Bytes(bytes)
        }
        LiveForm::Json => {
            let (sequence, time) = (sample.stamp.sequence, sample.stamp.time);
            let text = match subscription.selection.of(&sample.json()) {
                Ok(value) => json!({ "id": id, "sequence": sequence, "time": time, "value": value }),
                Err(problem) => json!({ "id": id, "sequence": sequence, "problem": problem.json() }),
            };
            Encoded::Text(text.to_string())
        }
    };
    samples.unwrap_or_default().into_iter().map(one).collect()
}
