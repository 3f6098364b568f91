//! Packets of RPLIDAR scanners: requests, response descriptors, and scan nodes.
//!
//! Slamtec, *RPLIDAR Interface Protocol and Application Notes* (LR001), chapters 2 to 4.

/// First byte of a request.
pub const REQUEST: u8 = 0xA5;
/// First two bytes of a response descriptor.
pub const DESCRIPTOR: [u8; 2] = [0xA5, 0x5A];

/// Request to a scanner.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum RplidarRequest {
    /// Ends a scan.
    Stop,
    /// Reset of the scanner.
    Reset,
    /// Request of a continuous scan.
    Scan,
    /// Request of model and serial number.
    Information,
    /// Request of the state of health.
    Health,
    /// Motor control, 0 to 1023.
    /// An A1 does not know it, and switches its motor by the line DTR.
    Motor(u16),
}

impl RplidarRequest {
    fn code(self) -> u8 {
        match self {
            Self::Stop => 0x25,
            Self::Reset => 0x40,
            Self::Scan => 0x20,
            Self::Information => 0x50,
            Self::Health => 0x52,
            Self::Motor(_) => 0xF0,
        }
    }

    /// Appends its packet to `bytes`.
    ///
    /// ```
    /// use slate_drivers::rplidar::packet::RplidarRequest;
    ///
    /// let mut bytes = Vec::new();
    /// RplidarRequest::Scan.append(&mut bytes);
    /// RplidarRequest::Motor(660).append(&mut bytes);
    /// assert_eq!(bytes, [0xA5, 0x20, 0xA5, 0xF0, 0x02, 0x94, 0x02, 0xC1]);
    /// ```
    pub fn append(self, bytes: &mut Vec<u8>) {
        let begin = bytes.len();
        bytes.extend([REQUEST, self.code()]);
        if let Self::Motor(speed) = self {
            bytes.push(2);
            bytes.extend(speed.to_le_bytes());
            bytes.push(bytes[begin..].iter().fold(0, |sum, byte| sum ^ byte));
        }
    }

    /// Parses a request at the beginning of bytes; returns it and its length.
    /// `None` for an incomplete or unknown request.
    pub fn parse(bytes: &[u8]) -> Option<(Self, usize)> {
        Some(match *bytes {
            [REQUEST, 0x25, ..] => (Self::Stop, 2),
            [REQUEST, 0x40, ..] => (Self::Reset, 2),
            [REQUEST, 0x20, ..] => (Self::Scan, 2),
            [REQUEST, 0x50, ..] => (Self::Information, 2),
            [REQUEST, 0x52, ..] => (Self::Health, 2),
            [REQUEST, 0xF0, 2, low, high, sum, ..] => {
                let is_right = bytes[..5].iter().fold(0, |sum, byte| sum ^ byte) == sum;
                (Self::Motor(u16::from_le_bytes([low, high])).filter(is_right)?, 6)
            }
            _ => return None,
        })
    }

    fn filter(self, is_right: bool) -> Option<Self> {
        is_right.then_some(self)
    }
}

/// Kind of a response, from its descriptor.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ResponseKind {
    /// Model and serial number.
    Information,
    /// State of health.
    Health,
    /// Nodes of a scan, without end.
    Scan,
}

impl ResponseKind {
    /// Bytes of a packet.
    pub fn length(self) -> usize {
        match self {
            Self::Information => 20,
            Self::Health => 3,
            Self::Scan => NODE,
        }
    }

    /// Returns the descriptor: length in 30 bits, mode in 2 bits, type.
    pub fn descriptor(self) -> [u8; 7] {
        let (mode, kind) = match self {
            Self::Information => (0, 0x04),
            Self::Health => (0, 0x06),
            Self::Scan => (1 << 6, 0x81),
        };
        [DESCRIPTOR[0], DESCRIPTOR[1], self.length() as u8, 0, 0, mode, kind]
    }

    /// Returns the kind of a descriptor.
    pub fn of(descriptor: &[u8]) -> Option<Self> {
        [Self::Information, Self::Health, Self::Scan].into_iter().find(|kind| kind.descriptor() == descriptor)
    }
}

/// Bytes of a node.
pub const NODE: usize = 5;

/// Measurement of a scan.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct RplidarNode {
    /// True if a new revolution begins with it.
    pub begins: bool,
    /// Strength of the echo, 0 to 63.
    pub quality: u8,
    /// Direction, clockwise from the front, 1/64 degree; 15 bits.
    pub angle: u16,
    /// Distance, 1/4 millimeter; 0 without an echo.
    pub distance: u16,
}

