//! The `[world]` table: robots and worlds by name and by path, sensors of their own, and what is refused.

#![allow(clippy::unwrap_used, clippy::disallowed_methods)] // Tests say what went wrong by failing.

use std::path::PathBuf;

use slate_module::blackboard::interface::Value;
use slate_module::{Instance, Setup};
use slate_sim::{Scenario, Simulator};

/// A `[world]` table with one robot `r` whose entry is given, and more keys of the world.
fn table(robot: &str, more: &str) -> Value {
    let text = format!(
        r#"{{"arena": "rocs_arena", "layout": "one", "robots": {{"r": {robot}}},
            "layouts": {{"one": {{"robots": {{"r": {{"x": 0, "y": 0, "theta": 0}}}}}}}} {more}}}"#
    );
    serde_json::from_str(&text).unwrap()
}

fn scenario(robot: &str, more: &str) -> Scenario {
    Scenario::new(&table(robot, more), 0).unwrap()
}

fn refusal(robot: &str, more: &str) -> String {
    Scenario::new(&table(robot, more), 0).unwrap_err().to_string()
}

fn says(text: &str, words: &[&str]) {
    assert!(words.iter().all(|word| text.contains(word)), "{words:?} is not all in: {text}");
}

fn in_project(path: &str) -> String {
    format!("{}/../../{path}", env!("CARGO_MANIFEST_DIR"))
}

