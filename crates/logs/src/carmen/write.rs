//! Recordings as logs of CARMEN.

use std::fmt::Write as _;
use std::io::Write;
use std::path::Path;

use slate_sorted::{SortedMap, SortedSet};

use super::geometry::Geometry;
use slate_bag::{Decoder, Error, Message, Selection, Unread, Value, seconds, whole};

/// Result of [`export_carmen`].
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct CarmenLog {
    /// Lines with the sweep of a laser.
    pub scans: u64,
    /// Lines with odometry.
    pub odometry: u64,
    /// Other lines, such as parameters.
    pub others: u64,
    /// Messages that CARMEN has no line for.
    pub left_out: u64,
    /// Messages that can't be read.
    pub unread: Vec<Unread>,
}

const LOG_HEADER: &str = "\
# CARMEN Logfile
# file format is one message per line
# message_name [message contents] ipc_timestamp ipc_hostname logger_timestamp
";

/// Writes the selected messages of a recording as lines of CARMEN's logger.
/// These are laser scans and odometry, of Slate's interfaces as well as ROS's messages, and everything that
/// [`import`](crate::import) has made of a log of CARMEN.
///
/// A sweep becomes the line that it came from. Any other one becomes `ROBOTLASER1`, that of another topic `ROBOTLASER2` and so on, at
/// the pose of the newest odometry, or `RAWLASER1` as long as there is none. Numbers are written with all their digits. The time at
/// which a line was logged counts from the first message.
///
/// # Errors
/// When the recording is damaged, two topics have odometry, there are more than nine other lasers, or
/// `out` can't be written.
pub fn export_carmen(path: &Path, selection: &Selection, out: &Path) -> Result<CarmenLog, Error> {
    let mut reader = crate::open(path)?;
    let host = reader.metadata()?.into_iter().find(|metadata| metadata.name == "carmen");
    let host = host.and_then(|mut metadata| metadata.metadata.remove("host"));
    // A host is one word.
    let host = host.filter(|host| !host.is_empty() && !host.contains(char::is_whitespace));
    let mut log = Log { host: host.unwrap_or_else(|| "nohost".into()), ..Log::default() };
    log.taken = reader.topics().iter().filter_map(|known| Some(numbered(&known.topic)?.1)).collect();
    let mut decoder = Decoder::default();
    whole::write(out, |file| {
        let failed = |source| Error::Write { path: out.into(), source };
        file.write_all(LOG_HEADER.as_bytes()).map_err(failed)?;
        let mut start = reader.start();
        selection.visit(&mut reader, |message| {
            let start = *start.get_or_insert(message.log_time);
            let value = decoder.decode(message);
            let unfit = |what| Error::Unfit { path: path.into(), what };
            if let Value::Unread { .. } = value {
                return Ok(true);
            }
            log.line.clear();
            log.take(message, &value, start).map_err(unfit)?;
            file.write_all(log.line.as_bytes()).map_err(failed)?;
            Ok(true)
        })?;
        log.result.unread = decoder.into_unread();
        Ok(log.result)
    })
}

#[derive(Default)]
struct Log {
    result: CarmenLog,
    host: String,
    geometry: Geometry,
    /// The topic that odometry comes from.
    odometry: Option<String>,
    /// The newest messages that belong to others, each with its time.
    newest: SortedMap<String, (u64, Value)>,
    /// The names of the lines of lasers that came from no such log, by topic.
    lasers: SortedMap<String, u8>,
    /// The numbers of all lasers.
    taken: SortedSet<u8>,
    line: String,
}

type Pose = [f64; 3];

