//! A cable between two ends of a connection.
#![allow(clippy::disallowed_methods, reason = "a cable goes by the machine's clock")]

use std::collections::BTreeMap;
use std::io::{ErrorKind, Read, Write};
use std::net::{Shutdown, SocketAddr, TcpListener, TcpStream, UdpSocket};
use std::sync::Arc;
use std::sync::atomic::{AtomicU8, Ordering};
use std::thread;
use std::time::Duration;

const CARRIES: u8 = 0;
/// Takes nothing and closes nothing.
const SWALLOWS: u8 = 1;
const CUT: u8 = 2;

/// From one look to the next.
const LOOK: Duration = Duration::from_millis(5);

/// A cable to a port of this machine.
pub struct Cable {
    /// The port of its other end.
    pub port: u16,
    state: Arc<AtomicU8>,
}

impl Cable {
    /// For TCP.
    pub fn to(target: u16) -> Self {
        let listener = TcpListener::bind(("127.0.0.1", 0)).unwrap();
        let port = listener.local_addr().unwrap().port();
        let state = Arc::new(AtomicU8::new(CARRIES));
        let shared = Arc::clone(&state);
        thread::spawn(move || {
            for near in listener.incoming() {
                let near = near.unwrap();
                let far = TcpStream::connect(("127.0.0.1", target));
                let (Ok(far), CARRIES) = (far, shared.load(Ordering::Relaxed)) else { continue };
                for (from, to) in [(&near, &far), (&far, &near)] {
                    let (from, to) = (from.try_clone().unwrap(), to.try_clone().unwrap());
                    let state = Arc::clone(&shared);
                    thread::spawn(move || carry(from, to, &state));
                }
            }
        });
        Self { port, state }
    }

    /// For UDP, where a cut says nothing to anybody.
    pub fn for_datagrams(target: u16) -> Self {
        let near = Arc::new(UdpSocket::bind(("127.0.0.1", 0)).unwrap());
        let port = near.local_addr().unwrap().port();
        let state = Arc::new(AtomicU8::new(CARRIES));
        let shared = Arc::clone(&state);
        thread::spawn(move || {
            // Each sender has a socket of its own, which receives the answers.
            let mut ways: BTreeMap<SocketAddr, Arc<UdpSocket>> = BTreeMap::new();
            let mut packet = [0; 1 << 16];
            while let Ok((length, from)) = near.recv_from(&mut packet) {
                let way = ways.entry(from).or_insert_with(|| {
                    let far = Arc::new(UdpSocket::bind("127.0.0.1:0").unwrap());
                    far.connect(("127.0.0.1", target)).unwrap();
                    let (back, answers, state) = (Arc::clone(&near), Arc::clone(&far), Arc::clone(&shared));
                    thread::spawn(move || {
                        let mut packet = [0; 1 << 16];
                        // The listener may be absent for a while.
                        while let Ok(length) = answers.recv(&mut packet).or_else(refused) {
                            if state.load(Ordering::Relaxed) == CARRIES {
                                let _ = back.send_to(&packet[..length], from);
                            }
                        }
                    });
                    far
                });
                if shared.load(Ordering::Relaxed) == CARRIES {
                    let _ = way.send(&packet[..length]);
                }
            }
        });
        Self { port, state }
    }

    /// Ends all connections, and takes no others.
    pub fn cut(&self) {
        self.state.store(CUT, Ordering::Relaxed);
    }

    /// Drops everything without notice.
    pub fn swallow(&self) {
        self.state.store(SWALLOWS, Ordering::Relaxed);
    }

    /// Carries again; connections that were cut stay so.
    pub fn mend(&self) {
        self.state.store(CARRIES, Ordering::Relaxed);
    }
}

/// Ignores the error of a socket without a listener.
fn refused(error: std::io::Error) -> std::io::Result<usize> {
    if error.kind() == ErrorKind::ConnectionRefused { Ok(0) } else { Err(error) }
}

fn carry(mut from: TcpStream, mut to: TcpStream, state: &AtomicU8) {
    from.set_read_timeout(Some(LOOK)).unwrap();
    let mut bytes = [0; 16 << 10];
    loop {
        match state.load(Ordering::Relaxed) {
            CARRIES => match from.read(&mut bytes) {
                Ok(0) => break,
                Ok(length) if to.write_all(&bytes[..length]).is_err() => break,
                Ok(_) => {}
                Err(error) if error.kind() == ErrorKind::WouldBlock => {}
                Err(_) => break,
            },
            SWALLOWS => thread::sleep(LOOK),
            _ => break,
        }
    }
    // One of both ends may be closed already.
    let _ = (from.shutdown(Shutdown::Both), to.shutdown(Shutdown::Both));
}
