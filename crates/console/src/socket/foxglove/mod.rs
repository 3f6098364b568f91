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

use std::sync::Arc;
use std::time::Duration;

use futures_util::future::Either;
use serde_json::json;
use slate_runtime::Teleoperation;
use slate_sorted::SortedMap;
use tokio::sync::{Semaphore, mpsc};
use tokio::time::Instant;

use super::{ClientMessage, Listener, Sink, SocketClient, ping, send_bytes, send_text};
use channels::{ChannelFormat, Channels};
use request::FoxgloveRequest;
use slate_control::operations::by_name;
use slate_control::{
    Caller, ControlSurface, Dispatcher, Operation, TransformStream, Watcher, frames, offload,
};
use slate_ros_messages as ros;

/// Names of the protocol; both are the same.
pub(super) const PROTOCOLS: [&str; 2] = ["foxglove.websocket.v1", "foxglove.sdk.v1"];

/// Polling period for new values and for added or removed properties.
const POLL_PERIOD: Duration = Duration::from_millis(10);
const SURVEY_PERIOD: Duration = Duration::from_secs(1);

/// Period of time messages, when the agent has its own clock.
const CLOCK_PERIOD: Duration = Duration::from_millis(100);

/// Duration of sending after which a client is warned that it is slow.
const SLOW_SEND: Duration = Duration::from_millis(250);

/// Size from which values are encoded in another thread, bytes.
const LARGE_SIZE: usize = 4096;

/// Maximum size of a client's queued requests, bytes.
/// They wait for the one before them; excess requests are refused.
const MAX_WAITING_BYTES: usize = 2 << 20;

/// Refusal of such a request.
const OVERLOAD_MESSAGE: &str = "too many requests of this client wait: one is refused";

/// Maximum number of subscriptions of a client.
const MAX_CHANNELS: usize = 512;

/// Client's subscription of `/tf`, or of `/tf_static`.
struct ClientTransforms {
    is_fixed: bool,
    stream: TransformStream,
}

impl ClientTransforms {
    /// Returns the message of the new values, and its time.
    fn next_message(&mut self, surface: &ControlSurface) -> Option<(u64, Vec<u8>)> {
        let (time, moving, fixed) = self.stream.take(surface);
        let transforms = if self.is_fixed { fixed } else { moving };
        let mut message = Vec::new();
        ros::encode_transforms(&transforms, &mut message).ok().filter(|()| !transforms.is_empty())?;
        Some((time, message))
    }
}

/// Outgoing message.
enum OutgoingMessage {
    Text(String),
    Bytes(Vec<u8>),
}

/// Subscriptions of a client, and the state last sent to it.
struct FoxgloveSession {
    surface: Arc<ControlSurface>,
    dispatcher: Arc<Dispatcher>,
    caller: Caller,
    who: String,
    channels: Channels,
    subscriptions: SortedMap<u32, Subscription>,
    /// Subscriptions of transforms.
    transforms: SortedMap<u32, ClientTransforms>,
    /// Channels that the client publishes, by its numbers.
    published: SortedMap<u32, publish::PublishTarget>,
    /// Actuators that it drives.
    controls: SortedMap<String, Teleoperation>,
    /// Parameters that it watches, with the values sent last.
    watched: SortedMap<String, serde_json::Value>,
    wants_graph: bool,
    graph: Option<serde_json::Value>,
}

struct Subscription {
    channel: u32,
    watcher: Watcher,
    format: Arc<ChannelFormat>,
    /// Frame of its values.
    frame: String,
}

