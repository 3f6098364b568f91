//! Real packets, and mutations of them.

use std::io::Read;
use std::net::UdpSocket;
use std::process::{Child, Command, Stdio};
use std::time::Duration;

/// Script that prints ports and payloads of the loopback interface's UDP packets.
/// It prints when its input ends, each packet once.
const CAPTURE: &str = "
import select, socket, sys
packets = socket.socket(socket.AF_PACKET, socket.SOCK_RAW, socket.ntohs(3))
packets.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 1 << 22)
packets.bind(('lo', 0))
seen = {}
print('ready', flush=True)
while True:
    found, _, _ = select.select([packets, sys.stdin], [], [])
    if packets not in found:
        break
    packet, address = packets.recvfrom(1 << 16)
    header = 14 + 4 * (packet[14] & 15)
    if address[2] != 4 and packet[14] >> 4 == 4 and packet[23] == 17 and len(seen) < 2000:
        seen[int.from_bytes(packet[header + 2:header + 4], 'big'), packet[header + 8:]] = None
for port, payload in seen:
    print(port, payload.hex())
";

/// Capture of the UDP packets on the loopback interface; requires root.
pub struct PacketCapture(Child);

impl PacketCapture {
    /// Starts the capture.
    ///
    /// # Panics
    /// Without Python, or without root.
    pub fn start() -> Self {
        let mut command = Command::new("python3");
        command.args(["-c", CAPTURE]).stdin(Stdio::piped()).stdout(Stdio::piped());
        let mut child = command.spawn().unwrap();
        let mut ready = [0; 6];
        let is_ready = child.stdout.as_mut().unwrap().read_exact(&mut ready).is_ok();
        assert!(is_ready, "this test needs Python and root");
        Self(child)
    }

    /// Ends; the payloads to those ports.
    ///
    /// # Panics
    /// Python has failed.
    pub fn end(mut self, ports: &[u16]) -> Vec<Vec<u8>> {
        drop(self.0.stdin.take());
        let mut text = String::new();
        self.0.stdout.take().unwrap().read_to_string(&mut text).unwrap();
        assert!(self.0.wait().unwrap().success());
        let lines = text.lines().filter_map(|line| line.split_once(' '));
        let own = lines.filter(|(port, _)| port.parse().is_ok_and(|port| ports.contains(&port)));
        own.map(|(_, payload)| bytes(payload)).collect()
    }
}

/// Returns a packet of RTPS with its announcements and values alone.
/// HEARTBEAT, ACKNACK, GAP and fragments are left out.
pub fn values_alone(packet: &[u8]) -> Option<Vec<u8>> {
    const HEADER: usize = 20;
    const DATA: u8 = 0x15;
    // INFO_TS, INFO_SRC, INFO_DST and INFO_REPLY (RTPS 2.5, 9.4.5.1).
    const VALUES: [u8; 5] = [0x09, 0x0c, 0x0e, 0x0f, DATA];
    let (header, mut rest) = packet.split_at_checked(HEADER)?;
    let (mut left, mut has_data) = (header.to_vec(), false);
    while let [kind, flags, first, second, ..] = *rest {
        let length = if flags & 1 == 1 { [first, second] } else { [second, first] };
        let length = (4 + usize::from(u16::from_le_bytes(length))).min(rest.len());
        if VALUES.contains(&kind) {
            left.extend_from_slice(&rest[..length]);
            has_data |= kind == DATA;
        }
        rest = &rest[length..];
    }
    has_data.then_some(left)
}

fn bytes(hex: &str) -> Vec<u8> {
    (0..hex.len() / 2).map(|place| u8::from_str_radix(&hex[2 * place..2 * place + 2], 16).unwrap()).collect()
}

/// Sends mutations of packets to ports of this machine, always the same ones.
pub struct HostileSender {
    packets: Vec<Vec<u8>>,
    socket: UdpSocket,
    state: u64,
}

impl HostileSender {
    /// Mutates packets of RTPS.
    ///
    /// # Panics
    /// No port is left.
    pub fn new(packets: Vec<Vec<u8>>) -> Self {
        Self { packets, socket: UdpSocket::bind(("127.0.0.1", 0)).unwrap(), state: 1 }
    }

    fn below(&mut self, limit: usize) -> usize {
        self.state =
            self.state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (self.state >> 33) as usize % limit
    }

    fn mutation(&mut self) -> Vec<u8> {
        // Behind the name of the protocol, without which it is no packet at all.
        const NAME: usize = 4;
        let place = self.below(self.packets.len());
        let mut packet = self.packets[place].clone();
        for _ in 0..1 + self.below(8) {
            let place = NAME + self.below(packet.len() - NAME);
            packet[place] = self.below(256) as u8;
        }
        if self.below(4) == 0 {
            packet.truncate(NAME + self.below(packet.len() - NAME));
        }
        packet
    }

    /// Sends a number of packets, one to each port in turn.
    ///
    /// # Panics
    /// The system refuses.
    #[allow(clippy::disallowed_methods, reason = "packets go by the machine's clock")]
    pub fn send(&mut self, ports: &[u16], count: usize) {
        for number in 0..count {
            let packet = self.mutation();
            let port = ports[number % ports.len()];
            // A closed port is reported with the next packet.
            let _ = self.socket.send_to(&packet, ("127.0.0.1", port));
            if number % 100 == 0 {
                std::thread::sleep(Duration::from_millis(5));
            }
        }
    }
}

/// Returns the resident memory of this program, bytes.
///
/// # Panics
/// The system does not tell.
pub fn resident_memory() -> u64 {
    let status = std::fs::read_to_string("/proc/self/statm").unwrap();
    status.split(' ').nth(1).unwrap().parse::<u64>().unwrap() * 4096
}
