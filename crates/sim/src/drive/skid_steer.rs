use serde::{Deserialize, Serialize};
use slate_module::Random;
use slate_module::math::{clamp, max};

use super::odometer::Odometer;
use super::{FourWheels, follow, held};
use crate::geometry::Point;
use crate::robot::{DriveDescription, Friction, NoiseDescription};

/// Standard gravity, m/s².
const GRAVITY: f64 = 9.80665;

/// Slip below which the friction force is proportional to it, m/s.
/// The tyre yields there; above it Coulomb friction holds.
const CREEP: f64 = 1e-3;

/// Convergence threshold of the iteration: largest speed change, m/s or rad/s.
const SETTLED: f64 = 1e-9;

/// Largest number of iterations per step.
/// Most steps need about three, and the transition from slipping to rest a few more. Each alone takes energy away.
const ITERATIONS: usize = 24;

/// Skid-steer drive: four driven wheels that all point ahead.
///
/// Each wheel exerts a friction force against the slip of its contact point: the body's velocity at that point minus
/// the speed of the tyre's surface. The force is Coulomb friction with different coefficients along and across the
/// wheel; of all forces within that ellipse it is the one of maximum dissipation (Goyal, Ruina and Papadopoulos,
/// "Planar sliding with dry friction", Wear 143, 1991). Friction per wheel and rolling resistance are those of MVSim
/// (Blanco-Claraco et al., SoftwareX 23, 2023). The reduced turn rate of such a robot, as if its track were wider,
/// results from it (Mandow et al., "Experimental kinematics for wheeled skid-steer mobile robots", IROS 2007). The
/// wheels hold their speeds regardless of the force, and each carries a quarter of the weight if the center of mass is
/// in the middle.
///
/// The forces of a step are those at the velocity at its end: the implicit Euler method. So they never add energy
/// beyond that of the wheels, regardless of the friction and the length of the step, and a robot at rest on standing
/// wheels stays at rest.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct SkidSteer {
    wheel_radius: f64,
    maximum_speed: f64,
    maximum_acceleration: f64,
    wheels: [Wheel; 4],
    pub(super) odometer: Odometer,
}

#[derive(Clone, Copy, Debug, Serialize, Deserialize)]
struct Wheel {
    /// Contact point relative to the center of mass, m.
    arm: Point,
    /// Normal force, N.
    load: f64,
    friction: Friction,
    command: f64,
    /// Wheel speed, rad/s.
    speed: f64,
}

/// Mass and moment of inertia of a body.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Mass {
    /// Mass, kg.
    pub mass: f64,
    /// Moment of inertia about the center of mass, kg m².
    pub moment: f64,
}

/// Twist of a body in its frame.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Velocity {
    /// Forward velocity of the center of mass, m/s.
    pub forward: f64,
    /// Leftward velocity of the center of mass, m/s.
    pub left: f64,
    /// Turn rate, counter-clockwise, rad/s.
    pub turn: f64,
}

impl SkidSteer {
    /// Creates a standing drive with the biases of this run.
    /// `mass` and `center` are the body's mass and center of mass.
    pub fn new(
        description: &DriveDescription,
        noise: &NoiseDescription,
        mass: f64,
        center: Point,
        random: Random,
    ) -> Self {
        let DriveDescription { wheel_radius, track, .. } = *description;
        let wheelbase = description.wheelbase.unwrap_or(track);
        // Wheels nearer to the center of mass carry more of it.
        let share = |at: f64, length: f64| clamp(0.5 + at / length, 0.0, 1.0);
        let (in_front, on_left) = (share(center.x, wheelbase), share(center.y, track));
        let all = description.friction.unwrap_or_default();
        let wheels = std::array::from_fn(|i| {
            let (front, left) = (i < 2, i % 2 == 0);
            let half = |positive: bool, length: f64| if positive { length / 2.0 } else { -length / 2.0 };
            let part = |positive: bool, share: f64| if positive { share } else { 1.0 - share };
            Wheel {
                arm: Point::new(half(front, wheelbase), half(left, track)).minus(center),
                load: mass * GRAVITY * part(front, in_front) * part(left, on_left),
                friction: description.wheel_friction.all()[i].1.unwrap_or(all),
                command: 0.0,
                speed: 0.0,
            }
        });
        let odometry_track = description.odometry_track.unwrap_or(track);
        Self {
            wheel_radius,
            maximum_speed: description.maximum_wheel_speed,
            maximum_acceleration: description.maximum_wheel_acceleration,
            wheels,
            odometer: Odometer::new(wheel_radius, odometry_track, noise, random),
        }
    }

