//! Value from one process to another one on this machine.
//! The time goes from before it is handed over until a thread of the other process has it, and each value waits for the
//! one before.
//!
//! The other process is this program again. It prints the latency of each value, which the sender reads.

use std::io::{BufRead, BufReader, Read, Write};
use std::net::{TcpListener, TcpStream};
use std::process::{Child, Command, Stdio};
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Arc, mpsc};
use std::thread;
use std::time::{Duration, Instant};

use iceoryx2::prelude::*;
use slate_blackboard::channel::Budget;
use slate_blackboard::interface::Interface;
use slate_blackboard::wake::Wake;
use slate_blackboard::{Access, Board, Store};
use slate_module::interface;
use slate_share::peers::{Peers, Setup, WantedProperty};
use slate_share::session::{Compression, Identity, Limits, Options};
use zenoh::Wait;
use zenoh::qos::CongestionControl;

use super::network::{AGENT, AGENT_KEY, AgentSender, CDR_HEADER, STALLED, read_stalled};
use super::scripts::{ALL, Script, script};
use super::sessions::session;
use crate::machine::now;
use crate::measure::{Contest, Effort, Samples, allocations};
use crate::table::{Role, Table};

/// The word that makes this program the other process.
pub const READER: &str = "@reader";

const SIZES: [usize; 5] = [64, 4 << 10, 64 << 10, 1 << 20, 4 << 20];

/// Longer than any value takes that comes at all.
pub const LOST: Duration = Duration::from_secs(10);

/// Measures all lines.
pub fn run(effort: Effort, table: &mut Table) {
    for size in SIZES {
        let mut contest = Contest::new("process to process, shared memory", format!("{size} B"));
        add(&mut contest, "Slate", Role::Slate, size, effort, Slate::start(size));
        add(
            &mut contest,
            "iceoryx2 publish-subscribe with an event",
            Role::Peer,
            size,
            effort,
            Iceoryx::start(size),
        );
        foreign(&SHARED_MEMORY, &mut contest, "process to process, shared memory", size, effort, table);
        contest.run(effort, table);
    }
    for size in SIZES {
        let mut contest = Contest::new("process to process, sockets", format!("{size} B"));
        add(
            &mut contest,
            "Slate, to a program of Zenoh",
            Role::Slate,
            size,
            effort,
            AgentSender::start(size),
        );
        add(
            &mut contest,
            "zenoh, in its callback",
            Role::Lesser,
            size,
            effort,
            Zenoh::start("zenoh-callback", size),
        );
        add(
            &mut contest,
            "zenoh, to a thread of the application",
            Role::Peer,
            size,
            effort,
            Zenoh::start("zenoh-thread", size),
        );
        add(&mut contest, "TCP, nothing else", Role::Floor, size, effort, Tcp::start(size));
        foreign(&SOCKETS, &mut contest, "process to process, sockets", size, effort, table);
        contest.run(effort, table);
    }
}

/// Peers that are no crates, where values go by shared memory.
static SHARED_MEMORY: [Script; 3] = [
    script("ROS 2 in C (rcl, Fast DDS)", Role::Peer, &["ros2", "rcl", "local"], ALL),
    script("ROS 2 in Python (rclpy, Fast DDS)", Role::Peer, &["ros2", "rclpy", "local"], ALL),
    script(DORA, Role::Peer, &["dora"], DORA_SHARES..usize::MAX),
];

/// Peers that are no crates, where values go by sockets.
static SOCKETS: [Script; 6] = [
    script("roscpp, in its callback", Role::Lesser, &["roscpp", "processes"], ALL),
    script("LCM over UDP multicast, in its callback", Role::Lesser, &["lcm"], ALL),
    script("CycloneDDS over UDP", Role::Peer, &["cyclonedds"], ALL),
    script("ROS 2 in C (rcl, Fast DDS) over UDP", Role::Peer, &["ros2", "rcl", "udp"], ALL),
    script("ROS 2 in Python (rclpy, Fast DDS) over UDP", Role::Peer, &["ros2", "rclpy", "udp"], ALL),
    script(DORA, Role::Peer, &["dora"], 0..DORA_SHARES),
];

const DORA: &str = "dora, nodes in Python";

