use std::path::PathBuf;
use std::time::Duration;

use serde::{Deserialize, Serialize};
use slate_interfaces::{Bumper, Chassis, DriverStatus, Odometry, SonarScan, WheelSpeeds};
use slate_module::aspect::{Actuators, Aspect, Threads};
use slate_module::prelude::*;
use slate_module::{Hardware, HardwareDevice, HardwareDrive};

use crate::driver::{self, DriverSettings, Order, Reading};
use crate::model::{MODELS, Model};
use crate::status::{Connection, PioneerStatus};

/// Battery of a robot.
#[interface(ros = "sensor_msgs/msg/BatteryState")]
#[derive(PartialEq)]
pub struct Battery {
    /// Under load; a Pioneer wants to be charged below 11.5 V.
    #[unit("V")]
    pub voltage: f64,
}

/// Ports of [`Pioneer`].
/// They are the ports of the simulated robot, as far as a real one has them, and some of its own.
#[ports]
pub struct PioneerIo {
    threads: Aspect<Threads>,
    actuators: Aspect<Actuators>,
    /// Wheel command from the gate.
    #[role("actuation")]
    #[stale(after = "100ms")]
    wheels: Input<WheelSpeeds>,
    /// Geometry and limits of the robot.
    chassis: Output<Chassis>,
    /// Newest echoes of the sonars, written with each new one.
    sonar: Output<SonarScan>,
    /// Odometry of the wheels.
    odometry: Output<Odometry>,
    /// State of the bumpers.
    bumper: Output<Bumper>,
    /// State of charge of the battery.
    battery: Output<Battery>,
    /// Status of the robot and of its connection.
    #[safe(PioneerStatus::default())]
    status: Output<PioneerStatus>,
    /// Drive status: true if the wheels obey.
    #[role("driver_status")]
    #[safe(DriverStatus::FAULT)]
    drive: Output<DriverStatus>,
}

/// Parameters of [`Pioneer`]; a change restarts the connection.
#[params]
#[derive(PartialEq)]
pub struct PioneerParams {
    #[param(default = "/dev/ttyUSB0", doc = "serial device, preferably of /dev/serial/by-id")]
    device: Text<252>,
    #[param(default = 9600, range = 9600..=115_200, unit = "baud", doc = "baud rate of the robot")]
    baud: u64,
    #[param(default = "", doc = "robot model, such as `p3dx-sh`; empty for that of the controller")]
    model: Text<28>,
    #[param(default = 16, range = 0..=16, doc = "number of sonars: 8 with a front array alone")]
    sonars: u64,
    #[param(default = 0.2, range = 0.05..=1.0, unit = "s", doc = "time to live of a wheel command")]
    time_to_live: f64,
    #[param(default = "wheels", doc = "actuator of the wheels, which is stopped on a lost connection")]
    actuator: Text<60>,
}

/// State of [`Pioneer`]. The connection is not saved, but opened again.
#[derive(Debug, Default, Serialize, Deserialize)]
pub struct PioneerState {
    /// Pose from wheel odometry: x, y, theta.
    pose: [f64; 3],
    #[serde(skip)]
    status: PioneerStatus,
    /// DriverSettings of the thread.
    #[serde(skip)]
    params: Option<PioneerParams>,
}

/// Drives a Pioneer by its ARCOS controller at a serial device.
///
/// A thread owns the device; the tick exchanges reports and commands with it, and never blocks.
pub struct Pioneer;

const DRIVER: &str = "driver";

#[module(stage = SensorAcquire)]
impl Module for Pioneer {
    type Io = PioneerIo;
    type Params = PioneerParams;
    type State = PioneerState;

    const DESCRIBES_HARDWARE: bool = true;

    fn hardware(_: &Setup<'_>, params: &PioneerParams) -> Result<Vec<Hardware>, Refusal> {
        // All that are known have the same body.
        let model = model(params)?.unwrap_or(&MODELS[0]);
        let mut sensors = vec![
            HardwareDevice::new("odometry", Odometry::DESCRIPTOR.name),
            HardwareDevice::new("bumper", Bumper::DESCRIPTOR.name),
        ];
        if params.sonars > 0 {
            let count = u32::try_from(params.sonars).unwrap_or(u32::MAX);
            let sonar = HardwareDevice::new("sonar", SonarScan::DESCRIPTOR.name);
            sensors.push(HardwareDevice { count, ..sonar });
        }
        Ok(vec![Hardware {
            robot: model.chassis().model.as_str().into(),
            ports: String::new(),
            setting: "params.model".into(),
            drive: Some(HardwareDrive { wheel_radius: model.wheel_radius, track: model.track }),
            sensors,
            actuators: vec![HardwareDevice::new("wheels", WheelSpeeds::DESCRIPTOR.name)],
        }])
    }