impl RplidarNode {
    /// Reads a node; nothing when one of its check bits is wrong.
    pub fn parse([first, low, high, near, far]: [u8; NODE]) -> Option<Self> {
        let (begins, inverted, check) = (first & 1 != 0, first & 2 != 0, low & 1 != 0);
        let angle = u16::from_le_bytes([low, high]) >> 1;
        // A little beyond a turn is possible by rounding.
        let is_right = begins != inverted && check && angle < 361 * 64;
        is_right.then_some(Self {
            begins,
            quality: first >> 2,
            angle,
            distance: u16::from_le_bytes([near, far]),
        })
    }

    /// Returns its bytes.
    pub fn bytes(&self) -> [u8; NODE] {
        let [low, high] = (self.angle << 1 | 1).to_le_bytes();
        let [near, far] = self.distance.to_le_bytes();
        [self.quality << 2 | if self.begins { 0b01 } else { 0b10 }, low, high, near, far]
    }

    /// Returns the direction.
    /// It is counter-clockwise from the front, radians from -2 pi to 0.
    pub fn direction(&self) -> f64 {
        -(f64::from(self.angle) / 64.0).to_radians()
    }

    /// Returns the distance, meters; `None` without an echo.
    pub fn range(&self) -> Option<f64> {
        (self.distance > 0).then(|| f64::from(self.distance) / 4000.0)
    }
}

/// Packet of a scanner.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum RplidarPacket<'a> {
    /// Model, firmware, hardware and serial number.
    Information(&'a [u8]),
    /// State of health: 0 good, 1 a warning, 2 an error; and its code.
    Health(u8, u16),
    /// Beginning of a scan.
    ScanBegins,
    /// Measurement.
    Node(RplidarNode),
}

/// Decoder of packets from a byte stream in arbitrary pieces, with garbage.
///
/// It holds less than 32 bytes. A node has only three bits of check, so that after garbage three nodes in a row must be
/// right before the first one counts.
#[derive(Clone, Debug, Default)]
pub struct PacketDecoder {
    held: Vec<u8>,
    expects: Option<ResponseKind>,
    damaged: u64,
    /// True if nodes are in step.
    in_step: bool,
}

/// Nodes that must be right in a row after garbage.
const RIGHT: usize = 3;

impl PacketDecoder {
    /// Decodes bytes, and calls `take` with each complete packet.
    pub fn receive(&mut self, bytes: &[u8], mut take: impl FnMut(RplidarPacket<'_>)) {
        for byte in bytes {
            self.held.push(*byte);
            while let Some(used) = self.next_packet(&mut take) {
                self.held.drain(..used);
            }
        }
    }

    /// Decodes the beginning of the held bytes; returns the number consumed, if any.
    fn next_packet(&mut self, take: &mut impl FnMut(RplidarPacket<'_>)) -> Option<usize> {
        let first = *self.held.first()?;
        match self.expects {
            Some(ResponseKind::Scan) => self.find_node(take),
            Some(kind) if self.held.len() >= kind.length() => {
                self.expects = None;
                let data = &self.held[..kind.length()];
                take(match (kind, data) {
                    (ResponseKind::Health, [status, low, high]) => {
                        RplidarPacket::Health(*status, u16::from_le_bytes([*low, *high]))
                    }
                    _ => RplidarPacket::Information(data),
                });
                Some(kind.length())
            }
            Some(_) => None,
            None if first != DESCRIPTOR[0] => Some(1),
            None if self.held.len() < 7 => None,
            None => match ResponseKind::of(&self.held[..7]) {
                Some(kind) => {
                    self.expects = Some(kind);
                    self.in_step = true;
                    if kind == ResponseKind::Scan {
                        take(RplidarPacket::ScanBegins);
                    }
                    Some(7)
                }
                None => Some(1),
            },
        }
    }

    fn find_node(&mut self, take: &mut impl FnMut(RplidarPacket<'_>)) -> Option<usize> {
        let needed = if self.in_step { NODE } else { RIGHT * NODE };
        if self.held.len() < needed {
            return None;
        }
        let nodes = self.held[..needed].as_chunks::<NODE>().0;
        let is_right = nodes.iter().all(|node| RplidarNode::parse(*node).is_some());
        if let Some(node) = nodes.first().copied().and_then(RplidarNode::parse).filter(|_| is_right) {
            self.in_step = true;
            take(RplidarPacket::Node(node));
            return Some(NODE);
        }
        self.damaged += u64::from(self.in_step);
        self.in_step = false;
        Some(1)
    }

    /// Resets the expected packet, on a new line or after a request.
    pub fn clear(&mut self) {
        self.held.clear();
        self.expects = None;
    }

    /// Returns the number of times that a node was damaged.
    pub fn damaged(&self) -> u64 {
        self.damaged
    }
}
