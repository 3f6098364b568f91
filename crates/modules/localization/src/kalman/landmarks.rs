//! Landmarks and their detections.

use slate_module::Sequence;
use slate_module::prelude::*;

/// Landmark whose place is known, such as a barcode on a wall.
#[interface]
#[derive(PartialEq)]
pub struct Landmark {
    /// Number that detections name it by.
    pub id: u32,
    /// x in the filter's frame.
    #[unit("m")]
    pub x: f64,
    /// y in the filter's frame.
    #[unit("m")]
    pub y: f64,
}

/// Landmarks of a place.
#[interface]
#[derive(PartialEq)]
pub struct LandmarkMap {
    /// Landmarks in any order.
    pub landmarks: Sequence<Landmark, 64>,
}

/// Detection of a landmark, in the robot's frame.
#[interface]
#[derive(PartialEq)]
pub struct LandmarkDetection {
    /// Number of the landmark.
    pub id: u32,
    /// Distance from the robot's reference point.
    #[unit("m")]
    pub range: f64,
    /// Bearing, counter-clockwise from the robot's front, in (-pi, pi].
    #[unit("rad")]
    pub bearing: f64,
}

/// Detections of landmarks at one time; possibly none.
#[interface]
#[derive(PartialEq)]
pub struct LandmarkDetections {
    /// Detections in any order.
    pub list: Sequence<LandmarkDetection, 16>,
}
