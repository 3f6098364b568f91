//! Events of Linux's joystick interface, `/dev/input/js0` and so on.
//!
//! Linux, *Joystick API Documentation* (`Documentation/input/joydev/joystick-api.rst`). The kernel scales the axes, and tells the
//! state of each axis and button when the device is opened; so neither calibration nor system calls are needed.

/// Bytes of an event.
pub const EVENT: usize = 8;

/// Event types of a button, of an axis, and the bit of the initial state.
const BUTTON: u8 = 1;
const AXIS: u8 = 2;
const INITIAL: u8 = 0x80;

/// Changed control of a joystick.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum JoystickChange {
    /// Number of a button, and true if it is pressed.
    Button(u8, bool),
    /// Axis of that number, -32767 to 32767: right and back are positive.
    Axis(u8, i16),
}

/// Event.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct JoystickEvent {
    /// Time of any clock, milliseconds.
    pub time: u32,
    /// True for an event of the initial state.
    pub is_initial: bool,
    /// Change that the event reports.
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