pub(super) async fn serve(client: SocketClient, mut sink: Sink, mut listener: Listener) {
    let (sender, mut requests) = mpsc::unbounded_channel();
    let capacity = Arc::new(Semaphore::new(MAX_WAITING_BYTES));
    let (answer, mut answers) = mpsc::unbounded_channel();
    let (dispatcher, caller) = (Arc::clone(&client.dispatcher), client.caller());
    let receiving = async move {
        while let Some(message) = listener.next().await {
            // A stop waits for no other request of this client.
            let answered = match services::stop_call(&message) {
                Some(call) => answer.send(services::answer(&dispatcher, &caller, &call)).is_ok(),
                None => match Arc::clone(&capacity).try_acquire_many_owned(message.size()) {
                    Ok(permit) => sender.send((message, permit)).is_ok(),
                    Err(_) => answer.send(status(1, OVERLOAD_MESSAGE, None)).is_ok(),
                },
            };
            if !answered {
                return;
            }
        }
    };
    let sending = async move {
        let mut session = FoxgloveSession::new(client);
        let greeting = session.greeting();
        if !send(&mut sink, greeting).await {
            return;
        }
        let began = Instant::now();
        let (mut surveyed, mut clocked, mut pinged) = (began, began, began);
        loop {
            let mut out = Vec::new();
            match tokio::time::timeout(POLL_PERIOD, requests.recv()).await {
                Ok(None) => return,
                Ok(Some((message, _permit))) => {
                    let carried = carry_out(session, &message);
                    let Some((back, messages)) = answer_while(carried, &mut answers, &mut sink).await else {
                        return;
                    };
                    session = back;
                    out = messages;
                }
                Err(_) if !ping(&mut sink, &mut pinged).await => return,
                Err(_) => {}
            }
            while let Ok(answer) = answers.try_recv() {
                out.push(answer);
            }
            if surveyed.elapsed() >= SURVEY_PERIOD {
                surveyed = Instant::now();
                let looked = offload(true, move || {
                    let mut out = session.channels.survey(&session.surface);
                    out.extend(session.parameters_changed());
                    out.extend(session.graph_changed());
                    (session, out)
                });
                let Some((back, news)) = looked.await else { return };
                session = back;
                out.extend(news);
            }
            if session.surface.is_lockstep && clocked.elapsed() >= CLOCK_PERIOD {
                clocked = Instant::now();
                out.push(OutgoingMessage::Bytes([&[2][..], &session.surface.now().to_le_bytes()].concat()));
            }
            if !send(&mut sink, out).await {
                return;
            }
            let Some(back) = session.send_values(&mut sink).await else { return };
            session = back;
        }
    };
    let (receiving, sending) = (std::pin::pin!(receiving), std::pin::pin!(sending));
    futures_util::future::select(receiving, sending).await;
}

