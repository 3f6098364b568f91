//! State of a joystick, from its events.

use std::time::Duration;

use slate_interfaces::Joy;
use slate_module::Sequence;

use super::event::{EVENT, JoystickChange, JoystickEvent};
use crate::driver::{DeviceFault, DeviceProtocol};

/// Time until the state at the beginning.
const TIMEOUT: Duration = Duration::from_secs(2);

/// Joystick, which only talks.
#[derive(Clone, Debug)]
pub struct JoystickSession {
    /// Dead zone: part of an axis's range that counts as its middle.
    deadzone: f64,
    held: Vec<u8>,
    axes: [f32; 16],
    buttons: [i32; 32],
    /// Numbers of axes and buttons.
    counts: (usize, usize),
    damaged: u64,
}

impl JoystickSession {
    /// Returns a joystick of which nothing is known.
    pub fn new(deadzone: f64) -> Self {
        Self { deadzone, held: Vec::new(), axes: [0.0; 16], buttons: [0; 32], counts: (0, 0), damaged: 0 }
    }

    fn take(&mut self, change: JoystickChange) {
        match change {
            JoystickChange::Button(number, is_pressed) => {
                let number = usize::from(number);
                if let Some(button) = self.buttons.get_mut(number) {
                    *button = i32::from(is_pressed);
                    self.counts.1 = self.counts.1.max(number + 1);
                }
            }
            JoystickChange::Axis(number, value) => {
                let (number, value) = (usize::from(number), axis(value, self.deadzone));
                if let Some(axis) = self.axes.get_mut(number) {
                    *axis = value;
                    self.counts.0 = self.counts.0.max(number + 1);
                }
            }
        }
    }
}

/// Returns an axis value from -1 to 1, forward and left positive.
/// 0 within the dead zone, and without a jump at its edge.
fn axis(value: i16, deadzone: f64) -> f32 {
    let value = (-f64::from(value) / 32_767.0).clamp(-1.0, 1.0);
    let beyond = value.abs() - deadzone;
    if beyond <= 0.0 { 0.0 } else { (value.signum() * beyond / (1.0 - deadzone)) as f32 }
}

impl DeviceProtocol for JoystickSession {
    type Value = Joy;

    fn begin(&mut self, _: Duration, _: &mut Vec<u8>) {
        *self = Self { damaged: self.damaged, ..Self::new(self.deadzone) };
    }

    fn receive(&mut self, bytes: &[u8], _: Duration, _: &mut Vec<u8>, take: &mut dyn FnMut(&Joy)) {
        let mut has_changed = false;
        for byte in bytes {
            self.held.push(*byte);
            let Some(event) = self.held.first_chunk::<EVENT>() else { continue };
            let Some(event) = JoystickEvent::parse(*event) else {
                self.damaged += 1;
                self.held.remove(0);
                continue;
            };
            self.held.clear();
            self.take(event.change);
            has_changed = true;
        }
        if has_changed {
            let (axes, buttons) = self.counts;
            take(&Joy {
                axes: Sequence::new(&self.axes[..axes]),
                buttons: Sequence::new(&self.buttons[..buttons]),
            });
        }
    }

    fn poll(&mut self, _: Duration, _: &mut Vec<u8>) -> Result<(), DeviceFault> {
        Ok(())
    }

    fn identity(&self) -> &str {
        "a joystick"
    }

    fn damaged(&self) -> u64 {
        self.damaged
    }

    fn allowed_silence(&self) -> Option<Duration> {
        // A joystick at rest sends nothing.
        (self.counts == (0, 0)).then_some(TIMEOUT)
    }
}
