//! Plane that touches the Earth.

use serde::{Deserialize, Serialize};
use slate_module::math;

/// Semi-major axis of the ellipsoid of WGS 84, m, and its squared eccentricity.
const SEMI_MAJOR_AXIS: f64 = 6_378_137.0;
const SQUARED_ECCENTRICITY: f64 = 6.694_379_990_141_316e-3;

/// Plane with x east and y north that touches the ellipsoid of WGS 84 at an origin.
///
/// Points are projected at a right angle to the plane, whatever their height, so that distances on the ground are too
/// short by 4 mm at 10 km from the origin, and by the cube of the distance.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct TangentPlane {
    /// Sine and cosine of the latitude.
    latitude: [f64; 2],
    /// Degrees.
    longitude: f64,
    /// Distances of the origin from the Earth's axis and the equatorial plane, m.
    origin: [f64; 2],
}

impl TangentPlane {
    /// Touches at a latitude and longitude in degrees; `None` if one is not on Earth.
    pub fn new(latitude: f64, longitude: f64) -> Option<Self> {
        let is_on_earth = latitude.abs() <= 90.0 && longitude.abs() <= 360.0;
        is_on_earth.then(|| {
            let angle = latitude.to_radians();
            Self { latitude: [math::sin(angle), math::cos(angle)], longitude, origin: meridian_place(angle) }
        })
    }

    /// Projects a latitude and longitude in degrees to meters east and north.
    pub fn project(&self, latitude: f64, longitude: f64) -> [f64; 2] {
        let east = (longitude - self.longitude).to_radians();
        let [from_axis, from_equator] = meridian_place(latitude.to_radians());
        let [sine, cosine] = self.latitude;
        // Away from the axis in the origin's meridian.
        let away = from_axis * math::cos(east) - self.origin[0];
        [from_axis * math::sin(east), (from_equator - self.origin[1]) * cosine - away * sine]
    }
}

/// Returns an ellipsoid point's distances from the Earth's axis and equator, m.
/// The equator's is the distance from its plane.
fn meridian_place(latitude: f64) -> [f64; 2] {
    let (sine, cosine) = (math::sin(latitude), math::cos(latitude));
    let prime_vertical = SEMI_MAJOR_AXIS / (1.0 - SQUARED_ECCENTRICITY * sine * sine).sqrt();
    [prime_vertical * cosine, prime_vertical * (1.0 - SQUARED_ECCENTRICITY) * sine]
}
