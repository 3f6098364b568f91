//! Files of the blackboard logger of Fawkes (`bblogger`).
//! They hold the values of one interface, as laid out in memory.
//!
//! Each value becomes a message with all fields of the interface; those of lasers, motors and poses also become values
//! of Slate's own interfaces. A file has the name of its interface, but not its definition: that is known of the
//! interfaces that come with Fawkes, and others are kept as bytes.

mod interface;

use std::f64::consts::TAU;
use std::fs::File;
use std::io::{BufReader, Read, Write};
use std::path::Path;

use slate_blackboard::interface::Bool;
use slate_interfaces::{Odometry, Pose2, Position, Quaternion, Transform, Twist2};

use self::interface::{Layout, Values};
use super::output::{Output, Sweep};
use super::{Imported, Options};
use slate_bag::Error;
use slate_ros_messages::{CdrWriter, Definition};

/// First bytes of a file.
pub(super) const MAGIC: [u8; 4] = [0xff, 0xbb, 0xff, 0xbb];

const HEADER_SIZE: usize = 196;

/// Maximum size of an interface, bytes.
const MAX_INTERFACE_SIZE: u32 = 1 << 20;

/// The interfaces of lasers don't say how far one sees, meters.
const RANGE_MAX: f64 = 100.0;

/// Header of a file.
struct Head {
    scenario: String,
    interface: String,
    id: String,
    hash: String,
    is_big: bool,
    /// Number of values; 0 if they must be counted.
    items: u32,
    data_size: u32,
    /// Microseconds.
    start: u64,
}

impl Head {
    fn parse(bytes: &[u8; HEADER_SIZE]) -> Result<Self, String> {
        let word = |at: usize| [bytes[at], bytes[at + 1], bytes[at + 2], bytes[at + 3]];
        let version = u32::from_be_bytes(word(4));
        if version != 1 {
            return Err(format!("it is of version {version}, and 1 is read"));
        }
        // The first bit of a word, which compilers put at the little end of it, wherever that is.
        let is_big = match word(8) {
            [0, 0, 0, 0] => false,
            [0x80, 0, 0, 0] => true,
            other => return Err(format!("its byte order is {other:02x?}, neither 0 nor 1")),
        };
        let number =
            |at: usize| if is_big { u32::from_be_bytes(word(at)) } else { u32::from_le_bytes(word(at)) };
        let long = |at: usize| {
            let (first, second) = (u64::from(number(at)), u64::from(number(at + 4)));
            if is_big { first << 32 | second } else { second << 32 | first }
        };
        let data_size = number(176);
        if !(16..=MAX_INTERFACE_SIZE).contains(&data_size) {
            return Err(format!(
                "its values have {data_size} bytes, and 16 to {MAX_INTERFACE_SIZE} are read"
            ));
        }
        let start = long(180).checked_mul(1_000_000).and_then(|time| time.checked_add(long(188)));
        Ok(Self {
            scenario: text(&bytes[16..48])?,
            interface: text(&bytes[48..96])?,
            id: text(&bytes[96..160])?,
            hash: bytes[160..176].iter().map(|byte| format!("{byte:02x}")).collect(),
            is_big,
            items: number(12),
            data_size,
            start: start.ok_or("its start is too late")?,
        })
    }
}

/// Returns a text that ends with a zero, or with its field.
fn text(bytes: &[u8]) -> Result<String, String> {
    let end = bytes.iter().position(|byte| *byte == 0).unwrap_or(bytes.len());
    String::from_utf8(bytes[..end].to_vec()).map_err(|_| "a name in its head is not UTF-8".into())
}

pub(super) fn read<W: Write>(
    path: &Path,
    output: &mut Output<W>,
    options: &Options,
    imported: &mut Imported,
) -> Result<(), Error> {
    let failed = |source| Error::Read { path: path.into(), source };
    let damaged = |offset, what| Error::Damaged { path: path.into(), offset, what };
    let mut input = BufReader::with_capacity(1 << 16, File::open(path).map_err(failed)?);
    let mut head = [0; HEADER_SIZE];
    let length = fill(&mut input, &mut head).map_err(failed)?;
    if length < HEADER_SIZE || head[..4] != MAGIC {
        return Err(damaged(
            0,
            format!("it should begin with a head of {HEADER_SIZE} bytes, which it does not have"),
        ));
    }
    let head = Head::parse(&head).map_err(|what| damaged(0, what))?;
    let layout = Layout::of(&head.interface, head.data_size as usize);
    if layout.is_none() {
        imported.unread(&format!("the fields of {}, kept as bytes", head.interface));
    }
    let about = [
        ("scenario", &head.scenario),
        ("interface", &head.interface),
        ("id", &head.id),
        ("hash", &head.hash),
    ];
    output.metadata("fawkes", about.map(|(key, text)| (key.to_owned(), text.clone())).into())?;
    let mut log =
        Log { topic: format!("/{}/{}", head.interface, head.id), head, layout, output, buffer: Vec::new() };
    let mut entry = vec![0; 8 + log.head.data_size as usize];
    let (mut offset, mut count) = (HEADER_SIZE as u64, 0_u32);
    loop {
        let found = fill(&mut input, &mut entry).map_err(failed)?;
        if found == 0 {
            break;
        }
        if found < entry.len() {
            let what =
                format!("the file ends in a value: {} bytes should follow, there are {found}", entry.len());
            return imported.wrong(options, damaged(offset, what));
        }
        match log.value(&entry) {
            Ok(()) => {}
            Err(ValueFault::Wrong(what)) => imported.wrong(options, damaged(offset, what))?,
            Err(ValueFault::Failed(error)) => return Err(error),
        }
        offset += entry.len() as u64;
        count = count.saturating_add(1);
    }
    match log.head.items {
        0 => Ok(()),
        items if items == count => Ok(()),
        items => {
            imported.wrong(options, damaged(0, format!("it should have {items} values, and has {count}")))
        }
    }
}

