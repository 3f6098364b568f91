//! Commands for actuators from linear and angular velocity.

use std::time::Duration;

use serde_json::{Value, json};
use slate::control::{Client, ControlsEntry};

use crate::failure::Failure;

/// Interfaces of commands that the keys support.
const COMMAND_INTERFACES: [&str; 3] = ["Twist2", "WheelSpeeds", "FourWheelSpeeds"];

/// Number of attempts to read a robot's description that is not written yet.
/// A pause follows each.
const MAX_ATTEMPTS: usize = 100;
const ATTEMPT_PAUSE: Duration = Duration::from_millis(20);

/// Kinematics of a robot, which decide its commands.
pub enum Drive {
    /// Twist of the robot's body.
    Twist,
    /// Speeds of the wheels, so many on each side.
    Wheels { per_side: usize, radius: f64, track: f64 },
}

impl Drive {
    /// Returns the drive of an actuator.
    pub fn of(client: &mut Client, controls: &ControlsEntry) -> Result<Self, Failure> {
        let per_side = match controls.interface.as_str() {
            "Twist2" => return Ok(Self::Twist),
            "WheelSpeeds" => 1,
            "FourWheelSpeeds" => 2,
            other => {
                return Err(Failure::NoKeys {
                    actuator: controls.actuator.clone(),
                    interface: other.into(),
                    known: COMMAND_INTERFACES.to_vec(),
                });
            }
        };
        let unknown = || Failure::NoChassis { actuator: controls.actuator.clone() };
        let chassis = chassis(client, &controls.actuator)?.ok_or_else(unknown)?;
        let number = |name: &str| chassis.get(name).and_then(Value::as_f64).filter(|number| *number > 0.0);
        let (radius, track) = number("wheel_radius").zip(number("track")).ok_or_else(unknown)?;
        Ok(Self::Wheels { per_side, radius, track })
    }

    /// Returns the command for a motion: m/s forward, and rad/s counter-clockwise.
    pub fn command(&self, forward: f64, turning: f64) -> Value {
        match self {
            Self::Twist => json!({ "linear": forward, "angular": turning }),
            Self::Wheels { per_side, radius, track } => {
                let left = (forward - turning * track / 2.0) / radius;
                let right = (forward + turning * track / 2.0) / radius;
                match per_side {
                    1 => json!({ "left": left, "right": right }),
                    _ => json!({
                        "front_left": left, "back_left": left, "front_right": right, "back_right": right,
                    }),
                }
            }
        }
    }
}

/// Reads the `Chassis` of the robot that an actuator moves.
fn chassis(client: &mut Client, actuator: &str) -> Result<Option<Value>, Failure> {
    let properties = client.properties(None)?.into_iter();
    let mut paths: Vec<_> =
        properties.filter(|property| property.interface == "Chassis").map(|property| property.path).collect();
    let robot = actuator.rsplit_once('/').map_or("", |(robot, _)| robot);
    if !robot.is_empty() {
        paths.retain(|path| path.starts_with(&format!("{robot}/")) || path.contains(&format!("/{robot}/")));
    }
    // An agent that has just been started has not written it yet.
    let attempts = if paths.is_empty() { 0 } else { MAX_ATTEMPTS };
    for attempt in 0..attempts {
        if attempt > 0 {
            std::thread::sleep(ATTEMPT_PAUSE);
        }
        for path in &paths {
            if let Some(reading) = client.read(&format!("/{path}"))? {
                return Ok(Some(reading.value));
            }
        }
    }
    Ok(None)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_turn_to_the_left_drives_the_right_side_forward() {
        let drive = Drive::Wheels { per_side: 1, radius: 0.1, track: 0.4 };
        assert_eq!(drive.command(0.5, 0.0), json!({ "left": 5.0, "right": 5.0 }));
        assert_eq!(drive.command(0.0, 1.0), json!({ "left": -2.0, "right": 2.0 }));
        let drive = Drive::Wheels { per_side: 2, radius: 0.1, track: 0.4 };
        assert_eq!(drive.command(0.0, 1.0)["back_right"], 2.0);
        assert_eq!(Drive::Twist.command(0.3, -1.0), json!({ "linear": 0.3, "angular": -1.0 }));
    }
}
