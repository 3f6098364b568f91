//! Joysticks, and driving by them.

use std::time::Duration;

use proptest::prelude::*;
use slate_drivers::DeviceProtocol;
use slate_drivers::joystick::event::{JoystickChange, JoystickEvent};
use slate_drivers::joystick::session::JoystickSession;
use slate_drivers::joystick::{JoystickTeleop, JoystickWheels};
use slate_drivers::simulated::SimulatedJoystick;
use slate_interfaces::{Joy, Twist2, WheelSpeeds};
use slate_module::prelude::*;
use slate_module::testing::Fixture;

use crate::common::{Running, at_terminal, refusal, survives_a_pulled_cable};

#[test]
fn joystick_state_arrives_and_survives_a_pulled_cable() {
    let device = at_terminal(SimulatedJoystick::default());
    let running = Running::well("joystick", device.name(), "params.deadzone = 0.1");
    running.until("all axes", || running.numbers("joy/axes").len() == 6);
    device.with(|joystick| {
        joystick.tilt(1, -32_767);
        joystick.tilt(0, 3000);
        joystick.press(4, true);
    });
    running.until("a button", || running.numbers("joy/buttons").get(4) == Some(&1.0));
    running.until("an axis", || running.numbers("joy/axes")[..2] == [0.0, 1.0]);
    // It is not moved, and still published.
    let before = running.number("status/arrival");
    std::thread::sleep(Duration::from_millis(100));
    assert_eq!(running.number("status/arrival"), before);
    assert!(running.is_well());
    survives_a_pulled_cable(&running, &device);
    running.until("its state", || running.numbers("joy/buttons").get(4) == Some(&1.0));
}

#[test]
fn joystick_drives_through_the_gate_until_it_is_pulled_out() {
    let device = at_terminal(SimulatedJoystick::default());
    let gate = "[modules.joystick_wheels]\nparams = { max_linear_velocity = 0.39 }\n[links]\n\"joystick_wheels/joy\" = \"joystick/joy\"\n[actuators.wheels]\n\
                commands = [\"joystick_wheels/wheels\"]\ntime_to_live = \"100ms\"\n\
                limits = { left = [-12.3, 12.3], right = [-12.3, 12.3] }\nsafe = { left = 0.0, right = 0.0 }";
    let running = Running::well("joystick", device.name(), gate);
    running.until("all axes", || running.numbers("joy/axes").len() == 6);
    device.with(|joystick| {
        joystick.tilt(1, -32_767);
        joystick.press(4, true);
    });
    // 0.39 m/s on wheels of 0.0975 m.
    let drives = |speed: f64| (running.number("../wheels/command/left") - speed).abs() < 1e-9;
    running.until("motion", || drives(4.0));
    device.unplug();
    running.until("standing", || drives(0.0));
    // The button is still held when it returns.
    device.plug().unwrap();
    running.until("a connection", || running.is_well());
    std::thread::sleep(Duration::from_millis(200));
    assert!(drives(0.0));
}

#[test]
fn joystick_that_is_none_is_refused() {
    assert!(refusal("joystick", "params.device = \"js0\"").contains("expected a device"));
    let running = Running::new("joystick", "/dev/input/slate-no-joystick", "");
    running.until_text("does not exist");
}

#[test]
fn axes_have_a_dead_zone_without_a_jump() {
    let axis = |value: i16| {
        let mut session = JoystickSession::new(0.2);
        let (mut joys, event) =
            (Vec::new(), JoystickEvent { time: 0, is_initial: true, change: JoystickChange::Axis(2, value) });
        session.receive(&event.bytes(), Duration::ZERO, &mut Vec::new(), &mut |joy| joys.push(*joy));
        assert_eq!(joys[0].axes.len(), 3);
        joys[0].axes[2]
    };
    assert_eq!([axis(0), axis(6000), axis(-6000)], [0.0; 3]);
    assert!(axis(-6600) > 0.0 && axis(-6600) < 0.01);
    assert_eq!([axis(32_767), axis(-32_767), axis(-32_768)], [-1.0, 1.0, 1.0]);
}

