//! Guarantees of the obstacle avoidance.
#![allow(clippy::unwrap_used, clippy::panic, reason = "a test stops where something is wrong")]

use std::f64::consts::PI;

use proptest::prelude::*;
use slate_avoidance::{
    Avoider, Course, Decision, Footprint, FootprintError, LocalMap, Other, Parameters, Rocs, RocsVariant,
    Sides,
};
use slate_interfaces::{Echo, Point2, Pose2, SonarPlacement, SonarScan, Twist2, WheelSpeeds};
use slate_module::{Bool, Sequence, math};

const RANGE: f64 = 1.0;
const BEARINGS: [f64; 16] = [
    90.0, 50.0, 30.0, 10.0, -10.0, -30.0, -50.0, -90.0, -90.0, -130.0, -150.0, -170.0, 170.0, 150.0, 130.0,
    90.0,
];

fn footprint() -> Footprint {
    Footprint::new(&[
        [0.19, -0.1],
        [0.19, 0.1],
        [0.1, 0.19],
        [-0.2, 0.19],
        [-0.26, 0.1],
        [-0.26, -0.1],
        [-0.2, -0.19],
        [0.1, -0.19],
    ])
    .unwrap()
}

/// A scan of sonars on a circle of 0.15 m; those that are not named hear nothing.
fn scan(heard: &[(usize, f64)]) -> SonarScan {
    let placements: Vec<_> = BEARINGS
        .iter()
        .map(|degrees| {
            let theta = degrees.to_radians();
            SonarPlacement { x: 0.15 * math::cos(theta), y: 0.15 * math::sin(theta), theta }
        })
        .collect();
    let mut echoes = [Echo { range: RANGE, ..Echo::default() }; 16];
    for (sonar, range) in heard {
        echoes[*sonar] = Echo { range: *range, heard: Bool::from(true) };
    }
    SonarScan {
        field_of_view: PI / 6.0,
        range_min: 0.0,
        range_max: RANGE,
        placements: Sequence::new(&placements),
        echoes: Sequence::new(&echoes),
    }
}

/// A wall straight ahead at that distance from the front sonars.
fn wall_ahead(range: f64) -> SonarScan {
    scan(&[(2, 1.1 * range), (3, range), (4, range), (5, 1.1 * range)])
}

const HERE: Pose2 = Pose2 { x: 0.0, y: 0.0, theta: 0.0 };
const AHEAD: Point2 = Point2 { x: 3.0, y: 0.0 };

fn settled(scan: &SonarScan, seconds: f64) -> (Avoider, Decision) {
    let (mut avoider, parameters) = (Avoider::new(footprint()), Parameters::default());
    let mut decision = Decision::Clear;
    for tick in 0..(seconds / 0.02) as u32 {
        let time = f64::from(tick) * 0.02;
        avoider.update_map(HERE, scan, &parameters, time);
        decision = avoider.steer(HERE, AHEAD, &parameters, time);
    }
    (avoider, decision)
}

#[test]
fn a_footprint_knows_how_far_a_point_is() {
    let square = Footprint::new(&[[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]]).unwrap();
    assert!((square.distance(2.0, 0.0) - 1.0).abs() < 1e-12);
    assert!((square.distance(4.0, 5.0) - 5.0).abs() < 1e-12, "the nearest part is a corner");
    assert!((square.distance(0.5, 0.0) + 0.5).abs() < 1e-12, "inside is negative");
    assert_eq!((square.half_width(), square.front()), (1.0, 1.0));
}