    pub(super) fn command(&mut self, wheels: FourWheels) {
        let FourWheels { front_left, front_right, back_left, back_right } = wheels;
        let commands = [front_left, front_right, back_left, back_right];
        for (wheel, command) in self.wheels.iter_mut().zip(commands) {
            wheel.command = held(command, self.maximum_speed);
        }
    }

    /// Advances the wheels by `step` seconds.
    pub fn follow(&mut self, step: f64) {
        for wheel in &mut self.wheels {
            wheel.speed = follow(wheel.speed, wheel.command, self.maximum_acceleration * step);
        }
        let [front_left, front_right, back_left, back_right] = self.wheels.map(|wheel| wheel.speed);
        let (left, right) = ((front_left + back_left) / 2.0, (front_right + back_right) / 2.0);
        self.odometer.measure(left, right, step);
    }

    /// Returns whether no wheel turns.
    pub fn stands(&self) -> bool {
        self.wheels.iter().all(|wheel| wheel.speed == 0.0)
    }

    /// Returns the velocity of a body after friction for `step` seconds.
    pub fn rub(&self, body: Mass, before: Velocity, step: f64) -> Velocity {
        let mut velocity = before;
        // Each force is a damper's whose strength is right for the velocity of the last iteration; so each iteration
        // is a linear system, and goes downhill to the one solution there is (iteratively reweighted least squares).
        for _ in 0..ITERATIONS {
            let last = velocity;
            velocity = self.damped(body, before, last, step);
            let change = max(
                max((velocity.forward - last.forward).abs(), (velocity.left - last.left).abs()),
                (velocity.turn - last.turn).abs(),
            );
            if change <= SETTLED {
                break;
            }
        }
        velocity
    }

    fn damped(&self, body: Mass, before: Velocity, last: Velocity, step: f64) -> Velocity {
        let mut system = System {
            matrix: [[body.mass, 0.0, 0.0], [0.0, body.mass, 0.0], [0.0, 0.0, body.moment]],
            right: [body.mass * before.forward, body.mass * before.left, body.moment * before.turn],
        };
        for wheel in &self.wheels {
            let Friction { longitudinal, lateral, rolling_resistance } = wheel.friction;
            let forward = last.forward - last.turn * wheel.arm.y;
            let surface = wheel.speed * self.wheel_radius;
            let slip = Point::new(
                longitudinal * (forward - surface),
                lateral * (last.left + last.turn * wheel.arm.x),
            );
            let creep = CREEP * max(longitudinal, lateral);
            let strength = damper(wheel.load * step, slip.dot(slip), creep);
            let along = [1.0, 0.0, -wheel.arm.y];
            system.add(along, strength * longitudinal * longitudinal, surface);
            system.add([0.0, 1.0, wheel.arm.x], strength * lateral * lateral, 0.0);
            system.add(along, damper(wheel.load * rolling_resistance * step, forward * forward, CREEP), 0.0);
        }
        system.solve()
    }
}

/// Returns the damping that yields an impulse at a slip well above `creep`.
fn damper(impulse: f64, squared_slip: f64, creep: f64) -> f64 {
    // A wheel without friction has neither.
    if creep > 0.0 { impulse / (squared_slip + creep * creep).sqrt() } else { 0.0 }
}

/// Linear system for the velocity after a step: momentum before and after.
struct System {
    matrix: [[f64; 3]; 3],
    right: [f64; 3],
}

impl System {
    /// Adds a damper along a direction that goes towards a speed.
    fn add(&mut self, direction: [f64; 3], strength: f64, towards: f64) {
        for (i, row) in self.matrix.iter_mut().enumerate() {
            for (j, value) in row.iter_mut().enumerate() {
                *value += strength * direction[i] * direction[j];
            }
            self.right[i] += strength * direction[i] * towards;
        }
    }

    /// Solves the system by the square-root-free Cholesky decomposition (LDLᵀ).
    /// The matrix is symmetric and positive definite.
    fn solve(&self) -> Velocity {
        let [[a, b, c], [_, d, e], [_, _, f]] = self.matrix;
        let [x, y, z] = self.right;
        let (l21, l31) = (b / a, c / a);
        let d2 = d - l21 * b;
        let l32 = (e - l31 * b) / d2;
        let d3 = f - l31 * c - l32 * l32 * d2;
        let y = y - l21 * x;
        let turn = (z - l31 * x - l32 * y) / d3;
        let left = y / d2 - l32 * turn;
        let forward = x / a - l21 * left - l31 * turn;
        Velocity { forward, left, turn }
    }
}
