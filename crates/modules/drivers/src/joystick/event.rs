//! Events of Linux's joystick interface, `/dev/input/js0` and so on.
//!
//! Linux, *Joystick API Documentation* (`Documentation/input/joydev/joystick-api.rst`). The kernel scales the axes, and tells the
//! state of each axis and button when the device is opened; so neither calibration nor system calls are needed.

/// Bytes of an event.
pub const EVENT: usize = 8;

/// Kind of an event of a button, of an axis, and the bit of those that tell the state at the beginning.
const BUTTON: u8 = 1;
const AXIS: u8 = 2;
const INITIAL: u8 = 0x80;

/// What has changed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum JoystickChange {
    /// A button of that number is pressed or released.
    Button(u8, bool),
    /// An axis of that number, -32767 to 32767: right and back are positive.
    Axis(u8, i16),
}

/// An event.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct JoystickEvent {
    /// Time of any clock, milliseconds.
    pub time: u32,
    /// Whether it tells the state at the beginning.
    pub is_initial: bool,
    /// What it tells.
    pub change: JoystickChange,
}

impl JoystickEvent {
    /// Reads an event; nothing for one of another kind.
    pub fn parse([t0, t1, t2, t3, low, high, kind, number]: [u8; EVENT]) -> Option<Self> {
        let value = i16::from_ne_bytes([low, high]);
        let change = match kind & !INITIAL {
            BUTTON if value == 0 || value == 1 => JoystickChange::Button(number, value == 1),
            AXIS => JoystickChange::Axis(number, value),
            _ => return None,
        };
        let time = u32::from_ne_bytes([t0, t1, t2, t3]);
        Some(Self { time, is_initial: kind & INITIAL != 0, change })
    }

    /// Returns its bytes.
    pub fn bytes(&self) -> [u8; EVENT] {
        let (value, kind, number) = match self.change {
            JoystickChange::Button(number, is_pressed) => (i16::from(is_pressed), BUTTON, number),
            JoystickChange::Axis(number, value) => (value, AXIS, number),
        };
        let ([t0, t1, t2, t3], [low, high]) = (self.time.to_ne_bytes(), value.to_ne_bytes());
        [t0, t1, t2, t3, low, high, if self.is_initial { kind | INITIAL } else { kind }, number]
    }
}
