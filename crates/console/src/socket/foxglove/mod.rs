//! WebSocket protocol of Foxglove.
//! Foxglove, Lichtblick and PlotJuggler speak it.
//!
//! Each property is a channel with ROS 2 messages: that which ROS has for it, or else one of its own. Where robots are comes as the
//! transforms of their frames, too. Each parameter of a module
//! is a parameter, by its path. What a client publishes (as JSON) goes to what takes it: a mailbox, an input without a link, or
//! an actuator, that of a robot with the message `Twist` too. Stop, reset and arm are services.

mod channels;
mod parameters;
mod publish;
mod request;
mod services;

use std::collections::BTreeMap;
use std::sync::Arc;
use std::time::Duration;

use futures_util::future::Either;
use serde_json::json;
use slate_runtime::Teleoperation;
use tokio::sync::{Semaphore, mpsc};
use tokio::time::Instant;

use super::{Listener, Said, Sink, Visitor, hand, ping, say};
use channels::{Channels, Form};
use request::FoxgloveRequest;
use slate_control::operations::by_name;
use slate_control::{Caller, ControlSurface, Dispatcher, Operation, TransformStream, Watcher, apart, frames};
use slate_record::ros;

/// Names of the protocol; both are the same.
pub(super) const PROTOCOLS: [&str; 2] = ["foxglove.websocket.v1", "foxglove.sdk.v1"];

/// Polling period for new values and for added or removed properties.
const LOOK: Duration = Duration::from_millis(10);
const SURVEY: Duration = Duration::from_secs(1);

/// Period of time messages, when the agent has its own clock.
const CLOCK: Duration = Duration::from_millis(100);

/// Duration of sending after which a client is warned that it is slow.
const SLOW: Duration = Duration::from_millis(250);

/// Size from which values are encoded in another thread, bytes.
const LARGE: usize = 4096;

/// Maximum size of a client's queued requests, bytes.
/// They wait for the one before them; excess requests are refused.
const WAITING: usize = 2 << 20;

/// Refusal of such a request.
const OVERLOADED: &str = "too many requests of this client wait: one is refused";

/// Maximum number of subscriptions of a client.
const MOST: usize = 512;

/// Client's subscription of `/tf`, or of `/tf_static`.
struct ClientTransforms {
    is_fixed: bool,
    stream: TransformStream,
}

impl ClientTransforms {
    /// Returns the message of the new values, and its time.
    fn look(&mut self, surface: &ControlSurface) -> Option<(u64, Vec<u8>)> {
        let (time, moving, fixed) = self.stream.take(surface);
        let told = if self.is_fixed { fixed } else { moving };
        let mut message = Vec::new();
        ros::encode_transforms(&told, &mut message).ok().filter(|()| !told.is_empty())?;
        Some((time, message))
    }
}

/// Outgoing message.
enum Out {
    Text(String),
    Bytes(Vec<u8>),
}

/// Subscriptions of a client, and the state last sent to it.
struct Session {
    surface: Arc<ControlSurface>,
    dispatcher: Arc<Dispatcher>,
    caller: Caller,
    who: String,
    channels: Channels,
    subscriptions: BTreeMap<u32, Subscription>,
    /// Subscriptions of transforms.
    transforms: BTreeMap<u32, ClientTransforms>,
    /// Channels that the client publishes, by its numbers.
    published: BTreeMap<u32, publish::Channel>,
    /// Actuators that it drives.
    controls: BTreeMap<String, Teleoperation>,
    /// Parameters that it watches, with the values sent last.
    watched: BTreeMap<String, serde_json::Value>,
    wants_graph: bool,
    graph: Option<serde_json::Value>,
}

struct Subscription {
    channel: u32,
    watcher: Watcher,
    form: Arc<Form>,
    /// Frame of its values.
    frame: String,
}

