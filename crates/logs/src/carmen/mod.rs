//! Logs of CARMEN: a line for each message.
//! A line has the message's kind, its content, the time at which it was sent, the host that sent it, and the time at
//! which it was logged.
//!
//! The times are those at which messages were sent, as that is what sensors' values are of.

mod entry;
mod geometry;
mod write;

pub use write::{CarmenLog, export_carmen};

use std::io::Write;

use slate_interfaces::{Odometry, Position, Quaternion, Transform, Twist2};
use slate_module::blackboard::interface::Bool;
use slate_sorted::SortedMap;

use self::entry::{CarmenEntry, Device, Scan};
use self::geometry::Geometry;
use super::lines::Lines;
use super::output::{Output, OutputBytes, Sweep};
use super::words::Words;
use super::{Imported, Options};
use slate_bag::Error;
use slate_ros_messages::Definition;

const PARAMETER: (&str, &str) = ("carmen_msgs/msg/Parameter", "string name\nstring value\n");
const SYNC: (&str, &str) = ("carmen_msgs/msg/Sync", "string tag\n");
const ACCELERATION: (&str, &str) =
    ("carmen_msgs/msg/Acceleration", "# Forward [m/s^2]\nfloat64 acceleration\n");
const DEVICE: (&str, &str) = (
    "carmen_msgs/msg/LaserDevice",
    "# 0 SICK LMS, 1 SICK PLS, 2 Hokuyo URG, 3 simulated, 4 SICK S300, 99 unknown\n\
     int32 laser_type\n\
     # [rad]\n\
     float64 field_of_view\n\
     # [m]\n\
     float64 accuracy\n\
     int32 remission_mode\n\
     float32[] remissions\n",
);
const MOTION: (&str, &str) = (
    "carmen_msgs/msg/LaserMotion",
    "# Forward [m/s]\nfloat64 tv\n# Counter-clockwise [rad/s]\nfloat64 rv\n# [m]\nfloat64 forward_safety_distance\n\
     # [m]\nfloat64 side_safety_distance\n# [rad]\nfloat64 turn_axis\n",
);

fn definition((name, text): (&str, &str)) -> Definition {
    Definition { name: name.into(), text: text.into() }
}

/// Returns true if a line can only be one of CARMEN's.
pub(super) fn is_line(line: &str) -> bool {
    let mut words = Words::new(line);
    let is_known = words.word("").is_ok_and(entry::is_known);
    (is_known && CarmenEntry::parse(line).is_ok()) || line.starts_with("# CARMEN Logfile")
}

/// Reads a log.
pub(super) fn read<W: Write>(
    lines: &mut Lines,
    output: &mut Output<W>,
    options: &Options,
    imported: &mut Imported,
) -> Result<(), Error> {
    let mut log =
        Log { output, geometry: Geometry::default(), untimed: Vec::new(), host: None, buffer: Vec::new() };
    loop {
        let entry = match lines.next()? {
            None => break,
            Some(Ok(line)) if line.is_empty() || line.starts_with('#') => continue,
            Some(line) => line.and_then(|line| match CarmenEntry::parse(line) {
                Ok(Some(entry)) => Ok(entry),
                Ok(None) => {
                    imported.unread(line.split_ascii_whitespace().next().unwrap_or_default());
                    Ok(CarmenEntry::Unread)
                }
                Err(what) => Err(what),
            }),
        };
        match entry {
            Ok(entry) => log.write(entry)?,
            Err(what) => imported.wrong(options, lines.error(what))?,
        }
    }
    log.end()
}

struct Log<'a, W> {
    output: &'a mut Output<W>,
    geometry: Geometry,
    /// Parameters without a time of their own.
    /// They get that of the next line that has one.
    untimed: Vec<(String, String)>,
    host: Option<String>,
    buffer: Vec<u8>,
}

