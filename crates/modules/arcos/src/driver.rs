//! Thread that has the device.

use std::path::PathBuf;
use std::time::{Duration, Instant};

use slate_interfaces::{Bumper, Odometry, Pose2, SonarScan};
use slate_module::aspect::Stop;
use slate_module::prelude::*;

use crate::model::Model;
use crate::odometry::Odometer;
use crate::port::{Port, PortError};
use crate::report::Report;
use crate::ring::Ring;
use crate::session::{Event, Session};
use crate::status::{Connection, PioneerStatus};

/// Message from the tick to the thread.
#[interface]
#[derive(PartialEq)]
pub struct Order {
    /// Left wheel, forward.
    #[unit("rad/s")]
    pub left: f64,
    /// Right wheel, forward.
    #[unit("rad/s")]
    pub right: f64,
}

/// Message from the thread to the tick: one report.
#[interface]
pub struct Reading {
    /// Arrival time.
    #[unit("ns")]
    pub time: u64,
    /// Pose and twist from wheel odometry.
    pub odometry: Odometry,
    /// Voltage of the battery.
    #[unit("V")]
    pub voltage: f64,
    /// Status of robot and connection.
    pub status: PioneerStatus,
    /// Scan of the sonars.
    pub sonar: SonarScan,
    /// True for a reading with a new sonar scan.
    pub heard: Bool,
    /// State of the bumpers.
    pub bumper: Bumper,
}

/// DriverSettings of the thread.
#[derive(Clone, Debug)]
pub struct DriverSettings {
    /// Serial device.
    pub device: PathBuf,
    /// Baud rate of the device.
    pub baud: u32,
    /// Model of the robot, if known.
    pub model: Option<&'static Model>,
    /// Number of sonars.
    pub sonars: usize,
    /// Time to live of a command.
    pub time_to_live: Duration,
    /// Initial pose of odometry.
    pub pose: Pose2,
}

/// Polling period of the device: the maximum delay of a command after the tick.
const POLL_PERIOD: Duration = Duration::from_millis(5);
/// Retry interval for a device that can't be opened.
const AGAIN: Duration = Duration::from_millis(500);
/// Time without an echo of a sonar after which a warning is logged.
const TIMEOUT: Duration = Duration::from_secs(3);
/// Timeout of the last commands at the end.
const FAREWELL: Duration = Duration::from_millis(100);

/// Runs the driver thread until it is stopped.
pub fn run(stop: &Stop, settings: DriverSettings) {
    let mut driver = Driver {
        stop,
        began: wall(),
        odometer: Odometer::new(settings.pose),
        settings,
        reported: String::new(),
        ring: None,
        pending: None,
        reading: Reading::default(),
        complained: false,
    };
    let mut session = Session::new(driver.settings.model, driver.settings.time_to_live);
    while !stop.is_set() {
        let reason = match Port::open(&driver.settings.device, driver.settings.baud) {
            Ok(port) => driver.serve(&port, &mut session),
            Err(error) => Err(error),
        };
        if let Err(error) = reason {
            driver.lose(error.to_string());
        }
        let begin = driver.now();
        while !stop.is_set() && driver.now().saturating_sub(begin) < AGAIN {
            driver.deliver();
            stop.wait(AGAIN);
            while let Ok(Some(Order { .. })) = stop.receive() {}
        }
    }
}

/// Returns the wall-clock time.
/// A device runs by the wall clock, so that its robot stops even when the agent's time stands still.
#[allow(clippy::disallowed_methods, reason = "the robot on the other end of the line has no other time")]
fn wall() -> Instant {
    Instant::now()
}

struct Driver<'a> {
    stop: &'a Stop,
    began: Instant,
    settings: DriverSettings,
    odometer: Odometer,
    /// Sonar ring of the connected robot, and its start time.
    ring: Option<(&'static Model, Ring, Duration)>,
    /// Connection fault last logged; empty while connected.
    reported: String,
    /// Newest reading.
    reading: Reading,
    /// Messages beyond the tick's capacity.
    pending: Option<Reading>,
    /// True if the log holds a warning of a silent sonar.
    complained: bool,
}