pub(super) async fn visit(visitor: Visitor, mut sink: Sink, mut listener: Listener) {
    let (sender, mut requests) = mpsc::unbounded_channel();
    let room = Arc::new(Semaphore::new(WAITING));
    let (answer, mut answers) = mpsc::unbounded_channel();
    let (dispatcher, caller) = (Arc::clone(&visitor.dispatcher), visitor.caller());
    let hears = async move {
        while let Some(said) = listener.next().await {
            // A stop waits for no other request of this client.
            let answered = match services::stop_call(&said) {
                Some(call) => answer.send(services::answer(&dispatcher, &caller, &call)).is_ok(),
                None => match Arc::clone(&room).try_acquire_many_owned(said.size()) {
                    Ok(permit) => sender.send((said, permit)).is_ok(),
                    Err(_) => answer.send(status(1, OVERLOADED, None)).is_ok(),
                },
            };
            if !answered {
                return;
            }
        }
    };
    let tells = async move {
        let mut session = Session::new(visitor);
        let greeting = session.greeting();
        if !send(&mut sink, greeting).await {
            return;
        }
        let began = Instant::now();
        let (mut surveyed, mut clocked, mut pinged) = (began, began, began);
        loop {
            let mut out = Vec::new();
            match tokio::time::timeout(LOOK, requests.recv()).await {
                Ok(None) => return,
                Ok(Some((said, _permit))) => {
                    let carried = carry_out(session, &said);
                    let Some((back, told)) = meanwhile(carried, &mut answers, &mut sink).await else {
                        return;
                    };
                    session = back;
                    out = told;
                }
                Err(_) if !ping(&mut sink, &mut pinged).await => return,
                Err(_) => {}
            }
            while let Ok(answer) = answers.try_recv() {
                out.push(answer);
            }
            if surveyed.elapsed() >= SURVEY {
                surveyed = Instant::now();
                let looked = apart(true, move || {
                    let mut out = session.channels.survey(&session.surface);
                    out.extend(session.parameters_changed());
                    out.extend(session.graph_changed());
                    (session, out)
                });
                let Some((back, news)) = looked.await else { return };
                session = back;
                out.extend(news);
            }
            if session.surface.is_lockstep && clocked.elapsed() >= CLOCK {
                clocked = Instant::now();
                out.push(Out::Bytes([&[2][..], &session.surface.now().to_le_bytes()].concat()));
            }
            if !send(&mut sink, out).await {
                return;
            }
            let Some(back) = session.tell(&mut sink).await else { return };
            session = back;
        }
    };
    let (hears, tells) = (std::pin::pin!(hears), std::pin::pin!(tells));
    futures_util::future::select(hears, tells).await;
}

/// Carries out a client's message in its turn, on a separate thread.
/// It may take long or wait for modules.
async fn carry_out(mut session: Session, said: &Said) -> Option<(Session, Vec<Out>)> {
    let request = match said {
        Said::Text(text) => FoxgloveRequest::parse(text),
        Said::Binary(bytes) => FoxgloveRequest::parse_bytes(bytes),
    };
    let request = match request {
        Ok(request) => request,
        Err(reason) => return Some((session, vec![status(1, &reason, None)])),
    };
    let turn = match session.operation(&request) {
        Some(operation) => match session.dispatcher.turn(operation).await {
            Ok(turn) => Some(turn),
            Err(problem) => return Some((session, vec![status(2, &problem.to_string(), None)])),
        },
        None => None,
    };
    let carried = apart(true, move || {
        let _turn = turn;
        let out = session.take(request);
        (session, out)
    });
    carried.await
}

/// Waits for work, and sends answers in the meantime.
/// `None` if the client is gone.
async fn meanwhile<T>(
    work: impl Future<Output = Option<T>>,
    answers: &mut mpsc::UnboundedReceiver<Out>,
    sink: &mut Sink,
) -> Option<T> {
    let mut work = std::pin::pin!(work);
    loop {
        let answer = std::pin::pin!(answers.recv());
        match futures_util::future::select(work.as_mut(), answer).await {
            Either::Left((done, _)) => return done,
            Either::Right((answer, _)) => {
                if !send(sink, vec![answer?]).await {
                    return None;
                }
            }
        }
    }
}

/// Sends messages; false when the client is gone.
async fn send(sink: &mut Sink, out: Vec<Out>) -> bool {
    for message in out {
        let good = match message {
            Out::Text(text) => say(sink, text).await,
            Out::Bytes(bytes) => hand(sink, bytes).await,
        };
        if !good {
            return false;
        }
    }
    true
}