/// Carries out a client's message in its turn, on a separate thread.
/// It may take long or wait for modules.
async fn carry_out(
    mut session: FoxgloveSession,
    message: &ClientMessage,
) -> Option<(FoxgloveSession, Vec<OutgoingMessage>)> {
    let request = match message {
        ClientMessage::Text(text) => FoxgloveRequest::parse(text),
        ClientMessage::Binary(bytes) => FoxgloveRequest::parse_bytes(bytes),
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
    let carried = offload(true, move || {
        let _turn = turn;
        let out = session.handle(request);
        (session, out)
    });
    carried.await
}

/// Waits for work, and sends answers in the meantime.
/// `None` if the client is gone.
async fn answer_while<T>(
    work: impl Future<Output = Option<T>>,
    answers: &mut mpsc::UnboundedReceiver<OutgoingMessage>,
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
async fn send(sink: &mut Sink, out: Vec<OutgoingMessage>) -> bool {
    for message in out {
        let is_connected = match message {
            OutgoingMessage::Text(text) => send_text(sink, text).await,
            OutgoingMessage::Bytes(bytes) => send_bytes(sink, bytes).await,
        };
        if !is_connected {
            return false;
        }
    }
    true
}

impl FoxgloveSession {
    fn new(client: SocketClient) -> Self {
        let caller = client.caller();
        Self {
            channels: Channels::default(),
            surface: client.surface,
            dispatcher: client.dispatcher,
            caller,
            who: client.who,
            subscriptions: SortedMap::new(),
            transforms: SortedMap::new(),
            published: SortedMap::new(),
            controls: SortedMap::new(),
            watched: SortedMap::new(),
            wants_graph: false,
            graph: None,
        }
    }

    /// Returns the first messages to a client.
    fn greeting(&mut self) -> Vec<OutgoingMessage> {
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
        let mut out = vec![OutgoingMessage::Text(info.to_string())];
        out.extend(self.channels.survey(&self.surface));
        out.push(services::advertise());
        out
    }

    /// Carries out a request.
    fn handle(&mut self, request: FoxgloveRequest) -> Vec<OutgoingMessage> {
        self.apply(request).unwrap_or_else(|reason| vec![status(1, &reason, None)])
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

    fn apply(&mut self, request: FoxgloveRequest) -> Result<Vec<OutgoingMessage>, String> {
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
                    if self.published.len() >= MAX_CHANNELS {
                        return Err(format!("a client publishes at most {MAX_CHANNELS} channels"));
                    }
                    self.published.insert(id, self.destination(channel)?);
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
        if self.subscriptions.len() + self.transforms.len() >= MAX_CHANNELS {
            return Err(format!("a client has at most {MAX_CHANNELS} subscriptions"));
        }
        if let Some(is_fixed) = self.channels.transforms(channel) {
            let stream = TransformStream::new(&self.surface, |_| true);
            self.transforms.insert(id, ClientTransforms { is_fixed, stream });
            return Ok(());
        }
        let Some((path, format)) = self.channels.get(channel) else {
            return Err(format!("there is no channel {channel}"));
        };
        let watcher = Watcher::new(&self.surface, path, 0).map_err(|error| error.to_string())?;
        let format = Arc::clone(format);
        let frame = frames(&self.surface, |_| true).of(&format!("/{path}")).to_owned();
        self.subscriptions.insert(id, Subscription { channel, watcher, format, frame });
        Ok(())
    }

    /// Sends the new values; `None` when the client is gone.
    async fn send_values(mut self, sink: &mut Sink) -> Option<Self> {
        let ids: Vec<u32> = self.subscriptions.keys().copied().collect();
        for id in ids {
            let Some(subscription) = self.subscriptions.get_mut(&id) else { continue };
            if !subscription.watcher.has_update(&self.surface) {
                continue;
            }
            let Some(mut subscription) = self.subscriptions.remove(&id) else { continue };
            let large = subscription.watcher.size() > LARGE_SIZE;
            let encoded = offload(large, move || {
                let messages = encode(id, &mut subscription);
                (subscription, messages)
            });
            let (subscription, messages) = encoded.await?;
            let (channel, began) = (subscription.channel, Instant::now());
            self.subscriptions.insert(id, subscription);
            for message in messages {
                if !send_bytes(sink, message).await {
                    return None;
                }
            }
            if began.elapsed() > SLOW_SEND {
                let path = self.channels.get(channel).map_or("", |(path, _)| path);
                let text = format!("this client reads slowly: of /{path} it gets the newest values");
                send(sink, vec![status(1, &text, Some(path))]).await.then_some(())?;
            }
        }
        for (id, transforms) in &mut self.transforms {
            let Some((time, message)) = transforms.next_message(&self.surface) else { continue };
            let head = [&[1][..], &id.to_le_bytes(), &time.to_le_bytes()].concat();
            if !send_bytes(sink, [head, message].concat()).await {
                return None;
            }
        }
        Some(self)
    }

    /// Returns the changed graph of publishers and subscribers, if any.
    fn graph_changed(&mut self) -> Vec<OutgoingMessage> {
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
        vec![OutgoingMessage::Text(update.to_string())]
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
        // A value that can't be encoded is left out; a later one may be possible.
        subscription.format.encode(&sample, &subscription.frame, &mut bytes).ok().map(|()| bytes)
    };
    samples.unwrap_or_default().into_iter().filter_map(message).collect()
}

/// Creates a status message for people.
/// Level 0 is information, 1 a warning, 2 an error.
fn status(level: u8, text: &str, id: Option<&str>) -> OutgoingMessage {
    let mut status = json!({ "op": "status", "level": level, "message": text });
    if let Some(id) = id {
        status["id"] = json!(id);
    }
    OutgoingMessage::Text(status.to_string())
}
