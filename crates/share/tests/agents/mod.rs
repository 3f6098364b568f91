//! Agents of several tests.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic, reason = "a test that fails panics")]
#![allow(dead_code, reason = "each test uses a part of it")]
#![allow(clippy::disallowed_methods, reason = "real agents go by the machine's clock")]

#[cfg(feature = "tls")]
pub mod cable;
#[cfg(feature = "tls")]
pub mod net;
pub mod process;
pub mod scout;

use std::path::PathBuf;
use std::sync::Arc;
use std::sync::OnceLock;
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::{Duration, Instant};

use slate_blackboard::channel::{Budget, Writer};
use slate_blackboard::interface::{Descriptor, Interface, Value, View};
use slate_blackboard::{Access, Board, Property, Store};
use slate_module::interface;
use slate_share::peers::{Clock, Peers, Setup};
use slate_share::session::{Identity, Limits};

/// A number.
#[interface]
#[derive(PartialEq)]
pub struct Number {
    /// The number.
    pub value: u64,
}

/// Many bytes.
#[interface]
pub struct Blob {
    /// What was written.
    pub number: u64,
    /// The bytes.
    pub data: [u8],
}

pub fn clock() -> Clock {
    static START: OnceLock<Instant> = OnceLock::new();
    let start = *START.get_or_init(Instant::now);
    Arc::new(move || start.elapsed().as_nanos() as u64)
}

/// A number that no other agent of this run has.
pub fn instance() -> u64 {
    static NEXT: AtomicU64 = AtomicU64::new(1);
    u64::from(std::process::id()) << 20 | NEXT.fetch_add(1, Ordering::Relaxed)
}

/// Where the agents of one test find each other: a folder of sockets, which is removed at its end, or ports.
pub struct Folder {
    path: PathBuf,
    #[cfg(feature = "tls")]
    net: Option<net::Net>,
}

impl Folder {
    pub fn new() -> Self {
        let folder = std::env::temp_dir().join(format!("slate-share-{:x}", instance()));
        std::fs::create_dir_all(&folder).unwrap();
        Self {
            path: folder,
            #[cfg(feature = "tls")]
            net: None,
        }
    }

    /// They are found at ports, over TLS.
    #[cfg(feature = "tls")]
    pub fn over_tls() -> Self {
        let mut folder = Self::new();
        folder.net = Some(net::Net::new(&folder.path));
        folder
    }

    pub fn path(&self, name: &str) -> PathBuf {
        self.path.join(name)
    }

    pub fn endpoint(&self, name: &str) -> String {
        #[cfg(feature = "tls")]
        if let Some(net) = &self.net {
            return net.endpoint(name);
        }
        format!("local:{}", self.path(name).display())
    }

    /// The files of a certificate of that agent, its key and its authority, if it needs some.
    pub fn files(&self, name: &str) -> Vec<PathBuf> {
        #[cfg(feature = "tls")]
        if let Some((own, authority)) = self.net.as_ref().map(|net| net.files(name)) {
            return vec![own.certificate, own.key, authority];
        }
        let _ = name;
        Vec::new()
    }

    /// An agent that can be found and find others.
    pub fn setup(&self, name: &str) -> Setup {
        #[cfg(feature = "tls")]
        if let Some(net) = &self.net {
            return Setup { carriers: net.carriers(name), ..setup(name) };
        }
        setup(name)
    }
}

impl Drop for Folder {
    fn drop(&mut self) {
        let _ = std::fs::remove_dir_all(&self.path);
    }
}

/// An agent with a board.
pub struct Agent {
    pub board: Arc<Board>,
    pub peers: Peers,
}

/// A machine with many tests at work may let a thread wait for long.
pub fn limits() -> Limits {
    Limits { silence: 2_000_000_000, ..Limits::default() }
}

pub fn setup(name: &str) -> Setup {
    let identity = Identity { agent: name.into(), instance: instance() };
    Setup { limits: limits(), ..Setup::new(identity, clock()) }
}

impl Agent {
    pub fn start(setup: Setup) -> Self {
        let board = Arc::new(Board::new(&setup.identity.agent));
        let peers = Peers::start(&board, setup).unwrap();
        Self { board, peers }
    }

    pub fn listening(name: &str, folder: &Folder) -> Self {
        Self::start(folder.setup(name).listen(&folder.endpoint(name)))
    }

    pub fn newest(&self, path: &str) -> Option<(Vec<u8>, usize)> {
        let (property, _) = self.board.get(path)?;
        property.newest().unwrap().map(|(bytes, items, _)| (bytes, items))
    }

    pub fn number(&self, path: &str) -> Option<u64> {
        self.newest(path).map(|(bytes, _)| u64::from_ne_bytes(bytes[..8].try_into().unwrap()))
    }
}

pub fn add(
    board: &Board,
    path: &str,
    descriptor: &'static Descriptor,
    capacity: usize,
    depth: usize,
) -> Arc<Property> {
    let store = Store { capacity, depth, budget: Budget { latest: 16, queues: 16, window: 64 } };
    board.add_channel(path, "For a test.", descriptor, store, Access::Output).unwrap()
}

pub fn output(board: &Board, path: &str, depth: usize) -> Writer {
    add(board, path, Number::DESCRIPTOR, 0, depth).channel().unwrap().writer().unwrap()
}

pub fn write(writer: &mut Writer, value: u64) {
    let mut number = Number { value };
    writer.write(View::of(&mut number).bytes(), 0, clock()()).unwrap();
}

/// Number of rejections for that reason.
pub fn rejected(agent: &Agent, why: &str) -> i128 {
    let field = |number: u32, name: &str| {
        let path = format!("share/rejected/{number}/{name}");
        agent.board.read(&path).ok().flatten().map(|(value, _)| value)
    };
    let is_so =
        |number: &u32| matches!(field(*number, "reason"), Some(Value::Text(text)) if text.contains(why));
    let number = (1..=8).find(is_so);
    number.and_then(|number| field(number, "count")?.as_integer()).unwrap_or(0)
}

/// Waits until something is so, and says what it was if it is not within a time that no machine needs.
pub fn wait_for(what: &str, mut is_so: impl FnMut() -> bool) {
    let start = Instant::now();
    while !is_so() {
        assert!(start.elapsed() < Duration::from_secs(20), "{what}: not within 20 s");
        std::thread::sleep(Duration::from_millis(1));
    }
}
