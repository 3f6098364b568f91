//! Driving by a joystick, while a dead-man button is held.

use serde::{Deserialize, Serialize};
use slate_interfaces::{Joy, Twist2, WheelSpeeds};
use slate_module::prelude::*;

/// State of teleoperation by a person.
#[derive(Debug, Default, Serialize, Deserialize)]
pub struct TeleoperationState {
    /// True if the dead-man button was seen released since the connection.
    was_released: bool,
    /// True if the dead-man button was held in the last tick.
    was_held: bool,
    /// True if the log holds a warning of a missing axis or button.
    has_complained: bool,
}

/// AxisAssignment of axes and buttons.
#[derive(Clone, Copy, Debug)]
struct AxisAssignment {
    dead_man_button: usize,
    linear_axis: usize,
    angular_axis: usize,
    max_linear_velocity: f64,
    max_angular_velocity: f64,
}

impl TeleoperationState {
    /// Returns a person's velocity command; `None` without a person.
    /// The release of the dead-man button is a standstill.
    fn command(
        &mut self,
        joy: Option<&Joy>,
        assignment: &AxisAssignment,
        now: &Tick,
    ) -> (Option<Twist2>, Outcome) {
        let Some(joy) = joy else {
            // A button that is held while the joystick comes back must not start the robot.
            *self = Self { has_complained: self.has_complained, ..Self::default() };
            return (None, Outcome::Degraded);
        };
        let axis = |number: usize| joy.axes.get(number).map(|axis| f64::from(*axis));
        let parts = (
            axis(assignment.linear_axis),
            axis(assignment.angular_axis),
            joy.buttons.get(assignment.dead_man_button),
        );
        let (Some(linear), Some(angular), Some(button)) = parts else {
            if !std::mem::replace(&mut self.has_complained, true) {
                now.warn(format_args!(
                    "the joystick has {} axes and {} buttons: choose `linear_axis`, `angular_axis` and `dead_man_button` among \
                     them, from 0",
                    joy.axes.len(),
                    joy.buttons.len()
                ));
            }
            return (None, Outcome::Degraded);
        };
        self.has_complained = false;
        let is_pressed = *button != 0;
        self.was_released |= !is_pressed;
        let is_held = is_pressed && self.was_released;
        let has_let_go = std::mem::replace(&mut self.was_held, is_held) && !is_held;
        let velocity = Twist2 {
            linear: linear * assignment.max_linear_velocity,
            angular: angular * assignment.max_angular_velocity,
        };
        (if is_held { Some(velocity) } else { has_let_go.then_some(Twist2::ZERO) }, Outcome::Ok)
    }
}

/// Ports of [`JoystickTeleop`].
#[ports]
pub struct JoystickTeleopIo {
    /// Axes and buttons of the joystick.
    #[stale(after = "200ms")]
    joy: Input<Joy>,
    /// Velocity of the robot, with the precedence of teleoperation.
    velocity: Command<Twist2>,
}

/// Parameters of [`JoystickTeleop`]; the numbers of axes and buttons begin with 0.
#[params]
pub struct JoystickTeleopParams {
    #[param(default = 4, range = 0..=31, doc = "button that must be held")]
    dead_man_button: u64,
    #[param(default = 1, range = 0..=15, doc = "axis for driving forward")]
    linear_axis: u64,
    #[param(default = 0, range = 0..=15, doc = "axis for turning left")]
    angular_axis: u64,
    #[param(default = 0.5, range = 0.0..=10.0, unit = "m/s", doc = "velocity at the end of the axis")]
    max_linear_velocity: f64,
    #[param(default = 1.0, range = 0.0..=10.0, unit = "rad/s", doc = "angular velocity at the end of the axis")]
    max_angular_velocity: f64,
}

/// Drives a robot by a joystick while a dead-man button is held.
///
/// It commands a gate for velocities. A robot with a Plan, an Execute or a ReactiveModel is commanded by its Execute alone.
pub struct JoystickTeleop;

#[module(stage = Act)]
impl Module for JoystickTeleop {
    type Io = JoystickTeleopIo;
    type Params = JoystickTeleopParams;
    type State = TeleoperationState;

    fn tick(
        state: &mut TeleoperationState,
        io: &JoystickTeleopIo,
        params: &JoystickTeleopParams,
        now: &Tick,
    ) -> Outcome {
        let assignment = AxisAssignment {
            dead_man_button: params.dead_man_button as usize,
            linear_axis: params.linear_axis as usize,
            angular_axis: params.angular_axis as usize,
            max_linear_velocity: params.max_linear_velocity,
            max_angular_velocity: params.max_angular_velocity,
        };
        let (velocity, outcome) = state.command(io.joy.fresh(), &assignment, now);
        if let Some(velocity) = velocity {
            io.velocity.send(velocity, Priority::Teleoperation);
        }
        outcome
    }
}

/// Ports of [`JoystickWheels`].
#[ports]
pub struct JoystickWheelsIo {
    /// Axes and buttons of the joystick.
    #[stale(after = "200ms")]
    joy: Input<Joy>,
    /// Speeds of two wheels, with the precedence of teleoperation.
    wheels: Command<WheelSpeeds>,
}

/// Parameters of [`JoystickWheels`]; the numbers of axes and buttons begin with 0.
#[params]
pub struct JoystickWheelsParams {
    #[param(default = 4, range = 0..=31, doc = "button that must be held")]
    dead_man_button: u64,
    #[param(default = 1, range = 0..=15, doc = "axis for driving forward")]
    linear_axis: u64,
    #[param(default = 0, range = 0..=15, doc = "axis for turning left")]
    angular_axis: u64,
    #[param(default = 0.5, range = 0.0..=10.0, unit = "m/s", doc = "velocity at the end of the axis")]
    max_linear_velocity: f64,
    #[param(default = 1.0, range = 0.0..=10.0, unit = "rad/s", doc = "angular velocity at the end of the axis")]
    max_angular_velocity: f64,
    #[param(default = 0.0975, range = 0.001..=10.0, unit = "m", doc = "radius of the wheels")]
    wheel_radius: f64,
    #[param(default = 0.331, range = 0.001..=10.0, unit = "m", doc = "distance between the wheels")]
    track: f64,
}

/// Drives a robot with two wheels by a joystick while a dead-man button is held.
///
/// As [`JoystickTeleop`], for a gate that takes the speeds of two wheels.
pub struct JoystickWheels;

#[module(stage = Act)]
impl Module for JoystickWheels {
    type Io = JoystickWheelsIo;
    type Params = JoystickWheelsParams;
    type State = TeleoperationState;

    fn tick(
        state: &mut TeleoperationState,
        io: &JoystickWheelsIo,
        params: &JoystickWheelsParams,
        now: &Tick,
    ) -> Outcome {
        let assignment = AxisAssignment {
            dead_man_button: params.dead_man_button as usize,
            linear_axis: params.linear_axis as usize,
            angular_axis: params.angular_axis as usize,
            max_linear_velocity: params.max_linear_velocity,
            max_angular_velocity: params.max_angular_velocity,
        };
        let (velocity, outcome) = state.command(io.joy.fresh(), &assignment, now);
        if let Some(Twist2 { linear, angular }) = velocity {
            let turn = angular * params.track / 2.0;
            let speeds = WheelSpeeds {
                left: (linear - turn) / params.wheel_radius,
                right: (linear + turn) / params.wheel_radius,
            };
            io.wheels.send(speeds, Priority::Teleoperation);
        }
        outcome
    }
}
