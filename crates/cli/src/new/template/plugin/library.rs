//! Drives a robot with two wheels to a target.
//!
//! `cargo test` tests it without a robot, `slate run PROJECT_NAME.toml` runs it in the simulator.

use slate_plugin::prelude::*;

/// Ports of the module; the configuration links them.
#[ports]
pub struct Io {
    /// Position of the robot.
    #[stale(after = "200ms")]
    position: Required<Position>,
    /// Heading of the robot.
    #[stale(after = "200ms")]
    orientation: Required<Orientation>,
    /// Target position.
    target: Required<Point2>,
    /// Command for the wheels.
    wheels: Command<WheelSpeeds>,
}

#[params]
pub struct Params {
    #[param(default = 0.4, range = 0.0..=1.2, unit = "m/s", doc = "maximum linear velocity")]
    max_linear_velocity: f64,
    #[param(default = 2.0, range = 0.0..=10.0, unit = "1/s", doc = "linear velocity per meter of distance to the target")]
    gain: f64,
    #[param(default = 0.05, range = 0.0..=1.0, unit = "m", doc = "distance from the target that counts as reached")]
    goal_tolerance: f64,
    #[param(default = 0.0975, range = 0.01..=1.0, unit = "m", doc = "radius of a wheel")]
    wheel_radius: f64,
    #[param(default = 0.331, range = 0.01..=2.0, unit = "m", doc = "distance between the wheels")]
    track: f64,
}

/// Module; the host owns its state and can save it.
pub struct Follower;

/// Turns to the target and drives there.
#[module(stage = Act, name = "MODULE_KIND")]
impl Module for Follower {
    type Io = Io;
    type Params = Params;
    // State between two ticks, which a reload of the code keeps.
    type State = ();

    fn tick(_: &mut (), io: &Io, params: &Params, _: &Tick) -> Outcome {
        let (Some(position), Some(orientation)) = (io.position.fresh(), io.orientation.fresh())
        else {
            // Without a pose it commands nothing, and the gate stops the wheels.
            return Outcome::Degraded;
        };
        let (x, y) = (io.target.x - position.x, io.target.y - position.y);
        let distance = math::hypot(x, y);
        if distance < params.goal_tolerance {
            io.wheels.send(WheelSpeeds::ZERO, Priority::Plan);
            return Outcome::Ok;
        }
        let error = math::angle_between(orientation.theta, math::atan2(y, x));
        // Slower while it faces away from the target, and near it.
        let speed =
            math::min(params.max_linear_velocity, params.gain * distance) * math::max(math::cos(error), 0.0);
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

    /// Returns the command at the origin with heading 0.
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
    fn drives_straight_to_a_target_ahead() {
        let wheels = wheels(Point2 { x: 2.0, y: 0.0 });
        assert_eq!(wheels.left, wheels.right);
        assert!(wheels.left > 0.0);
    }

    #[test]
    fn turns_to_a_target_beside_it() {
        let wheels = wheels(Point2 { x: 0.0, y: 1.0 });
        assert!(wheels.right > 0.0 && wheels.left < 0.0);
    }

    #[test]
    fn stands_still_at_the_target() {
        assert_eq!(wheels(Point2 { x: 0.0, y: 0.01 }), WheelSpeeds::ZERO);
    }

    #[test]
    fn commands_nothing_without_a_fresh_position() {
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
