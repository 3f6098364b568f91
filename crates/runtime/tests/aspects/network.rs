//! The aspect Network, over this machine's own addresses.

use std::collections::BTreeMap;
use std::io::{ErrorKind, Read, Write};
use std::net::{TcpListener, TcpStream, UdpSocket};
use std::sync::Mutex;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::mpsc::sync_channel;
use std::time::Instant;

use slate_module::Plugin;
use slate_module::aspect::{Aspect, Network, SEND_LIMIT, SOCKET_LIMIT};
use slate_module::prelude::*;
use slate_runtime::Agent;

use crate::aspects::{LONG, agent, steps, wait};

#[ports]
pub struct NodeIo {
    network: Aspect<Network>,
}

#[params]
pub struct NodeParams {
    #[param(default = 0, doc = "which node of the tests it is")]
    number: u64,
}

type Work = Box<dyn FnOnce(&Network) -> Outcome + Send>;

/// What the nodes do in their next ticks, by their numbers.
static WORK: Mutex<BTreeMap<u64, Work>> = Mutex::new(BTreeMap::new());

/// Does what a test says.
pub struct Worker;

#[module(stage = Think)]
impl Module for Worker {
    type Io = NodeIo;
    type Params = NodeParams;
    type State = ();

    fn tick(_: &mut (), io: &NodeIo, params: &NodeParams, _: &Tick) -> Outcome {
        let work = WORK.lock().unwrap().remove(&params.number);
        work.map_or(Outcome::Ok, |work| work(&io.network))
    }
}

/// An agent in lockstep that does in its ticks what a test says.
struct Node {
    agent: Agent,
    number: u64,
}

impl Node {
    fn new() -> Self {
        static NODES: AtomicU64 = AtomicU64::new(1);
        let number = NODES.fetch_add(1, Ordering::Relaxed);
        let text = format!("[modules.worker]\nparams.number = {number}\n");
        Self { agent: agent(&text, &[Plugin::linked::<Worker>()]), number }
    }

    fn with<R: Send + 'static>(
        &mut self,
        outcome: Outcome,
        work: impl FnOnce(&Network) -> R + Send + 'static,
    ) -> R {
        let (result, receiver) = sync_channel(1);
        let work = move |network: &Network| {
            result.send(work(network)).unwrap();
            outcome
        };
        WORK.lock().unwrap().insert(self.number, Box::new(work));
        steps(&mut self.agent, 1);
        receiver.recv().unwrap()
    }

    /// A tick with that work.
    fn tick<R: Send + 'static>(&mut self, work: impl FnOnce(&Network) -> R + Send + 'static) -> R {
        self.with(Outcome::Ok, work)
    }

    /// A tick that fails after it.
    fn failing<R: Send + 'static>(&mut self, work: impl FnOnce(&Network) -> R + Send + 'static) -> R {
        self.with(Outcome::Failed, work)
    }

    /// Opens a socket for datagrams and returns its address.
    fn udp(&mut self, address: &str) -> String {
        let address = address.to_owned();
        self.tick(move |network| network.udp(&address).unwrap().address().unwrap().as_str().to_owned())
    }

    /// Waits until it is connected.
    fn connect(&mut self, address: &str) {
        wait("a connection", || {
            let address = address.to_owned();
            self.tick(move |network| network.connect(&address).unwrap().is_some())
        });
    }

    /// Listens, and returns the address.
    fn listen(&mut self) -> String {
        self.tick(|network| network.listen(ANY).unwrap().address().unwrap().as_str().to_owned())
    }

    /// Waits for the connections that others make.
    fn accept(&mut self, count: usize) {
        wait("who connects", || {
            self.tick(|network| network.listen(ANY).unwrap().connections().count()) == count
        });
    }

    /// Receives from the first connection that another one made; why it has ended as an error.
    fn receive(&mut self, room: usize) -> Result<Vec<u8>, String> {
        self.tick(move |network| {
            let connection = network.listen(ANY).unwrap().connections().next().ok_or("no connection")?;
            let mut buffer = vec![0; room];
            let length = connection.receive(&mut buffer).map_err(|reason| reason.0)?;
            buffer.truncate(length);
            Ok(buffer)
        })
    }
}

