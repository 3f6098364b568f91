//! Scripted faults of sensors, equal in all runs.

use serde::{Deserialize, Serialize};
use slate_sorted::SortedMap;

use crate::error::{key, unknown};
use crate::world::DescriptionError;

/// Kind of a sensor's fault.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum FaultKind {
    /// Repeats its newest measurement.
    Frozen,
    /// All values are NaN.
    Invalid,
    /// Delayed measurements, with none in between.
    Late,
    /// No measurements.
    Silent,
}

const KINDS: [(&str, FaultKind); 4] = [
    ("frozen", FaultKind::Frozen),
    ("invalid", FaultKind::Invalid),
    ("late", FaultKind::Late),
    ("silent", FaultKind::Silent),
];

/// Sensors that can fail.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
pub enum FaultySensor {
    /// The ring of sonars.
    Sonar,
    /// The camera.
    Camera,
    /// The laser scanner.
    Laser,
    /// The positioning system.
    Position,
    /// The compass.
    Orientation,
    /// The wheel encoders.
    Odometry,
    /// The sensor that sees other robots.
    RobotSensor,
    /// The inertial measurement unit.
    Imu,
}

const SENSORS: [(&str, FaultySensor); 8] = [
    ("camera", FaultySensor::Camera),
    ("imu", FaultySensor::Imu),
    ("laser", FaultySensor::Laser),
    ("odometry", FaultySensor::Odometry),
    ("orientation", FaultySensor::Orientation),
    ("position", FaultySensor::Position),
    ("robot_sensor", FaultySensor::RobotSensor),
    ("sonar", FaultySensor::Sonar),
];

/// A fault of a sensor.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Fault {
    /// Sensor that fails.
    pub sensor: FaultySensor,
    /// Kind of the fault.
    pub kind: FaultKind,
    /// Beginning, ns.
    pub from: u64,
    /// End, ns; the maximum for a fault that lasts until the end of the run.
    pub until: u64,
    /// Delay of [`FaultKind::Late`], ns.
    pub delay: u64,
}

/// Fault as configured.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct FaultEntry {
    robot: String,
    sensor: String,
    kind: String,
    /// Beginning, s; end and delay are in s, too.
    from: f64,
    /// End; none for a fault that lasts until the end of the run.
    until: Option<f64>,
    #[serde(default = "half_a_second")]
    delay: f64,
}

fn half_a_second() -> f64 {
    0.5
}

