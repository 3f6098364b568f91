//! `scene.svg`, `trajectory.svg`, `timeline.svg` and `animation.svg`.
#![allow(clippy::unwrap_used, reason = "a test that fails panics")]

use crate::common;

use common::{sample, scene, square, summary, trajectory};
use proptest::prelude::*;
use roxmltree::{Document, Node};
use slate_report::{Bounds, Circle, Cone, Goal, Polygon, Report, Robot, Route, Scene, Trajectory};

const DELIBERATIVE: Option<Route> = Some(Route::Deliberative);
const REACTIVE: Option<Route> = Some(Route::Reactive);

fn plots(scene: &Scene, trajectory: &Trajectory) -> [String; 2] {
    let summary = summary(1);
    let report = Report { summary: &summary, scene, trajectory };
    [report.trajectory_svg().unwrap(), report.timeline_svg().unwrap()]
}

fn picture(scene: &Scene) -> String {
    let (summary, trajectory) = (summary(1), Trajectory::default());
    Report { summary: &summary, scene, trajectory: &trajectory }.scene_svg().unwrap()
}

/// The corners of all filled polygons.
fn polygons(svg: &str) -> Vec<Vec<(i32, i32)>> {
    let document = Document::parse(svg).unwrap();
    let polygons = document.descendants().filter(|node| node.has_tag_name("polygon"));
    polygons
        .map(|polygon| {
            let pairs = polygon.attribute("points").unwrap().split_whitespace();
            pairs
                .map(|pair| pair.split_once(',').unwrap())
                .map(|(x, y)| (x.parse().unwrap(), y.parse().unwrap()))
                .collect()
        })
        .collect()
}

/// A robot of 0.4 m by 0.2 m with two wheels and one sensor at its front.
fn robot(name: &str, x: f64, y: f64, theta: f64) -> Robot {
    Robot {
        name: name.to_owned(),
        x,
        y,
        theta,
        outline: vec![[0.2, 0.1], [-0.2, 0.1], [-0.2, -0.1], [0.2, -0.1]],
        wheels: vec![[[-0.1, 0.08], [0.1, 0.1]], [[-0.1, -0.1], [0.1, -0.08]]],
        cones: vec![Cone { x: 0.2, y: 0.0, direction: 0.0, opening: 0.5, range: 1.0 }],
    }
}

fn number(node: Node, attribute: &str) -> i32 {
    node.attribute(attribute).unwrap().parse().unwrap()
}

/// How many squares there are, by their dark outlines.
fn squares(svg: &str) -> usize {
    let document = Document::parse(svg).unwrap();
    let is_square = |node: &Node| {
        node.has_tag_name("rect")
            && node.attribute("fill") == Some("#222222")
            && node.attribute("width") == node.attribute("height")
    };
    document.descendants().filter(is_square).count()
}

#[test]
fn each_change_of_the_route_has_a_square() {
    let steady = plots(&scene(), &trajectory(&[DELIBERATIVE; 6])).map(|svg| squares(&svg));
    // A pause on one route is no change, a pause between the two is one.
    let routes = [None, DELIBERATIVE, REACTIVE, None, REACTIVE, DELIBERATIVE, None, REACTIVE];
    let changing = plots(&scene(), &trajectory(&routes)).map(|svg| squares(&svg));
    assert_eq!(steady, [1, 1], "the legend's");
    assert_eq!(changing, [4, 4]);
}

#[test]
fn scripted_robots_are_black_and_others_colored_by_route() {
    let mut run = trajectory(&[DELIBERATIVE, DELIBERATIVE, REACTIVE, REACTIVE]);
    run.samples.extend((0..5).map(|step| sample(step * 100, "R1", step as f64 * 0.2, -1.0, None, "")));
    let [map, _] = plots(&scene(), &run);
    let document = Document::parse(&map).unwrap();
    let longest = |color: &str| {
        let lines = document.descendants().filter(|node| node.attribute("stroke") == Some(color));
        lines.filter_map(|node| node.attribute("points")).map(|points| points.split(' ').count()).max()
    };
    // One pixel pair each, and the empty text after the last; the legend's lines have two pixels.
    assert!(longest("#000000") > Some(4), "R1: {:?}", longest("#000000"));
    assert!(longest("#CC3311") > Some(3), "deliberative: {:?}", longest("#CC3311"));
    assert!(longest("#0077BB") > Some(2), "reactive: {:?}", longest("#0077BB"));
}