impl Session {
    fn new(visitor: Visitor) -> Self {
        let caller = visitor.caller();
        Self {
            channels: Channels::default(),
            surface: visitor.surface,
            dispatcher: visitor.dispatcher,
            caller,
            who: visitor.who,
            subscriptions: BTreeMap::new(),
            transforms: BTreeMap::new(),
            published: BTreeMap::new(),
            controls: BTreeMap::new(),
            watched: BTreeMap::new(),
            wants_graph: false,
            graph: None,
        }
    }

    /// Returns the first messages to a client.
    fn greeting(&mut self) -> Vec<Out> {
        let mut capabilities =
            vec!["clientPublish", "parameters", "parametersSubscribe", "services", "connectionGraph"];
        if self.surface.is_lockstep {
            capabilities.push("time");
        }
        let info = json!({
            "op": "serverInfo",
            "name": format!("slate://{}", self.surface.name()),
            "capabilities": capabilities,
            "supportedEncodings": ["json"],
            "metadata": { "slate": env!("CARGO_PKG_VERSION") },
            "sessionId": self.surface.session,
        });
        let mut out = vec![Out::Text(info.to_string())];
        out.extend(self.channels.survey(&self.surface));
        out.push(services::advertise());
        out
    }

    /// Carries out a request.
    fn take(&mut self, request: FoxgloveRequest) -> Vec<Out> {
        self.make(request).unwrap_or_else(|reason| vec![status(1, &reason, None)])
    }