#[test]
fn an_outline_that_is_no_footprint_is_refused() {
    let refused = |corners: &[[f64; 2]]| Footprint::new(corners).unwrap_err();
    assert_eq!(refused(&[[0.0, 0.0], [1.0, 0.0]]), FootprintError::TooFewCorners);
    assert_eq!(refused(&[[0.0, 0.0], [f64::NAN, 0.0], [0.0, 1.0]]), FootprintError::NotFinite);
    assert_eq!(refused(&[[0.0, 0.0], [0.0, 1.0], [1.0, 0.0]]), FootprintError::NotConvex, "clockwise");
    assert_eq!(
        refused(&[[0.0, 0.0], [2.0, 0.0], [0.5, 0.5], [0.0, 2.0]]),
        FootprintError::NotConvex,
        "concave"
    );
    assert!(serde_json::from_str::<Footprint>("[[0,0],[0,1],[1,0]]").is_err(), "also when it is read");
}

#[test]
fn an_echo_is_remembered_along_its_arc_until_its_timeout() {
    let (mut map, footprint, parameters) = (LocalMap::default(), footprint(), Parameters::default());
    map.update(HERE, &scan(&[(3, 0.5)]), &footprint, &parameters, 0.0);
    assert!(map.obstacles().count() >= 3);
    let sonar = (0.15 * math::cos(PI / 18.0), 0.15 * math::sin(PI / 18.0));
    for mark in map.obstacles() {
        let range = math::hypot(mark.x - sonar.0, mark.y - sonar.1);
        assert!((range - 0.5).abs() < 1e-9, "{range}");
    }
    // A scan without sonars neither adds nor takes away.
    let mut blind = scan(&[]);
    blind.placements = Sequence::new(&[]);
    map.update(HERE, &blind, &footprint, &parameters, parameters.obstacle_timeout + 0.1);
    assert_eq!(map.obstacles().count(), 0);
}

#[test]
fn silence_where_something_was_heard_takes_it_away() {
    let (mut map, footprint, parameters) = (LocalMap::default(), footprint(), Parameters::default());
    map.update(HERE, &scan(&[(3, 0.5)]), &footprint, &parameters, 0.0);
    for tick in 1..5 {
        map.update(HERE, &scan(&[]), &footprint, &parameters, f64::from(tick) * 0.02);
    }
    assert_eq!(map.obstacles().count(), 0);
}

#[test]
fn silence_from_another_direction_does_not_take_a_wall_away() {
    let (mut map, footprint, parameters) = (LocalMap::default(), footprint(), Parameters::default());
    // Heard at the robot's left; then the robot stands behind it and looks along it.
    map.update(HERE, &scan(&[(0, 0.3)]), &footprint, &parameters, 0.0);
    let before = map.obstacles().count();
    map.update(Pose2 { x: -0.6, y: 0.45, theta: 0.0 }, &scan(&[]), &footprint, &parameters, 0.02);
    assert!(before > 0 && map.obstacles().count() == before);
}

#[test]
fn a_free_way_is_left_to_the_planner() {
    assert_eq!(settled(&scan(&[]), 1.0).1, Decision::Clear);
}

#[test]
fn obstacles_beside_the_path_do_not_disturb() {
    assert_eq!(settled(&scan(&[(0, 0.4), (15, 0.4), (7, 0.4), (8, 0.4)]), 3.0).1, Decision::Clear);
}

#[test]
fn a_wall_across_the_way_is_not_left_to_the_planner() {
    for range in [0.1, 0.3, 0.6] {
        let (_, decision) = settled(&wall_ahead(range), 3.0);
        assert!(decision != Decision::Clear, "{range}");
    }
}

#[test]
fn close_to_a_wall_the_robot_does_not_drive_at_it() {
    let (_, decision) = settled(&wall_ahead(0.06), 1.0);
    assert!(matches!(decision, Decision::Avoid(twist) if twist.linear <= 0.0), "{decision:?}");
}

#[test]
fn one_echo_in_front_stops_a_driving_robot_at_once() {
    let (mut avoider, parameters) = (Avoider::new(footprint()), Parameters::default());
    avoider.update_map(HERE, &scan(&[]), &parameters, 0.0);
    assert_eq!(avoider.steer(HERE, AHEAD, &parameters, 0.0), Decision::Clear);
    // Before the next choice is due.
    avoider.update_map(HERE, &wall_ahead(0.1), &parameters, 0.02);
    let decision = avoider.steer(HERE, AHEAD, &parameters, 0.02);
    assert!(matches!(decision, Decision::Avoid(twist) if twist.linear <= 0.0), "{decision:?}");
}

