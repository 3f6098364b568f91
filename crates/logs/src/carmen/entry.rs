use slate_interfaces::Pose2;

use crate::words::Words;

/// Time at which a message was sent, nanoseconds, and the host that sent it.
pub(super) type Sent = (u64, String);

/// Content of a line.
pub(super) enum CarmenEntry {
    Parameter {
        name: String,
        value: String,
        /// Lines of the old form do not say it.
        sent: Option<Sent>,
    },
    Sync {
        tag: String,
        sent: Sent,
    },
    Odometry {
        pose: Pose2,
        /// Twist, meters and radians per second.
        twist: (f64, f64),
        acceleration: f64,
        sent: Sent,
    },
    TruePose {
        pose: Pose2,
        odometry: Pose2,
        sent: Sent,
    },
    Scan(Scan),
    /// Another system's line, such as `NEFF` of a mapper.
    Unread,
}

pub(super) struct Scan {
    /// The name of the line in lower case.
    pub topic: String,
    pub ranges: Vec<f32>,
    /// Poses of the laser and of the robot.
    pub poses: Option<(Pose2, Pose2)>,
    pub device: Option<Device>,
    /// Speeds, safety distances, and where the robot turns.
    pub motion: Option<[f64; 5]>,
    pub sent: Sent,
}

/// Description of a laser in lines of the new form.
pub(super) struct Device {
    pub laser_type: i32,
    pub start_angle: f64,
    pub field_of_view: f64,
    pub resolution: f64,
    pub range_max: f64,
    pub accuracy: f64,
    pub remission_mode: i32,
    pub remissions: Vec<f32>,
}

pub(super) fn is_known(word: &str) -> bool {
    let is_numbered = |start| {
        word.strip_prefix(start)
            .is_some_and(|rest: &str| rest.len() == 1 && rest.as_bytes()[0].is_ascii_digit())
    };
    ["PARAM", "SYNC", "ODOM", "TRUEPOS", "FLASER", "RLASER"].contains(&word)
        || ["LASER", "RAWLASER", "ROBOTLASER"].into_iter().any(is_numbered)
}

impl CarmenEntry {
    /// Parses a line; `None` for a line of another system.
    pub fn parse(line: &str) -> Result<Option<Self>, String> {
        let mut words = Words::new(line);
        let name = words.word("its name")?;
        if !is_known(name) {
            return Ok(None);
        }
        let entry = match name {
            "PARAM" => return parameter(&words).map(Some),
            "SYNC" => Self::Sync { tag: words.word("a tag")?.into(), sent: sent(&mut words)? },
            "ODOM" => Self::Odometry {
                pose: words.pose("the pose")?,
                twist: (words.number("the speed")?, words.number("the speed of turning")?),
                acceleration: words.number("the acceleration")?,
                sent: sent(&mut words)?,
            },
            "TRUEPOS" => Self::TruePose {
                pose: words.pose("the true pose")?,
                odometry: words.pose("the pose by odometry")?,
                sent: sent(&mut words)?,
            },
            name => Self::Scan(scan(name, &mut words)?),
        };
        words.end()?;
        Ok(Some(entry))
    }

    /// Returns the time at which the entry was sent, and its host, if it has them.
    pub fn sent(&self) -> Option<(u64, &str)> {
        match self {
            Self::Parameter { sent, .. } => sent.as_ref(),
            Self::Sync { sent, .. } | Self::Odometry { sent, .. } | Self::TruePose { sent, .. } => Some(sent),
            Self::Scan(scan) => Some(&scan.sent),
            Self::Unread => None,
        }
        .map(|(time, host)| (*time, host.as_str()))
    }
}

/// Returns the end of each line.
fn sent(words: &mut Words<'_>) -> Result<Sent, String> {
    let time = words.seconds("the time at which it was sent")?;
    let host = words.word("the host")?.to_owned();
    // Seconds since the logger began, which may have been stopped and started.
    words.number("the time at which it was logged")?;
    Ok((time, host))
}

/// Parses a parameter.
/// Its value may have several words, and the old form does not say when it was sent.
fn parameter(words: &Words<'_>) -> Result<CarmenEntry, String> {
    let rest = words.rest();
    let (name, rest) = rest.split_first().ok_or("it ends where the name of a parameter should stand")?;
    let is_time = |word: &str| word.parse::<f64>().is_ok();
    let (value, sent) = match rest {
        [value @ .., _, time, host, logged]
            if is_time(time) && is_time(logged) && !is_time(host) && rest.len() > 3 =>
        {
            // Several words may end with a host name, and are kept whole.
            let value = &rest[..=value.len()];
            let mut end = Words::new(time);
            (value, Some((end.seconds("the time at which it was sent")?, (*host).to_owned())))
        }
        [value @ .., host, logged] if is_time(logged) && !is_time(host) && !value.is_empty() => (value, None),
        _ => return Err("it should have a value, a host, and the time at which it was logged".into()),
    };
    Ok(CarmenEntry::Parameter { name: (*name).into(), value: value.join(" "), sent })
}

fn scan(name: &str, words: &mut Words<'_>) -> Result<Scan, String> {
    let topic = name.to_ascii_lowercase();
    let (is_raw, is_robot) = (name.starts_with("RAWLASER"), name.starts_with("ROBOTLASER"));
    let mut scan =
        Scan { topic, ranges: Vec::new(), poses: None, device: None, motion: None, sent: (0, String::new()) };
    if is_raw || is_robot {
        let mut device = Device {
            laser_type: words.whole("the type of the laser")?,
            start_angle: words.number("the angle of the first beam")?,
            field_of_view: words.number("the field of view")?,
            resolution: words.number("the angle from beam to beam")?,
            range_max: words.number("the longest range")?,
            accuracy: words.number("the accuracy")?,
            remission_mode: words.whole("the mode of remissions")?,
            remissions: Vec::new(),
        };
        scan.ranges = words.list("ranges")?;
        device.remissions = words.list("remissions")?;
        scan.device = Some(device);
    } else {
        scan.ranges = words.list("ranges")?;
    }
    if is_robot || ["FLASER", "RLASER"].contains(&name) {
        scan.poses = Some((words.pose("the pose of the laser")?, words.pose("the pose of the robot")?));
    }
    if is_robot {
        let mut motion = [0.0; 5];
        let names = [
            "the speed",
            "the speed of turning",
            "the safety distance to the front",
            "the safety distance to the sides",
            "the turning axis",
        ];
        for (number, name) in motion.iter_mut().zip(names) {
            *number = words.number(name)?;
        }
        scan.motion = Some(motion);
    }
    scan.sent = sent(words)?;
    Ok(scan)
}
