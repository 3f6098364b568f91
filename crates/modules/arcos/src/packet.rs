//! Packets, the same in both directions: 2-byte header, count, data, checksum.

/// Header of each packet.
pub const HEADER: [u8; 2] = [0xFA, 0xFB];

/// Maximum number of bytes after the count: the data and two of checksum.
pub const LARGEST: usize = 249;

/// Bytes of the checksum.
const CHECKSUM: usize = 2;

/// Returns the checksum of a packet's data: the sum of its pairs of bytes.
/// The high byte comes first; a last single byte is combined by exclusive or.
///
/// ```
/// assert_eq!(slate_arcos::packet::checksum(&[0x04, 0x3B, 0x01, 0x00]), 0x053B);
/// assert_eq!(slate_arcos::packet::checksum(&[0x02]), 0x0002);
/// ```
pub fn checksum(data: &[u8]) -> u16 {
    let (pairs, rest) = data.as_chunks::<2>();
    let sum = pairs.iter().fold(0_u16, |sum, pair| sum.wrapping_add(u16::from_be_bytes(*pair)));
    rest.iter().fold(sum, |sum, byte| sum ^ u16::from(*byte))
}

/// Appends the packet of these data to `bytes`.
/// Appends nothing for data that fit in no packet: empty, or more than 247 bytes.
pub fn encode(data: &[u8], bytes: &mut Vec<u8>) {
    let count = data.len() + CHECKSUM;
    if data.is_empty() || count > LARGEST {
        return;
    }
    bytes.extend_from_slice(&HEADER);
    bytes.push(count as u8);
    bytes.extend_from_slice(data);
    bytes.extend_from_slice(&checksum(data).to_be_bytes());
}

/// Decoder of packets from a byte stream in arbitrary pieces, with garbage.
///
/// It holds less than two packets. When a checksum is wrong, the search continues with the byte after the header, so a
/// header that garbage imitates hides no packet for good.
#[derive(Clone, Debug, Default)]
pub struct Decoder {
    held: Vec<u8>,
    bad_checksums: u64,
    skipped: u64,
}

impl Decoder {
    /// Decodes bytes, and calls `packet` with the data of each complete packet.
    pub fn receive(&mut self, bytes: &[u8], mut packet: impl FnMut(&[u8])) {
        for chunk in bytes.chunks(LARGEST) {
            self.held.extend_from_slice(chunk);
            let mut from = 0;
            loop {
                match find_packet(&self.held[from..]) {
                    FoundPacket::Incomplete => break,
                    FoundPacket::Skip(count) => {
                        self.skipped += count as u64;
                        from += count;
                    }
                    FoundPacket::Bad => {
                        self.bad_checksums += 1;
                        self.skipped += 1;
                        from += 1;
                    }
                    FoundPacket::Packet(data) => {
                        packet(data);
                        from += HEADER.len() + 1 + data.len() + CHECKSUM;
                    }
                }
            }
            self.held.drain(..from);
        }
    }

    /// Forgets the beginning of a packet whose end will not come.
    pub fn clear(&mut self) {
        self.held.clear();
    }

    /// Returns the number of packets with a wrong checksum.
    pub fn bad_checksums(&self) -> u64 {
        self.bad_checksums
    }

    /// Returns the number of bytes outside of packets.
    pub fn skipped(&self) -> u64 {
        self.skipped
    }
}

/// Classification of the first bytes.
enum FoundPacket<'a> {
    /// Too little to say.
    Incomplete,
    /// Number of bytes that begin no packet.
    Skip(usize),
    /// Packet with a wrong checksum.
    Bad,
    /// Data of a packet.
    Packet(&'a [u8]),
}

fn find_packet(bytes: &[u8]) -> FoundPacket<'_> {
    let Some(start) = bytes.iter().position(|byte| *byte == HEADER[0]) else {
        return if bytes.is_empty() { FoundPacket::Incomplete } else { FoundPacket::Skip(bytes.len()) };
    };
    if start > 0 {
        return FoundPacket::Skip(start);
    }
    match bytes {
        [_, second, ..] if *second != HEADER[1] => FoundPacket::Skip(1),
        [_, _, count, rest @ ..] => {
            let count = usize::from(*count);
            if count <= CHECKSUM || count > LARGEST {
                return FoundPacket::Skip(1);
            }
            let Some((data, sum)) = rest.get(..count).and_then(|rest| rest.split_last_chunk::<CHECKSUM>())
            else {
                return FoundPacket::Incomplete;
            };
            if checksum(data) == u16::from_be_bytes(*sum) {
                FoundPacket::Packet(data)
            } else {
                FoundPacket::Bad
            }
        }
        _ => FoundPacket::Incomplete,
    }
}
