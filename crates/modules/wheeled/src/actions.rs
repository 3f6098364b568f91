//! Actions of RoCS's Table 2, with their decomposition, for wheeled robots.
//!
//! | action | decomposition |
//! |---|---|
//! | `SetWheelSpeed` | atomic |
//! | `TurnAngle` | atomic |
//! | `AvoidObstacle` | `TurnAngle`; `SetWheelSpeed` |
//! | `GoToOrigin` | `TurnToOrigin`; `SetWheelSpeed` |
//! | `TurnToOrigin` | `TurnAngle` |
//!
//! Two more are not in the table, so that everybody sees which reflex has the robot:
//!
//! | action | decomposition |
//! |---|---|
//! | `ReleaseBumper` | `SetWheelSpeed`, within a time limit |
//! | `KeepWall` | `SetWheelSpeed` |

use serde::{Deserialize, Serialize};
use slate_plugin::interfaces::WheelSpeeds;
use slate_plugin::prelude::*;

use crate::body::{BodyModel, WheeledBody};

/// Turns the wheels for a duration.
#[derive(Serialize, Deserialize)]
pub struct SetWheelSpeed {
    speeds: Speeds,
    left: f64,
}

/// Arguments of [`SetWheelSpeed`].
#[derive(Clone, Copy, Serialize, Deserialize)]
pub struct Speeds {
    /// Radians per second.
    pub left: f64,
    /// Radians per second.
    pub right: f64,
    /// Duration, seconds.
    pub duration: f64,
}
arguments!(Speeds { left, right, duration });

impl ActionKind for SetWheelSpeed {
    const KIND: &'static str = "SetWheelSpeed";
    type Arguments = Speeds;

    fn start(speeds: Speeds) -> Self {
        Self { left: speeds.duration, speeds }
    }
}

impl<B: WheeledBody> Action<B> for SetWheelSpeed {
    fn act(&mut self, acting: &Acting<'_, B>) -> Step {
        if self.left <= 0.0 {
            return Step::Done;
        }
        self.left -= acting.now.elapsed();
        let Speeds { left, right, .. } = self.speeds;
        acting.body.turn_wheels(WheelSpeeds { left, right }, acting.priority);
        Step::Running
    }
}

/// Turns on the spot by an angle.
///
/// It measures the turn by the pose. While that is unknown, it continues by the odometry, and without odometry by its own commands: a
/// reflex does without the deliberative route.
#[derive(Serialize, Deserialize)]
pub struct TurnAngle {
    turn: Turn,
    /// Goal heading, while the pose is known.
    heading: Option<f64>,
    /// Remaining angle at the newest tick, radians.
    #[serde(default)]
    remaining: Option<f64>,
    /// Heading by the odometry at the newest tick, radians.
    #[serde(default)]
    odometry: Option<f64>,
    /// Newest command, radians per second.
    #[serde(default)]
    commanded: f64,
}

/// Arguments of [`TurnAngle`].
#[derive(Clone, Copy, Serialize, Deserialize)]
pub struct Turn {
    /// Radians, counter-clockwise.
    pub angle: f64,
    /// Radians per second, greater than zero; else the action fails.
    pub speed: f64,
}
arguments!(Turn { angle, speed });

/// Tolerance of the goal heading, radians.
const HEADING_TOLERANCE: f64 = 0.1;

impl ActionKind for TurnAngle {
    const KIND: &'static str = "TurnAngle";
    type Arguments = Turn;

    fn start(turn: Turn) -> Self {
        Self { turn, heading: None, remaining: None, odometry: None, commanded: 0.0 }
    }
}

impl TurnAngle {
    /// Returns the remaining angle, radians, after the seconds since the newest tick.
    fn advance(&mut self, model: &BodyModel, elapsed: f64) -> f64 {
        let before = std::mem::replace(&mut self.odometry, model.odometry_heading());
        let remaining = self.remaining.unwrap_or(self.turn.angle);
        let remaining = if let Some(pose) = model.pose() {
            let heading = *self.heading.get_or_insert_with(|| math::wrap_angle(pose.theta + remaining));
            math::angle_between(pose.theta, heading)
        } else {
            // The next known heading may be another one.
            self.heading = None;
            let turned = match (before, self.odometry) {
                (Some(before), Some(after)) => math::angle_between(before, after),
                _ => self.commanded * elapsed,
            };
            math::wrap_angle(remaining - turned)
        };
        self.remaining = Some(remaining);
        remaining
    }
}