/// Reads the faults of `[world.faults]`, by robot.
/// `sensors` are those that the robots have.
///
/// # Errors
/// The invalid setting, and the expectation.
pub(crate) fn read(
    table: &SortedMap<String, serde_json::Value>,
    sensors: &SortedMap<String, Vec<FaultySensor>>,
) -> Result<SortedMap<String, Vec<Fault>>, DescriptionError> {
    let mut faults: SortedMap<String, Vec<(&str, Fault)>> = SortedMap::new();
    for (name, entry) in table {
        let path = format!("world.faults.{}", key(name));
        let wrong = |key: &str, message: String| Err(DescriptionError::new(&format!("{path}{key}"), message));
        let entry: FaultEntry = match serde_json::from_value(entry.clone()) {
            Ok(entry) => entry,
            Err(error) => return wrong("", error.to_string()),
        };
        let Some(own) = sensors.get(&entry.robot) else {
            let known = sensors.keys().map(String::as_str);
            return wrong(".robot", unknown("robot", &entry.robot, known));
        };
        let of_robot = |(_, sensor): &&(&str, FaultySensor)| own.contains(sensor);
        let known: Vec<_> = SENSORS.iter().filter(of_robot).map(|(name, _)| *name).collect();
        let Some((_, sensor)) = SENSORS.iter().filter(of_robot).find(|(name, _)| *name == entry.sensor)
        else {
            let (robot, sensor, known) = (&entry.robot, &entry.sensor, known.join(", "));
            let message = format!("`{robot}` has no sensor `{sensor}`; it has {known}");
            return wrong(".sensor", message);
        };
        let Some((_, kind)) = KINDS.iter().find(|(name, _)| *name == entry.kind) else {
            let known = KINDS.iter().map(|(name, _)| *name);
            return wrong(".kind", unknown("kind of fault", &entry.kind, known));
        };
        if !(entry.from.is_finite() && entry.from >= 0.0) {
            return wrong(".from", "expected a time in seconds, which is not negative".into());
        }
        if entry.until.is_some_and(|until| !(until.is_finite() && until > entry.from)) {
            return wrong(".until", "expected a time in seconds, later than `from`".into());
        }
        if !(entry.delay.is_finite() && entry.delay > 0.0) {
            return wrong(".delay", "expected a positive number of seconds".into());
        }
        // Seconds of a run are far below what a number of nanoseconds can hold; more than that never comes.
        let nanoseconds = |seconds: f64| (seconds * 1e9 + 0.5) as u64;
        let fault = Fault {
            sensor: *sensor,
            kind: *kind,
            from: nanoseconds(entry.from),
            until: entry.until.map_or(u64::MAX, nanoseconds),
            delay: nanoseconds(entry.delay),
        };
        let of_robot = faults.entry(entry.robot).or_default();
        let meets = |(_, other): &&(&str, Fault)| {
            other.sensor == fault.sensor && other.from < fault.until && fault.from < other.until
        };
        if let Some((other, _)) = of_robot.iter().find(meets) {
            let message =
                format!("it overlaps the fault `{other}` of the same sensor: expected one fault at a time");
            return wrong("", message);
        }
        of_robot.push((name, fault));
    }
    let plain = |(robot, faults): (String, Vec<(&str, Fault)>)| {
        (robot, faults.into_iter().map(|(_, fault)| fault).collect())
    };
    Ok(faults.into_iter().map(plain).collect())
}

/// Measurement at a time.
pub(crate) trait Measurement: Clone {
    /// Returns whether it is empty.
    fn is_none(&self) -> bool;

    /// Sets all values to NaN.
    fn spoil(&mut self);
}

/// Faults between a sensor and its readers.
#[derive(Debug, Default, Serialize, Deserialize)]
pub(crate) struct Display<M> {
    faults: Vec<Fault>,
    shown: M,
    /// Delayed measurement and its time.
    late: Option<(u64, M)>,
}

impl<M: Measurement> Display<M> {
    /// Sets the faults; those of other sensors are ignored.
    pub fn set_faults(&mut self, sensor: FaultySensor, faults: &[Fault]) {
        self.faults = faults.iter().filter(|fault| fault.sensor == sensor).copied().collect();
    }

    /// Returns the sensor's output for a measurement at time `now`, ns.
    /// `None` if there is no new output.
    pub fn show<'a>(&'a mut self, measured: &'a M, now: u64) -> Option<&'a M> {
        if self.faults.is_empty() {
            return Some(measured);
        }
        let fault = self.faults.iter().find(|fault| fault.from <= now && now < fault.until);
        let Some(fault) = fault else {
            self.late = None;
            self.shown.clone_from(measured);
            return Some(&self.shown);
        };
        if fault.kind != FaultKind::Late {
            self.late = None;
        }
        match fault.kind {
            FaultKind::Frozen => {}
            FaultKind::Silent => return None,
            FaultKind::Invalid => {
                self.shown.clone_from(measured);
                self.shown.spoil();
            }
            FaultKind::Late => {
                let Some((at, value)) = &mut self.late else {
                    self.late = Some((now, measured.clone()));
                    return None;
                };
                if now < at.saturating_add(fault.delay) {
                    return None;
                }
                self.shown.clone_from(value);
                value.clone_from(measured);
                *at = now;
            }
        }
        (!self.shown.is_none()).then_some(&self.shown)
    }
}