    fn create(_: &Setup<'_>, params: &PioneerParams) -> Result<PioneerState, Refusal> {
        model(params)?;
        Ok(PioneerState::default())
    }

    fn tick(state: &mut PioneerState, io: &PioneerIo, params: &PioneerParams, now: &Tick) -> Outcome {
        if !io.threads.is_running(DRIVER) {
            state.status = PioneerStatus::default();
            state.params = Some(*params);
            let spawned = settings(params, state)
                .and_then(|settings| io.threads.spawn(DRIVER, |stop| driver::run(stop, settings)));
            if let Err(reason) = spawned {
                now.error(format_args!("{reason}"));
                return Outcome::Failed;
            }
        } else if state.params != Some(*params) {
            // The next tick that finds it ended begins another one.
            io.threads.stop(DRIVER);
        }
        let losses = state.status.losses;
        while let Ok(Some(reading)) = io.threads.receive::<Reading>(DRIVER) {
            state.take(&reading, io, now);
        }
        let is_lost = state.status.losses > losses;
        if is_lost {
            keep_still(io, params, now);
        }
        // All that are known have the same body.
        io.chassis.set(model(params).ok().flatten().unwrap_or(&MODELS[0]).chassis());
        // A command from before the stop must not reach a reconnected robot.
        let command = io.wheels.fresh().filter(|_| !is_lost);
        let WheelSpeeds { left, right } = command.copied().unwrap_or(WheelSpeeds::ZERO);
        // Without room the thread has not looked for long, and finds the command too old in any case.
        let sent = io.threads.send(DRIVER, &Order { left, right });
        let status = &state.status;
        let is_well = status.connection == Connection::UP
            && status.motors.get()
            && !(status.left_stalled.get() || status.right_stalled.get());
        io.drive.set(DriverStatus { fault: (!is_well || sent != Ok(true)).into() });
        if sent == Ok(true) && command.is_some() && is_well { Outcome::Ok } else { Outcome::Degraded }
    }
}

/// Age above which a reading is discarded, nanoseconds.
const OLD: u64 = 500_000_000;

impl PioneerState {
    fn take(&mut self, reading: &Reading, io: &PioneerIo, now: &Tick) {
        if reading.status != self.status {
            self.status = reading.status;
            io.status.set(reading.status);
        }
        let is_old = now.now().saturating_sub(reading.time) > OLD;
        if reading.status.connection != Connection::UP || is_old {
            return;
        }
        let slate_interfaces::Pose2 { x, y, theta } = reading.odometry.pose;
        self.pose = [x, y, theta];
        io.odometry.set(reading.odometry);
        io.bumper.set(reading.bumper);
        io.battery.set(Battery { voltage: reading.voltage });
        if reading.heard.get() {
            io.sonar.set(reading.sonar);
        }
    }
}

/// Stops the actuator after a lost connection, until it is armed again.
/// People may stand beside a reconnected robot, so it moves only after a person has armed it.
fn keep_still(io: &PioneerIo, params: &PioneerParams, now: &Tick) {
    let actuator = params.actuator.as_str();
    let reason = "the connection to the robot was lost";
    if let Err(refusal) = io.actuators.stop(actuator, reason) {
        now.warn(format_args!(
            "{refusal}, so all are stopped: name that of the robot's wheels in `actuator`"
        ));
        io.actuators.stop_all(reason);
    }
    now.warn(format_args!(
        "{reason}: it does not move when it is back, until `slate reset` and then `slate arm` let it"
    ));
}

fn model(params: &PioneerParams) -> Result<Option<&'static Model>, Refusal> {
    let name = params.model.as_str();
    if name.is_empty() {
        return Ok(None);
    }
    let known = || MODELS.map(|model| model.name).join(", ");
    Model::named(name).map(Some).ok_or_else(|| Refusal(format!("unknown robot `{name}`; known: {}", known())))
}

fn settings(params: &PioneerParams, state: &PioneerState) -> Result<DriverSettings, Refusal> {
    let [x, y, theta] = state.pose;
    Ok(DriverSettings {
        device: PathBuf::from(params.device.as_str()),
        baud: params.baud as u32,
        model: model(params)?,
        sonars: params.sonars as usize,
        time_to_live: Duration::from_secs_f64(params.time_to_live),
        pose: slate_interfaces::Pose2 { x, y, theta },
    })
}
