//! Packets in an encrypted stream.
//! Each is preceded by its length: two bytes, little-endian.

use std::io::{self, ErrorKind, Read, Write};
use std::net::TcpStream;
use std::time::{SystemTime, UNIX_EPOCH};

use rustls::pki_types::ServerName;
use rustls::{ClientConnection, ServerConnection};

use super::credentials::{LoadedCredentials, common_name, expiry, explain};
use super::settings::{client, server};
use slate_tls::ShownCertificate;

/// Largest packet, bytes.
pub(super) const MAX_PACKET_SIZE: usize = 31 << 10;

const HEADER_SIZE: usize = 2;

/// Capacity of the decrypted buffer that is kept while idle, bytes.
const IDLE_BUFFER_CAPACITY: usize = 32 << 10;

/// One end of the stream, which never blocks.
pub(super) struct TlsConnection {
    tls: rustls::Connection,
    /// Decrypted bytes; the number of consumed ones follows.
    incoming: Vec<u8>,
    consumed: usize,
    /// Expiry of the first of both certificates, s since 1970.
    expiry: i64,
    /// Name in the other end's certificate.
    agent: Option<String>,
    shown: ShownCertificate,
}

impl TlsConnection {
    pub fn dial(loaded: LoadedCredentials) -> io::Result<Self> {
        let expiry = expiry(&loaded.chain[0]);
        // The name is neither resolved nor sent.
        let name = ServerName::try_from("agent").map_err(io::Error::other)?;
        let shown = ShownCertificate::default();
        let tls = client(loaded, shown.clone()).and_then(|settings| ClientConnection::new(settings, name));
        Ok(Self::new(tls.map_err(io::Error::other)?.into(), expiry, shown))
    }

    pub fn accept(loaded: LoadedCredentials) -> io::Result<Self> {
        let expiry = expiry(&loaded.chain[0]);
        let shown = ShownCertificate::default();
        let tls = server(loaded, shown.clone()).and_then(ServerConnection::new);
        Ok(Self::new(tls.map_err(io::Error::other)?.into(), expiry, shown))
    }

    fn new(mut tls: rustls::Connection, expiry: i64, shown: ShownCertificate) -> Self {
        // A packet is put in only when the buffer is empty.
        tls.set_buffer_limit(None);
        Self { tls, incoming: Vec::new(), consumed: 0, expiry, agent: None, shown }
    }

    /// Returns the name in the other end's certificate, once it is proven.
    pub fn agent(&self) -> Option<&str> {
        self.agent.as_deref()
    }

    /// Returns whether data waits for the socket.
    pub fn is_full(&self) -> bool {
        self.tls.wants_write()
    }

    /// Writes pending bytes, as far as the socket takes them.
    pub fn flush(&mut self, mut socket: &TcpStream) -> io::Result<()> {
        while self.tls.wants_write() {
            match self.tls.write_tls(&mut socket) {
                Ok(_) => {}
                Err(error) if error.kind() == ErrorKind::WouldBlock => break,
                Err(error) if error.kind() == ErrorKind::Interrupted => {}
                Err(error) => return Err(error),
            }
        }
        Ok(())
    }

    /// Encrypts a packet into the stream.
    pub fn put(&mut self, packet: &[u8]) -> io::Result<()> {
        self.check_certificates()?;
        let length = u16::try_from(packet.len()).map_err(io::Error::other)?;
        self.tls.writer().write_all(&length.to_le_bytes())?;
        self.tls.writer().write_all(packet)
    }

    /// Takes the next packet, as far as it fits.
    pub fn take(&mut self, socket: &TcpStream, packet: &mut [u8]) -> io::Result<Option<usize>> {
        loop {
            if let Some(whole) = self.whole()? {
                let fits = whole.len().min(packet.len());
                packet[..fits].copy_from_slice(&whole[..fits]);
                self.consumed += HEADER_SIZE + whole.len();
                return Ok(Some(fits));
            }
            self.check_certificates()?;
            if !self.advance(socket)? {
                return Ok(None);
            }
        }
    }