#[test]
fn robots_and_arenas_are_found_by_name_and_by_path() {
    let path = in_project("robots/summit_xl.toml");
    let by_path = scenario(&format!(r#"{{"model": "{path}"}}"#), "");
    let by_name = scenario(r#"{"model": "summit_xl"}"#, "");
    assert_eq!(by_path.placements[0].description, by_name.placements[0].description);
    let mut table = table(r#"{"model": "summit_xl"}"#, "");
    let Value::Table(entries) = &mut table else { unreachable!() };
    let (_, arena) = entries.iter_mut().find(|(key, _)| key == "arena").unwrap();
    *arena = Value::Text(in_project("worlds/rocs_arena.toml"));
    assert_eq!(Scenario::new(&table, 0).unwrap().world, by_name.world);
}

#[test]
fn unknown_names_are_refused_with_the_known_ones() {
    let text = refusal(r#"{"model": "summit"}"#, "");
    says(&text, &["world.robots.r.model: unknown robot", "summit", "pioneer_p3dx, summit_xl", ".toml"]);
    let tried = std::path::absolute("robots/mine.toml").unwrap();
    says(
        &refusal(r#"{"model": "robots/mine.toml"}"#, ""),
        &["world.robots.r.model: ", tried.to_str().unwrap()],
    );
}

#[test]
fn a_mistake_in_a_robots_file_is_found_there() {
    let text = std::fs::read_to_string(in_project("robots/summit_xl.toml")).unwrap();
    let path: PathBuf = std::env::temp_dir().join(format!("slate_sim_robot_{}.toml", std::process::id()));
    std::fs::write(&path, text.replace("mass = 51.0", "mass = -1")).unwrap();
    let refused = refusal(&format!(r#"{{"model": "{}"}}"#, path.display()), "");
    std::fs::remove_file(&path).unwrap();
    says(&refused, &[path.to_str().unwrap(), "line 4", "positive"]);
}

#[test]
fn a_robots_own_sonar_profile_comes_before_the_worlds() {
    let sonar = |robot: &str| scenario(robot, r#", "sonar": "vrep""#).placements[0].sonar.clone();
    assert_eq!(sonar(r#"{"model": "pioneer_p3dx"}"#), "vrep");
    assert_eq!(sonar(r#"{"model": "pioneer_p3dx", "sonar": "real"}"#), "real");
    assert_eq!(sonar(r#"{"model": "pioneer_p3dx", "sonar": ""}"#), "");
}

#[test]
fn the_sensor_that_sees_robots_goes_with_the_sonars_unless_said() {
    let range = |robot: &str, more: &str| {
        let scenario = scenario(robot, more);
        scenario.placements[0].robot_sensor().map(|sensor| sensor.range_max)
    };
    let summit = r#"{"model": "summit_xl"}"#;
    assert_eq!(range(summit, r#", "sonar": "vrep""#), Some(10.0));
    assert_eq!(range(summit, r#", "sonar": "real""#), Some(8.0));
    assert_eq!(range(summit, r#", "sonar": "real", "robot_sensor": "vrep""#), Some(10.0));
    let own = r#"{"model": "summit_xl", "robot_sensor": "real"}"#;
    assert_eq!(range(own, r#", "sonar": "vrep", "robot_sensor": "vrep""#), Some(8.0));
    let none = r#"{"model": "summit_xl", "robot_sensor": ""}"#;
    assert_eq!(range(none, r#", "sonar": "vrep""#), None);
    // Settings of the world do not concern robots without the sensor.
    assert_eq!(range(r#"{"model": "pioneer_p3dx"}"#, r#", "robot_sensor": "vrep""#), None);
    says(&refusal(summit, r#", "robot_sensor": "eyes""#), &["summit_xl", "eyes", "real, vrep"]);
    says(
        &refusal(r#"{"model": "pioneer_p3dx", "robot_sensor": "vrep"}"#, ""),
        &["pioneer_p3dx", "no sensor"],
    );
}

/// Sonar profile, range of the robot sensor, noise of positions, bias of the odometry.
fn sensors(robot: &str, more: &str) -> (String, Option<f64>, f64, f64) {
    let scenario = scenario(robot, more);
    let placement = &scenario.placements[0];
    let range = placement.robot_sensor().map(|sensor| sensor.range_max);
    let (positioning, odometry) = (placement.positioning(), placement.odometry());
    (placement.sonar.clone(), range, positioning.noise_position, odometry.turn_bias)
}

#[test]
fn one_key_chooses_the_profile_of_all_sensors() {
    let summit = r#"{"model": "summit_xl"}"#;
    let (exact, real) = (("vrep".into(), Some(10.0), 0.0, 0.0), ("real".into(), Some(8.0), 0.1, 0.02));
    assert_eq!(sensors(summit, r#", "profile": "vrep""#), exact);
    assert_eq!(sensors(summit, r#", "profile": "real""#), real);
    let own = r#"{"model": "summit_xl", "profile": "real"}"#;
    assert_eq!(sensors(own, r#", "profile": "vrep""#), real, "the robot's key comes before the world's");
    assert_eq!(sensors(own, r#", "sonar": "vrep""#), real);
    let sonar = r#"{"model": "summit_xl", "profile": "real", "sonar": "vrep"}"#;
    assert_eq!(
        sensors(sonar, ""),
        ("vrep".into(), Some(8.0), 0.1, 0.02),
        "a sensor's key before the general one"
    );
    assert_eq!(sensors(summit, r#", "profile": "real", "robot_sensor": "vrep""#).1, Some(10.0));
    assert_eq!(sensors(summit, r#", "sonar": "real""#).2, 0.0, "it is the key of the sonars alone");
}

#[test]
fn a_profile_that_a_robot_lacks_is_refused_at_its_key() {
    let pioneer = r#"{"model": "pioneer_p3dx"}"#;
    assert_eq!(
        refusal(pioneer, r#", "profile": "rael""#),
        "world.profile: pioneer_p3dx: unknown sensor profile `rael` (did you mean `real`?); expected real, vrep"
    );
    let own = r#"{"model": "pioneer_p3dx", "profile": "gps"}"#;
    says(&refusal(own, ""), &["world.robots.r.profile: pioneer_p3dx: unknown sensor profile `gps`"]);
    let text = std::fs::read_to_string(in_project("robots/summit_xl.toml")).unwrap();
    let path = std::env::temp_dir().join(format!("slate_sim_profile_{}.toml", std::process::id()));
    std::fs::write(&path, text.replace("[positioning.real]", "[positioning.indoor]")).unwrap();
    let refused = refusal(&format!(r#"{{"model": "{}", "profile": "real"}}"#, path.display()), "");
    std::fs::remove_file(&path).unwrap();
    says(
        &refused,
        &["unknown positioning profile `real`", "indoor, vrep", "add [positioning.real] to the robot"],
    );
}

#[test]
fn threads_are_a_number_of_them() {
    assert_eq!(scenario(r#"{"model": "summit_xl"}"#, r#", "threads": 2"#).threads, 2);
    says(
        &refusal(r#"{"model": "summit_xl"}"#, r#", "threads": 0"#),
        &["world.threads: ", "from 1 to 256, found 0"],
    );
}

#[test]
fn a_mistake_in_the_table_names_its_setting() {
    let pioneer = r#"{"model": "pioneer_p3dx"}"#;
    let of_robot = |robot: &str, words: &str| says(&refusal(robot, ""), &[words]);
    of_robot(r#"{"modle": "x"}"#, "world.robots.r.modle: unknown key `modle` (did you mean `model`?)");
    of_robot(r#"{"model": 3}"#, "world.robots.r.model: expected a string, found integer `3`");
    of_robot(r#"{"laser": "x"}"#, "world.robots.r: missing key `model`");
    of_robot(r#"{"script": {}}"#, "world.robots.r: missing key `model`");
    let sonar = r#"{"model": "pioneer_p3dx", "sonar": "rael"}"#;
    of_robot(
        sonar,
        "world.robots.r.sonar: pioneer_p3dx: unknown sonar profile `rael` (did you mean `real`?)",
    );
    let of_world = |more: &str, words: &str| says(&refusal(pioneer, more), &[words]);
    of_world(r#", "sonar": "vrap""#, "world.sonar: pioneer_p3dx: unknown sonar profile `vrap`");
    of_world(r#", "areena": "x""#, "world.areena: unknown key `areena` (did you mean `arena`?)");
    of_world(r#", "goals": {"robot": []}"#, "world.goals.robot: unknown robot `robot`; expected r");
    of_world(r#", "random": {}"#, "world.random: missing key `robot`");
    let layout = |text: &str, words: &str| {
        let text = format!(r#"{{"arena": "rocs_arena", "robots": {{"r": {pioneer}}}, {text}}}"#);
        let error = Scenario::new(&serde_json::from_str(&text).unwrap(), 0).unwrap_err();
        says(&error.to_string(), &[words]);
    };
    let one = r#""layouts": {"one": {"robots": {"q": {"x": 0, "y": 0, "theta": 0}}}}"#;
    layout(&format!(r#"{one}, "layout": "oen""#), "world.layout: unknown layout `oen` (did you mean `one`?)");
    layout(&format!(r#"{one}, "layout": "one""#), "world.layouts.one.robots: missing pose of the robot `r`");
    layout(r#""layouts": {"one": {}}"#, "world.layouts.one: missing key `robots`");
    layout(r#""layout": "random""#, "world.layout: missing table [world.random]");
}

fn create(robot: &str, more: &str) -> Result<Simulator, String> {
    let table = table(robot, more);
    let setup = Setup { name: "simulator", seed: 0, period: 20_000_000, section: Some(&table), params: None };
    Simulator::create(&setup, &[]).map_err(|refusal| refusal.to_string())
}

#[test]
fn a_script_needs_sonars_that_look_ahead_or_none() {
    let wanderer = r#"{"model": "summit_xl", "script": {}}"#;
    assert!(create(wanderer, r#", "sonar": "vrep""#).is_ok(), "three sonars are enough");
    says(&create(wanderer, "").unwrap_err(), &["`r`", "blind = true", "sonar profile"]);
    assert!(create(r#"{"model": "summit_xl", "script": {"blind": true}}"#, "").is_ok());
}

#[test]
fn a_robot_has_the_ports_of_what_it_is_made_of() {
    let ports = |robot: &str, more: &str| {
        let table = table(robot, more);
        let setup =
            Setup { name: "simulator", seed: 0, period: 20_000_000, section: Some(&table), params: None };
        let ports = Simulator::describe(&setup).unwrap().ports;
        ports.into_iter().map(|port| (port.name, port.descriptor.name.to_owned())).collect::<Vec<_>>()
    };
    let has = |ports: &[(String, String)], name: &str, interface: &str| {
        ports.iter().any(|(port, descriptor)| port == name && descriptor == interface)
    };
    let pioneer = ports(r#"{"model": "pioneer_p3dx"}"#, r#", "sonar": "vrep""#);
    assert!(has(&pioneer, "r/wheels", "WheelSpeeds"));
    assert!(has(&pioneer, "r/bumper", "Bumper") && !has(&pioneer, "r/sightings", "Sightings"), "{pioneer:?}");
    let summit = ports(r#"{"model": "summit_xl"}"#, r#", "sonar": "vrep""#);
    assert!(has(&summit, "r/wheels", "FourWheelSpeeds") && has(&summit, "r/sightings", "Sightings"));
    assert!(!has(&summit, "r/bumper", "Bumper"), "{summit:?}");
    let blind = ports(r#"{"model": "summit_xl", "robot_sensor": ""}"#, "");
    assert!(!has(&blind, "r/sightings", "Sightings"));
}

/// Poses of the robots `r` and `s`, one meter apart, under a seed, with an offset of the layout.
fn offset_starts(offset: &str, seed: u64) -> Vec<[f64; 3]> {
    let text = format!(
        r#"{{"arena": "rocs_arena", "layout": "one",
            "robots": {{"r": {{"model": "pioneer_p3dx"}}, "s": {{"model": "pioneer_p3dx"}}}},
            "layouts": {{"one": {{{offset}"robots": {{
                "r": {{"x": 0, "y": 0, "theta": 0}}, "s": {{"x": 1, "y": 0, "theta": 3.14}}}}}}}}}}"#
    );
    let scenario = Scenario::new(&serde_json::from_str(&text).unwrap(), seed).unwrap();
    scenario
        .placements
        .iter()
        .map(|placement| [placement.pose.x, placement.pose.y, placement.pose.theta])
        .collect()
}

#[test]
fn start_offsets_differ_by_seed_and_stay_in_their_bounds() {
    let offset = r#""start_offset": {"position": 0.03, "heading": 0.09}, "#;
    let without = offset_starts("", 1);
    assert_eq!(without, offset_starts("", 2), "a layout without offsets is the same for all seeds");
    let mut widest = [0.0_f64; 3];
    for seed in 0..200 {
        let starts = offset_starts(offset, seed);
        assert_eq!(starts, offset_starts(offset, seed), "a seed has one layout");
        for (start, usual) in starts.iter().zip(&without) {
            for (i, bound) in [0.03, 0.03, 0.09].into_iter().enumerate() {
                // Headings wrap.
                let change = (start[i] - usual[i]).abs();
                let change = if i == 2 { change.min(std::f64::consts::TAU - change) } else { change };
                assert!(change <= bound, "seed {seed}: {start:?}");
                widest[i] = widest[i].max(change);
            }
        }
    }
    assert!(widest[0] > 0.025 && widest[1] > 0.025 && widest[2] > 0.08, "{widest:?}");
}

#[test]
fn offset_robots_never_overlap() {
    // Up to half a meter each: most pairs would overlap in a tenth of all seeds.
    let offset = r#""start_offset": {"position": 0.5, "heading": 3.0}, "#;
    for seed in 0..100 {
        let [r, s] = offset_starts(offset, seed)[..] else { unreachable!() };
        assert!((r[0] - s[0]).hypot(r[1] - s[1]) > 0.25, "seed {seed}: {r:?}, {s:?}");
    }
}

#[test]
fn wrong_start_offsets_are_refused() {
    let layouts = |offset: &str| {
        let one = format!(
            r#""layouts": {{"one": {{"robots": {{"r": {{"x": 0, "y": 0, "theta": 0}}}}, "start_offset": {offset}}}}}"#
        );
        let text = format!(
            r#"{{"arena": "rocs_arena", "layout": "one", "robots": {{"r": {{"model": "pioneer_p3dx"}}}}, {one}}}"#
        );
        Scenario::new(&serde_json::from_str(&text).unwrap(), 0).unwrap_err().to_string()
    };
    says(
        &layouts(r#"{"position": -0.1}"#),
        &["world.layouts.one.start_offset.position", "from 0 to 1000000", "-0.1"],
    );
    says(&layouts(r#"{"positions": 0.1}"#), &["start_offset", "unknown key `positions`", "position"]);
}

#[test]
fn people_and_doors_of_a_world_are_checked_by_key() {
    let robot = r#"{"model": "pioneer_p3dx"}"#;
    for (more, words) in [
        (r#", "people": {"count": 0}"#, ["world.people.count: ", "from 1 to 500"]),
        (
            r#", "people": {"count": 2, "place": [[0, 0]]}"#,
            ["world.people.place: ", "did you mean `places`?"],
        ),
        (r#", "people": {"count": 2, "places": [[0, 0]]}"#, ["world.people.places: ", "from 2 to 64"]),
        (r#", "people": {"count": 2, "pause": [5, 2]}"#, ["world.people.pause: ", "least"]),
        (r#", "doors": {"d": {"from": [0, 0]}}"#, ["world.doors.d: ", "missing key `to`"]),
        (r#", "doors": {"d": {"from": [0, 0], "to": [0, 9], "open": "ajar"}}"#, ["ajar", "`near`"]),
        (r#", "doors": {"r": {"from": [1, 0], "to": [1, 1]}}"#, ["world.robots.r: ", "name of a door"]),
        (
            r#", "people": {"count": 1}, "doors": {"person_1": {"from": [1, 0], "to": [1, 1]}}"#,
            ["world.doors.person_1: ", "name of a person"],
        ),
    ] {
        says(&refusal(robot, more), &words);
    }
    let moving = scenario(robot, r#", "people": {"count": 3}"#).moving;
    assert_eq!(
        moving.people.unwrap().starts().map(|(name, _)| name.to_owned()).collect::<Vec<_>>(),
        ["person_1", "person_2", "person_3"]
    );
}

#[test]
fn an_imu_has_the_profile_of_its_robot() {
    let noise = |robot: &str, more: &str| {
        let scenario = scenario(robot, more);
        assert_eq!(scenario.imus.contains("r"), robot.contains("imu"));
        scenario.placements[0].imu().noise_angular_velocity
    };
    let carrier = r#"{"model": "pioneer_p3dx", "imu": true}"#;
    assert_eq!(noise(carrier, ""), 0.0);
    assert_eq!(noise(carrier, r#", "profile": "vrep""#), 0.0);
    assert_eq!(noise(carrier, r#", "profile": "real""#), 0.00061);
    assert_eq!(noise(r#"{"model": "pioneer_p3dx"}"#, r#", "profile": "vrep""#), 0.0);
}
