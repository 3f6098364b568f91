//! Sensors in front of drivers, the health of sensors, and the kinematics of drives.

use proptest::prelude::*;
use slate_interfaces::{FourWheelSpeeds, LaserScan, Twist2, WheelSpeeds};
use slate_mapek::prelude::*;
use slate_mapek::{Device, Kinematics, KnowledgeBlock, MonitorBlock, SensorBlock, Steering, driver_sensors};
use slate_module::Trigger;
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
struct SlowGauge {
    #[stale(after = "200ms")]
    gauge: Sensed<Near>,
    robot: Input<RobotModel>,
}

/// Hands on what it senses, by a device of the robot model.
struct SlowMonitor;

impl Monitor for SlowMonitor {
    const NAME: &'static str = "slow_monitor";
    type Sensors = SlowGauge;
    type Params = ();
    type State = ();
    type Value = Near;

    fn interpret((): &mut (), sensors: &SlowGauge, (): &(), _: &Tick) -> Option<Near> {
        let (near, gauge) =
            (sensors.gauge.updated()?, sensors.robot.get().and_then(|robot| robot.sensor("gauge")));
        gauge.is_none_or(|gauge| gauge.permits(near.distance)).then_some(*near)
    }

    fn device<'s>(sensors: &'s SlowGauge, port: &str) -> Option<&'s Device> {
        sensors.robot.get()?.sensor(port)
    }
}

#[test]
fn a_monitor_finds_limits_and_rate_in_the_robot_model() {
    let gauge =
        Device { minimum: 0.5, maximum: 4.0, rate: 0.5, name: Text::new("gauge"), ..Device::default() };
    let mut monitor = Fixture::<MonitorBlock<SlowMonitor>>::new();
    let mut after = |seconds: u64, is_known: bool| {
        monitor.set("gauge", Near { distance: 1.0 });
        monitor.tick();
        if is_known {
            let sensors = Sequence::new(&[gauge]);
            monitor.set("robot", RobotModel { sensors, ..RobotModel::default() });
        }
        monitor.advance(seconds * 1_000_000_000);
        monitor.expire("gauge");
        monitor.tick()
    };
    assert_eq!(after(9, false), Outcome::Degraded, "the port alone says when it has stopped");
    assert_eq!(after(9, true), Outcome::Ok, "five periods have not passed");
    assert_eq!(after(11, true), Outcome::Degraded);
    let mut passes = |distance| {
        monitor.set("gauge", Near { distance });
        monitor.tick();
        monitor.wrote("percept")
    };
    assert_eq!([passes(0.4), passes(0.5), passes(4.0), passes(4.1)], [false, true, true, false]);
}

#[test]
fn knowledge_beside_sensors_triggers_no_monitor() {
    let triggers = |trigger: Trigger| match trigger {
        Trigger::On { ports, .. } => ports,
        _ => Vec::new(),
    };
    assert_eq!(triggers(MonitorBlock::<SlowMonitor>::spec().trigger), ["gauge"]);
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
    /// Time of the newest measurement, and health.
    type State = (u64, u8);

    fn update(state: &mut (u64, u8), models: &Models, (): &(), now: &Tick) {
        let (measured, health) = (state.0, DeviceHealth(state.1));
        let mut gauge = Device { rate: 5.0, measured, health, name: Text::new("gauge"), ..Device::default() };
        gauge.watch(&models.gauge, now);
        *state = (gauge.measured, gauge.health.0);
        models.robot.set(RobotModel { sensors: Sequence::new(&[gauge]), ..RobotModel::default() });
    }
}

/// Health of the sensor after a time in milliseconds, at whose end it measures or not; unknown without a model.
fn health(knowledge: &mut Fixture<KnowledgeBlock<Body>>, milliseconds: u64, measures: bool) -> DeviceHealth {
    knowledge.advance(milliseconds * 1_000_000);
    if measures {
        knowledge.set("gauge", Near { distance: 1.0 });
    }
    knowledge.tick();
    let robot = knowledge.output::<RobotModel>("robot").unwrap_or_default();
    let health = robot.sensor("gauge").map_or(DeviceHealth::UNKNOWN, |gauge| gauge.health);
    assert_eq!(robot.is_silent("gauge"), health == DeviceHealth::SILENT);
    health
}

#[test]
fn a_sensor_of_5_hz_has_stopped_after_five_periods_only() {
    let mut knowledge = Fixture::<KnowledgeBlock<Body>>::new();
    assert_eq!(health(&mut knowledge, 0, false), DeviceHealth::UNKNOWN);
    assert_eq!(health(&mut knowledge, 20, true), DeviceHealth::FRESH);
    for _ in 0..4 {
        assert_eq!(health(&mut knowledge, 200, false), DeviceHealth::FRESH, "it loses single measurements");
    }
    assert_eq!(health(&mut knowledge, 220, false), DeviceHealth::SILENT);
}

#[test]
fn a_sensor_is_fresh_again_after_two_measurements_in_time() {
    let mut knowledge = Fixture::<KnowledgeBlock<Body>>::new();
    health(&mut knowledge, 20, true);
    assert_eq!(health(&mut knowledge, 1100, true), DeviceHealth::LATE, "one after a gap is not enough");
    assert_eq!(health(&mut knowledge, 20, false), DeviceHealth::LATE);
    assert_eq!(health(&mut knowledge, 180, true), DeviceHealth::FRESH);
    assert_eq!(health(&mut knowledge, 400, true), DeviceHealth::FRESH);
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