#[test]
fn a_robot_that_is_closed_in_stands_still() {
    let all: Vec<_> = (0..16).map(|sonar| (sonar, 0.05)).collect();
    assert_eq!(settled(&scan(&all), 1.0).1, Decision::Avoid(Twist2::ZERO));
}

#[test]
fn without_scans_the_robot_stands_still() {
    let (mut avoider, parameters) = (Avoider::new(footprint()), Parameters::default());
    assert_eq!(avoider.steer(HERE, AHEAD, &parameters, 0.0), Decision::Avoid(Twist2::ZERO), "none yet");
    avoider.update_map(HERE, &scan(&[]), &parameters, 0.0);
    assert_eq!(avoider.steer(HERE, AHEAD, &parameters, 0.2), Decision::Clear);
    assert_eq!(avoider.steer(HERE, AHEAD, &parameters, 0.4), Decision::Avoid(Twist2::ZERO), "no more");
}

#[test]
fn nan_never_moves_the_robot() {
    let (mut avoider, parameters) = (Avoider::new(footprint()), Parameters::default());
    // With nothing around, so that any number would set it going.
    avoider.update_map(HERE, &scan(&[]), &parameters, 0.0);
    let before = avoider.map().clone();
    for wrong in [f64::NAN, f64::INFINITY, 1e300] {
        let nowhere = Pose2 { x: wrong, ..HERE };
        avoider.update_map(nowhere, &wall_ahead(0.3), &parameters, 0.02);
        assert_eq!(avoider.steer(nowhere, AHEAD, &parameters, 0.02), Decision::Avoid(Twist2::ZERO));
        assert_eq!(
            avoider.steer(HERE, Point2 { x: 0.0, y: wrong }, &parameters, 0.02),
            Decision::Avoid(Twist2::ZERO)
        );
    }
    assert_eq!(avoider.map(), &before);
    assert_eq!(avoider.steer(HERE, AHEAD, &parameters, f64::NAN), Decision::Avoid(Twist2::ZERO));
}

#[test]
fn robot_waits_for_occupied_goal() {
    let (mut avoider, parameters) = (Avoider::new(footprint()), Parameters::default());
    let goal = Point2 { x: 0.6, y: 0.0 };
    for tick in 0..100 {
        let time = f64::from(tick) * 0.02;
        avoider.update_map(HERE, &wall_ahead(0.45), &parameters, time);
        assert_eq!(avoider.steer(HERE, goal, &parameters, time), Decision::Avoid(Twist2::ZERO));
    }
}

#[test]
fn an_obstacle_that_stays_is_waited_for_once() {
    let (mut avoider, parameters) = (Avoider::new(footprint()), Parameters::default());
    let goal = Point2 { x: 0.6, y: 0.0 };
    let mut moved = None;
    for tick in 0..400 {
        let time = f64::from(tick) * 0.02;
        // It gets on as soon as it does not wait.
        let pose = if moved.is_some() { Pose2 { x: 0.12, ..HERE } } else { HERE };
        avoider.update_map(pose, &wall_ahead(0.45 - pose.x), &parameters, time);
        let decision = avoider.steer(pose, goal, &parameters, time);
        if moved.is_none() && decision != Decision::Avoid(Twist2::ZERO) {
            moved = Some(time);
        } else if moved.is_some_and(|moved| time > moved + 0.2) {
            assert_ne!(decision, Decision::Avoid(Twist2::ZERO), "at {time} s");
        }
    }
    assert!(moved.is_some_and(|time| time > parameters.progress_timeout), "{moved:?}");
}

fn arbitrary_scan() -> impl Strategy<Value = SonarScan> {
    prop::collection::vec((0..16_usize, 0.0..1.2_f64), 0..16).prop_map(|heard| scan(&heard))
}

