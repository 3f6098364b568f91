use std::ops::Mul;

use slate_blackboard::interface::Descriptor;

use super::blackboard::{ABSENT, call_with_sink};
use super::{Effect, HostedService, Service, call_table, service};
use crate::table::{Bytes, DONE, Sink};
use crate::{Refusal, math};

call_table! {
    /// Transforms between frames, now or some seconds ago: a frame tree with time.
    /// It reads all properties of the interface `Transform` (of slate-interfaces) on the agent's blackboard.
    ///
    /// Frames are named as in ROS's REP-105, such as `map`, `odom` and `base_link`. A module publishes
    /// the pose of a frame in its parent with an ordinary `Output<Transform>`. A tick sees the transforms written
    /// before it began. The frames of a removed property keep their last pose.
    ///
    /// ```
    /// use slate_module::aspect::{Aspect, Transforms};
    /// use slate_module::prelude::*;
    ///
    /// /// A place that a laser sees.
    /// #[interface]
    /// pub struct Place {
    ///     /// Meters, ahead.
    ///     #[unit("m")] pub x: f64,
    ///     /// Meters, to the left.
    ///     #[unit("m")] pub y: f64,
    /// }
    ///
    /// #[ports]
    /// pub struct Io {
    ///     seen: Required<Place>,
    ///     on_the_map: Output<Place>,
    ///     transforms: Aspect<Transforms>,
    /// }
    ///
    /// /// Tells where on the map something is that the laser sees.
    /// pub struct Locator;
    ///
    /// #[module(stage = SensorProcess)]
    /// impl Module for Locator {
    ///     type Io = Io;
    ///     type Params = ();
    ///     type State = ();
    ///
    ///     fn tick(_: &mut (), io: &Io, _: &(), now: &Tick) -> Outcome {
    ///         match io.transforms.lookup("map", "laser", io.seen.stamp().time) {
    ///             Ok(laser) => {
    ///                 let [x, y, _] = laser.point([io.seen.x, io.seen.y, 0.0]);
    ///                 io.on_the_map.set(Place { x, y });
    ///                 Outcome::Ok
    ///             }
    ///             Err(reason) => {
    ///                 now.warn(format_args!("{reason}"));
    ///                 Outcome::Degraded
    ///             }
    ///         }
    ///     }
    /// }
    /// # fn main() {}
    /// ```
    pub struct Transforms {
        /// Returns the pose of the second frame in the first one at a time, ns.
        /// [`LATEST`] is the newest time at which it is known.
        fn lookup(Bytes, Bytes, u64, *mut RigidTransform, *const Sink) -> i32;
        /// Returns the newest time at which a frame is known in another one, ns.
        /// [`ABSENT`] if neither moves in the other.
        fn latest_common_time(Bytes, Bytes, *mut u64, *const Sink) -> i32;
        /// Lists all frames, a line each.
        fn frames(*const Sink) -> i32;
    }
}

/// Value of a time for the newest one.
pub const LATEST: u64 = u64::MAX;

// SAFETY: plain C data; the host gives each module a service of its own, which is used in the module's tick alone.
unsafe impl Service for Transforms {
    const DESCRIPTOR: &'static Descriptor =
        &service::<Self>("transforms 1", "Transforms between frames, now or some seconds ago.");
}

impl HostedService for Transforms {
    const EFFECT: Effect = Effect::Reads;
}

/// Rigid transform: pose of a frame in another one.
/// It transforms coordinates of the one to coordinates of the other.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RigidTransform {
    /// Position of the origin: x, y, z, m.
    pub translation: [f64; 3],
    /// Orientation of the axes: unit quaternion x, y, z, w.
    pub rotation: [f64; 4],
}

impl Default for RigidTransform {
    fn default() -> Self {
        Self::IDENTITY
    }
}

impl RigidTransform {
    /// Identity transform.
    pub const IDENTITY: Self = Self { translation: [0.0; 3], rotation: [0.0, 0.0, 0.0, 1.0] };

    /// Returns a pose in the plane: x and y, m; yaw, rad, counter-clockwise.
    pub fn planar(x: f64, y: f64, yaw: f64) -> Self {
        let (sin, cos) = (math::sin(yaw / 2.0), math::cos(yaw / 2.0));
        Self { translation: [x, y, 0.0], rotation: [0.0, 0.0, sin, cos] }
    }

    /// Transforms a point, m.
    pub fn point(&self, point: [f64; 3]) -> [f64; 3] {
        add(self.translation, self.vector(point))
    }

    /// Transforms a direction or a velocity: rotation without translation.
    pub fn vector(&self, vector: [f64; 3]) -> [f64; 3] {
        let [x, y, z, w] = self.rotation;
        let twice = cross([x, y, z], vector).map(|part| 2.0 * part);
        add(add(vector, twice.map(|part| w * part)), cross([x, y, z], twice))
    }

    /// Returns the inverse transform.
    pub fn inverse(&self) -> Self {
        let [x, y, z, w] = self.rotation;
        let turned = Self { translation: [0.0; 3], rotation: [-x, -y, -z, w] };
        Self { translation: turned.vector(self.translation).map(|part| -part), ..turned }
    }