fn joy(forward: f32, left: f32, pressed: bool) -> Joy {
    Joy { axes: Sequence::new(&[left, forward]), buttons: Sequence::new(&[0, 0, 0, 0, i32::from(pressed)]) }
}

#[test]
fn teleop_drives_only_while_the_button_is_held() {
    let mut teleop = Fixture::<JoystickTeleop>::new();
    assert_eq!(teleop.tick(), Outcome::Degraded);
    teleop.set("joy", joy(1.0, -0.5, false));
    assert_eq!(teleop.tick(), Outcome::Ok);
    assert!(!teleop.wrote("velocity"));
    teleop.set("joy", joy(1.0, -0.5, true));
    teleop.tick();
    assert_eq!(teleop.output::<Twist2>("velocity"), Some(Twist2 { linear: 0.5, angular: -0.5 }));
    assert_eq!(teleop.priority("velocity"), Some(Priority::Teleoperation as u32));
    // Its release is a standstill, and after that the plan may drive.
    teleop.set("joy", joy(1.0, -0.5, false));
    teleop.tick();
    assert_eq!(teleop.output::<Twist2>("velocity"), Some(Twist2::ZERO));
    teleop.tick();
    assert!(!teleop.wrote("velocity"));
}

#[test]
fn a_held_button_does_not_drive_when_the_joystick_returns() {
    let mut teleop = Fixture::<JoystickTeleop>::new();
    teleop.set("joy", joy(1.0, 0.0, true));
    teleop.tick();
    assert!(!teleop.wrote("velocity"), "it was never seen released");
    teleop.set("joy", joy(0.0, 0.0, false));
    teleop.tick();
    teleop.set("joy", joy(1.0, 0.0, true));
    teleop.tick();
    assert!(teleop.wrote("velocity"));
    teleop.expire("joy");
    assert_eq!(teleop.tick(), Outcome::Degraded);
    assert!(!teleop.wrote("velocity"));
    teleop.set("joy", joy(1.0, 0.0, true));
    teleop.tick();
    assert!(!teleop.wrote("velocity"), "it is held since before the loss");
}

#[test]
fn teleop_without_the_axis_is_degraded() {
    let mut teleop = Fixture::<JoystickTeleop>::new();
    teleop.params().linear_axis = 7;
    teleop.set("joy", joy(1.0, 0.0, true));
    assert_eq!(teleop.tick(), Outcome::Degraded);
}

#[test]
fn teleop_of_wheels_turns_by_their_difference() {
    let mut teleop = Fixture::<JoystickWheels>::new();
    teleop.params().wheel_radius = 0.1;
    teleop.params().track = 0.4;
    teleop.set("joy", joy(0.0, 0.0, false));
    teleop.tick();
    teleop.set("joy", joy(1.0, 1.0, true));
    teleop.tick();
    let speeds = teleop.output::<WheelSpeeds>("wheels").unwrap();
    // 0.5 m/s and 1 rad/s.
    assert!((speeds.left - 3.0).abs() < 1e-12 && (speeds.right - 7.0).abs() < 1e-12);
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]

    #[test]
    fn events_survive_a_round_trip(
        time in any::<u32>(),
        is_initial in any::<bool>(),
        number in any::<u8>(),
        value in any::<i16>(),
    ) {
        for change in [JoystickChange::Axis(number, value), JoystickChange::Button(number, value > 0)] {
            let event = JoystickEvent { time, is_initial, change };
            prop_assert_eq!(JoystickEvent::parse(event.bytes()), Some(event));
        }
    }

    #[test]
    fn joystick_takes_any_bytes(bytes in proptest::collection::vec(any::<u8>(), 0..500), cut in 1_usize..50) {
        let mut session = JoystickSession::new(0.05);
        for piece in bytes.chunks(cut) {
            session.receive(piece, Duration::ZERO, &mut Vec::new(), &mut |joy| {
                assert!(joy.axes.iter().all(|axis| (-1.0..=1.0).contains(axis)));
            });
        }
    }
}
