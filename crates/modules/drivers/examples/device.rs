//! Simulated device on a pseudo-terminal or a port.
//! Run it with `cargo run -p slate-drivers --example device -- hokuyo`.

use std::path::PathBuf;
use std::time::Duration;

use clap::{Parser, ValueEnum};
use slate_drivers::gps::message::GeographicPoint;
use slate_drivers::simulated::{
    DeviceFirmware, Faults, SimulatedDevice, SimulatedGps, SimulatedHokuyo, SimulatedImu, SimulatedJoystick,
    SimulatedLine, SimulatedRplidar, SimulationError,
};

/// Answers at a pseudo-terminal, or at a port, like a device.
#[derive(Parser)]
struct Arguments {
    /// Kind of the device
    kind: DeviceKind,
    /// Path that leads to the pseudo-terminal
    #[arg(long)]
    link: Option<PathBuf>,
    /// Port of TCP in place of a pseudo-terminal
    #[arg(long, conflicts_with = "link")]
    port: Option<u16>,
    /// Probability that a byte on the line is lost
    #[arg(long, default_value_t = 0.0)]
    drop: f64,
    /// Probability that a byte on the line is damaged
    #[arg(long, default_value_t = 0.0)]
    corrupt: f64,
    /// Number of seconds after which the cable is unplugged for five, repeatedly
    #[arg(long)]
    pull_after: Option<u64>,
}

#[derive(Clone, Copy, ValueEnum)]
enum DeviceKind {
    Hokuyo,
    Rplidar,
    Gps,
    Imu,
    Joystick,
}

fn main() {
    let arguments = Arguments::parse();
    let ended = match arguments.kind {
        DeviceKind::Hokuyo => run(&arguments, SimulatedHokuyo::default(), |scanner, second| {
            // A wall that comes and goes.
            scanner.set_distances(|step| 1000 + u32::from(step) + 100 * (second % 20) as u32);
        }),
        DeviceKind::Rplidar => run(&arguments, SimulatedRplidar::default(), |scanner, second| {
            scanner.set_distances(|degree| 4000 + 20 * degree + 400 * (second % 20) as u16);
        }),
        DeviceKind::Gps => run(&arguments, SimulatedGps::default(), |receiver, second| {
            // To the north at a meter per second; without a fix for ten seconds of each minute.
            let latitude = 48.0 + second as f64 * 9e-6;
            let point = GeographicPoint { latitude, longitude: 11.0 };
            receiver.set_point((second % 60 < 50).then_some(point));
        }),
        DeviceKind::Imu => run(&arguments, SimulatedImu::default(), |sensor, second| {
            sensor.set_attitude([(second * 6 % 360) as f64, 0.0, 0.0]);
            sensor.set_angular_velocity([0.0, 0.0, 0.1]);
        }),
        DeviceKind::Joystick => run(&arguments, SimulatedJoystick::default(), |joystick, second| {
            // The dead-man button is held for five of ten seconds.
            joystick.press(4, second % 10 < 5);
            joystick.tilt(1, -16_000);
        }),
    };
    if let Err(error) = ended {
        eprintln!("{error}");
        std::process::exit(1);
    }
}

fn run<F: DeviceFirmware>(
    arguments: &Arguments,
    firmware: F,
    mut change: impl FnMut(&mut F, u64),
) -> Result<(), SimulationError> {
    let line = match arguments.port {
        Some(port) => SimulatedLine::Tcp(port),
        None => SimulatedLine::Terminal(arguments.link.clone()),
    };
    let device = SimulatedDevice::start(firmware, line)?;
    device.set_faults(Faults { drop: arguments.drop, corrupt: arguments.corrupt, ..Faults::default() });
    println!("{}", device.name());
    for second in 0_u64.. {
        device.with(|firmware| change(firmware, second));
        if let Some(after) = arguments.pull_after.filter(|after| *after > 0) {
            match second % (after + 5) {
                time if time == after => device.unplug(),
                0 if second > 0 => device.plug()?,
                _ => {}
            }
        }
        std::thread::sleep(Duration::from_secs(1));
    }
    Ok(())
}