/// From so many bytes on dora shares memory.
const DORA_SHARES: usize = 4096;

/// Adds contestants that are scripts.
/// A quick run has a small and a large value only, as each takes seconds to start.
fn foreign(
    scripts: &'static [Script],
    contest: &mut Contest<'_>,
    work: &str,
    size: usize,
    effort: Effort,
    table: &mut Table,
) {
    if !effort.quick || [64, 1 << 20].contains(&size) {
        scripts.iter().for_each(|script| script.join(contest, work, size, effort, table));
    }
}

/// Sender of values.
pub trait Sender {
    /// Sends the bytes; the first eight are the time.
    fn send(&mut self, bytes: &[u8]);
}

/// A sender and the process that it sends to.
pub type Pair = (Box<dyn Sender>, Reader);

/// Lets a sender take part.
pub fn add(
    contest: &mut Contest<'_>,
    name: &str,
    role: Role,
    size: usize,
    effort: Effort,
    (mut sender, reader): Pair,
) {
    let count = effort.count(if size > 1 << 16 { 150 } else { 500 });
    let mut bytes = vec![7; size];
    contest.with(name, role, move |samples: &mut Samples| {
        for _ in 0..count {
            // Until all sleep again.
            thread::sleep(Duration::from_micros(500));
            let before = allocations();
            bytes[..8].copy_from_slice(&now().to_ne_bytes());
            sender.send(&bytes);
            samples.allocated(1, allocations() - before);
            samples.add(reader.took());
        }
    });
}

/// The other process.
pub struct Reader {
    child: Child,
    times: mpsc::Receiver<u64>,
}

impl Reader {
    /// Starts it, and waits until it is ready.
    pub fn start(kind: &str, place: &str, size: usize) -> Self {
        let program = std::env::current_exe().expect("a program knows where it is");
        let mut command = Command::new(program);
        command.args([READER, kind, place, &size.to_string()]).stdin(Stdio::piped()).stdout(Stdio::piped());
        let mut child = command.spawn().expect("this program can be started again");
        let (sender, times) = mpsc::channel();
        let output = child.stdout.take().map(BufReader::new).expect("it is piped");
        thread::spawn(move || {
            for line in output.lines().map_while(Result::ok) {
                let _ = line.parse().map(|time: u64| sender.send(time));
            }
        });
        let reader = Self { child, times };
        reader.took();
        reader
    }

    /// Returns whether a value has come that was not requested.
    pub fn has_come(&self) -> bool {
        self.times.try_recv().is_ok()
    }

    /// Returns the latency of the value just sent, ns.
    fn took(&self) -> u64 {
        self.times.recv_timeout(LOST).expect("the other process got the value within ten seconds")
    }
}

impl Drop for Reader {
    fn drop(&mut self) {
        // It ends when the other end is closed.
        drop(self.child.stdin.take());
        let _ = self.child.wait();
    }
}

/// Runs the other process.
/// Its arguments are the reader, the address and the size of values.
pub fn read(arguments: &[String]) {
    let [kind, place, size] = arguments else { return };
    let size = size.parse().unwrap_or(64);
    thread::spawn(|| {
        let _ = std::io::stdin().read(&mut [0]);
        std::process::exit(0);
    });
    match kind.as_str() {
        "slate" => read_slate(place, size),
        "iceoryx" => read_iceoryx(place),
        "tcp" => read_tcp(place, size),
        STALLED => read_stalled(place),
        AGENT => read_zenoh(place, (AGENT_KEY, CDR_HEADER), false),
        callback => read_zenoh(place, ("value", 0), callback == "zenoh-callback"),
    }
}

/// Prints the latency of a value for its sender.
fn tell(bytes: &[u8]) {
    let now = now();
    let sent = bytes.first_chunk().map_or(now, |first| u64::from_ne_bytes(*first));
    say(now.saturating_sub(sent));
}

/// Says how long a value took.
pub fn say(nanoseconds: u64) {
    let mut output = std::io::stdout().lock();
    let _ = writeln!(output, "{nanoseconds}").and_then(|()| output.flush());
}

