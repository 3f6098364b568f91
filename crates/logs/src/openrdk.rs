//! Sensor logs of OpenRDK.
//! Lines as those of CARMEN, but with the pose by odometry before the estimated one, and times in milliseconds after
//! midnight.

use std::f64::consts::PI;
use std::io::Write;

use slate_interfaces::Pose2;

use super::lines::Lines;
use super::output::{Output, OutputBytes, Sweep};
use super::words::{Words, shortened};
use super::{Imported, Options};
use slate_bag::Error;
use slate_ros_messages::Definition;

/// Default of OpenRDK's own player, meters.
const RANGE_LIMITS: (f64, f64) = (0.02, 80.0);

const MILLISECONDS_PER_DAY: u64 = 24 * 3600 * 1000;

/// Number of lines inspected to tell the two systems apart.
const INSPECTED_LINES: usize = 50;

struct OpenRdkEntry {
    /// The name of the line in lower case.
    topic: String,
    what: OpenRdkData,
    odometry: Pose2,
    estimated: Pose2,
    /// Milliseconds after midnight.
    time: u64,
}

enum OpenRdkData {
    Scan(Vec<f32>),
    Odometry,
    /// Radians.
    PanTilt(f64, f64),
}

pub(super) fn is_line(line: &str) -> bool {
    matches!(parse(line), Ok(Some(_)))
}

/// Returns true if lines are of OpenRDK and not of CARMEN.
/// All its times are whole numbers, and not all of them 0.
pub(super) fn is_openrdk_log(lines: &[&str]) -> bool {
    let timed = lines.iter().filter(|line| {
        let name = line.split_ascii_whitespace().next().unwrap_or_default();
        ["FLASER", "ODOM", "PANTILT"].contains(&name)
    });
    let mut times = timed.take(INSPECTED_LINES).map(|line| match parse(line) {
        Ok(Some(entry)) => Some(entry.time),
        _ => None,
    });
    let mut latest = 0;
    let is_whole = times.all(|time| time.inspect(|time| latest = latest.max(*time)).is_some());
    is_whole && latest > 0
}

/// Parses a line; `None` for a line of another kind.
fn parse(line: &str) -> Result<Option<OpenRdkEntry>, String> {
    let mut words = Words::new(line);
    let name = words.word("its name")?;
    let what = match name {
        "FLASER" => OpenRdkData::Scan(words.list("ranges")?),
        "ODOM" => OpenRdkData::Odometry,
        "PANTILT" => OpenRdkData::PanTilt(words.number("the pan angle")?, words.number("the tilt angle")?),
        _ => return Ok(None),
    };
    let (odometry, estimated) = (words.pose("the pose by odometry")?, words.pose("the estimated pose")?);
    let time = milliseconds(&mut words, "the time of the values")?;
    words.word("the host")?;
    milliseconds(&mut words, "the time at which they were sent")?;
    words.end()?;
    Ok(Some(OpenRdkEntry { topic: name.to_ascii_lowercase(), what, odometry, estimated, time }))
}

fn milliseconds(words: &mut Words<'_>, what: &str) -> Result<u64, String> {
    let word = words.word(what)?;
    let time = word.parse().ok().filter(|time| *time <= MILLISECONDS_PER_DAY);
    time.ok_or_else(|| format!("`{}` should be {what}, milliseconds after midnight", shortened(word)))
}

pub(super) fn read<W: Write>(
    lines: &mut Lines,
    output: &mut Output<W>,
    options: &Options,
    imported: &mut Imported,
) -> Result<(), Error> {
    let (mut days, mut last) = (0, 0);
    let mut buffer = Vec::new();
    loop {
        let entry = match lines.next()? {
            None => return Ok(()),
            Some(Ok(line)) if line.is_empty() || line.starts_with('#') => continue,
            Some(line) => line.and_then(|line| {
                let entry = parse(line)?;
                if entry.is_none() {
                    imported.unread(line.split_ascii_whitespace().next().unwrap_or_default());
                }
                Ok(entry)
            }),
        };
        let entry = match entry {
            Ok(Some(entry)) => entry,
            Ok(None) => continue,
            Err(what) => {
                imported.wrong(options, lines.error(what))?;
                continue;
            }
        };
        // A run continues over midnight.
        if entry.time + MILLISECONDS_PER_DAY / 2 < last {
            days += 1;
        }
        last = entry.time;
        let time = (days * MILLISECONDS_PER_DAY + entry.time) * 1_000_000;
        let topic = &entry.topic;
        output.value(&format!("/{topic}/odometry_pose"), time, &entry.odometry)?;
        output.value(&format!("/{topic}/estimated_pose"), time, &entry.estimated)?;
        match &entry.what {
            OpenRdkData::Odometry => {}
            OpenRdkData::PanTilt(pan, tilt) => {
                let _ = OutputBytes::new(&mut buffer).double(*pan).double(*tilt);
                let definition = || Definition {
                    name: "openrdk_msgs/msg/PanTilt".into(),
                    text: "# [rad]\nfloat64 pan\n# [rad]\nfloat64 tilt\n".into(),
                };
                output.message("/pantilt", time, definition, &buffer)?;
            }
            OpenRdkData::Scan(ranges) => {
                // A beam in each degree, as the system's own player has it.
                let angle_increment = PI / 180.0;
                let angle_min = -angle_increment * ranges.len() as f64 / 2.0;
                let (range_min, range_max) = RANGE_LIMITS;
                let sweep = Sweep { angle_min, angle_increment, range_min, range_max, ranges };
                output.sweep("/flaser/scan", time, &sweep)?;
            }
        }
    }
}
