use slate_blackboard::interface::{Descriptor, Kind, find};

use super::source::ValueBytes;
use super::{Error, FieldLocation, Items, Primitive, RosPrimitive};
use crate::cdr::{CdrWriter, wire_length};

/// Sonar echoes as a point cloud in the plane of the robot.
#[derive(Clone, Copy, Debug)]
pub(super) struct Cloud {
    placements: List<3>,
    echoes: List<2>,
}

/// List of interfaces: count, start, size of an item, and numbers in each.
/// Start and size in bytes.
#[derive(Clone, Copy, Debug)]
struct List<const N: usize> {
    count: Items,
    start: usize,
    size: usize,
    locations: [FieldLocation; N],
}

/// Bytes of a number of a point.
const NUMBER_SIZE: usize = 4;

impl Cloud {
    /// Returns the cloud of a value with placements of sonars and as many echoes.
    pub fn of(descriptor: &'static Descriptor) -> Option<Self> {
        Some(Self {
            placements: List::of(descriptor, "placements", ["x", "y", "theta"])?,
            echoes: List::of(descriptor, "echoes", ["range", "heard"])?,
        })
    }

    /// Iterates over the points of the echoes heard, in the middle of each cone.
    pub fn echo_points(&self, value: &ValueBytes<'_>) -> impl Iterator<Item = [f64; 2]> {
        let count = value.count(self.placements.count).min(value.count(self.echoes.count));
        (0..count).filter_map(|item| {
            let [range, heard] = self.echoes.numbers(value, item);
            let [x, y, theta] = self.placements.numbers(value, item);
            (heard != 0.0).then(|| [x + range * libm::cos(theta), y + range * libm::sin(theta)])
        })
    }

    /// Appends them, each with three numbers.
    pub fn points(&self, value: &ValueBytes<'_>, writer: &mut CdrWriter<'_>) -> Result<(), Error> {
        writer.length(wire_length(self.echo_points(value).count() * AXES.len() * NUMBER_SIZE)?);
        for [x, y] in self.echo_points(value) {
            // Among bytes nothing is aligned.
            [x, y, 0.0].iter().for_each(|number| writer.raw(&(*number as f32).to_le_bytes()));
        }
        Ok(())
    }
}

const AXES: [&str; 3] = ["x", "y", "z"];

/// Appends the description of a point's numbers.
pub(super) fn axes(writer: &mut CdrWriter<'_>) -> Result<(), Error> {
    /// `FLOAT32` of `sensor_msgs/PointField`.
    const FLOAT32: u8 = 7;
    writer.length(wire_length(AXES.len())?);
    for (place, axis) in AXES.into_iter().enumerate() {
        writer.text(axis)?;
        writer.length(wire_length(place * NUMBER_SIZE)?);
        writer.byte(FLOAT32);
        writer.length(1);
    }
    Ok(())
}

impl<const N: usize> List<N> {
    fn of(descriptor: &'static Descriptor, list: &str, names: [&str; N]) -> Option<Self> {
        let place = find(descriptor, list).ok()?;
        let Kind::Sequence(item, capacity) = *place.kind() else { return None };
        let Kind::Nested(inner) = item else { return None };
        let mut locations = [FieldLocation(Primitive::F64, 0); N];
        for (own, name) in locations.iter_mut().zip(names) {
            let found = find(inner, name).ok()?;
            *own = FieldLocation(Primitive::of(found.kind())?, found.offset());
        }
        let count = Items::Counted(place.offset(), capacity);
        Some(Self { count, start: place.offset() + 8, size: item.size(), locations })
    }

    fn numbers(&self, value: &ValueBytes<'_>, item: usize) -> [f64; N] {
        let bytes = &value.bytes[self.start + item * self.size..][..self.size];
        let item = ValueBytes { bytes, tail: 0 };
        self.locations.each_ref().map(|place| item.read(place).float())
    }
}