    /// Returns the next packet if it is complete.
    fn whole(&self) -> io::Result<Option<&[u8]>> {
        let waiting = &self.incoming[self.consumed..];
        let Some((head, rest)) = waiting.split_first_chunk::<HEADER_SIZE>() else { return Ok(None) };
        let length = usize::from(u16::from_le_bytes(*head));
        if length > MAX_PACKET_SIZE {
            let reason = format!("received a packet of {length} bytes, expected at most {MAX_PACKET_SIZE}");
            return Err(io::Error::new(ErrorKind::InvalidData, reason));
        }
        Ok(rest.get(..length))
    }

    /// Reads available bytes; false without any.
    fn advance(&mut self, mut socket: &TcpStream) -> io::Result<bool> {
        match self.tls.read_tls(&mut socket) {
            Ok(0) => return Err(end_of_stream()),
            Ok(_) => {}
            Err(error) if error.kind() == ErrorKind::WouldBlock => return Ok(false),
            Err(error) if error.kind() == ErrorKind::Interrupted => return Ok(true),
            Err(error) => return Err(error),
        }
        let handled = self.tls.process_new_packets();
        let state = handled.map_err(|error| {
            io::Error::new(
                ErrorKind::PermissionDenied,
                describe_error(&error, self.shown.get().and_then(common_name).as_deref()),
            )
        })?;
        self.incoming.drain(..std::mem::take(&mut self.consumed));
        let had = self.incoming.len();
        self.incoming.resize(had + state.plaintext_bytes_to_read(), 0);
        self.tls.reader().read_exact(&mut self.incoming[had..])?;
        self.incoming.shrink_to(IDLE_BUFFER_CAPACITY.max(self.incoming.len()));
        if state.peer_has_closed() && self.whole()?.is_none() {
            return Err(end_of_stream());
        }
        self.read_agent()?;
        Ok(true)
    }

    /// Stores the name of the other agent once the handshake is complete.
    fn read_agent(&mut self) -> io::Result<()> {
        if self.agent.is_none()
            && !self.tls.is_handshaking()
            && let Some([certificate, ..]) = self.tls.peer_certificates()
        {
            let name = common_name(certificate).ok_or_else(|| {
                io::Error::new(ErrorKind::PermissionDenied, "the certificate there has no common name")
            })?;
            self.expiry = self.expiry.min(expiry(certificate));
            self.agent = Some(name);
        }
        Ok(())
    }

    #[allow(clippy::disallowed_methods, reason = "certificates go by the calendar")]
    fn check_certificates(&self) -> io::Result<()> {
        let now = SystemTime::now().duration_since(UNIX_EPOCH).unwrap_or_default().as_secs();
        if i64::try_from(now).is_ok_and(|now| now <= self.expiry) {
            return Ok(());
        }
        Err(io::Error::new(ErrorKind::PermissionDenied, "a certificate of the link has expired"))
    }

    /// Announces the end of the stream to the other end.
    pub fn finish(&mut self, socket: &TcpStream) {
        self.tls.send_close_notify();
        // If there is no room for it, the end of the stream says it too.
        let _ = self.flush(socket);
    }
}

fn end_of_stream() -> io::Error {
    io::Error::new(ErrorKind::ConnectionAborted, "the other end closed the link")
}

/// Describes a TLS error for an agent whose certificate has the name `shown`.
fn describe_error(error: &rustls::Error, shown: Option<&str>) -> String {
    match error {
        rustls::Error::InvalidCertificate(_) => {
            let name = shown.map(|name| format!(", in the name of `{name}`,")).unwrap_or_default();
            format!("the certificate there{name} {}", explain(error).0)
        }
        rustls::Error::NoCertificatesPresented => "the peer shows no certificate".into(),
        rustls::Error::AlertReceived(alert) => {
            format!("the agent there refuses this agent's certificate ({alert:?})")
        }
        error => format!("the peer does not speak TLS as agents do: {error}"),
    }
}