#[test]
fn each_controlled_robot_has_a_strip_and_all_share_the_panels() {
    let routes = [DELIBERATIVE, REACTIVE, DELIBERATIVE];
    let mut run = trajectory(&routes);
    run.samples.extend((0..3).map(|step| sample(step * 100, "R3", 0.5, 0.5, routes[1], "")));
    run.samples.extend((0..3).map(|step| sample(step * 100, "R1", 0.2, -1.0, None, "")));
    let [map, timeline] = plots(&scene(), &run);
    let document = Document::parse(&timeline).unwrap();
    let texts: Vec<&str> =
        document.descendants().filter(Node::is_text).filter_map(|node| node.text()).map(str::trim).collect();
    let count = |wanted: &str| texts.iter().filter(|text| **text == wanted).count();
    assert_eq!([count("x [m]"), count("y [m]"), count("time [s]")], [1, 1, 1]);
    assert_eq!(
        [count("R1 (scripted)"), count("R2"), count("R3")],
        [1, 2, 2],
        "in the legend, and at a strip"
    );
    let width_of = |line: &Node| line.attribute("stroke-width").map(str::to_owned);
    let document = Document::parse(&map).unwrap();
    let is_white = |node: &Node| node.has_tag_name("polyline") && node.attribute("stroke") == Some("#FFFFFF");
    let hollow: Vec<_> = document.descendants().filter(is_white).map(|line| width_of(&line)).collect();
    assert_eq!(hollow.len(), 2, "the line of the second robot and its sample in the legend: {hollow:?}");
}

#[test]
fn the_scene_shows_the_robots_as_they_stand() {
    let scene = Scene {
        polygons: vec![square("box", 1.0, -0.5, 1.0)],
        goals: vec![Goal { label: "goal 1".into(), x: -1.0, y: 0.0 }],
        robots: vec![robot("R2", 0.0, 0.0, 0.0), robot("R3", 0.0, 1.0, std::f64::consts::FRAC_PI_2)],
        ..self::scene()
    };
    let svg = picture(&scene);
    for word in ["exp1, seed 1", "noise: none", "R2", "R3", "goal 1", "box", "range sensors", "1 m"] {
        assert!(svg.contains(word), "{word}");
    }
    let polygons = polygons(&svg);
    let span = |part: fn(&(i32, i32)) -> i32, polygon: &[(i32, i32)]| {
        let values = || polygon.iter().map(part);
        (values().min().unwrap(), values().max().unwrap())
    };
    let size = |polygon: &[(i32, i32)]| {
        let ((left, right), (top, bottom)) = (span(|point| point.0, polygon), span(|point| point.1, polygon));
        (right - left, bottom - top)
    };
    // Cones first, then the box, then of each robot its ground, its body, two wheels and an arrow.
    let [cone, other_cone, obstacle] = [0, 1, 2].map(|index| &polygons[index]);
    let meter = size(obstacle).0;
    let (body, other) = (&polygons[3], &polygons[8]);
    assert_eq!(polygons.len(), 13);
    let is_near = |pixels: i32, meters: f64| (f64::from(pixels) - meters * f64::from(meter)).abs() < 3.0;
    assert!(is_near(size(body).0, 0.4) && is_near(size(body).1, 0.2), "{:?}", size(body));
    assert!(is_near(size(other).0, 0.2) && is_near(size(other).1, 0.4), "one that heads north");
    let box_begins = span(|point| point.0, obstacle).0;
    assert!((span(|point| point.0, cone).1 - box_begins).abs() <= 2, "what is behind the box is not seen");
    assert!(is_near(size(other_cone).1, 1.0), "nothing is in the way of the other one");
}

