//! Drives a robot with two wheels to a target.
//!
//! `cargo test` tests it without a robot, `slate run PROJECT_NAME.toml` runs it in the simulator.

use slate_plugin::prelude::*;

/// What it reads and writes. What these are linked to is said in the configuration.
#[ports]
pub struct Io {
    /// Where the robot is.
    #[stale(after = "200ms")]
    position: Required<Position>,
    /// Where it looks.
    #[stale(after = "200ms")]
    orientation: Required<Orientation>,
    /// Where it shall go.
    target: Required<Point2>,
    /// How its wheels shall turn.
    wheels: Command<WheelSpeeds>,
}

#[params]
pub struct Params {
    #[param(default = 0.4, range = 0.0..=1.2, unit = "m/s", doc = "how fast it goes")]
    speed: f64,
    #[param(default = 2.0, range = 0.0..=10.0, unit = "1/s", doc = "how hard it turns to the target")]
    gain: f64,
    #[param(default = 0.05, range = 0.0..=1.0, unit = "m", doc = "it has arrived within this distance")]
    tolerance: f64,
    #[param(default = 0.0975, range = 0.01..=1.0, unit = "m", doc = "radius of a wheel")]
    wheel_radius: f64,
    #[param(default = 0.331, range = 0.01..=2.0, unit = "m", doc = "distance between the wheels")]
    track: f64,
}

/// The module; its state is beside it, so that the host can save it.
pub struct Follower;

/// Turns to the target and drives there.
#[module(stage = Act, name = "MODULE_KIND")]
impl Module for Follower {
    type Io = Io;
    type Params = Params;
    // What it remembers between two ticks; it is carried over when the code is exchanged.
    type State = ();

    fn tick(_: &mut (), io: &Io, params: &Params, _: &Tick) -> Outcome {
        let (Some(position), Some(orientation)) = (io.position.fresh(), io.orientation.fresh())
        else {
            // Who does not know where it is commands nothing, and the gate stops the wheels.
            return Outcome::Degraded;
        };
        let (x, y) = (io.target.x - position.x, io.target.y - position.y);
        let distance = math::hypot(x, y);
        if distance < params.tolerance {
            io.wheels.send(WheelSpeeds::ZERO, Priority::Plan);
            return Outcome::Ok;
        }
        let error = math::angle_between(orientation.theta, math::atan2(y, x));
        // It goes only as far as it looks there, and slows down before it arrives.
        let speed =
            math::min(params.speed, params.gain * distance) * math::max(math::cos(error), 0.0);
        let turn = params.gain * error * params.track / 2.0;
        let wheel = |speed: f64| speed / params.wheel_radius;
        io.wheels.send(
            WheelSpeeds {
                left: wheel(speed - turn),
                right: wheel(speed + turn),
            },
            Priority::Plan,
        );
        Outcome::Ok
    }
}

plugin!(Follower);

#[cfg(test)]
mod tests {
    use slate_plugin::module::testing::Fixture;

    use super::*;

    /// What it commands at the origin, looking along x.
    fn wheels(target: Point2) -> WheelSpeeds {
        let mut follower = Fixture::<Follower>::new();
        follower.set(
            "position",
            Position {
                x: 0.0,
                y: 0.0,
                z: 0.0,
            },
        );
        follower.set("orientation", Orientation { theta: 0.0 });
        follower.set("target", target);
        assert_eq!(follower.tick(), Outcome::Ok);
        follower.output("wheels").unwrap()
    }

    #[test]
    fn it_drives_straight_to_what_is_ahead() {
        let wheels = wheels(Point2 { x: 2.0, y: 0.0 });
        assert_eq!(wheels.left, wheels.right);
        assert!(wheels.left > 0.0);
    }

    #[test]
    fn it_turns_to_what_is_beside_it() {
        let wheels = wheels(Point2 { x: 0.0, y: 1.0 });
        assert!(wheels.right > 0.0 && wheels.left < 0.0);
    }

    #[test]
    fn it_stands_still_where_it_shall_be() {
        assert_eq!(wheels(Point2 { x: 0.0, y: 0.01 }), WheelSpeeds::ZERO);
    }

    #[test]
    fn it_waits_for_a_place_and_commands_nothing_once_it_is_old() {
        let mut follower = Fixture::<Follower>::new();
        follower.set("target", Point2 { x: 1.0, y: 0.0 });
        assert_eq!(follower.tick().waiting_for(), Some("position"));
        follower.set("position", Position::default());
        follower.set("orientation", Orientation { theta: 0.0 });
        follower.expire("position");
        assert_eq!(follower.tick(), Outcome::Degraded);
        assert_eq!(follower.output::<WheelSpeeds>("wheels"), None);
    }
}
