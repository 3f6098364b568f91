mod cloud;
mod compiler;
mod decode;
mod messages;
mod source;

use slate_blackboard::interface::{Descriptor, Enumeration, Kind};

use self::cloud::Cloud;
use self::compiler::{checked_steps, steps};
pub(super) use self::messages::message_body;
use self::messages::text;
use self::source::{Scalar, ValueBytes, scalar, write, write_name};
use super::cdr::{CdrWriter, WireFormat, wire_length};
use super::codec::items;
use super::names::own_frame;
use super::schema::reference;
use super::{Definition, Error, Primitive, RosPrimitive, Schema};

/// Conversion of a value to its standard ROS message.
///
/// The message has the content of the value: fields of the same name, and those that [are the same](standard) by
/// another name. Fields that the value lacks are 0, or the value for "unknown" in the message's definition.
#[derive(Debug)]
pub struct Standard {
    format: WireFormat,
    descriptor: &'static Descriptor,
    definition: Definition,
    schema: Schema,
    steps: Vec<MessageStep>,
}

/// Step that appends a field of a message.
#[derive(Debug)]
struct MessageStep {
    /// Path of the field.
    field: String,
    encode: EncodeStep,
}

/// Step of encoding a message, in order.
#[derive(Debug)]
enum EncodeStep {
    Number(Primitive, NumberSource),
    Text(TextSource),
    Stamp(Option<(FieldLocation, FieldLocation)>),
    /// A list, with its length before it or without.
    List {
        kind: Primitive,
        counted: bool,
        count: Items,
        start: usize,
        from: Primitive,
    },
    /// A list of messages, with its length before it or without.
    /// It has the offset of its items in the value, their interface, and the steps for each.
    Messages {
        counted: bool,
        count: Items,
        start: usize,
        item: &'static Descriptor,
        steps: Vec<MessageStep>,
    },
    /// A list of texts, with its length before it or without.
    /// It has the offset of its items in the value, and the capacity of each.
    TextList {
        counted: bool,
        count: Items,
        start: usize,
        capacity: usize,
    },
    /// Numbers of several fields, with their count.
    Listed(Primitive, Vec<FieldLocation>),
    /// Texts, with their count.
    Texts(Vec<&'static str>),
    /// The axes of points.
    Axes,
    /// Points, with the count of their bytes.
    Points(Cloud),
    /// Covariance of a pose in space, from that of x, y and theta in the plane.
    /// The offset is that of the latter.
    Covariance(usize),
    /// A list of that many zeros; without a length unless it is empty.
    Zeros(Primitive, Option<usize>),
    /// A message without fields.
    Empty,
}

/// A number in a value: its type and offset.
#[derive(Clone, Copy, Debug)]
struct FieldLocation(Primitive, usize);

#[derive(Debug)]
enum NumberSource {
    Constant(f64),
    Field(FieldLocation),
    HalfSine(FieldLocation),
    HalfCosine(FieldLocation),
    When { number: FieldLocation, holds: FieldLocation },
    Last { first: FieldLocation, step: FieldLocation, items: Items },
    Among(FieldLocation, &'static [f64]),
    Along { range: FieldLocation, bearing: FieldLocation },
    Across { range: FieldLocation, bearing: FieldLocation },
    Heard(Cloud, f64),
}

#[derive(Debug)]
enum TextSource {
    Constant(&'static str),
    Frame,
    /// A frame of the robot that the value is of.
    OfRobot(&'static str),
    /// A frame of the robot that the value names: offset and capacity.
    Named(usize, usize),
    /// Offset and capacity.
    Field(usize, usize),
    Name(FieldLocation, &'static Enumeration),
}

/// Number of items of a list of a value.
#[derive(Clone, Copy, Debug)]
enum Items {
    Fixed(usize),
    /// The offset of its length, and its capacity.
    Counted(usize, usize),
    Tail,
}

/// Returns the definition of a known ROS message.
/// An example is `sensor_msgs/msg/LaserScan`. It has no comments.
pub fn message_definition(name: &str) -> Option<Definition> {
    let (package, own) = name.split_once("/msg/")?;
    Some(Definition { name: name.into(), text: text(&format!("{package}/{own}"), WireFormat::Cdr)? })
}

/// Returns the conversion to the message that the interface names.
/// An example is `ros = "sensor_msgs/msg/LaserScan"`.
///
/// `None` if the interface names no message, or an unknown one, or its fields do not fit the message.
///
/// | message | fields other than those of the same name |
/// |---|---|
/// | all | `header` has the time and the frame that are given, but values in a map have `map`, and odometry `odom` (REP 105); covariances are 0, which means unknown |
/// | `sensor_msgs/LaserScan` | `angle_max` is the direction of the last beam |
/// | `sensor_msgs/Image` | `encoding` is the name of `format` in lower case |
/// | `sensor_msgs/NavSatFix` | `status` has the kind of the fix; the systems used and the source of the covariance are left out |
/// | `sensor_msgs/Range` | `range` is infinite without an echo |
/// | `sensor_msgs/BatteryState` | unmeasured fields are NaN |
/// | `nav_msgs/OccupancyGrid` | `info` has the pose and size of the cells; the time of loading is 0 |
/// | `nav_msgs/Odometry` | a rotation in the plane is one around z; the child is the robot's `base_link` |
/// | `nav_msgs/Path` | `poses` are the points, each with the header and no rotation |
/// | `geometry_msgs/Point` | a point in the plane has a `z` of 0 |
/// | `geometry_msgs/PoseWithCovarianceStamped` | a rotation in the plane is one around z, with its covariances |
/// | `geometry_msgs/Quaternion` | a heading in the plane is a rotation around z |
/// | `diagnostic_msgs/DiagnosticStatus` | a mission is OK until it has failed |
/// | `geometry_msgs/PolygonStamped` | the outline of a chassis, without its other fields |
/// | `geometry_msgs/PoseArray`, `geometry_msgs/PointStamped` | positions of detected robots from range and bearing, without their identities |
/// | `sensor_msgs/CameraInfo` | the whole image, without binning |
/// | `sensor_msgs/JointState` | the speeds of wheels, which have names such as `front_left_wheel`, or the joints `pan` and `tilt` of a head |
/// | `sensor_msgs/PointCloud2` | points of sonar echoes, on the axes of the cones |
/// | `std_msgs/Float64` | a distance |
/// | `geometry_msgs/Twist` | forward is x, turning is around z |
/// | `geometry_msgs/TransformStamped` | `header` has the value's own parent, and its own time unless it is fixed |
pub fn standard(descriptor: &'static Descriptor) -> Option<Standard> {
    standard_in(WireFormat::Cdr, descriptor)
}

/// Returns the conversion of an interface to its message in the ROS of a format.
/// The messages of ROS 1 are called `sensor_msgs/LaserScan`, and a `header` has a `seq`, which is 0.
pub fn standard_in(format: WireFormat, descriptor: &'static Descriptor) -> Option<Standard> {
    let (package, name) = descriptor.ros.split_once("/msg/")?;
    let short = format!("{package}/{name}");
    let text = text(&short, format)?;
    let schema = Schema::parse(descriptor.ros, &text).ok()?;
    let steps = steps(descriptor, &short, &schema)?;
    let name = if format == WireFormat::Ros1 { short } else { descriptor.ros.into() };
    Some(Standard { format, descriptor, definition: Definition { name, text }, schema, steps })
}

impl Standard {
    /// Returns the conversion of an interface's values to messages of a definition.
    /// Fields of the same name must fit, or the only ones of both.
    ///
    /// # Errors
    /// The path of a field that does not fit, empty when none does, and the reason in words.
    pub(super) fn defined(
        format: WireFormat,
        descriptor: &'static Descriptor,
        definition: Definition,
        schema: Schema,
    ) -> Result<Self, (String, String)> {
        let steps = checked_steps(descriptor, &reference("", &definition.name), &schema)?;
        Ok(Self { format, descriptor, definition, schema, steps })
    }

    /// Returns the message definition of ROS, without the comments.
    pub fn definition(&self) -> &Definition {
        &self.definition
    }

    /// Appends the message of a value, little-endian.
    /// Nothing is allocated if `out` has room.
    ///
    /// `bytes` is the value in its memory layout, with its tail; `stamp` is its time in nanoseconds, and `frame` is the
    /// coordinate frame of the value, such as `base_link`: they are the `header` of messages that have one. Where a robot has frames of its own, as in
    /// `r1/base_link`, other frames that messages name are that robot's too: `r1/odom`.
    ///
    /// # Errors
    /// When `bytes` is not a value of the interface; `out` is unchanged then.
    pub fn encode(&self, bytes: &[u8], stamp: u64, frame: &str, out: &mut Vec<u8>) -> Result<(), Error> {
        let tail = items(self.descriptor, bytes)?;
        wire_length(bytes.len())?;
        wire_length(frame.len() + 1)?;
        let value = ValueBytes { bytes, tail };
        append(&self.steps, &value, stamp, frame, &mut CdrWriter::of(self.format, out))
    }
}

/// Returns the robot of a frame, such as `r1` of `r1/base_link`; empty without one.
fn robot(frame: &str) -> &str {
    frame.rsplit_once('/').map_or("", |(robot, _)| robot)
}

/// Appends a value by its steps.
fn append(
    steps: &[MessageStep],
    value: &ValueBytes<'_>,
    stamp: u64,
    frame: &str,
    writer: &mut CdrWriter<'_>,
) -> Result<(), Error> {
    for step in steps {
        match &step.encode {
            EncodeStep::Number(kind, number) => write(writer, *kind, value.number(number)),
            EncodeStep::Stamp(own) => {
                let own = own.as_ref().filter(|(_, unless)| !value.holds(unless));
                let stamp = own.map_or(i128::from(stamp), |(time, _)| match value.read(time) {
                    Scalar::Whole(time) => time,
                    Scalar::Float(time) => time as i128,
                });
                let second = 1_000_000_000;
                write(writer, Primitive::I32, Scalar::Whole(stamp.div_euclid(second)));
                write(writer, Primitive::U32, Scalar::Whole(stamp.rem_euclid(second)));
            }
            EncodeStep::Text(TextSource::Frame) => writer.text(frame)?,
            EncodeStep::Text(TextSource::Constant(text)) => writer.text(text)?,
            EncodeStep::Text(TextSource::OfRobot(name)) => writer.joined(&own_frame(robot(frame), name))?,
            EncodeStep::Text(TextSource::Named(offset, capacity)) => {
                writer.joined(&own_frame(robot(frame), value.text(*offset, *capacity)))?;
            }
            EncodeStep::Text(TextSource::Field(offset, capacity)) => {
                writer.text(value.text(*offset, *capacity))?
            }
            EncodeStep::Text(TextSource::Name(location, enumeration)) => {
                write_name(writer, value.read(location), enumeration)?
            }
            EncodeStep::List { kind, counted, count, start, from } => {
                let count = begin_list(writer, value, *count, *counted)?;
                let memory = &value.bytes[*start..*start + count * from.size()];
                // The bytes of a truth value may be others than 0 and 1.
                if kind == from && *kind != Primitive::Bool {
                    writer.numbers(memory, kind.size());
                } else {
                    for number in memory.chunks_exact(from.size()) {
                        write(writer, *kind, scalar(*from, number));
                    }
                }
            }
            EncodeStep::TextList { counted, count, start, capacity } => {
                let (count, size) =
                    (begin_list(writer, value, *count, *counted)?, Kind::Text(*capacity).size());
                (0..count).try_for_each(|item| writer.text(value.text(*start + item * size, *capacity)))?;
            }
            EncodeStep::Messages { counted, count, start, item: descriptor, steps } => {
                let count = begin_list(writer, value, *count, *counted)?;
                for item in 0..count {
                    let size = descriptor.size;
                    let bytes = &value.bytes[*start + item * size..][..size];
                    append(steps, &ValueBytes { bytes, tail: 0 }, stamp, frame, writer)?;
                }
            }
            EncodeStep::Covariance(start) => covariance(value, *start, writer),
            EncodeStep::Listed(kind, locations) => {
                writer.length(wire_length(locations.len())?);
                locations.iter().for_each(|location| write(writer, *kind, value.read(location)));
            }
            EncodeStep::Texts(texts) => {
                writer.length(wire_length(texts.len())?);
                texts.iter().try_for_each(|text| writer.text(text))?;
            }
            EncodeStep::Axes => cloud::axes(writer)?,
            EncodeStep::Points(cloud) => cloud.points(value, writer)?,
            EncodeStep::Zeros(_, None) => writer.length(0),
            EncodeStep::Zeros(kind, Some(count)) => writer.zeros(*count, kind.size()),
            EncodeStep::Empty => writer.empty(),
        }
    }
    Ok(())
}

/// Appends the length of a list, if it is counted; returns how many items follow.
fn begin_list(
    writer: &mut CdrWriter<'_>,
    value: &ValueBytes<'_>,
    items: Items,
    is_counted: bool,
) -> Result<usize, Error> {
    let count = value.count(items);
    if is_counted {
        writer.length(wire_length(count)?);
    }
    Ok(count)
}

/// Appends the covariance of a pose in space, from that of x, y and theta.
fn covariance(value: &ValueBytes<'_>, start: usize, writer: &mut CdrWriter<'_>) {
    // x, y and the turn around z among x, y, z and the turns around them.
    const IN_PLANE: [Option<usize>; 6] = [Some(0), Some(1), None, None, None, Some(2)];
    for row in IN_PLANE {
        for column in IN_PLANE {
            let own = row.zip(column).map(|(row, column)| start + 8 * (3 * row + column));
            let own = own.map_or(Scalar::Whole(0), |at| scalar(Primitive::F64, &value.bytes[at..]));
            write(writer, Primitive::F64, own);
        }
    }
}