impl<B: WheeledBody> Action<B> for TurnAngle {
    fn act(&mut self, acting: &Acting<'_, B>) -> Step {
        let model = acting.body.model();
        if self.turn.speed.is_nan() || self.turn.speed <= 0.0 {
            // The wheels would contradict the angle, and the turn would never end.
            acting.now.warn(format_args!(
                "TurnAngle: expected a speed greater than 0 rad/s, found {}; the sign of the angle gives the side",
                self.turn.speed
            ));
            return Step::Failed;
        }
        let error = self.advance(model, acting.now.elapsed());
        if error.abs() < HEADING_TOLERANCE {
            return Step::Done;
        }
        // Slower near the heading, so that the turn does not overshoot.
        self.commanded = math::clamp(4.0 * error, -self.turn.speed, self.turn.speed);
        acting.body.turn_wheels(model.wheels_for(0.0, self.commanded), acting.priority);
        Step::Running
    }
}

/// Turns towards a place.
#[derive(Serialize, Deserialize)]
pub struct TurnToOrigin {
    x: f64,
    y: f64,
    turn: Option<TurnAngle>,
}

impl ActionKind for TurnToOrigin {
    const KIND: &'static str = "TurnToOrigin";
    type Arguments = (f64, f64);

    fn start((x, y): (f64, f64)) -> Self {
        Self { x, y, turn: None }
    }

    fn children(&self, tree: &mut ActionTree) {
        if let Some(turn) = &self.turn {
            tree.child(turn);
        }
    }
}

impl<B: WheeledBody> Action<B> for TurnToOrigin {
    fn act(&mut self, acting: &Acting<'_, B>) -> Step {
        if self.turn.is_none() {
            let Some(pose) = acting.body.model().pose() else { return Step::Failed };
            let angle = math::angle_between(pose.theta, math::atan2(self.y - pose.y, self.x - pose.x));
            self.turn = Some(TurnAngle::start(Turn { angle, speed: 1.2 }));
        }
        self.turn.as_mut().map_or(Step::Failed, |turn| turn.act(acting))
    }
}

/// Drives to a goal position without obstacle avoidance.
/// Its name is that of the paper's Table 2, where the goal is the origin.
///
/// Where sonars err it weaves, so that they hear faces beyond their greatest incidence.
#[derive(Serialize, Deserialize)]
pub struct GoToOrigin {
    leg: Leg,
    turn: Option<TurnToOrigin>,
    drive: Option<SetWheelSpeed>,
}

/// Arguments of [`GoToOrigin`].
#[derive(Clone, Copy, Serialize, Deserialize)]
pub struct Leg {
    /// Position to the east, meters.
    pub x: f64,
    /// Position to the north, meters.
    pub y: f64,
    /// Linear velocity, meters per second.
    /// With one below zero the action fails.
    pub speed: f64,
    /// Tolerance, meters.
    pub tolerance: f64,
}
arguments!(Leg { x, y, speed, tolerance });

/// Beyond this the robot first turns on the spot, radians.
const TURN_FIRST: f64 = 0.2;

impl ActionKind for GoToOrigin {
    const KIND: &'static str = "GoToOrigin";
    type Arguments = Leg;

    fn start(leg: Leg) -> Self {
        Self { leg, turn: None, drive: None }
    }

    fn children(&self, tree: &mut ActionTree) {
        match (&self.turn, &self.drive) {
            (Some(turn), _) => tree.child(turn),
            (None, Some(drive)) => tree.child(drive),
            (None, None) => {}
        }
    }
}

impl<B: WheeledBody> Action<B> for GoToOrigin {
    fn act(&mut self, acting: &Acting<'_, B>) -> Step {
        let model = acting.body.model();
        let Some(pose) = model.pose() else { return Step::Failed };
        if self.leg.speed < 0.0 {
            // It would back, where no sensor of a reflex looks.
            acting.now.warn(format_args!("{} goes forward, not at {} m/s", Self::KIND, self.leg.speed));
            return Step::Failed;
        }
        let (dx, dy) = (self.leg.x - pose.x, self.leg.y - pose.y);
        let distance = math::hypot(dx, dy);
        if distance < self.leg.tolerance {
            return Step::Done;
        }
        let error = math::angle_between(pose.theta, math::atan2(dy, dx));
        let weave = model.weave(distance);
        let aside = weave.map_or(0.0, |weave| weave.amplitude);
        if self.turn.is_none() && error.abs() > TURN_FIRST + aside {
            self.turn = Some(TurnToOrigin::start((self.leg.x, self.leg.y)));
        }
        match self.turn.as_mut().map(|turn| turn.act(acting)) {
            Some(Step::Running) => return Step::Running,
            Some(Step::Failed) => return Step::Failed,
            // The wheels must not wait for the next cycle.
            Some(Step::Done) | None => self.turn = None,
        }
        // Slower at the end; towards the goal on an arc.
        let linear = model.approach_speed(self.leg.speed, distance);
        let angular = weave.map_or(2.0 * error, |weave| 4.0 * (error + weave.offset));
        let speeds = model.wheels_for(linear, math::clamp(angular, -1.5, 1.5));
        let drive = self.drive.insert(SetWheelSpeed::start(Speeds {
            left: speeds.left,
            right: speeds.right,
            duration: 1.0,
        }));
        drive.act(acting)
    }
}