impl Driver<'_> {
    /// Returns the time since the start of the thread.
    fn now(&self) -> Duration {
        self.began.elapsed()
    }

    /// Runs the session on an open device, until the thread is stopped.
    fn serve(&mut self, port: &Port, session: &mut Session) -> Result<(), PortError> {
        session.begin();
        self.talk(port, session)?;
        session.close();
        let begin = self.now();
        while !session.outgoing().is_empty() && self.now().saturating_sub(begin) < FAREWELL {
            port.write(session.outgoing())?;
            port.wait(POLL_PERIOD)?;
        }
        Ok(())
    }

    fn talk(&mut self, port: &Port, session: &mut Session) -> Result<(), PortError> {
        let mut bytes = [0; 1024];
        while !self.stop.is_set() {
            port.wait(POLL_PERIOD)?;
            let now = self.now();
            while let Ok(Some(Order { left, right })) = self.stop.receive() {
                session.drive(left, right, now);
            }
            let count = port.read(&mut bytes)?;
            session.receive(&bytes[..count], now, |event| self.take(event));
            if let Some(event) = session.poll(now) {
                self.take(event);
            }
            port.write(session.outgoing())?;
            self.reading.status.bad_checksums = session.bad_checksums();
            self.deliver();
        }
        Ok(())
    }

    fn take(&mut self, event: Event) {
        match event {
            Event::Connected { identity, model } => {
                let text = format!("{} ({} {})", identity.name, identity.class, identity.model);
                self.stop.info(format_args!("connected to {text} at {}", self.settings.device.display()));
                self.reported.clear();
                self.odometer.interrupt();
                self.ring = Some((model, Ring::new(model, self.settings.sonars), self.now()));
                self.complained = false;
                self.reading.status.text = Text::new(&text);
            }
            Event::Report(report) => self.report(&report),
            Event::Lost(loss) => {
                self.lose(format!("{}: {loss}", self.settings.device.display()));
            }
        }
    }

    fn report(&mut self, report: &Report) {
        let now = self.now();
        let Some((model, ring, since)) = &mut self.ring else { return };
        let heard = ring.advance(&report.ranges, now.as_secs_f64());
        if let Some(sonar) = ring.silent(now.as_secs_f64())
            && !self.complained
            && now.saturating_sub(*since) > TIMEOUT
        {
            self.complained = true;
            self.stop.warn(format_args!(
                "no scans: sonar {sonar} sends nothing; check that the robot has the number of sonars in `sonars`"
            ));
        }
        let jumps = self.odometer.jumps();
        self.reading.odometry = self.odometer.advance(report, model);
        if self.odometer.jumps() > jumps {
            self.stop.warn(format_args!("the robot's place jumped, which is not counted as motion"));
        }
        let ((left, right), (front, back)) = (report.stalls(), report.bumpers());
        if (left || right)
            && !(self.reading.status.left_stalled.get() || self.reading.status.right_stalled.get())
        {
            self.stop.warn(format_args!("the robot is stalled: something holds it"));
        }
        let status = &mut self.reading.status;
        if status.motors.get() && !report.motors() {
            self.stop
                .warn(format_args!("the motors were switched off at the robot: press its motors button"));
        }
        status.connection = Connection::UP;
        status.motors = report.motors().into();
        status.stop_button = report.stop_button().into();
        (status.left_stalled, status.right_stalled) = (left.into(), right.into());
        self.reading.time = self.stop.now();
        self.reading.voltage = f64::from(report.battery) / 10.0;
        self.reading.bumper = Bumper { front: front.into(), back: back.into() };
        self.reading.heard = heard.is_some().into();
        if let Some(scan) = heard {
            self.reading.sonar = scan;
        }
        self.pending = Some(self.reading);
    }

    /// Handles a lost connection; logs each reason once.
    fn lose(&mut self, reason: String) {
        let status = &mut self.reading.status;
        if status.connection == Connection::UP {
            status.losses += 1;
        }
        if reason != self.reported {
            self.stop.warn(format_args!("no connection, which is tried again: {reason}"));
        }
        let (bad_checksums, losses) = (status.bad_checksums, status.losses);
        *status =
            PioneerStatus { bad_checksums, losses, text: Text::new(&reason), ..PioneerStatus::default() };
        self.reported = reason;
        self.reading.heard = false.into();
        self.pending = Some(self.reading);
    }

    /// Passes the newest reading to the tick, or later when there is no room.
    fn deliver(&mut self) {
        if let Some(reading) = self.pending.take()
            && !matches!(self.stop.send(&reading), Ok(true))
        {
            self.pending = Some(reading);
        }
    }
}
