//! Worlds and robots that are wrong: what is said, and where.

#![allow(clippy::unwrap_used, clippy::disallowed_methods)] // Tests say what went wrong by failing.

use proptest::prelude::*;
use slate_sim::DescriptionError;
use slate_sim::robot::RobotDescription;
use slate_sim::world::{Body, World};

const WORLD: &str = "name = \"w\"\n[bounds]\nminimum = [0, 0]\nmaximum = [1, 1]\n";

fn world_error(text: &str) -> DescriptionError {
    World::parse("w.toml", text).unwrap_err()
}

/// A shipped robot with one thing replaced.
fn robot_error(from: &str, to: &str) -> (DescriptionError, String) {
    broken(include_str!("../../../robots/pioneer_p3dx.toml"), from, to)
}

fn summit_error(from: &str, to: &str) -> (DescriptionError, String) {
    broken(include_str!("../../../robots/summit_xl.toml"), from, to)
}

fn broken(text: &str, from: &str, to: &str) -> (DescriptionError, String) {
    assert!(text.contains(from), "the robot has `{from}`");
    let text = text.replacen(from, to, 1);
    (RobotDescription::parse("r.toml", &text).unwrap_err(), text)
}

#[test]
fn an_error_names_file_line_column_and_bytes() {
    let text = format!("{WORLD}[[bodies]]\nname = \"b\"\ncenter = \"here\"\n");
    let error = world_error(&text);
    assert_eq!(error.position, Some((7, 10)));
    assert_eq!(&text[error.span.clone().unwrap()], "\"here\"");
    assert!(error.to_string().starts_with("w.toml, line 7, column 10: "), "{error}");
}

#[test]
fn an_unknown_key_is_refused_with_the_known_ones() {
    let error = world_error(&format!("{WORLD}[[bodies]]\nname = \"b\"\nradios = 1.0\n"));
    assert_eq!(error.position, Some((7, 1)));
    assert!(error.message.contains("radios") && error.message.contains("`radius`"), "{error}");
}

#[test]
fn invalid_toml_is_refused_at_its_place() {
    assert_eq!(world_error("name = \n").position.map(|(line, _)| line), Some(1));
}

#[test]
fn a_body_without_a_shape_is_found_at_its_table() {
    let text = format!(
        "{WORLD}[[bodies]]\nname = \"ok\"\ncenter = [0, 0]\nradius = 1\n\n[[bodies]]\nname = \"b\"\nradius = 1\n"
    );
    let error = world_error(&text);
    assert_eq!(error.position.map(|(line, _)| line), Some(10));
    assert!(error.message.contains("`b`") && error.message.contains("`center`"), "{error}");
}

#[test]
fn bodies_need_names_of_their_own_and_bounds_an_area() {
    let body = "[[bodies]]\nname = \"b\"\ncenter = [0, 0]\nradius = 1\n";
    let error = world_error(&format!("{WORLD}{body}{body}"));
    assert!(error.message.contains("two bodies `b`"), "{error}");
    let error = world_error(&WORLD.replace("[1, 1]", "[0, 1]"));
    assert!(error.message.contains("north-east") && error.position.is_some(), "{error}");
}

#[test]
fn a_robot_that_can_not_be_is_refused_at_the_value() {
    let cases = [
        ("mass = 9.0", "mass = -9.0", "-9.0", "positive"),
        ("track = 0.331", "track = nan", "nan", "positive"),
        ("range_max = 1.0", "range_max = 0.0", "0.0", "range_min"),
        ("field_of_view = 0.5236", "field_of_view = 4.0", "4.0", "pi"),
        ("dropout = 0.01", "dropout = 1.5", "1.5", "probability"),
        ("noise_position = 0.1", "noise_position = -0.1", "-0.1", "standard deviation"),
        ("rate = 5.0", "rate = 0.0", "0.0", "hertz"),
        ("turn_bias = 0.02", "turn_bias = nan", "nan", "standard deviation"),
    ];
    for (from, to, value, expected) in cases {
        let (error, text) = robot_error(from, to);
        assert_eq!(&text[error.span.clone().unwrap()], value, "{error}");
        assert!(error.message.contains(expected), "{error}");
    }
    let (error, _) = robot_error("[0.19, 0.05], [0.155, 0.11]", "[-0.9, 0.0], [0.110, 0.145]");
    assert!(error.message.contains("convex"), "{error}");
}

#[test]
fn moved_setting_of_position_noise_is_reported() {
    let (error, _) = robot_error("wheel_radius_bias = 0.01", "position = 0.1\nwheel_radius_bias = 0.01");
    assert!(error.message.contains("write `noise_position` in [positioning.NAME]"), "{error}");
    assert!(error.position.is_some(), "{error}");
}

#[test]
fn a_drive_that_can_not_be_is_refused_at_the_value() {
    let cases = [
        ("wheelbase = 0.458", "wheelbase = -0.458", "-0.458", "positive"),
        ("odometry_track = 0.916", "odometry_track = 0.0", "0.0", "positive"),
        ("kind = \"skid_steer\"", "kind = \"hover\"", "\"hover\"", "`skid_steer`"),
        ("lateral = 0.8", "lateral = \"good\"", "\"good\"", "f64"),
    ];
    for (from, to, value, expected) in cases {
        let (error, text) = summit_error(from, to);
        assert_eq!(&text[error.span.clone().unwrap()], value, "{error}");
        assert!(error.message.contains(expected), "{error}");
    }
    let line = |error: &DescriptionError| error.position.unwrap().0;
    let table = |text: &str, name: &str| text.lines().position(|line| line == name).unwrap() + 1;
    let (error, text) = summit_error("longitudinal = 0.8", "longitudinal = -0.8");
    assert!(error.message.contains("not negative"), "{error}");
    assert_eq!(line(&error), table(&text, "[drive.friction]"));
    // What is missing is missing in the table.
    for key in ["wheelbase", "odometry_track"] {
        let (error, text) = summit_error(key, &format!("# {key}"));
        assert!(error.message.contains(key) && error.message.contains("skid_steer"), "{error}");
        assert_eq!(line(&error), table(&text, "[drive]"));
    }
    let slippery = "[drive.wheel_friction]\nback_left = { longitudinal = 0.1, lateral = nan }\n[noise]";
    let (error, text) = summit_error("[noise]", slippery);
    assert_eq!(&text[error.span.clone().unwrap()], "{ longitudinal = 0.1, lateral = nan }", "{error}");
    let (error, _) = summit_error("[noise]", "[drive.wheel_friction]\nmiddle = 1\n[noise]");
    assert!(error.message.contains("middle") && error.message.contains("back_left"), "{error}");
}