    /// Returns the operation of a request that must wait for its turn.
    fn operation(&self, request: &FoxgloveRequest) -> Option<&'static Operation> {
        match request {
            FoxgloveRequest::SetParameters { .. } => by_name("write"),
            FoxgloveRequest::Message { channel, .. } => self.published.get(channel)?.operation(),
            FoxgloveRequest::Call(call) => by_name(services::name(call)?),
            _ => None,
        }
    }

    fn make(&mut self, request: FoxgloveRequest) -> Result<Vec<Out>, String> {
        match request {
            FoxgloveRequest::Subscribe(pairs) => {
                pairs.into_iter().try_for_each(|(id, channel)| self.subscribe(id, channel))?
            }
            FoxgloveRequest::Unsubscribe(ids) => {
                for id in ids {
                    self.subscriptions.remove(&id);
                    self.transforms.remove(&id);
                }
            }
            FoxgloveRequest::Advertise(channels) => {
                for (id, channel) in channels {
                    if self.published.len() >= MOST {
                        return Err(format!("a client publishes at most {MOST} channels"));
                    }
                    self.published.insert(id, self.publishing(channel)?);
                }
            }
            FoxgloveRequest::Unadvertise(ids) => {
                for id in ids {
                    if let Some(channel) = self.published.remove(&id) {
                        // With it goes what it drives.
                        self.controls.remove(channel.actuator().unwrap_or_default());
                    }
                }
            }
            FoxgloveRequest::Message { channel, payload } => self.publish(channel, &payload)?,
            FoxgloveRequest::GetParameters { names, id } => {
                return Ok(vec![self.parameters(&names, id.as_deref())]);
            }
            FoxgloveRequest::SetParameters { values, id } => {
                return Ok(self.set_parameters(&values, id.as_deref()));
            }
            FoxgloveRequest::WatchParameters(names) => self.watch_parameters(&names),
            FoxgloveRequest::UnwatchParameters(names) => {
                names.iter().for_each(|name| drop(self.watched.remove(name)))
            }
            FoxgloveRequest::Graph(wanted) => {
                (self.wants_graph, self.graph) = (wanted, None);
                return Ok(self.graph_changed());
            }
            FoxgloveRequest::Call(call) => {
                return Ok(vec![services::answer(&self.dispatcher, &self.caller, &call)]);
            }
        }
        Ok(Vec::new())
    }

    fn subscribe(&mut self, id: u32, channel: u32) -> Result<(), String> {
        if self.subscriptions.len() + self.transforms.len() >= MOST {
            return Err(format!("a client has at most {MOST} subscriptions"));
        }
        if let Some(is_fixed) = self.channels.transforms(channel) {
            let stream = TransformStream::new(&self.surface, |_| true);
            self.transforms.insert(id, ClientTransforms { is_fixed, stream });
            return Ok(());
        }
        let Some((path, form)) = self.channels.get(channel) else {
            return Err(format!("there is no channel {channel}"));
        };
        let watcher = Watcher::new(&self.surface, path, 0).map_err(|error| error.to_string())?;
        let form = Arc::clone(form);
        let frame = frames(&self.surface, |_| true).of(&format!("/{path}")).to_owned();
        self.subscriptions.insert(id, Subscription { channel, watcher, form, frame });
        Ok(())
    }

    /// Sends the new values; `None` when the client is gone.
    async fn tell(mut self, sink: &mut Sink) -> Option<Self> {
        let ids: Vec<u32> = self.subscriptions.keys().copied().collect();
        for id in ids {
            let Some(subscription) = self.subscriptions.get_mut(&id) else { continue };
            if !subscription.watcher.has_news(&self.surface) {
                continue;
            }
            let Some(mut subscription) = self.subscriptions.remove(&id) else { continue };
            let large = subscription.watcher.size() > LARGE;
            let encoded = apart(large, move || {
                let messages = encode(id, &mut subscription);
                (subscription, messages)
            });
            let (subscription, messages) = encoded.await?;
            let (channel, began) = (subscription.channel, Instant::now());
            self.subscriptions.insert(id, subscription);
            for message in messages {
                if !hand(sink, message).await {
                    return None;
                }
            }
            if began.elapsed() > SLOW {
                let path = self.channels.get(channel).map_or("", |(path, _)| path);
                let text = format!("this client reads slowly: of /{path} it gets the newest values");
                send(sink, vec![status(1, &text, Some(path))]).await.then_some(())?;
            }
        }
        for (id, transforms) in &mut self.transforms {
            let Some((time, message)) = transforms.look(&self.surface) else { continue };
            let head = [&[1][..], &id.to_le_bytes(), &time.to_le_bytes()].concat();
            if !hand(sink, [head, message].concat()).await {
                return None;
            }
        }
        Some(self)
    }

    /// Returns the changed graph of publishers and subscribers, if any.
    fn graph_changed(&mut self) -> Vec<Out> {
        if !self.wants_graph {
            return Vec::new();
        }
        let graph = self.channels.graph(&self.surface);
        if self.graph.as_ref() == Some(&graph) {
            return Vec::new();
        }
        let mut update = graph.clone();
        update["op"] = json!("connectionGraphUpdate");
        update["removedTopics"] = channels::removed(self.graph.as_ref(), &graph);
        update["removedServices"] = json!([]);
        self.graph = Some(graph);
        vec![Out::Text(update.to_string())]
    }
}

fn encode(id: u32, subscription: &mut Subscription) -> Vec<Vec<u8>> {
    let keeps_more =
        subscription.watcher.property().and_then(|property| property.channel()).map_or(0, |c| c.depth()) > 1;
    let watcher = &mut subscription.watcher;
    let samples = match keeps_more {
        true => watcher.take_all(),
        false => watcher.take().map(|sample| sample.into_iter().collect()),
    };
    let message = |sample: slate_control::Sample| {
        let mut bytes = vec![1];
        bytes.extend(id.to_le_bytes());
        bytes.extend(sample.stamp.time.to_le_bytes());
        // A value that can't be told is left out; another one may be.
        subscription.form.encode(&sample, &subscription.frame, &mut bytes).ok().map(|()| bytes)
    };
    samples.unwrap_or_default().into_iter().filter_map(message).collect()
}

/// Creates a status message for people.
/// Level 0 is information, 1 a warning, 2 an error.
fn status(level: u8, text: &str, id: Option<&str>) -> Out {
    let mut status = json!({ "op": "status", "level": level, "message": text });
    if let Some(id) = id {
        status["id"] = json!(id);
    }
    Out::Text(status.to_string())
}