const ANY: &str = "127.0.0.1:0";

fn peer() -> (UdpSocket, String) {
    let peer = UdpSocket::bind(ANY).unwrap();
    peer.set_read_timeout(Some(LONG)).unwrap();
    let address = peer.local_addr().unwrap().to_string();
    (peer, address)
}

fn listener() -> (TcpListener, String) {
    let listener = TcpListener::bind(ANY).unwrap();
    let address = listener.local_addr().unwrap().to_string();
    (listener, address)
}

#[test]
fn datagrams_go_and_come() {
    let (mut a, mut b) = (Node::new(), Node::new());
    let (to, from) = (a.udp(ANY), b.udp(ANY));
    let target = to.clone();
    b.tick(move |network| network.udp(ANY).unwrap().send(&target, b"hello").unwrap());
    wait("the datagram", || {
        let from = from.clone();
        a.tick(move |network| {
            let mut buffer = [0; 16];
            let socket = network.udp(ANY).unwrap();
            let Some((length, sender)) = socket.receive(&mut buffer).unwrap() else { return false };
            assert_eq!((&buffer[..length], sender.as_str()), (&b"hello"[..], from.as_str()));
            assert!(socket.receive(&mut buffer).unwrap().is_none());
            true
        })
    });
}

#[test]
fn messages_are_sent_after_successful_tick() {
    let (peer, to) = peer();
    let mut node = Node::new();
    for (outcome, text) in [(Outcome::Failed, "lost"), (Outcome::Ok, "sent")] {
        let to = to.clone();
        node.with(outcome, move |network| network.udp(ANY).unwrap().send(&to, text.as_bytes()).unwrap());
    }
    let mut buffer = [0; 16];
    let (length, _) = peer.recv_from(&mut buffer).unwrap();
    assert_eq!(&buffer[..length], b"sent");
}

#[test]
fn a_datagram_that_is_longer_than_the_buffer_is_cut() {
    let (peer, _) = peer();
    let mut node = Node::new();
    peer.send_to(b"0123456789", node.udp(ANY)).unwrap();
    wait("the datagram", || {
        node.tick(|network| {
            let mut buffer = [0; 4];
            let received = network.udp(ANY).unwrap().receive(&mut buffer).unwrap();
            received.is_some_and(|(length, _)| {
                assert_eq!(&buffer[..length], b"0123");
                true
            })
        })
    });
}

#[test]
fn oversized_or_invalid_address_is_refused_in_words() {
    let (_peer, to) = peer();
    let mut node = Node::new();
    let texts = node.tick(move |network| {
        let socket = network.udp(ANY).unwrap();
        let mut texts = Vec::new();
        let mut note = |result: Result<(), Refusal>| texts.push(result.unwrap_err().0);
        note(socket.send(&to, &vec![0; 70_000]));
        for _ in 0..SEND_LIMIT / 65_507 {
            socket.send(&to, &[0; 65_507]).unwrap();
        }
        note(socket.send(&to, &[0; 65_507]));
        note(socket.send("nonsense", b""));
        note(socket.send("localhost:80", b""));
        note(network.udp("1.2.3.4.5:6").map(drop));
        note(network.listen("").map(drop));
        note(network.udp("192.0.2.1:9").map(drop));
        texts
    });
    let parts = [
        "a datagram carries at most 65507 bytes, not 70000",
        "more than 262144 bytes in one tick",
        "`nonsense` is not an address: expected a number and a port",
        "`localhost:80` is not an address",
        "`1.2.3.4.5:6` is not an address",
        "`` is not an address",
        "udp 192.0.2.1:9 can't be opened: ",
    ];
    assert_eq!(texts.len(), parts.len());
    for (text, part) in texts.iter().zip(parts) {
        assert!(text.contains(part), "{part}: {text}");
    }
}

