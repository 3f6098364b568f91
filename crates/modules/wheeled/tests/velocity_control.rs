//! Wheels of a robot at a commanded velocity.
#![allow(clippy::unwrap_used, reason = "a test that fails panics")]

use slate::interfaces::{Chassis, Twist2, WheelSpeeds};
use slate::module::testing::Fixture;
use slate::module::{Outcome, Sequence, Text};
use slate_wheeled::velocity_control::VelocityControl;

fn control() -> Fixture<VelocityControl> {
    let mut control = Fixture::new();
    control.set(
        "chassis",
        Chassis {
            wheel_radius: 0.1,
            track: 0.4,
            maximum_wheel_speed: 10.0,
            maximum_wheel_acceleration: 20.0,
            outline: Sequence::default(),
            model: Text::new("pioneer_p3dx"),
        },
    );
    control
}

#[test]
fn a_velocity_holds_until_it_is_old() {
    let mut control = control();
    control.set("velocity", Twist2 { linear: 0.5, angular: 0.0 });
    control.tick();
    assert!(control.wrote("wheels"));
    control.advance(150_000_000);
    assert_eq!(control.tick().outcome(), Some(Outcome::Ok));
    control.advance(60_000_000);
    assert_eq!(control.tick().outcome(), Some(Outcome::Degraded), "who set it may be gone");
    assert!(!control.wrote("wheels"));
}

#[test]
fn a_velocity_without_a_timeout_holds_until_the_next_one() {
    let mut control = control();
    control.params().velocity_timeout = 0.0;
    control.tick();
    assert!(!control.wrote("wheels"), "without a velocity, the gate has its safe command");
    control.set("velocity", Twist2 { linear: 0.5, angular: 1.0 });
    for _ in 0..3 {
        control.tick();
        let wheels = control.output::<WheelSpeeds>("wheels").unwrap();
        assert!((wheels.left - 3.0).abs() < 1e-12 && (wheels.right - 7.0).abs() < 1e-12, "{wheels:?}");
    }
}

#[test]
fn wheels_beyond_their_limit_keep_the_curve() {
    let mut control = control();
    control.set("velocity", Twist2 { linear: 2.0, angular: 0.0 });
    control.tick();
    let straight = control.output::<WheelSpeeds>("wheels").unwrap();
    assert_eq!((straight.left, straight.right), (10.0, 10.0));
    control.set("velocity", Twist2 { linear: 1.0, angular: 5.0 });
    control.tick();
    let curve = control.output::<WheelSpeeds>("wheels").unwrap();
    assert_eq!((curve.left, curve.right), (0.0, 10.0));
}

#[test]
fn a_velocity_that_is_no_number_commands_nothing() {
    let mut control = control();
    control.set("velocity", Twist2 { linear: f64::NAN, angular: 0.0 });
    assert_eq!(control.tick().outcome(), Some(Outcome::Degraded));
    assert!(!control.wrote("wheels"));
}
