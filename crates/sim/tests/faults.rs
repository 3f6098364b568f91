//! Sensors that fail by script, and the laser scanner.

#![allow(clippy::unwrap_used, clippy::disallowed_methods)] // Tests say what went wrong by failing.

use slate_module::blackboard::interface::Value;
use slate_sim::drive::Wheels;
use slate_sim::fault::{Fault, FaultKind, FaultySensor};
use slate_sim::geometry::{Point, Pose};
use slate_sim::robot::RobotDescription;
use slate_sim::sonar::Echo;
use slate_sim::world::World;
use slate_sim::{Placement, Scenario, Simulation};

const STEP: u64 = 10_000_000;
const SECOND: u64 = 1_000_000_000;

/// A Pioneer that drives, with the real sonars and a laser scanner.
fn simulation(seed: u64) -> Simulation {
    let description = RobotDescription::load("pioneer_p3dx").unwrap();
    let laser = description.laser["urg_04lx"].clone();
    let pose = Pose { x: 0.0, y: 0.0, theta: 0.3 };
    let robot = Placement { name: "r".into(), description, sonar: "real".into(), pose, script: None };
    let mut simulation = Simulation::new(&World::load("rocs_arena").unwrap(), &[robot], seed, STEP).unwrap();
    simulation.mount_laser(0, &laser, seed);
    simulation.command(0, Wheels { left: 1.0, right: 1.5 });
    simulation
}

fn fault(kind: FaultKind) -> Fault {
    Fault { sensor: FaultySensor::Sonar, kind, from: SECOND, until: 2 * SECOND, delay: SECOND / 2 }
}

/// A time, what is shown at it, and what was measured.
type Shown = (u64, Option<Vec<Echo>>, Vec<Echo>);

/// What is shown in 3 s.
fn shown(mut simulation: Simulation) -> Vec<Shown> {
    (0..150)
        .map(|_| {
            simulation.step();
            simulation.step();
            simulation.sense();
            let shown = simulation.shown_sonar(0).map(<[_]>::to_vec);
            (simulation.now(), shown, simulation.sonar(0).unwrap().0.to_vec())
        })
        .collect()
}

fn with(kind: FaultKind) -> Vec<Shown> {
    let mut simulation = simulation(3);
    simulation.set_faults(0, &[fault(kind)]);
    shown(simulation)
}

fn fails(time: u64) -> bool {
    (SECOND..2 * SECOND).contains(&time)
}

#[test]
fn a_sensor_measures_except_during_its_fault() {
    for kind in [FaultKind::Frozen, FaultKind::Invalid, FaultKind::Late, FaultKind::Silent] {
        for (time, shown, measured) in with(kind) {
            assert_eq!(shown.as_ref() == Some(&measured), !fails(time), "{kind:?} at {time}");
        }
    }
}

#[test]
fn fault_changes_no_other_measurement() {
    let sound = shown(simulation(3));
    for kind in [FaultKind::Frozen, FaultKind::Invalid, FaultKind::Late, FaultKind::Silent] {
        let measured =
            |list: &[Shown]| list.iter().map(|(_, _, measured)| measured.clone()).collect::<Vec<_>>();
        assert_eq!(measured(&with(kind)), measured(&sound), "{kind:?}");
    }
}

#[test]
fn a_frozen_sensor_shows_its_last_measurement_again_and_again() {
    let all = with(FaultKind::Frozen);
    let (_, _, last) = all.iter().rfind(|(time, ..)| *time < SECOND).unwrap();
    let meanwhile: Vec<_> = all.iter().filter(|(time, ..)| fails(*time)).collect();
    assert_eq!(meanwhile.len(), 50);
    assert!(meanwhile.iter().all(|(_, shown, _)| shown.as_ref() == Some(last)));
}

#[test]
fn a_spoiled_sensor_shows_no_number_and_a_silent_one_nothing() {
    let meanwhile = |kind| with(kind).into_iter().filter(|(time, ..)| fails(*time));
    assert!(meanwhile(FaultKind::Invalid).all(|(_, shown, measured)| {
        let shown = shown.unwrap();
        shown.len() == measured.len() && shown.iter().all(|echo| echo.range.is_nan())
    }));
    assert!(meanwhile(FaultKind::Silent).all(|(_, shown, _)| shown.is_none()));
}

#[test]
fn a_late_sensor_repeats_old_measurements() {
    let all = with(FaultKind::Late);
    let measured = |at: u64| all.iter().find(|(time, ..)| *time == at).unwrap().2.clone();
    let shown: Vec<_> = all
        .iter()
        .filter(|(time, ..)| fails(*time))
        .filter_map(|(time, shown, _)| shown.clone().map(|shown| (*time, shown)))
        .collect();
    assert_eq!(
        shown,
        [(SECOND + SECOND / 2, measured(SECOND))],
        "the next would come when the fault is over"
    );
}

