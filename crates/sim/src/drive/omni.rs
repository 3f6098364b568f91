use serde::{Deserialize, Serialize};
use slate_module::Random;
use slate_module::math::{cos, max, sin, wrap_angle};

use super::{Velocity, Wheels, held};
use crate::geometry::Pose;
use crate::robot::{DriveDescription, NoiseDescription, OdometryDescription};

/// Smallest relative determinant of wheel arrangements that determine the motion.
/// The determinant is that of the normal equations, relative to that of three wheels in a star.
const LEAST_DETERMINANT: f64 = 1e-6;

/// Three or four omni wheels on a circle.
/// They roll along it and slide freely across.
///
/// The speed of a wheel's rim is the body's velocity along the circle at that wheel; the body's velocity is the
/// least-squares fit over all wheels (Siegwart, Nourbakhsh and Scaramuzza, 2011, *Introduction to Autonomous Mobile
/// Robots*, 3.2.3 and 3.2.5). All wheels reach the speeds of a command at the same time, so an accelerating robot goes
/// straight.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Omni {
    description: DriveDescription,
    wheels: Vec<OmniWheel>,
    odometer: OmniOdometer,
}

#[derive(Clone, Copy, Debug, Serialize, Deserialize)]
struct OmniWheel {
    /// Rim speed per forward velocity, leftward velocity and turn rate of the body.
    rim: [f64; 3],
    /// Forward velocity, leftward velocity and turn rate per rim speed.
    effect: [f64; 3],
    command: f64,
    /// Wheel speed, rad/s.
    speed: f64,
}

/// Dead reckoning from the encoders of all wheels.
#[derive(Clone, Debug, Serialize, Deserialize)]
struct OmniOdometer {
    /// Factors on the wheels' radii, and on the turn, as assumed by odometry.
    believed: (Vec<f64>, f64),
    white: f64,
    /// Scale factors of distance and rotation from the odometry's profile.
    scale: (f64, f64),
    random: Random,
    pose: Pose,
    /// Forward speed and turn rate by odometry, m/s and rad/s.
    measured: (f64, f64),
}

impl Omni {
    /// Creates a standing drive with the biases of this run.
    /// It does not move if its wheels do not determine the motion.
    pub fn new(description: DriveDescription, noise: &NoiseDescription, mut random: Random) -> Self {
        let rims = rims(&description);
        let effects = effects(&rims).unwrap_or_else(|| vec![[0.0; 3]; rims.len()]);
        let wheel = |(rim, effect)| OmniWheel { rim, effect, command: 0.0, speed: 0.0 };
        let wheels: Vec<_> = rims.into_iter().zip(effects).map(wheel).collect();
        let mut factor = |deviation: f64| 1.0 + deviation * random.normal();
        let radii = wheels.iter().map(|_| factor(noise.wheel_radius_bias)).collect();
        let believed = (radii, factor(noise.track_bias));
        let odometer = OmniOdometer {
            believed,
            white: noise.wheel_speed,
            scale: (1.0, 1.0),
            random,
            pose: Pose::default(),
            measured: (0.0, 0.0),
        };
        Self { description, wheels, odometer }
    }

    /// Sets the speeds of the wheels, rad/s, in their order.
    pub(super) fn command(&mut self, speeds: impl IntoIterator<Item = f64>) {
        let limit = self.description.maximum_wheel_speed;
        for (wheel, speed) in self.wheels.iter_mut().zip(speeds) {
            wheel.command = held(speed, limit);
        }
    }

    /// Sets the wheel speeds for a velocity.
    /// A velocity beyond the limits is scaled, so it keeps its direction.
    pub(super) fn command_velocity(&mut self, velocity: Velocity) {
        let Velocity { forward, left, turn } = velocity;
        let DriveDescription { wheel_radius, maximum_wheel_speed: limit, .. } = self.description;
        let is_finite = forward.is_finite() && left.is_finite() && turn.is_finite();
        let speed = |wheel: &OmniWheel| dot(wheel.rim, [forward, left, turn]) / wheel_radius;
        let fastest = self.wheels.iter().map(|wheel| speed(wheel).abs()).fold(limit, max);
        let part = if is_finite { limit / fastest } else { 0.0 };
        for wheel in &mut self.wheels {
            wheel.command = if is_finite { part * speed(wheel) } else { 0.0 };
        }
    }

