//! Topic that a node subscribes to.

use std::io;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::Duration;

use slate_module::Level;
use slate_sorted::{SortedMap, SortedSet};
use tokio::net::TcpStream;
use tokio::sync::Notify;
use tokio::task::JoinHandle;
use tokio::time::{sleep, timeout};

use super::context::NodeContext;
use super::header::{ConnectionHeader, mismatch, read_message, wrong};
use super::http::{HttpAddress, TIMEOUT};
use super::master::{CallError, call_method};
use super::xml::XmlValue;
use crate::checksum::message_checksum;

/// Bytes that a message may have.
const MAX_MESSAGE_BYTES: u32 = 64 << 20;

/// Publishers of a topic that are connected with, at most.
const MAX_PUBLISHERS: usize = 64;

/// Initial and maximum delay of reconnecting to a lost publisher.
const RETRY: [Duration; 2] = [Duration::from_millis(50), Duration::from_secs(2)];

/// Delay of reconnecting to a publisher with another message type.
const MISFIT: Duration = Duration::from_secs(5);

/// Takes messages, or why one can't be taken.
pub type MessageSink = Box<dyn Fn(Result<&[u8], String>) + Send + Sync>;

/// Topic, and the publishers that the master knows.
pub struct TopicSubscription {
    pub topic: String,
    pub of: String,
    definition: String,
    checksum: String,
    sink: MessageSink,
    /// Addresses of their APIs.
    publishers: Mutex<SortedSet<String>>,
    /// Outdated publishers: the master must be queried for them.
    is_stale: AtomicBool,
    changed: Notify,
    connected: AtomicUsize,
}

/// Counts a connection as long as it lives.
struct Connected<'a>(&'a AtomicUsize);

impl Drop for Connected<'_> {
    fn drop(&mut self) {
        self.0.fetch_sub(1, Ordering::Relaxed);
    }
}

/// Guard that ends a task when dropped.
struct ReadingTask(JoinHandle<()>);

impl Drop for ReadingTask {
    fn drop(&mut self) {
        self.0.abort();
    }
}

impl TopicSubscription {
    /// Creates a topic of a type, whose messages go to a sink.
    ///
    /// # Errors
    /// A definition that lacks a message, in words.
    pub fn new(topic: &str, (of, definition): (&str, &str), sink: MessageSink) -> Result<Self, String> {
        Ok(Self {
            topic: topic.into(),
            of: of.into(),
            definition: definition.into(),
            checksum: message_checksum(of, definition)?,
            sink,
            publishers: Mutex::default(),
            is_stale: AtomicBool::new(false),
            changed: Notify::new(),
            connected: AtomicUsize::new(0),
        })
    }

    /// Publishers that are connected.
    pub fn publishers(&self) -> usize {
        self.connected.load(Ordering::Relaxed)
    }

    /// Subscribes at the master, and returns the publishers that it knows.
    /// They are addresses of their APIs.
    ///
    /// # Errors
    /// When the master refuses or is not reached.
    pub async fn subscribe(&self, node: &NodeContext) -> Result<Vec<String>, CallError> {
        let arguments = vec![self.topic.as_str().into(), self.of.as_str().into(), node.api.as_str().into()];
        let all = node.master.call("registerSubscriber", arguments).await?;
        let all = all.as_list().unwrap_or_default().iter();
        Ok(all.filter_map(XmlValue::as_text).map(ToOwned::to_owned).collect())
    }

    /// Takes note of the publishers that the master knows.
    pub fn note_publishers(&self, all: impl IntoIterator<Item = String>) {
        let all = all.into_iter().take(MAX_PUBLISHERS).collect();
        *self.publishers.lock().unwrap_or_else(PoisonError::into_inner) = all;
        self.changed.notify_one();
    }

    /// Requests a query of the master for the publishers.
    /// The notice of a change is not trusted, as any program can send it.
    pub fn query_publishers(&self) {
        self.is_stale.store(true, Ordering::Release);
        self.changed.notify_one();
    }

