//! Aspect [`Network`]: sockets of a module, which never block.

mod calls;
mod connection;
mod datagrams;

use std::io;
use std::net::{SocketAddr, TcpListener};
use std::sync::Arc;

use slate_module::aspect::{Network, SOCKET_LIMIT};
use slate_sorted::SortedMap;

use super::{HostService, ServiceContext, in_place};
use connection::{Attempt, ModuleConnection};
use datagrams::DatagramSocket;
use slate_engine::digest::Digest;

/// Time after which a failed connection is tried again, ns.
/// In the agent's time.
const RETRY: u64 = 1_000_000_000;

struct NetworkService {
    table: Network,
    /// Sockets by number, in the order in which they were opened.
    sockets: SortedMap<u64, ModuleSocket>,
    /// Sockets that the module has named.
    named: SortedMap<(ModuleSocketKind, String), NamedSocket>,
    opened: u64,
    now: u64,
    /// Index of the sent data, for the digest.
    index: u32,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
enum ModuleSocketKind {
    Datagrams,
    Connection,
    Listener,
}

enum NamedSocket {
    Open(u64),
    Making(Attempt),
    Failed { reason: String, at: u64 },
}

enum ModuleSocket {
    Datagrams(DatagramSocket, IsClosing),
    Connection(Box<ModuleConnection>),
    Listener { listener: TcpListener, connections: Vec<u64>, closing: IsClosing },
}

/// True if the present tick closes a socket.
type IsClosing = bool;

/// Result of an attempt to receive.
enum ReceivedBytes {
    Nothing,
    Bytes(usize, Option<SocketAddr>),
    Refused(String),
}

// SAFETY: the table's context is the service itself, which only the thread that runs the module uses.
unsafe impl Send for NetworkService {}

pub(super) fn make(_: &ServiceContext, module: &Arc<str>) -> Box<dyn HostService> {
    in_place(|context| NetworkService {
        // SAFETY: the context is the service, in which the table stays.
        table: unsafe { calls::table(context) },
        sockets: SortedMap::new(),
        named: SortedMap::new(),
        opened: 0,
        now: 0,
        index: super::hash(&format!("{module} network")),
    })
}

impl HostService for NetworkService {
    fn table(&self) -> *const u8 {
        (&raw const self.table).cast()
    }

    fn prepare(&mut self, now: u64) {
        self.now = now;
        let mut over = Vec::new();
        for (number, socket) in &self.sockets {
            if let ModuleSocket::Connection(connection) = socket
                && let Some(reason) = connection.over()
            {
                over.push((*number, reason.to_owned()));
            }
        }
        for (number, reason) in over {
            self.forget(number, Some(reason));
        }
        self.accept();
    }

    fn commit(&mut self, _: u64, mut digest: Option<&mut Digest>) {
        let mut closed = Vec::new();
        for (number, socket) in &mut self.sockets {
            let stays = match socket {
                ModuleSocket::Datagrams(datagrams, closing) => {
                    datagrams.commit(self.index, digest.as_deref_mut());
                    !*closing
                }
                ModuleSocket::Connection(connection) => connection.commit(self.index, digest.as_deref_mut()),
                ModuleSocket::Listener { connections, closing, .. } => {
                    if *closing {
                        closed.extend(connections.iter().copied());
                    }
                    !*closing
                }
            };
            if !stays {
                closed.push(*number);
            }
        }
        closed.into_iter().for_each(|number| self.forget(number, None));
    }

    fn abandon(&mut self) {
        for socket in self.sockets.values_mut() {
            match socket {
                ModuleSocket::Datagrams(datagrams, closing) => {
                    datagrams.abandon();
                    *closing = false;
                }
                ModuleSocket::Connection(connection) => connection.abandon(),
                ModuleSocket::Listener { closing, .. } => *closing = false,
            }
        }
    }
}

impl NetworkService {
    /// Accepts the connections made by others.
    fn accept(&mut self) {
        let mut room = SOCKET_LIMIT.saturating_sub(self.count());
        let mut came = Vec::new();
        for socket in self.sockets.values_mut() {
            let ModuleSocket::Listener { listener, connections, .. } = socket else { continue };
            while room > 0
                && let Ok((stream, _)) = listener.accept()
            {
                // One that has ended meanwhile is as if it had not come.
                let Ok(connection) = ModuleConnection::new(stream) else { continue };
                self.opened += 1;
                room -= 1;
                connections.push(self.opened);
                came.push((self.opened, ModuleSocket::Connection(Box::new(connection))));
            }
        }
        self.sockets.extend(came);
    }

    /// Returns the number of sockets, including those being made.
    fn count(&self) -> usize {
        self.sockets.len()
            + self.named.values().filter(|named| matches!(named, NamedSocket::Making(_))).count()
    }

    /// Closes a socket; `reason` is given if it has ended by itself.
    fn forget(&mut self, number: u64, reason: Option<String>) {
        self.sockets.remove(&number);
        for socket in self.sockets.values_mut() {
            if let ModuleSocket::Listener { connections, .. } = socket {
                connections.retain(|other| *other != number);
            }
        }
        let key =
            self.named.iter().find(|(_, named)| matches!(named, NamedSocket::Open(open) if *open == number));
        let Some(key) = key.map(|(key, _)| key.clone()) else { return };
        match reason {
            Some(reason) => drop(self.named.insert(key, NamedSocket::Failed { reason, at: self.now })),
            None => drop(self.named.remove(&key)),
        }
    }