#[test]
fn a_fault_of_one_sensor_is_none_of_another() {
    let laser = |mut simulation: Simulation| {
        (0..150)
            .map(|_| {
                simulation.step();
                simulation.step();
                simulation.sense();
                simulation.shown_laser(0).map(|(ranges, _)| ranges.to_vec())
            })
            .collect::<Vec<_>>()
    };
    let mut failing = simulation(3);
    failing.set_faults(0, &[fault(FaultKind::Silent)]);
    let sound = laser(simulation(3));
    assert_eq!(laser(failing), sound);
    assert_eq!(sound.iter().flatten().count(), 31, "at first, and then ten times a second");
}

#[test]
fn a_laser_measures_the_way_to_the_walls_along_each_beam() {
    let mut description = RobotDescription::load("pioneer_p3dx").unwrap();
    let laser = description.laser.get_mut("urg_04lx").unwrap();
    (laser.noise_constant, laser.noise_proportional, laser.dropout) = (0.0, 0.0, 0.0);
    let laser = laser.clone();
    let pose = Pose { x: 1.0, y: -0.5, theta: 0.7 };
    let robot = Placement { name: "r".into(), description, sonar: String::new(), pose, script: None };
    let mut simulation = Simulation::new(&World::load("rocs_arena").unwrap(), &[robot], 0, STEP).unwrap();
    simulation.mount_laser(0, &laser, 0);
    simulation.sense();
    let (ranges, _) = simulation.shown_laser(0).unwrap();
    assert_eq!(ranges.len(), 683);
    let place = pose.frame().apply(Point::new(0.12, 0.0));
    let (mut seen, mut unseen) = (0, 0);
    for (beam, range) in ranges.iter().enumerate() {
        let angle = pose.theta + laser.angle_of(beam as u32);
        let (east, north) = (angle.cos(), angle.sin());
        // The inner faces of the walls: west, east, south, north.
        let east_or_west = (if east > 0.0 { 2.475 } else { -2.45 } - place.x) / east;
        let north_or_south = (if north > 0.0 { 2.475 } else { -2.425 } - place.y) / north;
        let expected = if east_or_west < north_or_south { east_or_west } else { north_or_south };
        if expected < 3.999 {
            assert!((f64::from(*range) - expected).abs() < 1e-5, "beam {beam}: {range}, not {expected}");
            seen += 1;
        } else if expected > 4.001 {
            assert!(range.is_infinite(), "beam {beam}: {range}");
            unseen += 1;
        }
    }
    assert!(seen > 500 && unseen > 3, "{seen} and {unseen}");
}

#[test]
fn a_fault_of_position_compass_or_odometry_is_shown() {
    let during = |sensor, kind| {
        let mut simulation = simulation(3);
        simulation.set_faults(0, &[Fault { sensor, ..fault(kind) }]);
        let (mut shown, mut valid) = ([0; 3], [0; 3]);
        for _ in 0..100 {
            simulation.step();
            simulation.step();
            if !fails(simulation.now()) {
                simulation.shown_fix(0);
                simulation.shown_odometry(0);
                continue;
            }
            let fix = simulation.shown_fix(0);
            let values = [
                fix.position.map(|position| position.x),
                fix.orientation,
                simulation.shown_odometry(0).map(|(pose, _)| pose.x),
            ];
            for (number, value) in values.into_iter().enumerate() {
                shown[number] += u32::from(value.is_some());
                valid[number] += u32::from(value.is_some_and(f64::is_finite));
            }
        }
        (shown, valid)
    };
    let all = during(FaultySensor::Laser, FaultKind::Silent).0;
    assert!(all.iter().all(|count| *count > 40), "{all:?}");
    let sensors = [FaultySensor::Position, FaultySensor::Orientation, FaultySensor::Odometry];
    for (number, sensor) in sensors.into_iter().enumerate() {
        let mut expected = all;
        expected[number] = 0;
        assert_eq!(during(sensor, FaultKind::Silent), (expected, expected), "{sensor:?} is silent alone");
        assert_eq!(during(sensor, FaultKind::Invalid), (all, expected), "{sensor:?} alone shows no number");
    }
}

