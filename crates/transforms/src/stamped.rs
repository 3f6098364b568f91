use nalgebra::{Isometry3, Quaternion, Translation3, Unit};
use slate_interfaces::{Position, Transform};

/// Converts a transform to nalgebra's type.
/// The quaternion is not checked; [`FrameTree`](crate::FrameTree) checks it.
pub fn isometry(transform: &Transform) -> Isometry3<f64> {
    let (place, turn) = (transform.translation, transform.rotation);
    let rotation = Unit::new_unchecked(Quaternion::new(turn.w, turn.x, turn.y, turn.z));
    Isometry3::from_parts(Translation3::new(place.x, place.y, place.z), rotation)
}

/// Converts a transform of a moving frame to the interface's type.
/// Names that are too long are cut.
pub fn stamped(parent: &str, child: &str, time: u64, transform: &Isometry3<f64>) -> Transform {
    let (place, turn) = (transform.translation, transform.rotation);
    Transform {
        time,
        parent: parent.into(),
        child: child.into(),
        translation: Position { x: place.x, y: place.y, z: place.z },
        rotation: slate_interfaces::Quaternion { x: turn.i, y: turn.j, z: turn.k, w: turn.w },
        ..Transform::default()
    }
}