#[test]
fn an_address_that_is_taken_is_refused() {
    let (_udp, udp) = peer();
    let (_tcp, tcp) = listener();
    let mut node = Node::new();
    let (udp, tcp) = node.tick(move |network| {
        (network.udp(&udp).map(drop).unwrap_err().0, network.listen(&tcp).map(drop).unwrap_err().0)
    });
    assert!(udp.contains("can't be opened"), "{udp}");
    assert!(tcp.contains("can't be listened at"), "{tcp}");
}

#[test]
fn a_module_has_no_more_sockets_than_it_may() {
    let mut node = Node::new();
    let reason = node.tick(|network| {
        for i in 0..SOCKET_LIMIT {
            network.udp(&format!("127.0.{i}.1:0")).unwrap();
        }
        network.udp("127.0.0.1:0").unwrap();
        network.udp("127.0.200.1:0").map(drop).unwrap_err().0
    });
    assert!(reason.contains("64 sockets already"), "{reason}");
    // One that is closed makes room, when the tick has ended well.
    node.failing(|network| network.udp(ANY).unwrap().close());
    assert!(node.tick(|network| network.udp("127.0.200.1:0").is_err()));
    node.tick(|network| network.udp(ANY).unwrap().close());
    assert!(node.tick(|network| network.udp("127.0.200.1:0").is_ok()));
}

#[test]
fn a_connection_is_made_beside_the_ticks_and_carries_both_ways() {
    let (listener, address) = listener();
    let mut node = Node::new();
    let named = address.replace("127.0.0.1", "localhost");
    node.connect(&named);
    let (mut peer, _) = listener.accept().unwrap();
    let name = named.clone();
    node.tick(move |network| {
        let connection = network.connect(&name).unwrap().unwrap();
        assert_eq!(connection.address().unwrap().as_str(), address);
        connection.send(b"ping").unwrap();
    });
    let mut buffer = [0; 4];
    peer.read_exact(&mut buffer).unwrap();
    assert_eq!(&buffer, b"ping");
    peer.write_all(b"pong").unwrap();
    wait("the answer", || {
        let name = named.clone();
        node.tick(move |network| {
            let mut buffer = [0; 16];
            let length = network.connect(&name).unwrap().unwrap().receive(&mut buffer).unwrap();
            assert!(length == 0 || &buffer[..length] == b"pong");
            length > 0
        })
    });
}

#[test]
fn no_tick_waits_for_an_address_that_does_not_answer() {
    let mut node = Node::new();
    let start = Instant::now();
    for _ in 0..10 {
        // An unassigned address (RFC 5737).
        node.tick(|network| {
            let _ = network.connect("192.0.2.1:9");
        });
    }
    assert!(start.elapsed().as_secs() < 3);
}

#[test]
fn a_failed_connection_is_retried_after_a_second_of_agent_time() {
    let (listener, address) = listener();
    drop(listener);
    let mut node = Node::new();
    let connect = |node: &mut Node| {
        let address = address.clone();
        node.tick(move |network| network.connect(&address).map(|found| found.is_some()).map_err(|r| r.0))
    };
    let mut reason = String::new();
    wait("the refusal", || connect(&mut node).map_err(|refusal| reason = refusal).is_err());
    assert!(reason.contains(&address) && reason.contains("can't be connected to"), "{reason}");
    assert_eq!(connect(&mut node), Err(reason.clone()), "the same again");
    // 49 cycles of 20 ms later it is not a second yet.
    let listener = TcpListener::bind(&address).unwrap();
    steps(&mut node.agent, 40);
    assert_eq!(connect(&mut node), Err(reason));
    steps(&mut node.agent, 10);
    assert_eq!(connect(&mut node), Ok(false), "in the making");
    node.connect(&address);
    drop(listener);
}

