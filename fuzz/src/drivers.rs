//! Output of devices to their drivers.

use std::time::Duration;

use slate_drivers::DeviceProtocol;
use slate_drivers::gps::session::{GpsOptions, GpsSession};
use slate_drivers::hokuyo::session::{HokuyoOptions, HokuyoSession};
use slate_drivers::imu::session::{ImuOptions, ImuSession};
use slate_drivers::joystick::session::JoystickSession;
use slate_drivers::rplidar::session::{RplidarOptions, RplidarSession};

use crate::input::Input;
use crate::memory::within;

/// Number of conversations: laser scanners, receiver, IMU and joystick.
pub const DEVICES: u8 = 5;

/// Session with a scanner of Hokuyo.
pub fn hokuyo() -> HokuyoSession {
    HokuyoSession::new(HokuyoOptions { angle_min: -3.2, angle_max: 3.2, cluster: 1, skip: 0 })
}

/// Session with an RPLIDAR.
pub fn rplidar() -> RplidarSession {
    RplidarSession::new(RplidarOptions { beams: 360, range_min: 0.15, range_max: 12.0, motor: 660 })
}

/// Session with a satellite receiver.
pub fn gps() -> GpsSession {
    GpsSession::new(GpsOptions { rate: 1.0, range_error_stddev: 4.0 })
}

/// Session with an inertial measurement unit.
pub fn imu() -> ImuSession {
    let options = ImuOptions {
        rate: 50,
        orientation_stddev: 0.0,
        angular_velocity_stddev: 0.0,
        linear_acceleration_stddev: 0.0,
    };
    ImuSession::new(options)
}

/// Reads a script: which device, the length of pieces, and what it says.
pub fn run(script: &[u8]) {
    let mut script = Input(script);
    let (device, piece) = (script.byte() % DEVICES, usize::from(script.byte()) + 1);
    let bytes = script.0;
    within(1 << 20, || match device {
        0 => talk(hokuyo(), bytes, piece, |sweep| {
            assert!(sweep.angle_increment > 0.0 && sweep.ranges.iter().all(|range| *range >= 0.0));
        }),
        1 => talk(rplidar(), bytes, piece, |sweep| {
            assert!(sweep.ranges.len() == 360 && sweep.ranges.iter().all(|range| *range >= 0.0));
        }),
        2 => talk(gps(), bytes, piece, |fix| {
            assert!(!(fix.latitude.abs() > 90.0 || fix.longitude.abs() > 180.0));
        }),
        3 => talk(imu(), bytes, piece, |imu| {
            assert!(imu.angular_velocity.x.is_finite() && imu.orientation.w.is_finite());
        }),
        _ => talk(JoystickSession::new(0.05), bytes, piece, |joy| {
            assert!(joy.axes.iter().all(|axis| (-1.0..=1.0).contains(axis)));
        }),
    });
}

/// A device says all of it in pieces, a tenth of a second apart.
fn talk<C: DeviceProtocol>(mut conversation: C, bytes: &[u8], piece: usize, mut take: impl FnMut(&C::Value)) {
    let (mut now, mut outgoing) = (Duration::ZERO, Vec::new());
    conversation.begin(now, &mut outgoing);
    for piece in bytes.chunks(piece) {
        now += Duration::from_millis(100);
        conversation.receive(piece, now, &mut outgoing, &mut |value| take(value));
        outgoing.clear();
        if conversation.poll(now, &mut outgoing).is_err() {
            conversation.begin(now, &mut outgoing);
        }
        assert!(outgoing.len() < 1024, "it says more than it is asked");
        let _ = (conversation.device_error(), conversation.identity(), conversation.damaged());
    }
}
