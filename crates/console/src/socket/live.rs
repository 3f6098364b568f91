//! Values of many properties over one socket.
//!
//! The client says `{"subscribe": [{"id": 1, "url": "/r2/planner/state", "rate": 20, "form": "json"}]}` and
//! `{"unsubscribe": [1]}`. It gets `{"id", "interface", "schema", "url"}` for each, and then values: as text `{"id",
//! "sequence", "time", "value"}`, or in the form `binary` the bytes 1, id (u32), time (u64), sequence (u64), all little-endian,
//! and the value as it lies in memory. Whoever reads slowly gets the newest value of each; nothing is kept for him.

use std::collections::BTreeMap;
use std::sync::Arc;
use std::time::Duration;

use serde::Deserialize;
use serde_json::{Value as Json, json};
use slate_blackboard::{Access, Url};
use tokio::sync::mpsc;
use tokio::time::Instant;

use super::{Listener, Said, Sink, Visitor, hand, ping, say};
use slate_control::ControlSurface;
use slate_control::Problem;
use slate_control::Selection;
use slate_control::{Sample, Watcher, apart};

/// Minimum polling period for new values.
const LOOK: Duration = Duration::from_millis(10);

/// Maximum number of subscriptions of a client.
const MOST: usize = 512;

/// Size from which values are encoded in another thread, bytes.
const LARGE: usize = 4096;

/// First byte of a value.
const VALUE: u8 = 1;

#[derive(Deserialize)]
#[serde(rename_all = "lowercase", deny_unknown_fields)]
enum LiveRequest {
    Subscribe(Vec<Wish>),
    Unsubscribe(Vec<u32>),
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Wish {
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

pub(super) async fn visit(visitor: Visitor, mut sink: Sink, mut listener: Listener) {
    let (sender, mut requests) = mpsc::channel(16);
    let hears = async move {
        while let Some(said) = listener.next().await {
            let Said::Text(text) = said else { continue };
            if sender.send(text).await.is_err() {
                return;
            }
        }
    };
    let surface = Arc::clone(&visitor.surface);
    let tells = async move {
        let mut subscriptions = BTreeMap::new();
        let mut last_ping = Instant::now();
        loop {
            let asked = tokio::time::timeout(LOOK, requests.recv()).await;
            let good = match asked {
                Ok(None) => false,
                Ok(Some(text)) => {
                    let answers = take(&surface, &mut subscriptions, &text);
                    say_all(&mut sink, answers).await
                }
                Err(_) => ping(&mut sink, &mut last_ping).await,
            };
            if !good || !tell(&surface, &mut subscriptions, &mut sink).await {
                return;
            }
        }
    };
    let (hears, tells) = (std::pin::pin!(hears), std::pin::pin!(tells));
    futures_util::future::select(hears, tells).await;
}

async fn say_all(sink: &mut Sink, texts: Vec<Json>) -> bool {
    for text in texts {
        if !say(sink, text.to_string()).await {
            return false;
        }
    }
    true
}

/// Handles a request; returns its answer.
fn take(
    surface: &Arc<ControlSurface>,
    subscriptions: &mut BTreeMap<u32, LiveSubscription>,
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
        LiveRequest::Subscribe(wishes) => wishes
            .into_iter()
            .map(|wish| {
                let id = wish.id;
                let room = subscriptions.len() < MOST || subscriptions.contains_key(&id);
                let full = || Problem::unfit(format!("there are {MOST} subscriptions"), "end one");
                let subscribed = if room { subscribe(surface, wish) } else { Err(full()) };
                match subscribed {
                    Ok((subscription, told)) => {
                        subscriptions.insert(id, subscription);
                        told
                    }
                    Err(problem) => json!({ "id": id, "problem": problem.json() }),
                }
            })
            .collect(),
    }
}

fn subscribe(surface: &Arc<ControlSurface>, wish: Wish) -> Result<(LiveSubscription, Json), Problem> {
    let url =
        Url::parse(&wish.url).map_err(|error| Problem::bad(error.to_string(), "such as /module/property"))?;
    if url.agent().is_some_and(|agent| agent != surface.name()) {
        return Err(Problem::not_found(format!("{url} is of another agent"), "ask that agent"));
    }
    if !(0.01..=100.0).contains(&wish.rate) {
        return Err(Problem::bad(format!("the rate is {}", wish.rate), "it is from 0.01 to 100 Hz"));
    }
    let selection = Selection::parse(wish.pointer.as_deref(), wish.select.as_deref())?;
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
    let told = json!({
        "id": wish.id,
        "url": format!("slate://{}/{}", surface.name(), url.path_in("")),
        "interface": descriptor.name,
        "schema": format!("{:016x}", descriptor.hash),
    });
    let period = Duration::from_secs_f64(1.0 / wish.rate);
    let (form, every) = (wish.form, wish.every);
    Ok((LiveSubscription { watcher, period, due: Instant::now(), form, every, selection }, told))
}

/// Sends the new values that are due; false when the client is gone.
async fn tell(
    surface: &Arc<ControlSurface>,
    subscriptions: &mut BTreeMap<u32, LiveSubscription>,
    sink: &mut Sink,
) -> bool {
    let now = Instant::now();
    let due: Vec<u32> = subscriptions
        .iter_mut()
        .filter_map(|(id, subscription)| {
            (subscription.due <= now && subscription.watcher.has_news(surface)).then_some(*id)
        })
        .collect();
    for id in due {
        let Some(mut subscription) = subscriptions.remove(&id) else { continue };
        subscription.due = now + subscription.period;
        let large = subscription.watcher.size() > LARGE;
        let encoded = apart(large, move || {
            let messages = encode(id, &mut subscription);
            (subscription, messages)
        });
        let Some((subscription, messages)) = encoded.await else { return false };
        subscriptions.insert(id, subscription);
        for message in messages {
            let good = match message {
                Encoded::Text(text) => say(sink, text).await,
                Encoded::Bytes(bytes) => hand(sink, bytes).await,
            };
            if !good {
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
            let mut bytes = vec![VALUE];
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