    /// Returns the yaw in the plane, rad, counter-clockwise from the x axis.
    pub fn yaw(&self) -> f64 {
        let [x, y, z, w] = self.rotation;
        math::atan2(2.0 * (w * z + x * y), 1.0 - 2.0 * (y * y + z * z))
    }
}

/// Composition of transforms: `map_to_base * base_to_laser`.
/// The result is the other pose in this frame's parent.
impl Mul for RigidTransform {
    type Output = Self;

    fn mul(self, other: Self) -> Self {
        let ([ax, ay, az, aw], [bx, by, bz, bw]) = (self.rotation, other.rotation);
        Self {
            translation: self.point(other.translation),
            rotation: [
                aw * bx + ax * bw + ay * bz - az * by,
                aw * by - ax * bz + ay * bw + az * bx,
                aw * bz + ax * by - ay * bx + az * bw,
                aw * bw - ax * bx - ay * by - az * bz,
            ],
        }
    }
}

fn add([ax, ay, az]: [f64; 3], [bx, by, bz]: [f64; 3]) -> [f64; 3] {
    [ax + bx, ay + by, az + bz]
}

fn cross([ax, ay, az]: [f64; 3], [bx, by, bz]: [f64; 3]) -> [f64; 3] {
    [ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx]
}

impl Transforms {
    /// Returns the pose of `source` in `target` at a time, ns.
    /// It transforms coordinates in `source` to coordinates in `target`. Between two known times the translation is
    /// linear and the rotation of constant rate; there is no extrapolation.
    ///
    /// # Errors
    /// When a frame is not known, they are not connected, or an edge between them is not known at that time. While a
    /// robot starts that is usual.
    pub fn lookup(&self, target: &str, source: &str, time: u64) -> Result<RigidTransform, Refusal> {
        let mut place = RigidTransform::IDENTITY;
        let (target, source) = (Bytes::of(target), Bytes::of(source));
        // SAFETY: everything lives during the call.
        let (code, reason) = call_with_sink(|sink| unsafe {
            (self.lookup)(self.context, target, source, time, &raw mut place, sink)
        });
        if code == DONE { Ok(place) } else { Err(Refusal(reason)) }
    }

    /// Returns the pose of `source` in `target` at their newest common time.
    /// That is the newest time at which all frames between them are known.
    ///
    /// # Errors
    /// As for [`lookup`](Transforms::lookup).
    pub fn lookup_latest(&self, target: &str, source: &str) -> Result<RigidTransform, Refusal> {
        self.lookup(target, source, LATEST)
    }

    /// Returns the newest time at which `source` is known in `target`, ns.
    /// `None` if no frame between them moves, so that any time is valid.
    ///
    /// # Errors
    /// When a frame is not known, or they are not connected.
    pub fn latest_common_time(&self, target: &str, source: &str) -> Result<Option<u64>, Refusal> {
        let mut time = 0;
        let (target, source) = (Bytes::of(target), Bytes::of(source));
        // SAFETY: everything lives during the call.
        let (code, reason) = call_with_sink(|sink| unsafe {
            (self.latest_common_time)(self.context, target, source, &raw mut time, sink)
        });
        match code {
            DONE => Ok(Some(time)),
            ABSENT => Ok(None),
            _ => Err(Refusal(reason)),
        }
    }

    /// Returns the names of all frames, in alphabetical order.
    pub fn frames(&self) -> Vec<String> {
        // SAFETY: everything lives during the call.
        let (_, text) = call_with_sink(|sink| unsafe { (self.frames)(self.context, sink) });
        text.lines().map(str::to_owned).collect()
    }
}

#[cfg(test)]
mod tests {
    use std::f64::consts::FRAC_PI_2;

    use super::*;

    fn near(a: [f64; 3], b: [f64; 3]) -> bool {
        a.iter().zip(b).all(|(a, b)| (a - b).abs() < 1e-12)
    }

    #[test]
    fn a_quarter_turn_to_the_left_takes_ahead_to_the_left() {
        let left = RigidTransform::planar(1.0, 2.0, FRAC_PI_2);
        assert!(near(left.point([3.0, 0.0, 0.5]), [1.0, 5.0, 0.5]));
        assert!(near(left.vector([3.0, 0.0, 0.5]), [0.0, 3.0, 0.5]));
        assert!((left.yaw() - FRAC_PI_2).abs() < 1e-12);
    }

    #[test]
    fn there_and_back_is_where_it_was() {
        let tilt = RigidTransform { translation: [0.0, 0.0, 1.0], rotation: [0.5, 0.5, 0.5, 0.5] };
        let there = RigidTransform::planar(1.0, -2.0, 0.7) * tilt;
        assert!(near((there * there.inverse()).point([1.0, 2.0, 3.0]), [1.0, 2.0, 3.0]));
        assert!(near((there.inverse() * there).point([1.0, 2.0, 3.0]), [1.0, 2.0, 3.0]));
    }

    #[test]
    fn a_product_is_one_after_the_other() {
        let (a, b) = (
            RigidTransform::planar(1.0, -2.0, 0.7),
            RigidTransform { translation: [3.0, 4.0, 5.0], rotation: [0.5, -0.5, 0.5, 0.5] },
        );
        let point = [0.1, 0.2, 0.3];
        assert!(near((a * b).point(point), a.point(b.point(point))));
    }
}
