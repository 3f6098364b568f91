//! Joysticks and gamepads of Linux, and driving by them.

pub mod event;
pub mod session;
mod teleoperation;

use serde::{Deserialize, Serialize};
use slate_device_line::LineAddress;
use slate_interfaces::Joy;
use slate_module::prelude::*;

use self::session::JoystickSession;
pub use self::teleoperation::{
    JoystickTeleop, JoystickTeleopIo, JoystickTeleopParams, JoystickWheels, JoystickWheelsIo,
    JoystickWheelsParams, TeleoperationState,
};
use crate::driver::{DriverIo, DriverStart, DriverState, device, reading, step};

/// Parameters of [`Joystick`]; a change reopens the device.
#[params]
#[derive(PartialEq)]
pub struct JoystickParams {
    #[param(default = "/dev/input/js0", doc = "joystick, preferably of /dev/input/by-id")]
    device: Text<252>,
    #[param(default = 0.05, range = 0.0..=0.9, doc = "part of the way of an axis that counts as its middle")]
    deadzone: f64,
}

reading!(JoyReading, Joy);

impl DriverStart for JoystickParams {
    type DriverReading = JoyReading;
    type DeviceProtocol = JoystickSession;

    const LASTS: bool = true;

    fn start(&self) -> Result<(LineAddress, JoystickSession), Refusal> {
        let address = LineAddress::input(self.device.as_str()).map_err(|error| device(&error))?;
        Ok((address, JoystickSession::new(self.deadzone)))
    }
}

/// Port of [`Joystick`].
#[ports]
pub struct JoystickIo {
    /// Axes and buttons, in each cycle while the joystick is there.
    joy: Output<Joy>,
}

/// State of [`Joystick`].
#[derive(Debug, Default, Serialize, Deserialize)]
pub struct JoystickState {
    driver: DriverState<JoystickParams>,
    /// Newest state of axes and buttons.
    #[serde(skip)]
    joy: Option<Joy>,
}

/// Reads a joystick or gamepad of Linux.
///
/// A joystick tells changes alone. Its state is published in each cycle, so that one that is gone becomes stale.
pub struct Joystick;

#[module(stage = SensorAcquire)]
impl Module for Joystick {
    type Io = (DriverIo, JoystickIo);
    type Params = JoystickParams;
    type State = JoystickState;

    fn create(_: &Setup<'_>, params: &JoystickParams) -> Result<JoystickState, Refusal> {
        params.check().map(|()| JoystickState::default())
    }

    fn tick(state: &mut JoystickState, io: &Self::Io, params: &JoystickParams, now: &Tick) -> Outcome {
        let JoystickState { driver, joy } = state;
        let outcome = step(driver, &io.0, params, now, |newest| *joy = Some(*newest));
        if !driver.is_connected() {
            *joy = None;
        }
        if let Some(joy) = joy {
            io.1.joy.set(*joy);
        }
        outcome
    }
}