/// Fills a buffer, or as much of it as the file has.
fn fill(input: &mut impl Read, buffer: &mut [u8]) -> std::io::Result<usize> {
    let mut filled = 0;
    while filled < buffer.len() {
        match input.read(&mut buffer[filled..]) {
            Ok(0) => break,
            Ok(read) => filled += read,
            Err(error) if error.kind() == std::io::ErrorKind::Interrupted => {}
            Err(error) => return Err(error),
        }
    }
    Ok(filled)
}

/// Reason why a value is not written.
enum ValueFault {
    Wrong(String),
    Failed(Error),
}

impl From<Error> for ValueFault {
    fn from(error: Error) -> Self {
        Self::Failed(error)
    }
}

struct Log<'a, W> {
    topic: String,
    head: Head,
    layout: Option<Layout>,
    output: &'a mut Output<W>,
    buffer: Vec<u8>,
}

impl<W: Write> Log<'_, W> {
    fn value(&mut self, entry: &[u8]) -> Result<(), ValueFault> {
        let word = |at: usize| {
            let bytes = [entry[at], entry[at + 1], entry[at + 2], entry[at + 3]];
            if self.head.is_big { u32::from_be_bytes(bytes) } else { u32::from_le_bytes(bytes) }
        };
        let after = u64::from(word(0)) * 1_000_000 + u64::from(word(4));
        let time = self.head.start.checked_add(after).and_then(|time| time.checked_mul(1000));
        let time = time.ok_or_else(|| ValueFault::Wrong("a value is of a time that is too late".into()))?;
        let data = &entry[8..];
        self.buffer.clear();
        let Some(layout) = &self.layout else {
            let mut out = CdrWriter::new(&mut self.buffer);
            out.length(data.len() as u32);
            out.raw(data);
            let definition =
                || Definition { name: "fawkes_msgs/msg/Bytes".into(), text: "uint8[] data\n".into() };
            return Ok(self.output.message(&self.topic, time, definition, &self.buffer)?);
        };
        let values = Values { data, is_big: self.head.is_big };
        layout.encode(&values, &mut self.buffer).map_err(ValueFault::Wrong)?;
        let definition = || layout.definition(&self.head.interface);
        self.output.message(&self.topic, time, definition, &self.buffer)?;
        self.standard(time, &values)?;
        Ok(())
    }

    /// Returns the value as one of Slate's interfaces, if one matches.
    fn standard(&mut self, time: u64, values: &Values<'_>) -> Result<(), Error> {
        let Some(layout) = &self.layout else { return Ok(()) };
        let number = |name: &str| layout.numbers(values, name).first().copied().unwrap_or_default();
        let text = |name: &str| layout.text(values, name);
        let topic = |name: &str| format!("{}/{name}", self.topic);
        let pose = |name: &str, rotation: &str| {
            let (position, turn) = (layout.numbers(values, name), layout.numbers(values, rotation));
            let [x, y, z] = position[..] else { return None };
            let [qx, qy, qz, w] = turn[..] else { return None };
            Some((Position { x, y, z }, Quaternion { x: qx, y: qy, z: qz, w }))
        };
        match self.head.interface.as_str() {
            "Laser360Interface" | "Laser720Interface" | "Laser1080Interface" => {
                let mut ranges: Vec<f32> =
                    layout.numbers(values, "distances").iter().map(|meters| *meters as f32).collect();
                for range in &mut ranges {
                    // Nothing was seen there.
                    if range.is_nan() || *range <= 0.0 {
                        *range = f32::INFINITY;
                    }
                }
                if number("clockwise_angle") != 0.0 && !ranges.is_empty() {
                    ranges[1..].reverse();
                }
                let sweep = Sweep {
                    angle_min: 0.0,
                    angle_increment: TAU / ranges.len().max(1) as f64,
                    range_min: 0.0,
                    range_max: RANGE_MAX,
                    ranges: &ranges,
                };
                self.output.sweep(&topic("scan"), time, &sweep)
            }
            "MotorInterface" => {
                let pose = Pose2 {
                    x: number("odometry_position_x"),
                    y: number("odometry_position_y"),
                    theta: number("odometry_orientation"),
                };
                let twist = Twist2 { linear: number("vx"), angular: number("omega") };
                self.output.value(&topic("odometry"), time, &Odometry { pose, twist })
            }
            "Position3DInterface" | "TransformInterface" => {
                let Some((translation, rotation)) = pose("translation", "rotation") else { return Ok(()) };
                let child = match text("child_frame") {
                    child if child.is_empty() => self.head.id.clone(),
                    child => child,
                };
                let transform = Transform {
                    time,
                    parent: text("frame").as_str().into(),
                    child: child.as_str().into(),
                    translation,
                    rotation,
                    fixed: Bool::from(number("static_transform") != 0.0),
                };
                self.output.value(&topic("transform"), time, &transform)
            }
            _ => Ok(()),
        }
    }
}
