//! WebSockets: live values, teleoperation, and Foxglove.

mod foxglove;
mod live;
mod teleoperation;

use std::net::SocketAddr;
use std::sync::Arc;
use std::time::Duration;

use futures_util::stream::{SplitSink, SplitStream};
use futures_util::{SinkExt, StreamExt};
use hyper::header::{
    CONNECTION, HeaderMap, HeaderValue, ORIGIN, SEC_WEBSOCKET_ACCEPT, SEC_WEBSOCKET_PROTOCOL, UPGRADE,
};
use hyper::upgrade::Upgraded;
use hyper::{Method, Request, Response, StatusCode};
use hyper_util::rt::TokioIo;
use slate_module::Level;
use tokio::time::Instant;
use tokio_tungstenite::WebSocketStream;
use tokio_tungstenite::tungstenite::handshake::derive_accept_key;
use tokio_tungstenite::tungstenite::protocol::{Role as Side, WebSocketConfig};
use tokio_tungstenite::tungstenite::{Bytes, Message};

use crate::guard::{Guard, TOKEN_PROTOCOL, protocols};
use slate_control::{
    BASE, Caller, ConnectionSlot, ControlSurface, Dispatcher, Problem, Query, ResponseBody, Role, response,
    with_caller_name,
};

/// Maximum size of a client's message, bytes.
const MAX_MESSAGE_SIZE: usize = 64 << 10;

/// Maximum message rate of a client, Hz.
const MAX_MESSAGE_RATE: f64 = 256.0;

/// Timeout of a silent client, which does not even answer pings.
const SILENCE_TIMEOUT: Duration = Duration::from_secs(30);

/// Period of pings.
const PING_PERIOD: Duration = Duration::from_secs(10);

/// Sink of one end of a socket.
type Sink = SplitSink<WebSocketStream<TokioIo<Upgraded>>, Message>;

/// Source of a client's messages.
struct Listener {
    stream: SplitStream<WebSocketStream<TokioIo<Upgraded>>>,
    /// Messages, and since when they are counted.
    count: (f64, Instant),
}

/// Message of a client.
enum ClientMessage {
    Text(String),
    Binary(Bytes),
}

impl ClientMessage {
    /// Returns the approximate size in memory, bytes.
    fn size(&self) -> u32 {
        let length = match self {
            Self::Text(text) => text.len(),
            Self::Binary(bytes) => bytes.len(),
        };
        u32::try_from(length).unwrap_or(u32::MAX).saturating_add(64)
    }
}

impl Listener {
    /// Returns the next message.
    /// `None` if the client is gone, silent for too long, or sends too many.
    async fn next(&mut self) -> Option<ClientMessage> {
        loop {
            let message = tokio::time::timeout(SILENCE_TIMEOUT, self.stream.next()).await.ok()??.ok()?;
            let passed = self.count.1.elapsed().as_secs_f64();
            if passed >= 1.0 {
                self.count = (0.0, Instant::now());
            }
            self.count.0 += 1.0;
            if self.count.0 > 2.0 * MAX_MESSAGE_RATE {
                return None;
            }
            match message {
                Message::Text(text) => return Some(ClientMessage::Text(text.as_str().to_owned())),
                Message::Binary(bytes) => return Some(ClientMessage::Binary(bytes)),
                Message::Close(_) => return None,
                Message::Ping(_) | Message::Pong(_) | Message::Frame(_) => {}
            }
        }
    }
}

/// Kind of a socket.
#[derive(Clone, Copy, PartialEq, Eq)]
enum SocketService {
    Live,
    Teleoperation,
    Foxglove,
}

/// Subprotocol of our own sockets.
const SLATE_PROTOCOL: &str = "slate.v1";