/// Turns away from an obstacle and drives on.
#[derive(Serialize, Deserialize)]
pub struct AvoidObstacle {
    evasion: Evasion,
    /// First turn; `None` when it is done.
    turn: Option<TurnAngle>,
    drive: SetWheelSpeed,
}

/// Arguments of [`AvoidObstacle`].
#[derive(Clone, Copy, Serialize, Deserialize)]
pub struct Evasion {
    /// Turn on the spot that comes first, radians.
    pub angle: f64,
    /// Then the left wheel, radians per second.
    pub left: f64,
    /// Velocity of the right wheel, radians per second.
    pub right: f64,
    /// Duration, seconds.
    pub duration: f64,
}
arguments!(Evasion { angle, left, right, duration });

impl ActionKind for AvoidObstacle {
    const KIND: &'static str = "AvoidObstacle";
    type Arguments = Evasion;

    fn start(evasion: Evasion) -> Self {
        let Evasion { angle, left, right, duration } = evasion;
        Self {
            evasion,
            turn: (angle != 0.0).then(|| TurnAngle::start(Turn { angle, speed: 1.0 })),
            drive: SetWheelSpeed::start(Speeds { left, right, duration }),
        }
    }

    /// Restarts with a new evasion, unless it turns to the other side.
    /// A turn is finished first: the robot would waver before an obstacle.
    fn renew(&mut self, evasion: Evasion) {
        if self.turn.is_none() || self.evasion.angle * evasion.angle >= 0.0 {
            *self = Self::start(evasion);
        }
    }

    fn children(&self, tree: &mut ActionTree) {
        match &self.turn {
            Some(turn) => tree.child(turn),
            None => tree.child(&self.drive),
        }
    }
}

impl<B: WheeledBody> Action<B> for AvoidObstacle {
    fn act(&mut self, acting: &Acting<'_, B>) -> Step {
        match self.turn.as_mut().map(|turn| turn.act(acting)) {
            Some(Step::Running) => return Step::Running,
            Some(Step::Failed) => return Step::Failed,
            Some(Step::Done) | None => self.turn = None,
        }
        self.drive.act(acting)
    }
}

/// Defines an action that is [`SetWheelSpeed`] under a name of its own.
macro_rules! named_drive {
    ($(#[$attribute:meta])* $name:ident) => {
        $(#[$attribute])*
        #[derive(Serialize, Deserialize)]
        pub struct $name {
            drive: SetWheelSpeed,
        }

        impl ActionKind for $name {
            const KIND: &'static str = stringify!($name);
            type Arguments = Speeds;

            fn start(speeds: Speeds) -> Self {
                Self { drive: SetWheelSpeed::start(speeds) }
            }

            fn children(&self, tree: &mut ActionTree) {
                tree.child(&self.drive);
            }
        }

        impl<B: WheeledBody> Action<B> for $name {
            fn act(&mut self, acting: &Acting<'_, B>) -> Step {
                self.drive.act(acting)
            }
        }
    };
}
named_drive! {
    /// Follows a wall.
    KeepWall
}

/// Drives away from a contact.
/// It stops when that has not helped within a time limit.
#[derive(Serialize, Deserialize)]
pub struct ReleaseBumper {
    drive: SetWheelSpeed,
    /// Remaining time until it stops, seconds.
    left: f64,
}

/// Arguments of [`ReleaseBumper`].
#[derive(Clone, Copy, Serialize, Deserialize)]
pub struct Release {
    /// Left wheel, radians per second.
    pub left: f64,
    /// Right wheel, radians per second.
    pub right: f64,
    /// Duration after the last contact, seconds.
    pub duration: f64,
    /// Time limit of the drive, renewals included, seconds.
    pub time_limit: f64,
}
arguments!(Release { left, right, duration, time_limit });

impl ActionKind for ReleaseBumper {
    const KIND: &'static str = "ReleaseBumper";
    type Arguments = Release;

    fn start(Release { left, right, duration, time_limit }: Release) -> Self {
        Self { drive: SetWheelSpeed::start(Speeds { left, right, duration }), left: time_limit }
    }

    /// Restarts the drive; the time limit continues.
    fn renew(&mut self, release: Release) {
        *self = Self { left: self.left, ..Self::start(release) };
    }

    fn children(&self, tree: &mut ActionTree) {
        tree.child(&self.drive);
    }
}

impl<B: WheeledBody> Action<B> for ReleaseBumper {
    fn act(&mut self, acting: &Acting<'_, B>) -> Step {
        self.left -= acting.now.elapsed();
        if self.left < 0.0 {
            // No direction helps: the robot stands until the contact ends.
            self.drive.speeds.left = 0.0;
            self.drive.speeds.right = 0.0;
        }
        self.drive.act(acting)
    }
}
