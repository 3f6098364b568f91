use std::time::Duration;

use slate_device_line::simulated::DeviceFirmware;

use crate::joystick::event::{JoystickChange, JoystickEvent};

/// Simulated gamepad.
#[derive(Clone, Debug)]
pub struct SimulatedJoystick {
    axes: Vec<i16>,
    buttons: Vec<bool>,
    /// Pending changes, each with true for the initial state.
    changes: Vec<(JoystickChange, bool)>,
}

impl Default for SimulatedJoystick {
    fn default() -> Self {
        Self::new(6, 11)
    }
}

impl SimulatedJoystick {
    /// Returns a gamepad with that many axes and buttons.
    pub fn new(axes: usize, buttons: usize) -> Self {
        Self { axes: vec![0; axes], buttons: vec![false; buttons], changes: Vec::new() }
    }

    /// Presses a button, or releases it.
    pub fn press(&mut self, button: u8, is_pressed: bool) {
        if let Some(place) = self.buttons.get_mut(usize::from(button)) {
            *place = is_pressed;
            self.changes.push((JoystickChange::Button(button, is_pressed), false));
        }
    }

    /// Moves an axis, -32767 to 32767: right and back are positive.
    pub fn tilt(&mut self, axis: u8, value: i16) {
        if let Some(place) = self.axes.get_mut(usize::from(axis)) {
            *place = value;
            self.changes.push((JoystickChange::Axis(axis, value), false));
        }
    }
}

impl DeviceFirmware for SimulatedJoystick {
    fn open(&mut self) {
        self.changes.clear();
        let buttons =
            (0..).zip(&self.buttons).map(|(number, pressed)| JoystickChange::Button(number, *pressed));
        let axes = (0..).zip(&self.axes).map(|(number, value)| JoystickChange::Axis(number, *value));
        self.changes.extend(buttons.chain(axes).map(|change| (change, true)));
    }

    fn receive(&mut self, _: &[u8]) {}

    fn advance(&mut self, now: Duration, outgoing: &mut Vec<u8>) {
        for (change, is_initial) in self.changes.drain(..) {
            outgoing.extend(JoystickEvent { time: now.as_millis() as u32, is_initial, change }.bytes());
        }
    }
}