/// A number that no other agent of this run has.
fn instance() -> u64 {
    static NEXT: AtomicU64 = AtomicU64::new(1);
    u64::from(std::process::id()) << 20 | NEXT.fetch_add(1, Ordering::Relaxed)
}

/// A free port.
pub fn port() -> u16 {
    let listener = TcpListener::bind("127.0.0.1:0").and_then(|listener| listener.local_addr());
    listener.expect("there is a free port").port()
}

/// Many bytes.
#[interface]
pub struct Blob {
    /// When it was sent.
    #[unit("ns")]
    pub time: u64,
    /// The rest.
    pub data: [u8],
}

struct Slate {
    writer: slate_blackboard::channel::Writer,
    peers: Peers,
    _folder: tempfile::TempDir,
}

const PATH: &str = "out/blob";

fn setup(name: &str) -> Setup {
    let identity = Identity { agent: name.into(), instance: instance() };
    let limits = Limits { silence: 2_000_000_000, ..Limits::default() };
    Setup { limits, ..Setup::new(identity, Arc::new(now)) }
}

impl Slate {
    fn start(size: usize) -> Pair {
        let folder = super::folder();
        let endpoint = format!("local:{}", folder.path().join("base").display());
        let board = Arc::new(Board::new("base"));
        let setup = Setup { poll: None, ..setup("base").listen(&endpoint) };
        let peers = Peers::start(&board, setup).expect("it can listen");
        let store =
            Store { capacity: size - 8, depth: 1, budget: Budget { latest: 16, queues: 16, window: 64 } };
        let property = board.add_channel(PATH, "What is sent.", Blob::DESCRIPTOR, store, Access::Output);
        let property = property.expect("the board is empty");
        let writer = property.channel().and_then(|channel| channel.writer().ok()).expect("it is new");
        let reader = Reader::start("slate", &endpoint, size);
        let begin = Instant::now();
        while property.readers() == 0 {
            assert!(begin.elapsed() < LOST, "the reader subscribes");
            thread::sleep(Duration::from_millis(1));
        }
        thread::sleep(Duration::from_millis(300));
        (Box::new(Self { writer, peers, _folder: folder }), reader)
    }
}

impl Sender for Slate {
    fn send(&mut self, bytes: &[u8]) {
        assert!(self.writer.write(bytes, bytes.len() - 8, now()).is_ok(), "no reader blocks");
        self.peers.notifier().notify();
    }
}

fn read_slate(endpoint: &str, size: usize) {
    let updated = Arc::new(Wake::new());
    let board = Arc::new(Board::new("reader"));
    let setup = Setup { updated: Some(Arc::clone(&updated)), ..setup("reader") };
    let peers = Peers::start(&board, setup).expect("a process can start threads");
    peers.connect("base", endpoint).expect("the endpoint is right");
    let want = WantedProperty::new(PATH, Options::default().compression(Compression::None));
    peers.subscribe("base", want.expect(Blob::DESCRIPTOR, size - 8)).expect("it is connected to");
    let (mirror, _) = board.find(&format!("agents/base/{PATH}")).expect("it was subscribed to");
    let mut reader = mirror.channel().and_then(|channel| channel.latest().ok()).expect("a mirror has room");
    say(0);
    loop {
        updated.wait();
        if reader.refresh() {
            reader.value().into_iter().for_each(|loan| tell(loan.bytes()));
        }
    }
}

struct Iceoryx {
    publisher: iceoryx2::port::publisher::Publisher<ipc::Service, [u8], ()>,
    notifier: iceoryx2::port::notifier::Notifier<ipc::Service>,
    _node: Node<ipc::Service>,
}

impl Iceoryx {
    fn start(size: usize) -> Pair {
        let node = super::iceoryx::plain_node();
        let place = format!("slate-bench/process/{}", instance());
        let values = node.service_builder(&super::iceoryx::name(&place)).publish_subscribe::<[u8]>();
        let values = values.subscriber_max_buffer_size(4).create().expect("a new service");
        let event = node.service_builder(&super::iceoryx::name(&place)).event().create();
        let event = event.expect("a new service");
        let publisher = values.publisher_builder().initial_max_slice_len(size).create();
        let publisher = publisher.expect("there is one publisher");
        let notifier = event.notifier_builder().create().expect("there is one notifier");
        let reader = Reader::start("iceoryx", &place, size);
        (Box::new(Self { publisher, notifier, _node: node }), reader)
    }
}