#[test]
fn both_axes_have_the_same_scale() {
    for maximum in [[2.0, 2.0], [9.0, 2.0], [1.0, 30.0], [300.0, 1.0]] {
        let side = 0.5 * if maximum[0] < maximum[1] { maximum[0] } else { maximum[1] };
        let bounds = Bounds { minimum: [0.0, 0.0], maximum };
        let scene = Scene { bounds, polygons: vec![square("", 0.1, 0.1, side)], ..Scene::default() };
        let [map, _] = plots(&scene, &Trajectory::default());
        let corners = &polygons(&map)[0];
        let (width, height) = (corners[1].0 - corners[0].0, corners[0].1 - corners[2].1);
        assert!(width > 0 && (width - height).abs() <= 2, "{maximum:?}: {width} by {height}");
    }
}

#[test]
fn the_legend_tells_what_is_drawn() {
    let [map, timeline] = plots(&scene(), &trajectory(&[DELIBERATIVE, REACTIVE]));
    for word in ["exp1, seed 1", "noise: none", "deliberative route", "goal", "box", "R2", "x [m]", "y [m]"] {
        assert!(map.contains(word), "{word}");
    }
    for word in ["exp1, seed 1", "noise: none", "reactive", "R2", "time [s]"] {
        assert!(timeline.contains(word), "{word}");
    }
}

#[test]
fn a_run_without_samples_is_drawn() {
    for scene in [scene(), Scene::default()] {
        let [map, timeline] = plots(&scene, &Trajectory::default());
        for svg in [map, timeline, picture(&scene)] {
            let document = Document::parse(&svg).unwrap();
            for side in ["width", "height"] {
                assert!((100..2000).contains(&number(document.root_element(), side)), "a size for a screen");
            }
        }
    }
}

#[test]
fn same_run_gives_same_bytes() {
    let run = || plots(&scene(), &trajectory(&[DELIBERATIVE, REACTIVE, DELIBERATIVE]));
    assert_eq!(run(), run());
}

/// Coordinates as a run gives them, and as a run gone wrong gives them.
fn coordinate() -> impl Strategy<Value = f64> {
    prop_oneof![4 => -5.0..5.0_f64, 1 => any::<f64>(), 1 => Just(f64::NAN), 1 => Just(1e6)]
}

fn route() -> impl Strategy<Value = Option<Route>> {
    prop_oneof![Just(None), Just(DELIBERATIVE), Just(REACTIVE)]
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]
    #[test]
    fn any_run_is_drawn_as_well_formed_svg(
        samples in proptest::collection::vec(
            (any::<u64>(), prop_oneof![Just("R1"), Just("R2"), Just("<&\u{1}>")], coordinate(), coordinate(), route()),
            0..20,
        ),
        points in proptest::collection::vec([coordinate(), coordinate()], 0..5),
        center in [coordinate(), coordinate()],
        radius in coordinate(),
        pose in [coordinate(), coordinate(), coordinate()],
        name in any::<String>(),
    ) {
        let samples = samples.into_iter().map(|(time, robot, x, y, route)| sample(time, robot, x, y, route, &name));
        let scene = Scene {
            bounds: Bounds { minimum: center, maximum: [radius, radius] },
            polygons: vec![Polygon { name: name.clone(), points }],
            circles: vec![Circle { name: name.clone(), center, radius }],
            goals: vec![Goal { label: name.clone(), x: radius, y: radius }],
            robots: vec![Robot {
                name: name.clone(),
                cones: vec![Cone { x: radius, y: 0.1, direction: pose[2], opening: pose[1], range: pose[0] }],
                ..robot("R2", pose[0], pose[1], pose[2])
            }],
            scripted: vec!["R1".to_owned()],
        };
        let [map, timeline] = plots(&scene, &Trajectory { samples: samples.collect() });
        for svg in [map, timeline, picture(&scene)] {
            prop_assert!(Document::parse(&svg).is_ok());
        }
    }
}