    /// Commands the motion of a differential drive with these wheel speeds.
    pub(super) fn command_sides(&mut self, Wheels { left, right }: Wheels) {
        let DriveDescription { wheel_radius, track, .. } = self.description;
        let forward = (left + right) / 2.0 * wheel_radius;
        let turn = (right - left) / track * wheel_radius;
        self.command_velocity(Velocity { forward, left: 0.0, turn });
    }

    /// Advances the wheels by `step` seconds; returns the body's velocity.
    /// The velocity is that of the body's middle.
    pub fn advance(&mut self, step: f64) -> Velocity {
        let DriveDescription { wheel_radius, maximum_wheel_acceleration, .. } = self.description;
        let mut velocity = [0.0; 3];
        let change = maximum_wheel_acceleration * step;
        let farthest = self.wheels.iter().map(|wheel| (wheel.command - wheel.speed).abs()).fold(change, max);
        for wheel in &mut self.wheels {
            wheel.speed += change / farthest * (wheel.command - wheel.speed);
            add(&mut velocity, wheel.effect, wheel.speed * wheel_radius);
        }
        self.odometer.measure(&self.wheels, wheel_radius, step);
        let [forward, left, turn] = velocity;
        Velocity { forward, left, turn }
    }

    /// Adds systematic errors of this run's odometry, from a separate random stream.
    pub(super) fn set_bias(&mut self, bias: &OdometryDescription, mut random: Random) {
        let mut factor = |deviation: f64| 1.0 + deviation * random.normal();
        self.odometer.scale = (factor(bias.distance_bias), factor(bias.turn_bias));
    }

    /// Returns pose, forward speed and turn rate by odometry.
    pub(super) fn odometry(&self) -> (Pose, (f64, f64)) {
        (self.odometer.pose, self.odometer.measured)
    }
}

impl OmniOdometer {
    /// Integrates the wheel speeds over `step` seconds.
    fn measure(&mut self, wheels: &[OmniWheel], wheel_radius: f64, step: f64) {
        let mut velocity = [0.0; 3];
        for (wheel, radius) in wheels.iter().zip(&self.believed.0) {
            let rim = wheel.speed * wheel_radius * radius * (1.0 + self.white * self.random.normal());
            add(&mut velocity, wheel.effect, rim);
        }
        let (distance, turn) = self.scale;
        let (forward, left) = (distance * velocity[0], distance * velocity[1]);
        let angular = turn * velocity[2] / self.believed.1;
        self.measured = (forward, angular);
        let middle = self.pose.theta + angular * step / 2.0;
        let (cosine, sine) = (cos(middle), sin(middle));
        self.pose.x += (forward * cosine - left * sine) * step;
        self.pose.y += (forward * sine + left * cosine) * step;
        self.pose.theta = wrap_angle(self.pose.theta + angular * step);
    }
}

/// Returns the rim speed of each wheel per body velocity.
fn rims(description: &DriveDescription) -> Vec<[f64; 3]> {
    let angles = description.wheel_angles.iter().flat_map(|angles| angles.degrees());
    let rim = |degrees: &f64| {
        let angle = degrees.to_radians();
        [-sin(angle), cos(angle), description.track / 2.0]
    };
    angles.map(rim).collect()
}

/// Returns the body velocity per wheel speed: the pseudoinverse of all rims.
fn effects(rims: &[[f64; 3]]) -> Option<Vec<[f64; 3]>> {
    let mut matrix = [[0.0; 3]; 3];
    for rim in rims {
        for (row, own) in matrix.iter_mut().zip(rim) {
            add(row, *rim, *own);
        }
    }
    let [a, b, c] = matrix;
    let columns = [cross(b, c), cross(c, a), cross(a, b)];
    let determinant = dot(a, columns[0]);
    let radius = rims.first().map_or(0.0, |rim| rim[2]);
    // A star of three wheels has 27/4 of the squared radius.
    let is_determined = determinant > LEAST_DETERMINANT * 6.75 * radius * radius;
    // The matrix is symmetric, as its inverse is.
    let effect = |rim: &[f64; 3]| columns.map(|column| dot(column, *rim) / determinant);
    is_determined.then(|| rims.iter().map(effect).collect())
}

fn dot(a: [f64; 3], b: [f64; 3]) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

fn cross(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

fn add(sum: &mut [f64; 3], vector: [f64; 3], factor: f64) {
    sum.iter_mut().zip(vector).for_each(|(sum, value)| *sum += value * factor);
}