fn arbitrary_pose() -> impl Strategy<Value = Pose2> {
    (-2.0..2.0_f64, -2.0..2.0_f64, -PI..PI).prop_map(|(x, y, theta)| Pose2 { x, y, theta })
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]

    #[test]
    fn all_marks_are_near_and_no_cell_holds_two(walk in prop::collection::vec((arbitrary_pose(), arbitrary_scan()), 1..30)) {
        let (mut map, footprint, parameters) = (LocalMap::default(), footprint(), Parameters::default());
        for (tick, (pose, scan)) in walk.iter().enumerate() {
            map.update(*pose, scan, &footprint, &parameters, tick as f64 * 0.05);
            let mut cells: Vec<_> = map
                .obstacles()
                .map(|mark| ((mark.x / 0.05).floor() as i64, (mark.y / 0.05).floor() as i64))
                .collect();
            let count = cells.len();
            cells.sort_unstable();
            cells.dedup();
            prop_assert_eq!(cells.len(), count);
            for mark in map.obstacles() {
                prop_assert!((mark.x - pose.x).abs() < 1.25 && (mark.y - pose.y).abs() < 1.25);
            }
        }
    }

    #[test]
    fn a_saved_avoider_goes_on_as_if_nothing_had_happened(
        walk in prop::collection::vec((arbitrary_pose(), arbitrary_scan()), 2..20),
        cut in 0..20_usize,
    ) {
        let (mut avoider, parameters) = (Avoider::new(footprint()), Parameters::default());
        let mut restored: Option<Avoider> = None;
        for (tick, (pose, scan)) in walk.iter().enumerate() {
            let time = tick as f64 * 0.05;
            if tick == cut % walk.len() {
                let saved = slate_module::encode(&avoider).unwrap();
                restored = Some(slate_module::decode(&saved).unwrap());
            }
            avoider.update_map(*pose, scan, &parameters, time);
            let decision = avoider.steer(*pose, AHEAD, &parameters, time);
            if let Some(restored) = &mut restored {
                restored.update_map(*pose, scan, &parameters, time);
                prop_assert_eq!(restored.steer(*pose, AHEAD, &parameters, time), decision);
            }
        }
        prop_assert_eq!(restored, Some(avoider));
    }

    #[test]
    fn commands_stay_within_the_limits(
        walk in prop::collection::vec((arbitrary_pose(), arbitrary_scan()), 1..20),
        goal in (-1e3..1e3_f64, -1e3..1e3_f64),
    ) {
        let (mut avoider, parameters) = (Avoider::new(footprint()), Parameters::default());
        for (tick, (pose, scan)) in walk.iter().enumerate() {
            let time = tick as f64 * 0.05;
            avoider.update_map(*pose, scan, &parameters, time);
            if let Decision::Avoid(twist) = avoider.steer(*pose, Point2 { x: goal.0, y: goal.1 }, &parameters, time) {
                prop_assert!(twist.linear <= parameters.max_linear_velocity && twist.linear >= -parameters.max_reverse_velocity);
                prop_assert!(twist.angular.abs() <= parameters.max_angular_velocity);
            }
        }
    }
}

#[test]
fn the_published_law_counts_every_detection_at_least_in_full() {
    let law = Rocs { variant: RocsVariant::Rocs };
    // Sonar 4 of 8: left wheel 1.5 - 0.8, right wheel 1.5 - 1.0, however far.
    for range in [0.1, 0.2, 0.29] {
        assert_eq!(law.react(&scan(&[(3, range)])), Some(WheelSpeeds { left: 0.7, right: 0.5 }));
    }
    // Their clamp lets what is nearer count for more: 1.25 times.
    let near = law.react(&scan(&[(3, 0.05)])).unwrap();
    assert!((near.left - 0.5).abs() < 1e-9 && (near.right - 0.25).abs() < 1e-9, "{near:?}");
    assert_eq!(law.react(&scan(&[(3, 0.31)])), None, "too far");
    assert_eq!(law.react(&scan(&[(12, 0.1)])), None, "the back has no say");
}