impl Log {
    fn take(&mut self, message: &Message<'_>, value: &Value, start: u64) -> Result<(), String> {
        let topic = &message.channel.topic;
        let schema = message.schema.map_or("", |schema| schema.name.as_str());
        match (schema, topic.as_str()) {
            ("slate_msgs/msg/LaserScan" | "sensor_msgs/msg/LaserScan", _) => {
                self.scan(topic, message.log_time, value)?;
                self.result.scans += 1;
            }
            ("slate_msgs/msg/Odometry" | "nav_msgs/msg/Odometry", _) => {
                if let Some(other) = self.odometry.as_ref().filter(|other| *other != topic) {
                    return Err(format!("it has odometry at `{other}` and at `{topic}`; select one of them"));
                }
                self.odometry.get_or_insert_with(|| topic.clone());
                self.odometry(topic, message.log_time, value)?;
                self.result.odometry += 1;
            }
            ("carmen_msgs/msg/Parameter", _) => {
                let [name, value] = ["name", "value"].map(|name| value.text(name).unwrap_or_default());
                self.geometry.parameter(&name, &value);
                let _ = write!(self.line, "PARAM {name} {value}");
                self.result.others += 1;
            }
            ("carmen_msgs/msg/Sync", _) => {
                let _ = write!(self.line, "SYNC {}", value.text("tag").unwrap_or_default());
                self.result.others += 1;
            }
            (_, "/truepos/true_pose") => {
                let odometry = self.at("/truepos/odometry_pose", message.log_time).and_then(Value::pose);
                let (Some(own), Some(odometry)) = (value.pose(), odometry) else { return self.left_out() };
                let _ = write!(self.line, "TRUEPOS");
                self.numbers(own.iter().chain(&odometry));
                self.result.others += 1;
            }
            _ if is_part(topic) => {
                self.newest.insert(topic.clone(), (message.log_time, value.clone()));
                return Ok(());
            }
            _ => return self.left_out(),
        }
        let logged = micro(message.log_time.saturating_sub(start));
        let _ = writeln!(self.line, " {} {} {logged}", micro(message.publish_time), self.host);
        Ok(())
    }

    fn left_out(&mut self) -> Result<(), String> {
        self.result.left_out += 1;
        Ok(())
    }

    /// Returns a message of the same time.
    fn at(&self, topic: &str, time: u64) -> Option<&Value> {
        self.newest.get(topic).filter(|(own, _)| *own == time).map(|(_, value)| value)
    }

