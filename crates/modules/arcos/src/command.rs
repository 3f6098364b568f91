//! Commands to the controller.

use crate::packet;

/// Command: its number and argument.
///
/// ```
/// use slate_arcos::command::Command;
///
/// let mut bytes = Vec::new();
/// Command::Enable(true).encode(&mut bytes);
/// assert_eq!(bytes, [0xFA, 0xFB, 0x06, 0x04, 0x3B, 0x01, 0x00, 0x05, 0x3B]);
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Command<'a> {
    /// Step of the synchronization, 0 to 2, while there is no connection.
    Sync(u8),
    /// Watchdog renewal, so that the robot does not stop.
    Pulse,
    /// Starts the controller's servers: reports, motors, sonars.
    Open,
    /// Ends the connection, and switches motors and sonars off.
    Close,
    /// Switches the motors on or off.
    Enable(bool),
    /// Reset of the origin to the present pose.
    SetOrigin,
    /// Forward speed, mm/s.
    Velocity(i16),
    /// Turn, degrees per second, counter-clockwise.
    Rotation(i16),
    /// Switches the sonars on or off.
    Sonar(bool),
    /// Stop with the motors on.
    Stop,
    /// Speeds of left and right wheels, each in units of 20 mm/s.
    Wheels(i8, i8),
    /// Any command, with its argument.
    Other(u8, Argument<'a>),
}

/// Argument of a command.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Argument<'a> {
    /// No argument.
    None,
    /// Number from -65535 to 65535: a sign and 16 bits.
    Number(i32),
    /// Bytes, at most [`TEXT`]; a command with a longer text is left out.
    Text(&'a [u8]),
}

/// Longest text of a command: number, type, length and checksum go with it.
pub const TEXT: usize = packet::LARGEST - 5;

const POSITIVE: u8 = 0x3B;
const NEGATIVE: u8 = 0x1B;
const STRING: u8 = 0x2B;

impl<'a> Command<'a> {
    /// Returns number and argument.
    fn parts(self) -> (u8, Argument<'a>) {
        let number = |value: i16| Argument::Number(i32::from(value));
        let switch = |on: bool| Argument::Number(i32::from(on));
        match self {
            Self::Sync(step) => (step, Argument::None),
            Self::Pulse => (0, Argument::None),
            Self::Open => (1, Argument::None),
            Self::Close => (2, Argument::None),
            Self::Enable(on) => (4, switch(on)),
            Self::SetOrigin => (7, Argument::None),
            Self::Velocity(speed) => (11, number(speed)),
            Self::Rotation(turn) => (21, number(turn)),
            Self::Sonar(on) => (28, switch(on)),
            Self::Stop => (29, Argument::None),
            Self::Wheels(left, right) => {
                (32, Argument::Number(i32::from(u16::from_le_bytes([right as u8, left as u8]))))
            }
            Self::Other(number, argument) => (number, argument),
        }
    }

    /// Appends its packet to `bytes`.
    pub fn encode(self, bytes: &mut Vec<u8>) {
        let (number, argument) = self.parts();
        let mut data = Vec::with_capacity(4);
        data.push(number);
        match argument {
            Argument::None => {}
            Argument::Number(value) => {
                data.push(if value < 0 { NEGATIVE } else { POSITIVE });
                let magnitude = value.unsigned_abs().min(u32::from(u16::MAX)) as u16;
                data.extend_from_slice(&magnitude.to_le_bytes());
            }
            Argument::Text(text) => {
                data.extend_from_slice(&[STRING, text.len() as u8]);
                data.extend_from_slice(text);
            }
        }
        packet::encode(&data, bytes);
    }

    /// Decodes a packet's data to a command; `None` if they are no command.
    /// Numbers 0 to 2 have another meaning while there is no connection: see [`Command::Sync`].
    pub fn decode(data: &'a [u8]) -> Option<Self> {
        let (&number, rest) = data.split_first()?;
        let argument = match *rest {
            [] => Argument::None,
            [POSITIVE, low, high] => Argument::Number(i32::from(u16::from_le_bytes([low, high]))),
            [NEGATIVE, low, high] => Argument::Number(-i32::from(u16::from_le_bytes([low, high]))),
            [STRING, length, ref text @ ..] if text.len() == usize::from(length) => Argument::Text(text),
            _ => return None,
        };
        let other = Self::Other(number, argument);
        Some(match (number, argument) {
            (0, Argument::None) => Self::Pulse,
            (1, Argument::None) => Self::Open,
            (2, Argument::None) => Self::Close,
            (7, Argument::None) => Self::SetOrigin,
            (29, Argument::None) => Self::Stop,
            (4, Argument::Number(on)) => Self::Enable(on != 0),
            (28, Argument::Number(on)) => Self::Sonar(on != 0),
            (11, Argument::Number(speed)) => i16::try_from(speed).map_or(other, Self::Velocity),
            (21, Argument::Number(turn)) => i16::try_from(turn).map_or(other, Self::Rotation),
            (32, Argument::Number(speeds)) => {
                let [right, left, ..] = speeds.to_le_bytes();
                Self::Wheels(left as i8, right as i8)
            }
            _ => other,
        })
    }
}