impl<W: Write> Log<'_, W> {
    fn write(&mut self, entry: CarmenEntry) -> Result<(), Error> {
        if let Some((time, host)) = entry.sent() {
            if self.host.is_none() {
                self.host = Some(host.to_owned());
            }
            self.untimed(time)?;
        }
        match entry {
            CarmenEntry::Unread => Ok(()),
            CarmenEntry::Parameter { name, value, sent: None } => {
                self.geometry.parameter(&name, &value);
                self.untimed.push((name, value));
                Ok(())
            }
            CarmenEntry::Parameter { name, value, sent: Some((time, _)) } => {
                self.parameter(time, &name, &value)
            }
            CarmenEntry::Sync { tag, sent: (time, _) } => {
                let written = OutputBytes::new(&mut self.buffer).text(&tag).map(drop);
                debug_assert!(written.is_ok(), "a line is shorter than a text can be");
                self.output.message("/sync", time, || definition(SYNC), &self.buffer)
            }
            CarmenEntry::Odometry { pose, twist: (linear, angular), acceleration, sent: (time, _) } => {
                let _ = OutputBytes::new(&mut self.buffer).double(acceleration);
                self.output.message("/odom/acceleration", time, || definition(ACCELERATION), &self.buffer)?;
                let twist = Twist2 { linear, angular };
                self.output.value("/odom", time, &Odometry { pose, twist })
            }
            CarmenEntry::TruePose { pose, odometry, sent: (time, _) } => {
                self.output.value("/truepos/odometry_pose", time, &odometry)?;
                self.output.value("/truepos/true_pose", time, &pose)
            }
            CarmenEntry::Scan(scan) => self.scan(&scan),
        }
    }

    fn untimed(&mut self, time: u64) -> Result<(), Error> {
        for (name, value) in std::mem::take(&mut self.untimed) {
            self.parameter(time, &name, &value)?;
        }
        Ok(())
    }

    fn parameter(&mut self, time: u64, name: &str, value: &str) -> Result<(), Error> {
        self.geometry.parameter(name, value);
        let written =
            OutputBytes::new(&mut self.buffer).text(name).and_then(|bytes| bytes.text(value)).map(drop);
        debug_assert!(written.is_ok(), "a line is shorter than a text can be");
        self.output.message("/param", time, || definition(PARAMETER), &self.buffer)?;
        // Where a laser is mounted.
        let offset = match name {
            "robot_frontlaser_offset" => Some(("laser_front", 0.0)),
            "robot_rearlaser_offset" => Some(("laser_rear", 1.0)),
            _ => None,
        };
        if let Some(((child, back), x)) = offset.zip(value.parse::<f64>().ok()) {
            let transform = Transform {
                time,
                parent: "base_link".into(),
                child: child.into(),
                translation: Position { x, y: 0.0, z: 0.0 },
                // A laser at the back looks there.
                rotation: Quaternion { x: 0.0, y: 0.0, z: back, w: 1.0 - back },
                fixed: Bool::from(true),
            };
            self.output.value(&format!("/transforms/{child}"), time, &transform)?;
        }
        Ok(())
    }

    fn scan(&mut self, scan: &Scan) -> Result<(), Error> {
        let (time, topic) = (scan.sent.0, &scan.topic);
        if let Some((laser, robot)) = &scan.poses {
            self.output.value(&format!("/{topic}/laser_pose"), time, laser)?;
            self.output.value(&format!("/{topic}/robot_pose"), time, robot)?;
        }
        if let Some(Device { laser_type, field_of_view, accuracy, remission_mode, remissions, .. }) =
            &scan.device
        {
            let bytes = OutputBytes::new(&mut self.buffer)
                .whole(*laser_type)
                .double(*field_of_view)
                .double(*accuracy);
            let _ = bytes.whole(*remission_mode).singles(remissions);
            self.output.message(&format!("/{topic}/device"), time, || definition(DEVICE), &self.buffer)?;
        }
        if let Some(motion) = scan.motion {
            let _ =
                motion.iter().fold(OutputBytes::new(&mut self.buffer), |bytes, number| bytes.double(*number));
            self.output.message(&format!("/{topic}/motion"), time, || definition(MOTION), &self.buffer)?;
        }
        let known =
            scan.device.as_ref().map(|device| (device.start_angle, device.resolution, device.range_max));
        let (angle_min, angle_increment, range_max) =
            known.unwrap_or_else(|| self.geometry.of(topic, scan.ranges.len()));
        let sweep = Sweep { angle_min, angle_increment, range_min: 0.0, range_max, ranges: &scan.ranges };
        self.output.sweep(&format!("/{topic}/scan"), time, &sweep)
    }

    fn end(mut self) -> Result<(), Error> {
        self.untimed(0)?;
        let host = self.host.take().map(|host| ("host".to_owned(), host));
        self.output.metadata("carmen", SortedMap::from_iter(host))
    }
}