    fn numbers<'a>(&mut self, numbers: impl IntoIterator<Item = &'a f64>) {
        for number in numbers {
            let _ = write!(self.line, " {number}");
        }
    }

    fn list(&mut self, numbers: &[String]) {
        let _ = write!(self.line, " {}", numbers.len());
        for number in numbers {
            let _ = write!(self.line, " {number}");
        }
    }

    fn odometry(&mut self, topic: &str, time: u64, value: &Value) -> Result<(), String> {
        let own = value.pose().ok_or_else(|| format!("`{topic}` has no pose in the plane"))?;
        let speed = |of: &str| {
            let plane = match of {
                "linear" => "twist/twist/linear/x",
                _ => "twist/twist/angular/z",
            };
            value.number(&format!("twist/{of}")).or_else(|| value.number(plane)).unwrap_or_default()
        };
        let acceleration = self.at(&format!("{topic}/acceleration"), time);
        let acceleration = acceleration.and_then(|value| value.number("acceleration")).unwrap_or_default();
        let _ = write!(self.line, "ODOM");
        self.numbers(own.iter().chain(&[speed("linear"), speed("angular"), acceleration]));
        self.newest.insert("odometry".into(), (time, value.clone()));
        Ok(())
    }

    fn scan(&mut self, topic: &str, time: u64, value: &Value) -> Result<(), String> {
        let number = |name: &str| value.number(name).unwrap_or_default();
        let (first, step, most) = (number("angle_min"), number("angle_increment"), number("range_max"));
        // In such a log, a laser that sees nothing says its longest range.
        let mut ranges = items(value, "ranges");
        for range in &mut ranges {
            if !range.parse::<f64>().is_ok_and(f64::is_finite) {
                *range = most.to_string();
            }
        }
        let group = topic.strip_suffix("/scan").unwrap_or(topic);
        let part = |name: &str| self.at(&format!("{group}/{name}"), time);
        let poses = part("laser_pose").and_then(Value::pose).zip(part("robot_pose").and_then(Value::pose));
        let known = self.newest.get("odometry").and_then(|(_, value)| value.pose()).map(|pose| (pose, pose));
        let poses: Option<(Pose, Pose)> = poses.or(known);
        let (device, motion) = (part("device").cloned(), part("motion").cloned());
        let name = group.rsplit('/').next().unwrap_or_default().to_ascii_uppercase();
        let is_old = ["FLASER", "RLASER"].contains(&name.as_str())
            && self.geometry.of(&name.to_ascii_lowercase(), ranges.len()) == (first, step, most);
        if let Some((laser, robot)) = poses.filter(|_| is_old) {
            let _ = write!(self.line, "{name}");
            self.list(&ranges);
            self.numbers(laser.iter().chain(&robot));
            return Ok(());
        }
        let name = match numbered(topic) {
            Some((true, number)) => format!("ROBOTLASER{number}"),
            Some((false, number)) => format!("RAWLASER{number}"),
            None => {
                let free = (1..=9).find(|number| !self.taken.contains(number));
                let number = match (self.lasers.get(topic), free) {
                    (Some(known), _) => *known,
                    (None, Some(free)) => free,
                    (None, None) => return Err("it has more than nine lasers; select some of them".into()),
                };
                self.taken.insert(number);
                self.lasers.insert(topic.into(), number);
                format!("{}LASER{number}", if poses.is_some() { "ROBOT" } else { "RAW" })
            }
        };
        let parameter = |name: &str| device.as_ref().and_then(|device| device.number(name));
        // Of an unknown laser.
        let kind = parameter("laser_type").unwrap_or(99.0);
        let view = parameter("field_of_view").unwrap_or(step * ranges.len().saturating_sub(1) as f64);
        let _ = write!(self.line, "{name} {kind}");
        let (accuracy, mode) =
            (parameter("accuracy").unwrap_or_default(), parameter("remission_mode").unwrap_or_default());
        self.numbers(&[first, view, step, most, accuracy, mode]);
        self.list(&ranges);
        self.list(&device.as_ref().map_or_else(Vec::new, |device| items(device, "remissions")));
        if let Some((laser, robot)) = poses.filter(|_| name.starts_with("ROBOT")) {
            let motion = ["tv", "rv", "forward_safety_distance", "side_safety_distance", "turn_axis"]
                .map(|name| motion.as_ref().and_then(|motion| motion.number(name)).unwrap_or_default());
            self.numbers(laser.iter().chain(&robot).chain(&motion));
        }
        Ok(())
    }
}

/// Returns whether the topic's scans have the robot's pose, and the laser's number.
/// The topic is one of an imported log.
fn numbered(topic: &str) -> Option<(bool, u8)> {
    let group = topic.strip_suffix("/scan")?.rsplit('/').next()?;
    let (is_robot, number) = match (group.strip_prefix("robotlaser"), group.strip_prefix("rawlaser")) {
        (Some(number), _) => (true, number),
        (_, Some(number)) => (false, number),
        _ => (false, group.strip_prefix("laser")?),
    };
    let number = number.parse().ok().filter(|number| (1..=9).contains(number))?;
    Some((is_robot, number))
}

/// Returns true for topics of scans, odometry and true poses of an imported log.
fn is_part(topic: &str) -> bool {
    ["/laser_pose", "/robot_pose", "/device", "/motion", "/acceleration", "/truepos/odometry_pose"]
        .iter()
        .any(|end| topic.ends_with(end))
}

/// Returns the numbers of a list.
fn items(value: &Value, name: &str) -> Vec<String> {
    match value {
        Value::Message(value) => match value.get(name) {
            Some(slate_ros_messages::Value::Numbers(numbers)) => {
                numbers.iter().map(|number| number.to_string()).collect()
            }
            _ => Vec::new(),
        },
        _ => Vec::new(),
    }
}

/// Formats seconds with microseconds, as in CARMEN.
/// More digits are written only where they are significant.
fn micro(time: u64) -> String {
    let text = seconds(time);
    match text.strip_suffix("000") {
        Some(short) => short.into(),
        None => text,
    }
}
