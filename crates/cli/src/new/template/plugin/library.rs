//! Drives a robot with two wheels to a target.
//!
//! `cargo test` tests it without a robot, `slate run PROJECT_NAME.toml` runs it in the simulator.

use slate_plugin::prelude::*;

/// Ports; the configuration links them.
#[ports]
pub struct Io {
    /// Position in the map frame.
    #[stale(after = "200ms")]
    position: Required<Position>,
    /// Heading in the map frame.
    #[stale(after = "200ms")]
    orientation: Required<Orientation>,
    /// Target in the map frame.
    target: Required<Point2>,
    /// Setpoints of the two wheels.
    wheels: Command<WheelSpeeds>,
}

#[params]
pub struct Params {
    #[param(default = 0.4, range = 0.0..=1.2, unit = "m/s", doc = "maximum speed")]
    speed: f64,
    #[param(default = 2.0, range = 0.0..=10.0, unit = "1/s", doc = "gain on distance and heading error")]
    gain: f64,
    #[param(default = 0.05, range = 0.0..=1.0, unit = "m", doc = "distance at which it has arrived")]
    tolerance: f64,
    #[param(default = 0.0975, range = 0.01..=1.0, unit = "m", doc = "radius of a wheel")]
    wheel_radius: f64,
    #[param(default = 0.331, range = 0.01..=2.0, unit = "m", doc = "distance between the wheels")]
    track: f64,
}

/// The module; the host keeps its state.
pub struct Follower;

/// Turns to the target and drives there.
#[module(stage = Act, name = "MODULE_KIND")]
impl Module for Follower {
    type Io = Io;
    type Params = Params;
    // Kept between ticks, and by a reload.
    type State = ();

    fn tick(_: &mut (), io: &Io, params: &Params, _: &Tick) -> Outcome {
        let (Some(position), Some(orientation)) = (io.position.fresh(), io.orientation.fresh())
        else {
            // Without a fresh pose it commands nothing, and the gate stops the wheels.
            return Outcome::Degraded;
        };
        let (x, y) = (io.target.x - position.x, io.target.y - position.y);
        let distance = math::hypot(x, y);
        if distance < params.tolerance {
            io.wheels.send(WheelSpeeds::ZERO, Priority::Plan);
            return Outcome::Ok;
        }
        let error = math::angle_between(orientation.theta, math::atan2(y, x));
        // It slows down near the target, and while it faces elsewhere.
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

    /// The command at the origin, with heading 0.
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
    fn robot_drives_straight_to_a_target_ahead() {
        let wheels = wheels(Point2 { x: 2.0, y: 0.0 });
        assert_eq!(wheels.left, wheels.right);
        assert!(wheels.left > 0.0);
    }

    #[test]
    fn robot_turns_to_a_target_beside_it() {
        let wheels = wheels(Point2 { x: 0.0, y: 1.0 });
        assert!(wheels.right > 0.0 && wheels.left < 0.0);
    }

    #[test]
    fn robot_stops_at_the_target() {
        assert_eq!(wheels(Point2 { x: 0.0, y: 0.01 }), WheelSpeeds::ZERO);
    }

    #[test]
    fn commands_need_a_fresh_position() {
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