impl Sender for Iceoryx {
    fn send(&mut self, bytes: &[u8]) {
        let sample = self.publisher.loan_slice_uninit(bytes.len()).expect("a sample is free");
        assert!(sample.write_from_slice(bytes).send().is_ok(), "the subscriber is there");
        assert!(self.notifier.notify().is_ok(), "the listener is there");
    }
}

fn read_iceoryx(place: &str) {
    let node = super::iceoryx::plain_node();
    let values = node.service_builder(&super::iceoryx::name(place)).publish_subscribe::<[u8]>().open();
    let event = node.service_builder(&super::iceoryx::name(place)).event().open();
    let (values, event) = (values.expect("it was created"), event.expect("it was created"));
    let subscriber = values.subscriber_builder().create().expect("there is one subscriber");
    let listener = event.listener_builder().create().expect("there is one listener");
    say(0);
    while listener.blocking_wait(|_| {}).is_ok() {
        while let Ok(Some(sample)) = subscriber.receive() {
            tell(sample.payload());
        }
    }
}

/// A publisher of Zenoh alone.
pub struct Zenoh {
    publisher: zenoh::pubsub::Publisher<'static>,
    _session: zenoh::Session,
}

impl Zenoh {
    /// Begins, and waits for the reader of that kind.
    pub fn start(kind: &str, size: usize) -> Pair {
        let place = port().to_string();
        let session = session(Some(("listen", &place)));
        let publisher = session.declare_publisher("value").congestion_control(CongestionControl::Block);
        let publisher = publisher.express(true).wait().expect("the key is right");
        let reader = Reader::start(kind, &place, size);
        let begin = Instant::now();
        while !publisher.matching_status().wait().is_ok_and(|status| status.matching()) {
            assert!(begin.elapsed() < LOST, "the subscriber is found");
            thread::sleep(Duration::from_millis(1));
        }
        thread::sleep(Duration::from_millis(300));
        (Box::new(Self { publisher, _session: session }), reader)
    }
}

impl Sender for Zenoh {
    fn send(&mut self, bytes: &[u8]) {
        assert!(self.publisher.put(bytes.to_vec()).wait().is_ok(), "the session is open");
    }
}

fn read_zenoh(place: &str, (key, header): (&'static str, usize), in_callback: bool) {
    let session = session(Some(("connect", place)));
    let (wake, newest) = (Arc::new(Wake::new()), Arc::new(AtomicU64::new(0)));
    let (woken, written) = (Arc::clone(&wake), Arc::clone(&newest));
    let callback = move |sample: zenoh::sample::Sample| {
        let bytes = sample.payload().to_bytes();
        let bytes = &bytes[header..];
        if in_callback {
            return tell(bytes);
        }
        newest.store(bytes.first_chunk().map_or(0, |first| u64::from_ne_bytes(*first)), Ordering::Release);
        wake.notify(1);
    };
    let _subscriber = session.declare_subscriber(key).callback(callback).wait().expect("the key is right");
    say(0);
    loop {
        woken.wait();
        tell(&written.load(Ordering::Acquire).to_ne_bytes());
    }
}

struct Tcp(TcpStream);

impl Tcp {
    fn start(size: usize) -> Pair {
        let listener = TcpListener::bind("127.0.0.1:0").expect("there is a free port");
        let place = listener.local_addr().expect("it is bound").to_string();
        let reader = Reader::start("tcp", &place, size);
        let (stream, _) = listener.accept().expect("the reader connects");
        stream.set_nodelay(true).expect("it is a TCP stream");
        (Box::new(Self(stream)), reader)
    }
}

impl Sender for Tcp {
    fn send(&mut self, bytes: &[u8]) {
        self.0.write_all(bytes).expect("the reader is there");
    }
}

fn read_tcp(place: &str, size: usize) {
    let mut stream = TcpStream::connect(place).expect("the other process listens");
    let mut bytes = vec![0; size];
    say(0);
    while stream.read_exact(&mut bytes).is_ok() {
        tell(&bytes);
    }
}
