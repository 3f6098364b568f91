//! A cable between two ends of a link over TCP.

use std::io::{Read, Write};
use std::net::{Shutdown, TcpListener, TcpStream};
use std::sync::Arc;
use std::sync::atomic::{AtomicU8, Ordering};
use std::thread;
use std::time::Duration;

use super::net::port;

pub const CARRIES: u8 = 0;
/// Takes nothing and closes nothing.
pub const SWALLOWS: u8 = 1;
pub const CUT: u8 = 2;

/// A cable to a port of this machine.
pub struct Cable {
    endpoint: String,
    state: Arc<AtomicU8>,
}

impl Cable {
    pub fn to(endpoint: &str) -> Self {
        let (host, target) = endpoint.rsplit_once(':').unwrap();
        let target: u16 = target.parse().unwrap();
        let (port, state) = (port(), Arc::new(AtomicU8::new(CARRIES)));
        let listener = TcpListener::bind(("127.0.0.1", port)).unwrap();
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
        Self { endpoint: format!("{host}:{port}"), state }
    }

    /// The endpoint of its other end.
    pub fn endpoint(&self) -> &str {
        &self.endpoint
    }

    pub fn set(&self, state: u8) {
        self.state.store(state, Ordering::Relaxed);
    }
}

fn carry(mut from: TcpStream, mut to: TcpStream, state: &AtomicU8) {
    from.set_read_timeout(Some(Duration::from_millis(5))).unwrap();
    let mut bytes = [0; 16 << 10];
    loop {
        match state.load(Ordering::Relaxed) {
            CARRIES => match from.read(&mut bytes) {
                Ok(0) => break,
                Ok(length) if to.write_all(&bytes[..length]).is_err() => break,
                Ok(_) => {}
                Err(error) if error.kind() == std::io::ErrorKind::WouldBlock => {}
                Err(_) => break,
            },
            SWALLOWS => thread::sleep(Duration::from_millis(5)),
            _ => break,
        }
    }
    // One of both ends may be closed already.
    let _ = (from.shutdown(Shutdown::Both), to.shutdown(Shutdown::Both));
}