#[test]
fn end_of_connection_is_reported_after_all_data() {
    let (listener, address) = listener();
    let mut node = Node::new();
    node.connect(&address);
    let (mut peer, _) = listener.accept().unwrap();
    peer.write_all(b"bye").unwrap();
    drop(peer);
    let mut seen = Vec::new();
    let reason = loop {
        let name = address.clone();
        let got = node.tick(move |network| {
            let mut buffer = [0; 2];
            let connection = network.connect(&name).unwrap().unwrap();
            let length = connection.receive(&mut buffer).map_err(|reason| reason.0)?;
            Ok(buffer[..length].to_vec())
        });
        match got {
            Ok(bytes) => seen.extend(bytes),
            Err(reason) => break reason,
        }
    };
    assert_eq!(seen, b"bye");
    let reason: String = reason;
    assert!(reason.contains(&address) && reason.contains("closed by the other end"), "{reason}");
    let again = node.tick(move |network| network.connect(&address).map(drop).map_err(|reason| reason.0));
    assert_eq!(again, Err(reason), "until the connection is retried");
}

#[test]
fn listener_serves_connections() {
    let mut node = Node::new();
    let address = node.listen();
    let mut first = TcpStream::connect(&address).unwrap();
    node.accept(1);
    let second = TcpStream::connect(&address).unwrap();
    node.accept(2);
    let others = node.tick(|network| {
        let connections = network.listen(ANY).unwrap().connections();
        connections.map(|connection| connection.address().unwrap().as_str().to_owned()).collect::<Vec<_>>()
    });
    let expected = [first.local_addr().unwrap().to_string(), second.local_addr().unwrap().to_string()];
    assert_eq!(others, expected, "oldest first");
    first.write_all(b"question").unwrap();
    let mut got = Vec::new();
    wait("the question", || {
        got.extend(node.receive(16).unwrap());
        got == b"question"
    });
    node.tick(|network| network.listen(ANY).unwrap().connections().next().unwrap().send(b"answer").unwrap());
    let mut buffer = [0; 6];
    first.read_exact(&mut buffer).unwrap();
    assert_eq!(&buffer, b"answer");
    drop(first);
    let mut reason = String::new();
    wait("the end", || node.receive(16).map_err(|refusal| reason = refusal).is_err());
    assert!(reason.contains("closed by the other end"), "{reason}");
    node.accept(1);
}

#[test]
fn send_queue_is_bounded_and_ordered() {
    let mut node = Node::new();
    let address = node.listen();
    let mut peer = TcpStream::connect(&address).unwrap();
    node.accept(1);
    let mut sent = 0_usize;
    let reason = loop {
        let first = sent;
        let result = node.tick(move |network| {
            let data: Vec<u8> = (first..first + 50_000).map(|i| (i % 251) as u8).collect();
            let connection = network.listen(ANY).unwrap().connections().next().unwrap();
            connection.send(&data).map_err(|reason| reason.0)
        });
        match result {
            Ok(()) => sent += 50_000,
            Err(reason) => break reason,
        }
        assert!(sent < 100_000_000, "somebody takes it all");
    };
    assert!(reason.contains("and at most 262144 may"), "{reason}");
    peer.set_nonblocking(true).unwrap();
    let (mut got, mut buffer) = (0, vec![0; 65_536]);
    wait("all of it", || {
        // What waits goes out with the next ticks.
        steps(&mut node.agent, 1);
        match peer.read(&mut buffer) {
            Ok(length) => {
                assert!(
                    buffer[..length].iter().enumerate().all(|(i, byte)| *byte == ((got + i) % 251) as u8)
                );
                got += length;
            }
            Err(error) => assert_eq!(error.kind(), ErrorKind::WouldBlock),
        }
        got >= sent
    });
    assert_eq!(got, sent, "and nothing of what was refused");
}

