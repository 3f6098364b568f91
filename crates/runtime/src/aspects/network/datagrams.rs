use std::io;
use std::net::{SocketAddr, UdpSocket};

use slate_module::aspect::SEND_LIMIT;

use super::{ReceivedBytes, address, is_for_later};
use slate_engine::digest::Digest;

/// Largest payload of a datagram, bytes.
const LONGEST: usize = 65_507;

/// Datagram socket with the datagrams that this tick sends.
pub(super) struct DatagramSocket {
    socket: UdpSocket,
    data: Vec<u8>,
    /// Destination of each datagram, and its end in `data`.
    outgoing: Vec<(SocketAddr, usize)>,
    /// Error of the last send.
    error: Option<io::Error>,
}

impl DatagramSocket {
    pub fn bind(text: &str) -> Result<Self, String> {
        let socket = UdpSocket::bind(address(text)?).and_then(|socket| {
            socket.set_nonblocking(true)?;
            socket.set_broadcast(true)?;
            Ok(socket)
        });
        let socket = socket.map_err(|error| format!("udp {text} can't be opened: {error}"))?;
        Ok(Self { socket, data: Vec::new(), outgoing: Vec::new(), error: None })
    }

    pub fn address(&self) -> io::Result<SocketAddr> {
        self.socket.local_addr()
    }

    pub fn send(&mut self, to: &str, data: &[u8]) -> Result<(), String> {
        let to = address(to)?;
        if data.len() > LONGEST {
            return Err(format!("a datagram carries at most {LONGEST} bytes, not {}", data.len()));
        }
        if self.data.len() + data.len() > SEND_LIMIT {
            return Err(format!("more than {SEND_LIMIT} bytes in one tick are not sent to {to}"));
        }
        self.data.extend_from_slice(data);
        self.outgoing.push((to, self.data.len()));
        Ok(())
    }

    pub fn receive(&mut self, room: &mut [u8]) -> ReceivedBytes {
        if let Some(error) = self.error.take() {
            return ReceivedBytes::Refused(error.to_string());
        }
        match self.socket.recv_from(room) {
            Ok((length, from)) => ReceivedBytes::Bytes(length, Some(from)),
            Err(error) if is_for_later(&error) => ReceivedBytes::Nothing,
            Err(error) => ReceivedBytes::Refused(error.to_string()),
        }
    }

    /// Sends the datagrams of the tick.
    pub fn commit(&mut self, index: u32, mut digest: Option<&mut Digest>) {
        let mut start = 0;
        for (to, end) in &self.outgoing {
            let datagram = &self.data[start..*end];
            start = *end;
            if let Some(digest) = digest.as_deref_mut() {
                digest.add(index, datagram);
            }
            match self.socket.send_to(datagram, to) {
                // Datagrams get lost, also where there is no room for them.
                Err(error) if !is_for_later(&error) => self.error = Some(error),
                _ => {}
            }
        }
        self.abandon();
    }

    pub fn abandon(&mut self) {
        self.data.clear();
        self.outgoing.clear();
    }
}