impl SocketService {
    /// Returns the kind of socket at a path for a client with these subprotocols.
    fn of(path: &str, offered: &[String]) -> Option<Self> {
        let speaks_foxglove = offered.iter().any(|protocol| foxglove::PROTOCOLS.contains(&protocol.as_str()));
        match path.strip_prefix(BASE).unwrap_or(path) {
            "/live" => Some(Self::Live),
            "/teleoperation" => Some(Self::Teleoperation),
            "/foxglove" => Some(Self::Foxglove),
            // Where its clients look unless a path is given.
            "/" if speaks_foxglove => Some(Self::Foxglove),
            _ => None,
        }
    }

    fn protocols(self) -> &'static [&'static str] {
        match self {
            Self::Live | Self::Teleoperation => &[SLATE_PROTOCOL],
            Self::Foxglove => &foxglove::PROTOCOLS,
        }
    }
}

/// Client at a socket.
struct SocketClient {
    surface: Arc<ControlSurface>,
    dispatcher: Arc<Dispatcher>,
    role: Role,
    /// Identity of the client, for the log.
    who: String,
    /// Slot of the connection, which counts as long as this lives.
    slot: Arc<ConnectionSlot>,
}

impl SocketClient {
    /// Returns the caller of operations.
    fn caller(&self) -> Caller {
        let connection = Arc::clone(&self.slot);
        Caller { role: self.role, who: self.who.clone(), local: None, is_told: false, connection }
    }
}

/// Opens a socket.
pub(crate) fn open<B>(
    dispatcher: &Arc<Dispatcher>,
    guard: &Guard,
    slot: &Arc<ConnectionSlot>,
    from: SocketAddr,
    mut request: Request<B>,
) -> Result<Response<ResponseBody>, Problem> {
    let path = request.uri().path().to_owned();
    let headers = request.headers();
    let offered = protocols(headers);
    let kind = SocketService::of(&path, &offered).ok_or_else(|| {
        let help = format!("available: {BASE}/live, {BASE}/teleoperation and /foxglove");
        Problem::not_found(format!("there is no WebSocket at {path}"), help)
    })?;
    let key = key(request.method(), headers)?.to_owned();
    let mut query = Query::parse(request.uri().query().unwrap_or_default())?;
    let role = guard.role(request.method(), headers, &mut query)?;
    guard.check_rate()?;
    let mine: Vec<_> = offered.iter().filter(|protocol| !protocol.starts_with(TOKEN_PROTOCOL)).collect();
    let chosen = kind.protocols().iter().find(|known| mine.iter().any(|protocol| protocol == *known));
    if chosen.is_none() && !(mine.is_empty() && kind != SocketService::Foxglove) {
        let message = format!("none of the subprotocols is supported: {}", offered.len());
        return Err(Problem::bad(message, format!("offer {}", kind.protocols().join(" or "))));
    }
    if kind == SocketService::Teleoperation && role < Role::Operator {
        let message = format!("{} may not drive", role.with_article());
        return Err(Problem::new(StatusCode::FORBIDDEN, message, "ask with the token of an operator"));
    }
    let full = || {
        let message = "too many WebSockets are open";
        Problem::new(StatusCode::SERVICE_UNAVAILABLE, message, "close one").with("retry-after", "5")
    };
    // Only browsers say which page they come from.
    let is_page = kind == SocketService::Live && headers.contains_key(ORIGIN);
    if !slot.upgrade(is_page) {
        return Err(full());
    }
    let (who, _) = with_caller_name(format!("{role} at {from}"), headers);
    let mut answer = response(StatusCode::SWITCHING_PROTOCOLS, "", ResponseBody::Whole(None));
    let accepted = derive_accept_key(key.as_bytes());
    let answered = answer.headers_mut();
    answered.insert(CONNECTION, HeaderValue::from_static("Upgrade"));
    answered.insert(UPGRADE, HeaderValue::from_static("websocket"));
    if let Ok(accepted) = HeaderValue::from_str(&accepted) {
        answered.insert(SEC_WEBSOCKET_ACCEPT, accepted);
    }
    if let Some(chosen) = chosen {
        answered.insert(SEC_WEBSOCKET_PROTOCOL, HeaderValue::from_static(chosen));
    }
    answered.remove(hyper::header::CONTENT_TYPE);
    let upgrade = hyper::upgrade::on(&mut request);
    let closed = Arc::clone(&slot.close_notice);
    let slot = Arc::clone(slot);
    let (surface, dispatcher) = (Arc::clone(dispatcher.surface()), Arc::clone(dispatcher));
    let client = SocketClient { surface, dispatcher, role, who, slot };
    tokio::spawn(async move {
        let Ok(upgraded) = upgrade.await else { return };
        let serve = serve(kind, client, upgraded);
        let (serve, closed) = (std::pin::pin!(serve), std::pin::pin!(closed.notified()));
        futures_util::future::select(serve, closed).await;
    });
    Ok(answer)
}

