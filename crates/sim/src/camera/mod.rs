//! Cameras of robots.

mod camera_sensor;
mod head;

pub(crate) use camera_sensor::CameraSensor;
