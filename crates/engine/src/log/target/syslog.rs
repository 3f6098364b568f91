use std::fmt::Write;
use std::io;
use std::net::{SocketAddr, UdpSocket};
use std::os::unix::net::UnixDatagram;
use std::time::Duration;

pub use slate_configuration::SyslogAddress;
use slate_module::Level;

use super::outage::Outage;
use super::{LogTarget, Record};

/// Syslog of this machine or of another one.
///
/// An unreachable one is reported once and retried with every line. UDP does not report whether a line
/// arrived, only that the network is down.
#[derive(Debug)]
pub struct SyslogTarget {
    address: SyslogAddress,
    /// Socket; `None` after an error, so that the next line opens it again.
    socket: Option<Socket>,
    outage: Outage,
    agent: String,
    /// Name in messages.
    name: String,
}

#[derive(Debug)]
enum Socket {
    Local(UnixDatagram),
    Remote(UdpSocket, SocketAddr),
}

/// "User-level messages", as any program's are.
const FACILITY: u8 = 1;

/// Maximum wait for a full syslog; after that it is tried without waiting.
const SEND_TIMEOUT: Duration = Duration::from_millis(10);

impl SyslogTarget {
    /// Returns a target for the syslog at `address`, for the agent of that name.
    pub fn new(address: SyslogAddress, agent: &str) -> Self {
        let name = match &address {
            SyslogAddress::Socket(path) => format!("the syslog at {}", slate_configuration::printable(path)),
            SyslogAddress::Server(address) => format!("the syslog at {address}"),
        };
        // The length that RFC 5424 allows.
        let agent = agent.chars().take(48).collect();
        Self { address, socket: None, outage: Outage::default(), agent, name }
    }

    fn connected(&self) -> io::Result<Socket> {
        Ok(match &self.address {
            SyslogAddress::Socket(path) => {
                let socket = UnixDatagram::unbound()?;
                socket.connect(path)?;
                socket.set_write_timeout(Some(SEND_TIMEOUT))?;
                Socket::Local(socket)
            }
            SyslogAddress::Server(address) => {
                let any: SocketAddr =
                    if address.is_ipv4() { ([0_u8; 4], 0).into() } else { ([0_u16; 8], 0).into() };
                Socket::Remote(UdpSocket::bind(any)?, *address)
            }
        })
    }

    fn send(&mut self, record: &Record) -> io::Result<()> {
        let socket = match self.socket.take() {
            Some(socket) => socket,
            None => self.connected()?,
        };
        match &socket {
            Socket::Local(socket) => {
                socket.set_nonblocking(self.outage.is_on())?;
                socket.send(local(record, &self.agent).as_bytes())?;
            }
            Socket::Remote(socket, address) => {
                // Not connected, as a refusal would come with every other line only.
                socket.send_to(structured(record, &self.agent).as_bytes(), *address)?;
            }
        }
        self.socket = Some(socket);
        Ok(())
    }
}

impl LogTarget for SyslogTarget {
    fn write(&mut self, record: &Record) {
        let result = self.send(record);
        self.outage.record_result(&self.name, result);
    }

    fn diagnostic(&mut self) -> Option<String> {
        self.outage.diagnostic()
    }
}

fn priority(level: Level) -> u8 {
    let severity = match level {
        Level::Error => 3,
        Level::Warn => 4,
        Level::Info => 6,
        Level::Debug | Level::Trace => 7,
    };
    FACILITY * 8 + severity
}

/// Formats a message for the local socket, without a time.
/// Its time is that of its arrival, as the agent's may be virtual.
fn local(record: &Record, agent: &str) -> String {
    let process = std::process::id();
    format!("<{}>{agent}[{process}]: {}: {}", priority(record.level), record.module, record.message())
}

/// Formats a message with its fields as structured data.
/// The number is the one that RFC 5612 keeps for examples, as no other is assigned to Slate.
fn structured(record: &Record, agent: &str) -> String {
    let (priority, process) = (priority(record.level), std::process::id());
    let time = record.time as f64 * 1e-9;
    let mut message = format!(
        "<{priority}>1 - - {agent} {process} - [slate@32473 module=\"{}\" time=\"{time}\"",
        record.module
    );
    if record.dropped > 0 {
        // Writing to a String can't fail.
        let _ = write!(message, " dropped=\"{}\"", record.dropped);
    }
    message.push(']');
    if !record.fields.is_empty() {
        message.push_str("[fields@32473");
        for (key, value) in &record.fields {
            let _ = write!(message, " {}=\"{}\"", name(key), escaped(value));
        }
        message.push(']');
    }
    message.push(' ');
    message.push_str(&record.text);
    message
}

/// Formats a name of structured data.
/// At most 32 visible characters of ASCII without `=`, `]` and `"`.
fn name(key: &str) -> String {
    let allowed = |c: char| c.is_ascii_graphic() && !matches!(c, '=' | ']' | '"');
    let name: String = key.chars().take(32).map(|c| if allowed(c) { c } else { '_' }).collect();
    if name.is_empty() { "_".into() } else { name }
}

fn escaped(value: &str) -> String {
    let mut result = String::with_capacity(value.len());
    for c in value.chars() {
        if matches!(c, '"' | '\\' | ']') {
            result.push('\\');
        }
        result.push(c);
    }
    result
}