    /// Reads all publishers, until it is aborted.
    pub async fn run(self: Arc<Self>, node: Arc<NodeContext>) {
        let mut tasks: SortedMap<String, ReadingTask> = SortedMap::new();
        loop {
            if self.is_stale.swap(false, Ordering::AcqRel)
                && let Ok(all) = self.subscribe(&node).await
            {
                self.note_publishers(all);
            }
            let mut wanted = self.publishers.lock().unwrap_or_else(PoisonError::into_inner).clone();
            // Its own publications are not read.
            wanted.remove(&node.api);
            tasks.retain(|publisher, _| wanted.contains(publisher));
            for publisher in wanted {
                let read = Arc::clone(&self).read(Arc::clone(&node), publisher.clone());
                tasks.entry(publisher).or_insert_with(|| ReadingTask(tokio::spawn(read)));
            }
            self.changed.notified().await;
        }
    }

    /// Reads a publisher, and connects again when it is lost.
    async fn read(self: Arc<Self>, node: Arc<NodeContext>, publisher: String) {
        let mut pause = RETRY[0];
        loop {
            match self.connect(&node, &publisher).await {
                Ok(stream) => {
                    pause = RETRY[0];
                    self.receive(stream).await;
                }
                Err(error) if error.kind() == io::ErrorKind::InvalidData => {
                    node.log_once(Level::Warn, &error.to_string());
                    pause = MISFIT;
                }
                Err(_) => pause = (pause * 2).min(RETRY[1]),
            }
            sleep(pause).await;
        }
    }

    /// Connects to a publisher.
    ///
    /// # Errors
    /// When the publisher is not reached; invalid data when it means another message.
    async fn connect(&self, node: &NodeContext, publisher: &str) -> io::Result<TcpStream> {
        let api = HttpAddress::parse(publisher).map_err(io::Error::other)?;
        node.check_reach(&api.authority).await?;
        let protocols = XmlValue::List(vec![XmlValue::List(vec!["TCPROS".into()])]);
        let arguments = [node.name().into(), self.topic.as_str().into(), protocols];
        let answer = call_method(&api, "requestTopic", &arguments).await;
        let answer = answer.map_err(|error| io::Error::other(error.to_string()))?;
        let authority = match answer.as_list() {
            Some([_, host, port]) => host.as_text().zip(port.as_integer()),
            _ => None,
        };
        let (host, port) = authority.ok_or_else(|| io::Error::other("it speaks no TCPROS"))?;
        let authority = format!("{host}:{port}");
        node.check_reach(&authority).await?;
        let (stream, theirs) = self.exchange(node, &authority, &self.of, &self.checksum).await?;
        if theirs.get("error").is_empty() && theirs.takes(&self.of, &self.checksum) {
            return Ok(stream);
        }
        // A wildcard request returns the type that it has instead.
        let theirs = match theirs.get("error") {
            "" => theirs,
            _ => self.exchange(node, &authority, "*", "*").await?.1,
        };
        Err(wrong(&mismatch(&self.topic, "publisher", &theirs, &self.of, &self.checksum)))
    }

    /// Sends the wanted type to a publisher, and returns its header.
    async fn exchange(
        &self,
        node: &NodeContext,
        authority: &str,
        of: &str,
        checksum: &str,
    ) -> io::Result<(TcpStream, ConnectionHeader)> {
        let exchange = async {
            let mut stream = TcpStream::connect(authority).await?;
            stream.set_nodelay(true)?;
            let own = [
                ("callerid", node.name()),
                ("md5sum", checksum),
                ("message_definition", &self.definition),
                ("tcp_nodelay", "1"),
                ("topic", &self.topic),
                ("type", of),
            ];
            ConnectionHeader::of(own).write(&mut stream).await?;
            let theirs = ConnectionHeader::read(&mut stream).await.map_err(io::Error::other)?;
            Ok::<_, io::Error>((stream, theirs))
        };
        timeout(TIMEOUT, exchange).await?
    }

    /// Takes messages until the connection is lost.
    async fn receive(&self, mut stream: TcpStream) {
        self.connected.fetch_add(1, Ordering::Relaxed);
        let _connected = Connected(&self.connected);
        loop {
            match read_message(&mut stream, MAX_MESSAGE_BYTES).await {
                Ok(message) => (self.sink)(Ok(&message)),
                Err(error) if error.kind() == io::ErrorKind::InvalidData => {
                    return (self.sink)(Err(error.to_string()));
                }
                Err(_) => return,
            }
        }
    }
}