#[test]
fn the_repaired_law_counts_near_more_than_far() {
    let law = Rocs { variant: RocsVariant::RocsFixed };
    let speeds = law.react(&scan(&[(3, 0.2)])).unwrap();
    assert!((speeds.left - 1.1).abs() < 1e-9 && (speeds.right - 1.0).abs() < 1e-9, "{speeds:?}");
    assert_eq!(law.react(&scan(&[(3, 0.05)])), Some(WheelSpeeds { left: 0.7, right: 0.5 }));
    assert_eq!(law.react(&scan(&[(3, 0.29)])), None, "too little to act on");
}

/// What an avoider that hears nothing does about a robot straight ahead that moves so, on the way to a goal behind it.
fn met(ahead: f64, velocity: [f64; 2]) -> Decision {
    let (mut avoider, parameters) = (Avoider::new(footprint()), Parameters::default());
    avoider.update_map(HERE, &scan(&[]), &parameters, 0.0);
    avoider.set_others([Other { x: ahead, y: 0.0, radius: 0.3, velocity }], 0.0);
    avoider.steer(HERE, Point2 { x: 3.0, y: 0.0 }, &parameters, 0.0)
}

#[test]
fn a_robot_that_is_seen_is_avoided_as_it_moves() {
    assert_eq!(met(2.5, [0.0, 0.0]), Decision::Clear, "far away");
    let Decision::Avoid(round) = met(0.9, [0.0, 0.0]) else { panic!("it stands in the way") };
    assert!(round.angular != 0.0, "there is a way round: {round:?}");
    let Decision::Avoid(approached) = met(0.6, [-0.4, 0.0]) else { panic!("it comes") };
    assert!(approached.linear <= 0.0, "nobody drives into who comes: {approached:?}");
}

#[test]
fn undetected_robots_are_forgotten() {
    let (mut avoider, parameters) = (Avoider::new(footprint()), Parameters::default());
    let goal = Point2 { x: 3.0, y: 0.0 };
    avoider.set_others([Other { x: 0.7, y: 0.0, radius: 0.3, velocity: [0.0; 2] }], 0.0);
    avoider.update_map(HERE, &scan(&[]), &parameters, 0.0);
    assert_ne!(avoider.steer(HERE, goal, &parameters, 0.0), Decision::Clear);
    avoider.set_others([], 0.2);
    avoider.update_map(HERE, &scan(&[]), &parameters, 0.2);
    assert_eq!(avoider.steer(HERE, goal, &parameters, 0.2), Decision::Clear);
    // Nor is a robot with an impossible pose.
    avoider.set_others([Other { x: f64::NAN, y: 0.0, radius: 0.3, velocity: [0.0; 2] }], 0.4);
    avoider.update_map(HERE, &scan(&[]), &parameters, 0.4);
    assert_eq!(avoider.steer(HERE, goal, &parameters, 0.4), Decision::Clear);
}

/// What an avoider that hears nothing does about a planned motion, with a robot straight ahead that moves so.
fn guarded(planned: Twist2, ahead: f64, velocity: [f64; 2]) -> Decision {
    let (mut avoider, parameters) = (Avoider::new(footprint()), Parameters::default());
    avoider.update_map(HERE, &scan(&[]), &parameters, 0.0);
    avoider.set_others([Other { x: ahead, y: 0.0, radius: 0.3, velocity }], 0.0);
    avoider.guard(HERE, Twist2::ZERO, AHEAD, Some(planned), &parameters, 0.0)
}

