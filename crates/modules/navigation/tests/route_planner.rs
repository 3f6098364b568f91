//! The Plan of a robot that navigates.
#![allow(clippy::unwrap_used, reason = "a test that fails panics")]

use std::fs;

use slate_navigation::{
    NavigationGoal, NavigationMission, NavigationState, NavigationStatus, RoutePlanner, RoutePlannerParams,
};
use slate_plugin::interfaces::{OccupancyGrid, Path, Point2, Pose2};
use slate_plugin::mapek::{Ended, Ending, ExecuteStatus, PlanBlock, PlanStep, Planned, Route};
use slate_plugin::module::testing::Fixture;
use slate_plugin::module::{Sequence, Text};
use slate_wheeled::knowledge::WheeledModel;

use crate::common::model;

const GRAPH: &str = "
graph-name: test
nodes:
  - { name: here, pos: [0.5, 0.5] }
  - { name: detour, pos: [3.0, 0.5] }
  - { name: there, pos: [3.5, 3.5], properties: [ { orientation: 1.57 } ] }
connections: [ [here, detour], [detour, there] ]
";

/// A room of 4 m by 4 m with a wall from the west at y = 2, which leaves a gap at the east.
struct Scene {
    planner: Fixture<PlanBlock<RoutePlanner>>,
    robot: WheeledModel,
    mission: NavigationMission,
    /// Newest one.
    status: NavigationStatus,
}

impl Scene {
    fn new(name: &str) -> Self {
        let file = std::env::temp_dir().join(format!("slate-navigation-{}-{name}.yaml", std::process::id()));
        fs::write(&file, GRAPH).unwrap();
        let params = RoutePlannerParams {
            graph_filename: Text::new(file.to_str().unwrap()),
            give_up_timeout: 5.0,
            ..RoutePlannerParams::default()
        };
        let robot = model(Pose2 { x: 0.5, y: 0.5, theta: 0.0 });
        let planner = Fixture::with(params).unwrap();
        let mut scene = Self {
            planner,
            robot,
            mission: NavigationMission::default(),
            status: NavigationStatus::default(),
        };
        scene.set_costs(40);
        scene
    }

    /// A costmap with a wall of that many cells of 0.1 m.
    fn set_costs(&mut self, wall: usize) {
        self.planner.write::<OccupancyGrid>("costmap", 1600, |map| {
            (map.resolution, map.width, map.height) = (0.1, 40, 40);
            for (cell, cost) in map.data.iter_mut().enumerate() {
                let (column, row) = (cell % 40, cell / 40);
                *cost = if (19..=20).contains(&row) && column < wall { 100 } else { 0 };
            }
        });
    }

    fn go_to(&mut self, goals: &[NavigationGoal]) {
        self.mission = NavigationMission {
            number: self.mission.number + 1,
            goals: Sequence::new(goals),
            ..NavigationMission::default()
        };
    }

    /// A run of the Plan after a time, ms; returns the newest message.
    fn run(&mut self, milliseconds: u64) -> Option<Planned> {
        self.planner.set("mission", self.mission);
        self.planner.set("robot", self.robot);
        self.planner.advance(milliseconds * 1_000_000);
        self.planner.tick();
        self.status = self.planner.output("status").unwrap_or(self.status);
        self.planner.sent::<Planned>("plan").last().copied()
    }

    /// Execute runs the newest action, or has ended it.
    fn execute(&mut self, ticket: u64, ended: Option<Ending>) {
        let route = if ended.is_some() { Route::IDLE } else { Route::DELIBERATIVE };
        let ended: Vec<_> = ended
            .map(|ending| Ended { number: ticket, ticket, ending, ..Ended::default() })
            .into_iter()
            .collect();
        let status =
            ExecuteStatus { ticket, route, ended: Sequence::new(&ended), ..ExecuteStatus::default() };
        self.planner.set("situation", status);
    }

    fn path(&self) -> Vec<Point2> {
        self.planner.read::<Path, _>("path", |path| path.points.to_vec()).unwrap_or_default()
    }

    fn status(&self) -> NavigationStatus {
        self.status
    }
}

fn point(x: f64, y: f64) -> NavigationGoal {
    NavigationGoal { x, y, ..NavigationGoal::default() }
}

fn place(name: &str) -> NavigationGoal {
    NavigationGoal { place: Text::new(name), ..NavigationGoal::default() }
}

fn kind(planned: Option<Planned>) -> String {
    planned.map(|planned| planned.action.kind.as_str().to_owned()).unwrap_or_default()
}

#[test]
fn a_path_leads_round_a_wall_to_the_goal() {
    let mut scene = Scene::new("path");
    scene.set_costs(30);
    scene.go_to(&[point(0.5, 3.5)]);
    let planned = scene.run(0).unwrap();
    assert_eq!(planned.action.kind.as_str(), "NavigateTo");
    assert_eq!(&planned.action.arguments[..], &[0.5, 3.5, 0.0, 0.0]);
    let path = scene.path();
    assert!(path.iter().any(|point| point.x > 2.9), "{path:?}");
    assert_eq!((path[0].x, path[path.len() - 1].y), (0.5, 3.5));
    assert_eq!(scene.status().state, NavigationState::NAVIGATING);
}

#[test]
fn a_route_leads_through_the_nodes_of_the_graph() {
    let mut scene = Scene::new("route");
    scene.set_costs(28);
    scene.go_to(&[place("there")]);
    let planned = scene.run(0).unwrap();
    assert_eq!(&planned.action.arguments[..], &[3.5, 3.5, 1.57, 1.0]);
    let path = scene.path();
    assert!(path.iter().any(|point| (point.x, point.y) == (3.0, 0.5)), "{path:?}");
}