#[test]
fn a_tick_that_fails_takes_its_bytes_back_and_no_others() {
    let mut node = Node::new();
    let address = node.listen();
    let mut peer = TcpStream::connect(&address).unwrap();
    node.accept(1);
    let send = |text: &'static str| {
        move |network: &Network| {
            let connection = network.listen(ANY).unwrap().connections().next().unwrap();
            connection.send(text.as_bytes()).unwrap();
            connection.close();
        }
    };
    node.tick(|network| network.listen(ANY).unwrap().connections().next().unwrap().send(b"one ").unwrap());
    node.failing(send("two "));
    node.tick(send("three"));
    let mut text = String::new();
    peer.read_to_string(&mut text).unwrap();
    assert_eq!(text, "one three", "and then it was closed");
    node.accept(0);
}

#[test]
fn sockets_are_closed_with_the_module() {
    let mut node = Node::new();
    let (udp, tcp) = (node.udp(ANY), node.listen());
    let mut peer = TcpStream::connect(&tcp).unwrap();
    node.accept(1);
    assert!(UdpSocket::bind(&udp).is_err());
    node.agent.composer().unload("worker").unwrap();
    let mut text = String::new();
    assert_eq!(peer.read_to_string(&mut text).unwrap(), 0);
    UdpSocket::bind(&udp).unwrap();
    assert!(TcpStream::connect(&tcp).is_err());
}

#[test]
fn messages_are_part_of_the_digest() {
    let (_peer, to) = peer();
    let run = |text: &'static str| {
        let mut node = Node::new();
        let to = to.clone();
        node.tick(move |network| network.udp(ANY).unwrap().send(&to, text.as_bytes()).unwrap());
        node.agent.digest().unwrap()
    };
    assert_eq!(run("one"), run("one"));
    assert_ne!(run("one"), run("two"));
}

/// Other ends that write, read and leave as they like.
mod unruly {
    use proptest::prelude::*;

    use super::*;

    #[derive(Clone, Debug)]
    enum Deed {
        Connect,
        Write(usize, Vec<u8>),
        Leave(usize),
        Tick,
    }

    fn deed() -> impl Strategy<Value = Deed> {
        prop_oneof![
            Just(Deed::Connect),
            (0..4_usize, proptest::collection::vec(any::<u8>(), 0..64))
                .prop_map(|(i, data)| Deed::Write(i, data)),
            (0..4_usize).prop_map(Deed::Leave),
            Just(Deed::Tick),
        ]
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(24))]
        #[test]
        fn every_byte_is_echoed_once_to_its_sender(deeds in proptest::collection::vec(deed(), 1..24)) {
            let mut node = Node::new();
            let address = node.listen();
            let mut peers: Vec<(TcpStream, Vec<u8>)> = Vec::new();
            let echo = |node: &mut Node| node.tick(|network| {
                for connection in network.listen(ANY).unwrap().connections() {
                    let mut buffer = [0; 48];
                    if let Ok(length) = connection.receive(&mut buffer) {
                        let _ = connection.send(&buffer[..length]);
                    }
                }
            });
            for deed in deeds {
                match deed {
                    Deed::Connect if peers.len() < 4 => {
                        peers.push((TcpStream::connect(&address).unwrap(), Vec::new()));
                    }
                    Deed::Write(i, data) => if let Some((peer, sent)) = peers.get_mut(i) {
                        peer.write_all(&data).unwrap();
                        sent.extend(data);
                    },
                    Deed::Leave(i) if i < peers.len() => drop(peers.remove(i)),
                    _ => echo(&mut node),
                }
            }
            for (peer, sent) in &mut peers {
                peer.set_nonblocking(true).unwrap();
                let mut got = Vec::new();
                wait("the echo", || {
                    echo(&mut node);
                    let mut buffer = [0; 4096];
                    if let Ok(length) = peer.read(&mut buffer) {
                        got.extend_from_slice(&buffer[..length]);
                    }
                    got.len() >= sent.len()
                });
                prop_assert_eq!(&got, sent);
            }
        }
    }
}
