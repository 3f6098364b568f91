//! The parts one by one.

use slate::interfaces::Point2;
use slate::mapek::AnalyzeBlock;
use slate::module::testing::Fixture;
use slate::prelude::*;
use slate_suave::interfaces::{
    Function, FunctionDesign, FunctionDesigns, InspectionProgress, Navigation, PipelineCourse, Setpoint,
    ThrusterRestart, VehicleMission, VehicleTask,
};
use slate_suave::managed::follow_pipeline::FollowPipeline;
use slate_suave::managed::recover_thrusters::RecoverThrusters;
use slate_suave::managed::spiral_search::SpiralSearch;
use slate_suave::manager::health::VisibilityTrend;
use slate_suave::manager::knowledge::SearchModel;
use slate_suave::manager::outlook::{DueDesign, SearchOutlook};
use slate_suave::statistics::mann_whitney_less;
use slate_suave::vehicle::{Vehicle, forces, wrench};

const CYCLE: u64 = 50_000_000;

#[test]
fn mann_whitney_agrees_with_published_values() {
    // The example of SciPy's documentation: two-sided p = 0.11134688653314041 with ties and continuity corrected.
    let (males, females) = ([19.0, 22.0, 16.0, 29.0, 24.0], [20.0, 11.0, 17.0, 12.0]);
    assert!((mann_whitney_less(&females, &males) - 0.111_346_886_533 / 2.0).abs() < 1e-6);
    // By hand: U = 4.5, variance 22.5 with three ties, z = -1.58114.
    let (first, second) = ([1.0, 2.0, 3.0, 4.0, 5.0], [3.0, 4.0, 5.0, 6.0, 7.0]);
    assert!((mann_whitney_less(&first, &second) - 0.056_923).abs() < 1e-5);
    assert_eq!(mann_whitney_less(&[], &second), 1.0);
    assert_eq!(mann_whitney_less(&[2.0, 2.0], &[2.0, 2.0]), 1.0);
}

#[test]
fn mixer_produces_requested_wrench() {
    for wanted in [[10.0, 0.0, 0.0, 0.0], [0.0, -4.0, 0.0, 0.0], [0.0, 0.0, 6.0, 0.0]] {
        let made = wrench(forces(wanted));
        for axis in 0..3 {
            assert!((made[axis] - wanted[axis]).abs() < 1e-9, "{wanted:?}: {made:?}");
        }
        // The thrusters behind are 1 cm farther from the middle than those in front.
        assert!(made[3].abs() < 0.2, "{wanted:?}: {made:?}");
    }
    let made = wrench(forces([0.0, 0.0, 0.0, 2.0]));
    assert!((made[3] - 2.0).abs() < 1e-9, "{made:?}");
}

#[test]
fn a_failed_thruster_slows_and_turns_the_vehicle() {
    let drive = |failed: bool| {
        let mut vehicle = Vehicle { position: [0.0, 0.0, 2.0], ..Vehicle::default() };
        let mut thrust = forces([10.0, 0.0, 0.0, 0.0]);
        if failed {
            thrust[0] = 0.0;
        }
        for _ in 0..100 {
            vehicle.advance(thrust, [0.0; 2], 0.01);
        }
        vehicle
    };
    let (healthy, failed) = (drive(false), drive(true));
    assert!(healthy.heading.abs() < 0.01 && failed.heading < -0.1, "{healthy:?} {failed:?}");
    assert!(failed.velocity[0] < 0.8 * healthy.velocity[0], "{healthy:?} {failed:?}");
}

#[test]
fn a_current_carries_the_vehicle() {
    let mut vehicle = Vehicle { position: [0.0, 0.0, 2.0], ..Vehicle::default() };
    for _ in 0..3000 {
        vehicle.advance([0.0; 6], [0.1, 0.0], 0.01);
    }
    assert!(vehicle.velocity[0] > 0.07 && vehicle.velocity[0] < 0.1, "{vehicle:?}");
}

fn pipeline() -> PipelineCourse {
    let corners = [(-15.0, 0.0), (-25.0, 0.0), (-25.0, 10.0)].map(|(x, y)| Point2 { x, y });
    PipelineCourse { corners: Sequence::new(&corners) }
}

#[test]
fn the_path_has_twenty_points_on_each_piece() {
    let pipeline = pipeline();
    assert_eq!(pipeline.len(), 40);
    assert_eq!(pipeline.point(0), Point2 { x: -15.5, y: 0.0 });
    assert_eq!(pipeline.point(39), Point2 { x: -25.0, y: 10.0 });
    assert_eq!(PipelineCourse::default().len(), 0);
}

/// The setpoints of a search whose vehicle is always where it is to go.
fn spiral(altitude: f64, seconds: u32) -> Vec<(f64, f64)> {
    let mut search = Fixture::<SpiralSearch>::new();
    search.params().altitude = altitude;
    let (mut points, mut at) = (Vec::new(), Navigation { altitude, ..Navigation::default() });
    for _ in 0..seconds * 20 {
        search.set("navigation", at);
        search.tick();
        for point in search.sent::<Setpoint>("setpoint") {
            points.push((point.x, point.y));
            (at.x, at.y) = (point.x, point.y);
        }
        search.advance(CYCLE);
    }
    points
}

