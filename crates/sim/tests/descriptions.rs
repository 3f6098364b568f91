//! Worlds and robots that are wrong: what is said, and where.

#![allow(clippy::unwrap_used, clippy::disallowed_methods)] // Tests say what went wrong by failing.

use slate_sim::DescriptionError;
use slate_sim::robot::RobotDescription;
use slate_sim::world::{Body, World};

const WORLD: &str = "name = \"w\"\n[bounds]\nminimum = [0, 0]\nmaximum = [1, 1]\n";

fn world_error(text: &str) -> DescriptionError {
    World::parse("w.toml", text).unwrap_err()
}

/// The shipped robot with one thing replaced.
fn robot_error(from: &str, to: &str) -> (DescriptionError, String) {
    let text = include_str!("../../../robots/pioneer_p3dx.toml");
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
fn what_is_no_toml_is_refused_where_it_ends_to_be() {
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
fn what_is_not_there_is_said_with_what_is() {
    let error = World::load("moon").unwrap_err().to_string();
    assert!(error.contains("moon") && error.contains("rocs_arena"), "{error}");
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