/// The values of the first animation of `kind`, and how long it lasts.
fn animated(svg: &str, kind: &str) -> (Vec<String>, f64) {
    let document = Document::parse(svg).unwrap();
    let animation = document.descendants().find(|node| node.attribute("type") == Some(kind)).unwrap();
    let values = animation.attribute("values").unwrap().split(';').map(str::to_owned).collect();
    (values, animation.attribute("dur").unwrap().trim_end_matches('s').parse().unwrap())
}

fn animation(trajectory: &Trajectory) -> String {
    Report { summary: &summary(1), scene: &scene(), trajectory }.animation_svg().unwrap()
}

#[test]
fn animation_moves_each_robot_and_ends_at_its_last_pose() {
    let svg = animation(&trajectory(&[DELIBERATIVE, DELIBERATIVE, REACTIVE, REACTIVE]));
    let (places, seconds) = animated(&svg, "translate");
    assert!(places.first() != places.last(), "{places:?}");
    assert_eq!(seconds, 2.3, "0.3 s of driving and a pause of 2 s");
    let document = Document::parse(&svg).unwrap();
    let still = document.descendants().find_map(|node| node.attribute("transform")).unwrap();
    assert_eq!(
        still,
        format!("translate({})", places.last().unwrap()),
        "viewers without animation see the end"
    );
    let fill = document.descendants().find(|node| node.attribute("attributeName") == Some("fill")).unwrap();
    assert_eq!(fill.attribute("values"), Some("#cc3311;#0077bb"), "red for the plan, blue for the reflex");
}

#[test]
fn animation_of_a_long_run_plays_twenty_seconds() {
    let mut long = trajectory(&[DELIBERATIVE; 500]);
    long.samples.iter_mut().for_each(|sample| sample.time *= 100);
    let svg = animation(&long);
    let (places, seconds) = animated(&svg, "rotate");
    assert!(seconds <= 22.0 && svg.contains("times as fast"), "{seconds}");
    assert!(places.len() < 250 && svg.len() < 200_000, "{} frames, {} bytes", places.len(), svg.len());
}

#[test]
fn animation_of_no_samples_or_no_finite_pose_is_a_still() {
    let mut lost = trajectory(&[DELIBERATIVE; 3]);
    lost.samples.iter_mut().for_each(|sample| sample.x = f64::NAN);
    for run in [Trajectory::default(), lost] {
        assert!(!animation(&run).contains("animateTransform"));
    }
}

#[test]
fn each_kind_of_action_has_a_shape_of_its_own() {
    let mut run = Trajectory::default();
    let actions = ["", "GoToOrigin", "AvoidObstacle", "GoToOrigin", "KeepWall(0.3)", "KeepWall(0.4)"];
    for (action, step) in actions.iter().zip(0_u32..) {
        let route = if action.starts_with("Go") { DELIBERATIVE } else { REACTIVE };
        run.samples.push(sample(
            u64::from(step) * 100_000_000,
            "R2",
            f64::from(step) * 0.3,
            1.0,
            route,
            action,
        ));
    }
    let [map, _] = plots(&scene(), &run);
    for kind in ["GoToOrigin begins", "AvoidObstacle begins", "KeepWall begins"] {
        assert_eq!(map.matches(kind).count(), 1, "{kind}");
    }
    // Discs for the first kind, and filled polygons of as many corners as a triangle and a diamond.
    let corners: Vec<usize> = polygons(&map).iter().map(Vec::len).collect();
    let count = |corner: usize| corners.iter().filter(|corners| **corners == corner).count();
    assert_eq!(count(3), 2, "AvoidObstacle begins once, beside the legend: {corners:?}");
    // The box of the scene has four corners, too.
    assert_eq!(count(4), 1 + 3, "KeepWall begins twice with other arguments, beside the legend: {corners:?}");
}
