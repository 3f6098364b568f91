//! `trajectory.svg` and `timeline.svg`.
#![allow(clippy::unwrap_used, reason = "a test ends at the first surprise")]

mod common;

use common::{sample, scene, square, summary, trajectory};
use proptest::prelude::*;
use roxmltree::{Document, Node};
use slate_record::{Bounds, Circle, Goal, Polygon, Report, Route, Scene, Trajectory};

const DELIBERATIVE: Option<Route> = Some(Route::Deliberative);
const REACTIVE: Option<Route> = Some(Route::Reactive);

fn plots(scene: &Scene, trajectory: &Trajectory) -> [String; 2] {
    let summary = summary(1);
    let report = Report { summary: &summary, scene, trajectory };
    [report.trajectory_svg().unwrap(), report.timeline_svg().unwrap()]
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
    assert_eq!(steady, [1, 0], "the legend's");
    assert_eq!(changing, [4, 3]);
}

#[test]
fn scripted_robots_are_black_and_the_others_have_the_colour_of_their_route() {
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
fn both_axes_have_the_same_scale() {
    for maximum in [[2.0, 2.0], [9.0, 2.0], [1.0, 30.0], [300.0, 1.0]] {
        let side = 0.5 * if maximum[0] < maximum[1] { maximum[0] } else { maximum[1] };
        let bounds = Bounds { minimum: [0.0, 0.0], maximum };
        let scene = Scene { bounds, polygons: vec![square("", 0.1, 0.1, side)], ..Scene::default() };
        let [map, _] = plots(&scene, &Trajectory::default());
        let document = Document::parse(&map).unwrap();
        let polygon = document.descendants().find(|node| node.has_tag_name("polygon")).unwrap();
        let corners: Vec<(i32, i32)> = polygon
            .attribute("points")
            .unwrap()
            .split_whitespace()
            .map(|pair| pair.split_once(',').unwrap())
            .map(|(x, y)| (x.parse().unwrap(), y.parse().unwrap()))
            .collect();
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
        for svg in plots(&scene, &Trajectory::default()) {
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
        name in any::<String>(),
    ) {
        let samples = samples.into_iter().map(|(time, robot, x, y, route)| sample(time, robot, x, y, route, &name));
        let scene = Scene {
            bounds: Bounds { minimum: center, maximum: [radius, radius] },
            polygons: vec![Polygon { name: name.clone(), points }],
            circles: vec![Circle { name: name.clone(), center, radius }],
            goals: vec![Goal { label: name.clone(), x: radius, y: radius }],
            scripted: vec!["R1".to_owned()],
        };
        for svg in plots(&scene, &Trajectory { samples: samples.collect() }) {
            prop_assert!(Document::parse(&svg).is_ok());
        }
    }
}