#[test]
fn a_safe_planned_twist_passes_and_an_unsafe_one_is_made_safe() {
    let (on, back) = (Twist2 { linear: 0.4, angular: 0.0 }, Twist2 { linear: -0.2, angular: 0.0 });
    assert_eq!(guarded(on, 1.5, [0.0; 2]), Decision::Clear);
    assert_eq!(guarded(back, 0.6, [-0.1, 0.0]), Decision::Clear, "it leaves");
    let Decision::Avoid(slower) = guarded(on, 0.6, [0.0; 2]) else { panic!("it is in the way") };
    assert!(slower.linear < 0.4, "{slower:?}");
    let not = Twist2 { linear: f64::NAN, angular: 0.0 };
    assert_eq!(guarded(not, 1.5, [0.0; 2]), Decision::Avoid(Twist2::ZERO));
}

#[test]
fn known_room_is_not_left() {
    let known = Parameters { room_half_width: Some(1.0), ..Parameters::default() };
    let there = |x: f64, linear: f64| {
        let mut avoider = Avoider::new(footprint());
        avoider.update_map(Pose2 { x, ..HERE }, &scan(&[]), &known, 0.0);
        let planned = Twist2 { linear, angular: 0.0 };
        avoider.guard(Pose2 { x, ..HERE }, Twist2::ZERO, HERE_POINT, Some(planned), &known, 0.0)
    };
    assert_eq!(there(0.0, 0.4), Decision::Clear);
    assert_ne!(there(0.75, 0.4), Decision::Clear, "the wall is ahead");
    assert_ne!(there(-0.7, -0.2), Decision::Clear, "no sonar needs to hear it");
    assert_eq!(there(0.9, -0.2), Decision::Clear, "who is out comes back");
}

const HERE_POINT: Point2 = Point2 { x: 0.0, y: 0.0 };

#[test]
fn moving_robot_needs_stopping_distance() {
    let heavy = Parameters {
        room_half_width: Some(1.0),
        sides: Some(Sides { track: 0.9, acceleration: 0.6 }),
        ..Parameters::default()
    };
    let moving = |linear: f64| {
        let (mut avoider, here) = (Avoider::new(footprint()), Pose2 { x: 0.6, ..HERE });
        avoider.update_map(here, &scan(&[]), &heavy, 0.0);
        let (moving, planned) = (Twist2 { linear, angular: 0.0 }, Twist2 { linear: 0.1, angular: 0.5 });
        avoider.guard(here, moving, HERE_POINT, Some(planned), &heavy, 0.0)
    };
    assert_eq!(moving(0.1), Decision::Clear);
    assert_ne!(moving(0.6), Decision::Clear, "it would slide on into the wall");
}

#[test]
fn wheels_follow_only_so_fast() {
    let sides = Sides { track: 1.0, acceleration: 0.5 };
    let standing = Course { pose: HERE, motion: Twist2::ZERO };
    let full = Twist2 { linear: 1.0, angular: 0.0 };
    let later = (0..10).fold(standing, |course, _| sides.after(course, full, 0.1));
    assert!((later.motion.linear - 0.5).abs() < 1e-9 && (later.pose.x - 0.25).abs() < 1e-9, "{later:?}");
    let turning = sides.after(standing, Twist2 { linear: 0.0, angular: 1.0 }, 0.1);
    assert!((turning.motion.angular - 0.1).abs() < 1e-9, "both sides work against each other: {turning:?}");
}

#[test]
fn of_motions_the_one_is_best_from_which_the_best_can_follow() {
    let sides = Sides { track: 0.5, acceleration: 2.0 };
    let standing = Course { pose: HERE, motion: Twist2::ZERO };
    let [on, back, stop] = [0.5, -0.5, 0.0].map(|linear| Twist2 { linear, angular: 0.0 });
    let best = |motions: &[Twist2], to: f64| {
        let first = motions.iter().map(|motion| (*motion, 0.0));
        sides.best(standing, 0.2, first, [stop].into_iter(), |pose, _| (pose.x - to).abs())
    };
    assert_eq!(best(&[stop, on, back], 1.0), Some(on));
    assert_eq!(best(&[stop, on, back], -1.0), Some(back));
    assert_eq!(best(&[stop, on, back], f64::NAN), None, "nobody knows");
}