    fn room(&self) -> Result<(), String> {
        if self.count() < SOCKET_LIMIT {
            return Ok(());
        }
        Err(format!("the module has {SOCKET_LIMIT} sockets already: close some"))
    }

    fn add(&mut self, socket: ModuleSocket) -> u64 {
        self.opened += 1;
        self.sockets.insert(self.opened, socket);
        self.opened
    }

    /// Returns the socket of an address, opened if needed.
    fn open(&mut self, kind: ModuleSocketKind, text: &str) -> Result<Option<u64>, String> {
        let key = (kind, text.to_owned());
        match self.named.get(&key) {
            Some(NamedSocket::Open(number)) => return Ok(Some(*number)),
            Some(NamedSocket::Making(attempt)) => {
                let Some(result) = attempt.result() else { return Ok(None) };
                return match result.and_then(ModuleConnection::new) {
                    Ok(connection) => {
                        let number = self.add(ModuleSocket::Connection(Box::new(connection)));
                        self.named.insert(key, NamedSocket::Open(number));
                        Ok(Some(number))
                    }
                    Err(error) => {
                        let reason = format!("{text} can't be connected to: {error}");
                        self.named.insert(key, NamedSocket::Failed { reason: reason.clone(), at: self.now });
                        Err(reason)
                    }
                };
            }
            Some(NamedSocket::Failed { reason, at }) if self.now.saturating_sub(*at) < RETRY => {
                return Err(reason.clone());
            }
            _ => self.room()?,
        }
        let socket = match kind {
            ModuleSocketKind::Datagrams => ModuleSocket::Datagrams(DatagramSocket::bind(text)?, false),
            ModuleSocketKind::Listener => {
                let listener = TcpListener::bind(address(text)?)
                    .and_then(|listener| listener.set_nonblocking(true).map(|()| listener));
                let listener =
                    listener.map_err(|error| format!("tcp {text} can't be listened at: {error}"))?;
                ModuleSocket::Listener { listener, connections: Vec::new(), closing: false }
            }
            ModuleSocketKind::Connection => {
                self.named.insert(key, NamedSocket::Making(Attempt::new(text)?));
                return Ok(None);
            }
        };
        let number = self.add(socket);
        self.named.insert(key, NamedSocket::Open(number));
        Ok(Some(number))
    }

    fn socket(&mut self, number: u64) -> Result<&mut ModuleSocket, String> {
        self.sockets.get_mut(&number).ok_or_else(|| "the socket is closed".into())
    }

    fn accepted(&self, number: u64, place: usize) -> Option<u64> {
        match self.sockets.get(&number)? {
            ModuleSocket::Listener { connections, .. } => connections.get(place).copied(),
            _ => None,
        }
    }

    fn send(&mut self, number: u64, to: &str, data: &[u8]) -> Result<(), String> {
        match self.socket(number)? {
            ModuleSocket::Datagrams(datagrams, _) => datagrams.send(to, data),
            ModuleSocket::Connection(connection) => connection.send(data),
            ModuleSocket::Listener { .. } => Err("a listener sends nothing".into()),
        }
    }

    fn receive(&mut self, number: u64, room: &mut [u8]) -> ReceivedBytes {
        match self.socket(number) {
            Ok(ModuleSocket::Datagrams(datagrams, _)) => datagrams.receive(room),
            Ok(ModuleSocket::Connection(connection)) => connection.receive(room),
            Ok(ModuleSocket::Listener { .. }) => ReceivedBytes::Refused("a listener receives nothing".into()),
            Err(reason) => ReceivedBytes::Refused(reason),
        }
    }

    fn address(&mut self, number: u64, other: bool) -> Result<SocketAddr, String> {
        match (self.socket(number)?, other) {
            (ModuleSocket::Datagrams(datagrams, _), false) => {
                datagrams.address().map_err(|error| error.to_string())
            }
            (ModuleSocket::Listener { listener, .. }, false) => {
                listener.local_addr().map_err(|error| error.to_string())
            }
            (ModuleSocket::Connection(connection), true) => Ok(connection.other()),
            _ => Err("such a socket has no such address".into()),
        }
    }

    fn close(&mut self, number: u64) {
        match self.sockets.get_mut(&number) {
            Some(ModuleSocket::Datagrams(_, closing) | ModuleSocket::Listener { closing, .. }) => {
                *closing = true
            }
            Some(ModuleSocket::Connection(connection)) => connection.close(),
            None => {}
        }
    }
}

/// Parses an address without a name, as a name lookup would wait.
fn address(text: &str) -> Result<SocketAddr, String> {
    let help = "expected a number and a port, such as 192.168.0.7:9000 or [::1]:9000";
    text.parse().map_err(|_| format!("`{text}` is not an address: {help}"))
}

/// Returns true if an error only means that no data are available now.
fn is_for_later(error: &io::Error) -> bool {
    matches!(error.kind(), io::ErrorKind::WouldBlock | io::ErrorKind::Interrupted)
}
