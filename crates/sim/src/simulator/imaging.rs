//! Ports of cameras and their heads.

use slate_interfaces::{ImageFormat, PanTiltState, Position, Quaternion, Transform};
use slate_module::{Text, math};

use super::ports::{CameraIo, HeadIo};
use crate::robot::CameraDescription;
use crate::simulation::Simulation;

/// Rotation from x forward, y left, z up to the optical frame (REP 103).
/// The optical frame has x right, y down, z forward.
const OPTICAL: Quaternion = Quaternion { x: -0.5, y: 0.5, z: -0.5, w: 0.5 };

/// Publishes the new image of a robot's camera, and at first the constant outputs.
pub(super) fn show_image(simulation: &mut Simulation, robot: usize, io: &CameraIo, is_first: bool) {
    let Some(camera) = simulation.camera(robot) else { return };
    let (width, height) = (camera.width, camera.height);
    if is_first {
        io.camera_info.set(camera.info());
        io.camera_base.set(base(camera));
        let carrier = if camera.head.is_some() { "camera_tilt" } else { "camera_base" };
        io.camera_mount.set(joint(carrier, "camera", OPTICAL, None));
    }
    let Some(pixels) = simulation.shown_image(robot) else { return };
    io.camera.write(pixels.len(), |image| {
        (image.width, image.height, image.step) = (width, height, 3 * width);
        image.format = ImageFormat::RGB8;
        image.data.copy_from_slice(pixels);
    });
}

/// Commands the head of a camera and publishes its state; `now` in ns.
pub(super) fn move_head(simulation: &mut Simulation, robot: usize, io: &HeadIo, now: u64) {
    // As with wheels, a command of now takes effect in the next cycle.
    if let Some(command) = io.pan_tilt_command.get() {
        simulation.command_head(robot, [command.pan, command.tilt]);
    }
    let Some(([pan, tilt], [pan_velocity, tilt_velocity])) = simulation.head(robot) else { return };
    io.pan_tilt.set(PanTiltState { pan, tilt, pan_velocity, tilt_velocity });
    io.camera_pan.set(joint("camera_base", "camera_pan", about_z(pan), Some(now)));
    io.camera_tilt.set(joint("camera_pan", "camera_tilt", about_y(tilt), Some(now)));
}

/// Returns the mount of a camera or its head.
fn base(camera: &CameraDescription) -> Transform {
    let [x, y, z, yaw, pitch] = camera.mount;
    let (turn, nod) = (about_z(yaw.to_radians()), about_y(pitch.to_radians()));
    // First about z, then about the new y.
    let rotation = Quaternion { x: -turn.z * nod.y, y: turn.w * nod.y, z: turn.z * nod.w, w: turn.w * nod.w };
    Transform { translation: Position { x, y, z }, ..joint("base_link", "camera_base", rotation, None) }
}

/// Returns the transform of a joint, at a time or fixed.
fn joint(parent: &str, child: &str, rotation: Quaternion, now: Option<u64>) -> Transform {
    Transform {
        time: now.unwrap_or(0),
        parent: Text::new(parent),
        child: Text::new(child),
        rotation,
        fixed: now.is_none().into(),
        ..Transform::default()
    }
}

fn about_y(angle: f64) -> Quaternion {
    Quaternion { y: math::sin(angle / 2.0), w: math::cos(angle / 2.0), ..Quaternion::IDENTITY }
}

fn about_z(angle: f64) -> Quaternion {
    Quaternion { z: math::sin(angle / 2.0), w: math::cos(angle / 2.0), ..Quaternion::IDENTITY }
}