#[test]
fn a_differential_drive_has_nothing_that_slips() {
    for (key, value) in [("wheelbase", "0.4"), ("odometry_track", "0.4")] {
        let (error, text) = robot_error("[noise]", &format!("{key} = {value}\n[noise]"));
        assert_eq!(&text[error.span.clone().unwrap()], value);
        assert!(error.message.contains(key) && error.message.contains("skid_steer"), "{error}");
    }
    let friction = "[drive.friction]\nlongitudinal = 1.0\nlateral = 1.0\n[noise]";
    let (error, _) = robot_error("[noise]", friction);
    assert!(error.message.contains("friction") && error.message.contains("skid_steer"), "{error}");
    let friction = "[drive.wheel_friction]\nback_left = { longitudinal = 1.0, lateral = 1.0 }\n[noise]";
    let (error, _) = robot_error("[noise]", friction);
    assert!(error.message.contains("wheel_friction") && error.message.contains("skid_steer"), "{error}");
}

#[test]
fn sensors_that_can_not_be_are_refused_at_the_value() {
    let cases = [
        ("field_of_view = 6.2832", "field_of_view = 7.0", "7.0", "full turn"),
        ("visible_share = 0.25", "visible_share = 0.0", "0.0", "share"),
        ("range_max = 10.0", "range_max = -1.0", "-1.0", "positive"),
        ("noise_bearing = 0.02", "noise_bearing = -0.1", "-0.1", "deviation"),
        ("dropout = 0.05", "dropout = 2.0", "2.0", "probability"),
        ("rate = 10.0 ", "rate = 0.0 ", "0.0", "hertz"),
        ("mount = [0.0, 0.0, 0]", "mount = [0.0, inf, 0]", "[0.0, inf, 0]", "finite"),
    ];
    for (from, to, value, expected) in cases {
        let (error, text) = summit_error(from, to);
        assert_eq!(&text[error.span.clone().unwrap()], value, "{error}");
        assert!(error.message.contains(expected), "{error}");
    }
    let (error, text) = robot_error("range_max = 5.0", "range_max = 5.0\nrate = -3.0");
    assert_eq!(&text[error.span.clone().unwrap()], "-3.0");
    assert!(error.message.contains("hertz"), "{error}");
    let (error, text) = robot_error("back = -0.1", "back = 0.2");
    let bumper = text.lines().position(|line| line == "[bumper]").unwrap() + 1;
    assert!(error.message.contains("`back`") && error.position.unwrap().0 == bumper, "{error}");
}

#[test]
fn missing_name_is_reported_with_existing_ones() {
    let error = World::load("moon").unwrap_err().to_string();
    assert!(error.contains("moon") && error.contains("rocs_arena"), "{error}");
    let error = RobotDescription::load("pionier").unwrap_err().to_string();
    assert!(error.contains("pionier") && error.contains("pioneer_p3dx, summit_xl"), "{error}");
    let error = RobotDescription::load("nowhere/robot.toml").unwrap_err().to_string();
    assert!(error.contains("nowhere/robot.toml"), "{error}");
}

#[test]
fn a_world_is_found_by_name_and_by_path() {
    let path = concat!(env!("CARGO_MANIFEST_DIR"), "/../../worlds/rocs_arena.toml");
    assert_eq!(World::load(path).unwrap(), World::load("rocs_arena").unwrap());
}

#[test]
fn a_circle_is_as_wide_as_its_radius_says() {
    let circle = Body::circle("post", [1.0, 2.0], 0.1).polygon().unwrap();
    let corners = circle.points.iter().map(|point| (point.x - 1.0, point.y - 2.0));
    assert!(corners.into_iter().all(|(x, y)| ((x * x + y * y).sqrt() - 0.1).abs() < 1e-12));
    assert!(Body::circle("post", [0.0, 0.0], -1.0).polygon().is_none());
}

proptest! {
    /// Whatever becomes of a description, it is read, or what is wrong with it lies inside of it.
    #[test]
    fn a_damaged_description_is_read_or_refused_in_its_place(
        at in 0.0..1.0,
        length in 0_usize..12,
        damage in "[a-z0-9_ .=\"{}\\[\\]\\-\\n]{0,12}",
        summit in any::<bool>(),
    ) {
        let text = match summit {
            true => include_str!("../../../robots/summit_xl.toml"),
            false => include_str!("../../../robots/pioneer_p3dx.toml"),
        };
        let from = (text.len() as f64 * at) as usize;
        let to = (from + length).min(text.len());
        let text = format!("{}{damage}{}", &text[..from], &text[to..]);
        if let Err(error) = RobotDescription::parse("r.toml", &text) {
            prop_assert!(!error.message.is_empty() && error.source_name == "r.toml");
            let span = error.span.unwrap_or_default();
            prop_assert!(span.start <= span.end && span.end <= text.len(), "{span:?}");
        }
    }
}
