//! Sensors in front of drivers, the health of sensors, and the kinematics of drives.

use proptest::prelude::*;
use slate_interfaces::{FourWheelSpeeds, LaserScan, Twist2, WheelSpeeds};
use slate_mapek::prelude::*;
use slate_mapek::{Device, Kinematics, KnowledgeBlock, MonitorBlock, SensorBlock, Steering, driver_sensors};
use slate_module::prelude::*;
use slate_module::testing::Fixture;

use crate::common::Near;

driver_sensors! {
    Laser("test_laser", "A laser scanner."): LaserScan,
}

#[test]
fn a_sensor_hands_on_a_laser_scan_of_a_driver() {
    assert_eq!(Laser::NAME, "test_laser");
    let mut laser = Fixture::<SensorBlock<Laser>>::new();
    laser.tick();
    assert!(!laser.wrote("value"), "the driver has not measured yet");
    laser.write("source", 683, |scan: &mut LaserScan| {
        scan.range_max = 4.0;
        scan.ranges.fill(1.5);
    });
    laser.tick();
    let read = laser.read("value", |scan: &LaserScan| (scan.range_max, scan.ranges.len(), scan.ranges[682]));
    assert_eq!(read, Some((4.0, 683, 1.5)));
    laser.tick();
    assert!(!laser.wrote("value"), "it has measured nothing since");
}

#[ports]
struct GaugeSensor {
    #[stale(after = "200ms")]
    gauge: Sensed<Near>,
}

/// Hands on what it senses.
struct GaugeMonitor;

impl Monitor for GaugeMonitor {
    const NAME: &'static str = "gauge_monitor";
    type Sensors = GaugeSensor;
    type Params = ();
    type State = ();
    type Value = Near;

    fn interpret((): &mut (), sensors: &GaugeSensor, (): &(), _: &Tick) -> Option<Near> {
        sensors.gauge.fresh().copied()
    }
}

#[test]
fn a_monitor_is_degraded_while_its_sensor_is_silent() {
    let mut monitor = Fixture::<MonitorBlock<GaugeMonitor>>::new();
    assert_eq!(monitor.tick(), Outcome::Ok, "it may begin before its sensor");
    monitor.set("gauge", Near { distance: 1.0 });
    assert_eq!(monitor.tick(), Outcome::Ok);
    monitor.advance(200_000_000);
    monitor.expire("gauge");
    assert_eq!(monitor.tick(), Outcome::Degraded);
    monitor.set("gauge", Near { distance: 1.0 });
    assert_eq!(monitor.tick(), Outcome::Ok);
}

#[ports]
struct Models {
    #[stale(after = "200ms")]
    gauge: Sensed<Near>,
    robot: Output<RobotModel>,
}

/// Knows one sensor.
struct Body;

impl Knowledge for Body {
    const NAME: &'static str = "body";
    type Models = Models;
    type Params = ();
    type State = ();

    fn update((): &mut (), models: &Models, (): &(), now: &Tick) {
        let mut gauge = Device { rate: 20.0, name: Text::new("gauge"), ..Device::default() };
        gauge.watch(&models.gauge, now);
        models.robot.set(RobotModel { sensors: Sequence::new(&[gauge]), ..RobotModel::default() });
    }
}

#[test]
fn a_sensor_is_fresh_then_late_then_silent() {
    let mut knowledge = Fixture::<KnowledgeBlock<Body>>::new();
    let health = |knowledge: &mut Fixture<KnowledgeBlock<Body>>| {
        knowledge.tick();
        let robot = knowledge.output::<RobotModel>("robot").unwrap();
        assert_eq!(robot.is_silent("gauge"), robot.sensor("gauge").unwrap().health == DeviceHealth::SILENT);
        robot.sensor("gauge").unwrap().health
    };
    assert_eq!(health(&mut knowledge), DeviceHealth::UNKNOWN);
    knowledge.set("gauge", Near { distance: 1.0 });
    assert_eq!(health(&mut knowledge), DeviceHealth::FRESH);
    knowledge.advance(110_000_000);
    assert_eq!(health(&mut knowledge), DeviceHealth::LATE);
    knowledge.expire("gauge");
    assert_eq!(health(&mut knowledge), DeviceHealth::SILENT);
    knowledge.set("gauge", Near { distance: 1.0 });
    assert_eq!(health(&mut knowledge), DeviceHealth::FRESH);
}

#[test]
fn an_unknown_drive_stands() {
    let twist = Twist2 { linear: 1.0, angular: 1.0 };
    assert_eq!(Kinematics::default().wheels_for(twist), WheelSpeeds::ZERO);
    assert_eq!(Kinematics::default().twist_of(WheelSpeeds { left: 1.0, right: 2.0 }), Twist2::ZERO);
}

proptest! {
    #[test]
    fn forward_and_inverse_kinematics_are_inverse(
        (radius, track) in (0.01..0.5_f64, 0.05..2.0_f64),
        (linear, angular) in (-2.0..2.0_f64, -4.0..4.0_f64),
        (left, right) in (-15.0..15.0_f64, -15.0..15.0_f64),
        skids in any::<bool>(),
    ) {
        let steering = if skids { Steering::SKID_STEER } else { Steering::DIFFERENTIAL };
        let drive = Kinematics { wheel_radius: radius, track, steering };
        let twist = Twist2 { linear, angular };
        for back in [drive.twist_of(drive.wheels_for(twist)), drive.twist_of_four(drive.four_wheels_for(twist))] {
            prop_assert!((back.linear - linear).abs() < 1e-9 && (back.angular - angular).abs() < 1e-9, "{back:?}");
        }
        let wheels = drive.wheels_for(drive.twist_of(WheelSpeeds { left, right }));
        prop_assert!((wheels.left - left).abs() < 1e-9 && (wheels.right - right).abs() < 1e-9, "{wheels:?}");
        let four = FourWheelSpeeds { front_left: left, front_right: right, back_left: left, back_right: right };
        let four_back = drive.four_wheels_for(drive.twist_of_four(four));
        prop_assert!((four_back.front_left - left).abs() < 1e-9 && (four_back.back_right - right).abs() < 1e-9);
        // A turn to the left has the right wheels ahead.
        let turn = drive.wheels_for(Twist2 { linear: 0.0, angular: 1.0 });
        prop_assert!(turn.right > 0.0 && turn.left == -turn.right);
    }
}
