//! Inertial measurement units.

use std::time::Duration;

use proptest::prelude::*;
use slate_device_line::simulated::Faults;
use slate_drivers::DeviceProtocol;
use slate_drivers::imu::message::VectorNavMessage;
use slate_drivers::imu::session::{ImuOptions, ImuSession};
use slate_drivers::simulated::SimulatedImu;
use slate_interfaces::Imu;

use crate::common::{Running, Talk, at_terminal, refusal, survives_a_pulled_cable};

const OPTIONS: ImuOptions = ImuOptions {
    rate: 100,
    orientation_stddev: 0.1,
    angular_velocity_stddev: 0.0,
    linear_acceleration_stddev: 0.5,
};

fn measured(sensor: SimulatedImu) -> Imu {
    let mut talk = Talk::new(ImuSession::new(OPTIONS), sensor);
    talk.pass(Duration::from_millis(100), 9).unwrap().pop().unwrap()
}

/// The device's axes in the frame x east, y north, z up.
fn axes(imu: &Imu) -> [[f64; 3]; 3] {
    let slate_interfaces::Quaternion { x, y, z, w } = imu.orientation;
    [
        [1.0 - 2.0 * (y * y + z * z), 2.0 * (x * y + w * z), 2.0 * (x * z - w * y)],
        [2.0 * (x * y - w * z), 1.0 - 2.0 * (x * x + z * z), 2.0 * (y * z + w * x)],
        [2.0 * (x * z + w * y), 2.0 * (y * z - w * x), 1.0 - 2.0 * (x * x + y * y)],
    ]
}

fn close(one: [f64; 3], other: [f64; 3]) -> bool {
    one.iter().zip(other).all(|(one, other)| (one - other).abs() < 1e-5)
}

#[test]
fn imu_measurement_arrives_as_sent_in_axes_of_robots() {
    let mut sensor = SimulatedImu::default();
    sensor.set_angular_velocity([0.1, 0.2, -0.3]);
    sensor.set_acceleration([1.5, -0.5, -9.81]);
    let device = at_terminal(sensor);
    let running = Running::well("vector_nav", device.name(), "params.rate = 100");
    let vector = |name: &str| ["x", "y", "z"].map(|axis| running.number(&format!("imu/{name}/{axis}")));
    assert!(close(vector("angular_velocity"), [0.1, -0.2, 0.3]));
    assert!(close(vector("linear_acceleration"), [1.5, 0.5, 9.81]));
    assert_eq!(running.text(), "VN-100S-CR");
    assert_eq!(device.with(|sensor| sensor.rate()), 100);
    survives_a_pulled_cable(&running, &device);
}

pub fn imu_survives_damage_noise_and_a_lost_setting() {
    let device = at_terminal(SimulatedImu::default());
    let running = Running::well("vector_nav", device.name(), "params.rate = 50");
    device.set_faults(Faults { corrupt: 5e-3, ..Faults::default() });
    running.until("damage", || running.number("status/damaged") > 2.0);
    device.set_faults(Faults { noise: true, ..Faults::default() });
    running.until_text("only noise is on the line");
    // It is switched off and on, and sends something else than it was told.
    device.with(|sensor| *sensor = SimulatedImu::default());
    device.set_faults(Faults::default());
    running.until("measurements", || running.is_well());
}

#[test]
fn imu_orientation_is_that_of_robots() {
    let at = |attitude: [f64; 3]| {
        let mut sensor = SimulatedImu::default();
        sensor.set_attitude(attitude);
        axes(&measured(sensor))
    };
    // To the north, to the east; z is up.
    let [forward, _, up] = at([0.0, 0.0, 0.0]);
    assert!(close(forward, [0.0, 1.0, 0.0]) && close(up, [0.0, 0.0, 1.0]));
    assert!(close(at([90.0, 0.0, 0.0])[0], [1.0, 0.0, 0.0]));
    // Nose up to the north, right side down to the north.
    assert!(close(at([0.0, 90.0, 0.0])[0], [0.0, 0.0, 1.0]));
    assert!(close(at([0.0, 0.0, 90.0])[1], [0.0, 0.0, 1.0]));
    let imu = measured(SimulatedImu::default());
    assert_eq!(imu.orientation_covariance[4], 0.1 * 0.1);
    assert_eq!(imu.angular_velocity_covariance, [0.0; 9]);
    assert_eq!(imu.linear_acceleration_covariance[0], 0.25);
}

#[test]
fn imu_errors_are_reported_in_words() {
    let mut session = ImuSession::new(OPTIONS);
    let mut bytes = Vec::new();
    slate_drivers::sentence::append("VNERR,0C", &mut bytes);
    session.receive(&bytes, Duration::ZERO, &mut Vec::new(), &mut |_| ());
    assert!(
        session
            .device_error()
            .is_some_and(|device_error| device_error.contains("raise the sensor's baud rate"))
    );
    assert!(refusal("vector_nav", "params.rate = 60").contains("expected one of 1, 2, 4"));
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]

    #[test]
    fn imu_takes_any_bytes(text in "(\\$VN(YMR|ERR|RRG|WRG),[0-9,.+\\-]{0,120}\\*[0-9A-F]{2}\r\n|.{0,20}){0,20}") {
        let mut session = ImuSession::new(OPTIONS);
        session.receive(text.as_bytes(), Duration::ZERO, &mut Vec::new(), &mut |_| ());
        for body in text.split(['$', '*']) {
            let _ = VectorNavMessage::parse(body);
        }
    }

    #[test]
    fn imu_axes_stay_perpendicular(yaw in -180.0..180.0, pitch in -90.0..90.0, roll in -180.0..180.0) {
        let body = format!("VNYMR,{yaw:.3},{pitch:.3},{roll:.3},0,0,0,0,0,-9.81,0,0,0");
        let Some(VectorNavMessage::Sample(sample)) = VectorNavMessage::parse(&body) else { panic!("{body}") };
        let slate_interfaces::Quaternion { x, y, z, w } = sample.orientation;
        prop_assert!((x * x + y * y + z * z + w * w - 1.0).abs() < 1e-12);
        // Gravity in the device's frame: what is up by pitch and roll is up in the frame of the world.
        let [forward, left, up] = axes(&Imu { orientation: sample.orientation, ..Imu::default() });
        prop_assert!((forward[2] - sine(pitch)).abs() < 1e-4);
        prop_assert!((left[2] - sine(roll) * cosine(pitch)).abs() < 1e-4);
        prop_assert!((up[2] - cosine(roll) * cosine(pitch)).abs() < 1e-4);
    }
}

fn sine(degrees: f64) -> f64 {
    slate_module::math::sin(degrees.to_radians())
}

fn cosine(degrees: f64) -> f64 {
    slate_module::math::cos(degrees.to_radians())
}