#[test]
fn the_turns_of_the_spiral_are_as_far_apart_as_the_camera_sees() {
    for altitude in [1.0, 3.0] {
        let points = spiral(altitude, 130);
        assert_eq!(points.len(), 130, "a point each second");
        let radius = |at: usize| math::hypot(points[at].0, points[at].1);
        // 2 pi of 0.1 rad each; the width of 60 degrees.
        let width = 2.0 * altitude * math::tan(std::f64::consts::PI / 6.0);
        let growth = radius(62 + 60) - radius(60);
        assert!((growth - width * 6.2 / (2.0 * std::f64::consts::PI)).abs() < 1e-6, "{growth}");
    }
}

#[test]
fn a_search_waits_until_its_point_is_reached() {
    let mut search = Fixture::<SpiralSearch>::new();
    for _ in 0..200 {
        search.set("navigation", Navigation { altitude: 0.3, ..Navigation::default() });
        search.tick();
        let points = search.sent::<Setpoint>("setpoint");
        assert!(points.iter().all(|point| math::hypot(point.x, point.y) < 0.1), "{points:?}");
        search.advance(CYCLE);
    }
}

#[test]
fn an_inspection_begins_where_the_pipeline_was_found() {
    let mut follow = Fixture::<FollowPipeline>::new();
    follow.set("chart", pipeline());
    follow.set("mission", VehicleMission { point: 10, task: VehicleTask::INSPECT });
    let (mut at, mut inspected) = (Navigation::default(), 0.0);
    for _ in 0..100 {
        follow.set("navigation", at);
        follow.tick();
        if let Some(point) = follow.sent::<Setpoint>("setpoint").last() {
            if at == Navigation::default() {
                assert_eq!((point.x, point.y), (-20.5, 0.0));
            }
            (at.x, at.y) = (point.x, point.y);
        }
        inspected =
            follow.output::<InspectionProgress>("inspection").map_or(inspected, |newest| newest.distance);
        follow.advance(CYCLE);
    }
    assert!((inspected - 11.5).abs() < 1e-9, "24 points in 5 s: {inspected} m");
}

#[test]
fn thrusters_are_restarted_after_the_preparation() {
    let mut recovery = Fixture::<RecoverThrusters>::new();
    let mut restarted = Vec::new();
    for cycle in 0..300 {
        recovery.tick();
        for repair in recovery.sent::<ThrusterRestart>("repairs") {
            restarted.push((cycle, repair.thruster));
        }
        recovery.advance(CYCLE);
    }
    assert_eq!(restarted, [(200, 1), (205, 2), (210, 3), (215, 4), (220, 5), (225, 6)]);
}

fn designs() -> FunctionDesigns {
    let spiral = |altitude: f64, performance| FunctionDesign {
        function: Function::SEARCH,
        performance,
        altitude,
        visibility: altitude + 0.25,
        ..FunctionDesign::default()
    };
    FunctionDesigns { list: Sequence::new(&[spiral(3.0, 1.0), spiral(2.0, 0.5), spiral(1.0, 0.25)]) }
}

/// The designs that are due while the visibility is as `visibility` says after so many cycles.
fn due(pipeline_height: f64, cycles: u32, visibility: impl Fn(u32) -> (f64, f64)) -> Vec<(u32, u32)> {
    let mut outlook = Fixture::<AnalyzeBlock<SearchOutlook>>::new();
    let (mut due, mut change) = (Vec::new(), 0);
    for cycle in 0..cycles {
        let (distance, rate) = visibility(cycle);
        outlook.set("designs", designs());
        outlook.set("model", SearchModel { pipeline_height, visibility_margin: 0.1, vertical_speed: 0.3 });
        outlook.set("visibility", VisibilityTrend { distance, rate });
        outlook.tick();
        let newest: Option<DueDesign> = outlook.output("change");
        if let Some(newest) = newest.filter(|newest| newest.change > change) {
            change = newest.change;
            due.push((cycle, newest.place));
        }
        outlook.advance(CYCLE);
    }
    due
}

#[test]
fn without_a_pipeline_model_the_published_visibilities_hold() {
    let falling = |cycle: u32| (3.505 - 0.01 * f64::from(cycle), -0.2);
    assert_eq!(due(f64::NAN, 200, falling), [(0, 0), (26, 1), (126, 2)]);
}

#[test]
fn the_height_of_the_pipeline_lowers_the_need_of_visibility() {
    let falling = |cycle: u32| (3.505 - 0.01 * f64::from(cycle), -0.2);
    assert_eq!(due(0.5, 200, falling), [(0, 0), (91, 1), (191, 2)]);
}

#[test]
fn a_rising_visibility_is_climbed_for_in_time() {
    // 0.06 m/s: what takes 3.3 s to climb is begun 0.2 m early.
    let rising = |cycle: u32| (2.3 + 0.003 * f64::from(cycle), 0.06);
    let due = due(f64::NAN, 400, rising);
    assert_eq!(due.iter().map(|(_, place)| *place).collect::<Vec<_>>(), [1, 0], "and then kept: {due:?}");
    assert!((248..=252).contains(&due[1].0), "{due:?}");
}

#[test]
fn designs_are_chosen_by_performance_among_the_suitable() {
    let designs = designs();
    assert_eq!(designs.best(Function::SEARCH, |_| true), Some(0));
    assert_eq!(designs.best(Function::SEARCH, |design| design.altitude < 3.0), Some(1));
    assert_eq!(designs.best(Function::MOTION, |_| true), None);
}