#[test]
fn goals_follow_each_other_and_then_the_mission_is_done() {
    let mut scene = Scene::new("goals");
    scene.set_costs(0);
    scene.go_to(&[point(1.0, 0.5), point(2.0, 0.5)]);
    let first = scene.run(0).unwrap();
    scene.execute(first.ticket, None);
    assert!(scene.run(1000).is_none(), "it is on its way");
    scene.execute(first.ticket, Some(Ending::COMPLETED));
    let second = scene.run(100).unwrap();
    assert_eq!(second.action.arguments[0], 2.0);
    scene.execute(second.ticket, Some(Ending::COMPLETED));
    assert!(scene.run(100).is_none());
    assert_eq!((scene.status().state, scene.status().reached), (NavigationState::FINISHED, 2));
}

#[test]
fn a_pause_clears_the_action_and_a_resumption_requests_it() {
    let mut scene = Scene::new("pause");
    scene.set_costs(0);
    scene.go_to(&[point(3.0, 0.5)]);
    let first = scene.run(0).unwrap();
    scene.execute(first.ticket, None);
    scene.mission.is_paused = true.into();
    let cleared = scene.run(100).unwrap();
    assert_eq!(cleared.step, PlanStep::CLEAR);
    scene.execute(cleared.ticket, Some(Ending::CANCELLED));
    assert!(scene.run(2000).is_none());
    assert_eq!(scene.status().state, NavigationState::PAUSED);
    scene.mission.is_paused = false.into();
    assert_eq!(kind(scene.run(100)), "NavigateTo");
}

#[test]
fn a_goal_in_a_wall_is_refused_with_the_nearest_free_point() {
    let mut scene = Scene::new("wall");
    scene.set_costs(30);
    // The wall reaches from 1.9 m to 2.1 m; what is within 0.25 m is taken instead.
    scene.go_to(&[point(0.5, 2.05)]);
    assert_eq!(kind(scene.run(0)), "NavigateTo");
    scene.planner.params().tolerance = 0.02;
    scene.go_to(&[point(0.5, 2.05)]);
    scene.run(100);
    let status = scene.status();
    assert_eq!(status.state, NavigationState::BLOCKED);
    assert!(status.reason.as_str().contains("nearest free point"), "{}", status.reason);
    assert!((status.nearest_free.y - 2.15).abs() < 1e-9, "{status:?}");
    for _ in 0..8 {
        scene.run(1000);
    }
    let status = scene.status();
    assert_eq!((status.state, status.given_up), (NavigationState::FINISHED, 1));
    assert!(status.reason.as_str().contains("nearest free point"), "{}", status.reason);
}

#[test]
fn a_goal_without_a_path_waits_and_goes_on_when_it_is_free() {
    let mut scene = Scene::new("blocked");
    scene.go_to(&[point(0.5, 3.5)]);
    assert!(scene.run(0).is_none_or(|planned| planned.step == PlanStep::CLEAR));
    assert!(scene.status().reason.as_str().starts_with("no path to (0.50, 3.50)"));
    scene.set_costs(30);
    assert_eq!(kind(scene.run(1000)), "NavigateTo");
}

#[test]
fn an_unknown_place_is_given_up_with_a_similar_name() {
    let mut scene = Scene::new("unknown");
    scene.go_to(&[place("ther"), place("there")]);
    scene.set_costs(0);
    scene.run(0);
    let reason = scene.status().reason;
    assert!(reason.as_str().contains("no place `ther`") && reason.as_str().contains("there"), "{reason}");
    assert_eq!(kind(scene.run(200)), "NavigateTo");
}

#[test]
fn a_missing_pose_or_costmap_is_named() {
    let mut scene = Scene::new("inputs");
    scene.go_to(&[point(1.0, 0.5)]);
    scene.robot.robot.pose = Pose2::UNKNOWN;
    scene.run(0);
    assert_eq!(scene.status().state, NavigationState::WAITING_FOR_INPUT);
    assert!(scene.status().reason.as_str().contains("pose"));
    scene.robot = model(Pose2 { x: 0.5, y: 0.5, theta: 0.0 });
    scene.planner.expire("costmap");
    scene.run(200);
    assert!(scene.status().reason.as_str().contains("costmap"), "{}", scene.status().reason);
    scene.set_costs(0);
    assert_eq!(kind(scene.run(200)), "NavigateTo");
}

#[test]
fn a_goal_to_dock_at_is_approached_and_then_docked_at() {
    let mut scene = Scene::new("dock");
    scene.set_costs(0);
    let goal =
        NavigationGoal { x: 3.0, y: 0.5, has_heading: true.into(), dock: true.into(), ..point(0.0, 0.0) };
    scene.go_to(&[goal]);
    let first = scene.run(0).unwrap();
    assert_eq!(&first.action.arguments[..], &[2.4, 0.5, 0.0, 1.0]);
    scene.execute(first.ticket, Some(Ending::COMPLETED));
    let second = scene.run(100).unwrap();
    assert_eq!(second.action.kind.as_str(), "Dock");
    assert_eq!(&second.action.arguments[..], &[3.0, 0.5, 0.0, 0.1]);
    scene.execute(second.ticket, Some(Ending::COMPLETED));
    scene.run(100);
    assert_eq!((scene.status().state, scene.status().reached), (NavigationState::FINISHED, 1));
}