/// A `[world]` table with a Pioneer `r` that carries a laser, and a fault `f`.
fn scenario(fault: &str) -> Result<Scenario, String> {
    let text = format!(
        r#"{{"arena": "rocs_arena", "layout": "one", "sonar": "real",
            "robots": {{"r": {{"model": "pioneer_p3dx", "laser": "urg_04lx"}}, "s": {{"model": "summit_xl", "sonar": ""}}}},
            "layouts": {{"one": {{"robots": {{"r": {{"x": 0, "y": 0, "theta": 0}}, "s": {{"x": 1, "y": 1, "theta": 0}}}}}}}},
            "faults": {{"f": {fault}}}}}"#
    );
    let table: Value = serde_json::from_str(&text).unwrap();
    Scenario::new(&table, 0).map_err(|error| error.to_string())
}

#[test]
fn a_fault_is_read_from_the_configuration() {
    let read =
        scenario(r#"{"robot": "r", "sensor": "laser", "kind": "late", "from": 1, "until": 2.5}"#).unwrap();
    let expected = Fault {
        sensor: FaultySensor::Laser,
        kind: FaultKind::Late,
        from: SECOND,
        until: 5 * SECOND / 2,
        delay: SECOND / 2,
    };
    assert_eq!(read.faults["r"], [expected]);
    assert_eq!(read.lasers["r"].beams, 683);
}

#[test]
fn a_fault_without_an_end_lasts_to_the_end_of_the_run() {
    let read = scenario(r#"{"robot": "r", "sensor": "sonar", "kind": "silent", "from": 1}"#).unwrap();
    assert_eq!(read.faults["r"][0].until, u64::MAX);
}

#[test]
fn an_invalid_fault_is_refused_with_its_place() {
    for (fault, words) in [
        (
            r#"{"robot": "q", "sensor": "sonar", "kind": "invalid", "from": 1, "until": 2}"#,
            &["world.faults.f.robot: ", "`q`", "r, s"][..],
        ),
        (
            r#"{"robot": "r", "sensor": "nose", "kind": "invalid", "from": 1, "until": 2}"#,
            &["world.faults.f.sensor: ", "`nose`", "laser, odometry, orientation, position, sonar"],
        ),
        (
            r#"{"robot": "s", "sensor": "sonar", "kind": "invalid", "from": 1, "until": 2}"#,
            &[
                "world.faults.f.sensor: ",
                "`s` has no sensor `sonar`",
                "it has odometry, orientation, position",
            ],
        ),
        (
            r#"{"robot": "r", "sensor": "sonar", "kind": "odd", "from": 1, "until": 2}"#,
            &["world.faults.f.kind: ", "`odd`", "frozen, invalid, late, silent"],
        ),
        (
            r#"{"robot": "r", "sensor": "sonar", "kind": "invalid", "from": -1, "until": 2}"#,
            &["world.faults.f.from: ", "not negative"],
        ),
        (
            r#"{"robot": "r", "sensor": "sonar", "kind": "invalid", "from": 3, "until": 2}"#,
            &["world.faults.f.until: ", "later than `from`"],
        ),
        (
            r#"{"robot": "r", "sensor": "sonar", "kind": "late", "from": 1, "until": 2, "delay": 0}"#,
            &["world.faults.f.delay: ", "positive"],
        ),
        (
            r#"{"robot": "r", "sensor": "sonar", "kind": "invalid", "until": 2}"#,
            &["world.faults.f: ", "from"],
        ),
        (
            r#"{"robot": "r", "sensor": "sonar", "kind": "invalid", "from": 1, "until": 2, "for": 1}"#,
            &["world.faults.f: ", "for"],
        ),
    ] {
        let text = scenario(fault).unwrap_err();
        assert!(text.starts_with(words[0]), "{text}");
        assert!(words.iter().all(|word| text.contains(word)), "{words:?} is not all in: {text}");
    }
    let twice = r#"{"robot": "r", "sensor": "sonar", "kind": "invalid", "from": 1, "until": 2},
        "g": {"robot": "r", "sensor": "sonar", "kind": "frozen", "from": 1.5, "until": 3}"#;
    let text = scenario(twice).unwrap_err();
    assert!(text.contains("world.faults.g") && text.contains("`f`"), "{text}");
}

#[test]
fn an_unknown_laser_is_refused_with_the_known_ones() {
    let table = r#"{"arena": "rocs_arena", "layout": "one", "robots": {"r": {"model": "pioneer_p3dx", "laser": "eye"}},
        "layouts": {"one": {"robots": {"r": {"x": 0, "y": 0, "theta": 0}}}}}"#;
    let table: Value = serde_json::from_str(table).unwrap();
    let text = Scenario::new(&table, 0).unwrap_err().to_string();
    assert!(text.contains("pioneer_p3dx") && text.contains("`eye`") && text.contains("urg_04lx"), "{text}");
}