/// Returns the WebSocket key of the client.
fn key<'h>(method: &Method, headers: &'h HeaderMap) -> Result<&'h str, Problem> {
    let text = |name: &str| headers.get(name).and_then(|value| value.to_str().ok()).unwrap_or_default();
    let is_upgrade = text("connection").split(',').any(|part| part.trim().eq_ignore_ascii_case("upgrade"));
    if *method != Method::GET || !is_upgrade || !text("upgrade").eq_ignore_ascii_case("websocket") {
        return Err(Problem::bad(
            "this is no handshake of a WebSocket",
            "open it with GET and `Upgrade: websocket`",
        ));
    }
    if text("sec-websocket-version") != "13" {
        let problem =
            Problem::new(StatusCode::UPGRADE_REQUIRED, "the version of WebSockets is 13", "use that");
        return Err(problem.with("sec-websocket-version", "13"));
    }
    let key = text("sec-websocket-key");
    if key.len() != 24 {
        return Err(Problem::bad("the handshake has no key", "send `Sec-WebSocket-Key`"));
    }
    Ok(key)
}

async fn serve(kind: SocketService, client: SocketClient, upgraded: Upgraded) {
    let mut settings = WebSocketConfig::default();
    settings.max_message_size = Some(MAX_MESSAGE_SIZE);
    settings.max_frame_size = Some(MAX_MESSAGE_SIZE);
    // Unsent data waits in the kernel, or its sender waits.
    settings.write_buffer_size = 0;
    let stream = WebSocketStream::from_raw_socket(TokioIo::new(upgraded), Side::Server, Some(settings)).await;
    let (sink, stream) = stream.split();
    let listener = Listener { stream, count: (0.0, Instant::now()) };
    if kind != SocketService::Live {
        client.surface.log(Level::Info, &format!("{} has come to {}", client.who, kind.name()));
    }
    match kind {
        SocketService::Live => live::serve(client, sink, listener).await,
        SocketService::Teleoperation => teleoperation::serve(client, sink, listener).await,
        SocketService::Foxglove => foxglove::serve(client, sink, listener).await,
    }
}

impl SocketService {
    fn name(self) -> &'static str {
        match self {
            Self::Live => "the live values",
            Self::Teleoperation => "the controls",
            Self::Foxglove => "the endpoint for Foxglove",
        }
    }
}

/// Sends text; false when the client is gone.
async fn send_text(sink: &mut Sink, text: String) -> bool {
    sink.send(Message::Text(text.into())).await.is_ok()
}

/// Sends bytes; false when the client is gone.
async fn send_bytes(sink: &mut Sink, bytes: Vec<u8>) -> bool {
    sink.send(Message::Binary(bytes.into())).await.is_ok()
}

/// Pings the client periodically; false when it is gone.
async fn ping(sink: &mut Sink, last: &mut Instant) -> bool {
    if last.elapsed() < PING_PERIOD {
        return true;
    }
    *last = Instant::now();
    sink.send(Message::Ping(Bytes::new())).await.is_ok()
}
