//! Referee of deliveries.

use std::fmt::Write;

use serde::{Deserialize, Serialize};
use slate_navigation_graph::{NavigationGraph, read_graph};
use slate_plugin::interfaces::{Clearance, Contacts, MissionOutcome, MissionState, Point2, Pose2, Verdict};
use slate_plugin::prelude::*;

use crate::frames::distance;
use crate::mission::{NavigationGoal, NavigationMission};

/// Deliveries of a robot.
#[interface]
pub struct DeliveryMetrics {
    /// Deliveries from one place of the mission to the next.
    pub deliveries: u64,
    /// Number of deliveries within their time.
    pub in_time: u64,
    /// Mean time of a delivery.
    #[unit("s")]
    pub mean_time: f64,
    /// Longest time of a delivery.
    #[unit("s")]
    pub longest_time: f64,
    /// Length of the robot's path.
    #[unit("m")]
    pub path_length: f64,
    /// Least distance to another body.
    #[unit("m")]
    pub minimum_clearance: f64,
    /// Contacts of the robot.
    pub collisions: u64,
    /// Contacts in which the robot was one that moved in.
    pub collisions_caused: u64,
}

/// Ports of [`DeliveryReferee`].
#[ports]
pub struct DeliveryRefereeIo {
    /// True pose of the robot.
    #[role("truth")]
    truth: Input<Pose2>,
    /// True clearance.
    #[role("truth")]
    clearance: Input<Clearance>,
    /// Contacts of the simulator.
    #[role("truth")]
    contacts: Queue<Contacts>,
    /// Mission of the robot, from its Knowledge: the places in turn.
    mission: Input<NavigationMission>,
    /// Verdict on the mission.
    verdict: Output<Verdict>,
    /// Metrics of the deliveries so far.
    metrics: Output<DeliveryMetrics>,
}

/// Parameters of [`DeliveryReferee`].
#[params]
pub struct DeliveryRefereeParams {
    #[param(default = "r2", doc = "name of the robot to judge")]
    robot: Text<28>,
    #[param(default = "", doc = "file of the navigation graph with the places")]
    graph_filename: Text<252>,
    #[param(default = 0.4, range = 0.0..=10.0, unit = "m", doc = "distance from a place at which it is reached")]
    goal_tolerance: f64,
    #[param(default = 10, range = 1..=1_000_000, doc = "deliveries after which the run ends")]
    deliveries: u64,
    #[param(default = 30.0, range = 0.0..=1e6, unit = "s", doc = "time of a delivery beside that of its way")]
    time_allowance: f64,
    #[param(default = 0.2, range = 0.01..=10.0, unit = "m/s", doc = "velocity on the way between two places that is in time")]
    velocity_allowance: f64,
    #[param(default = 3600.0, range = 0.0..=1e9, unit = "s", doc = "time limit of the run")]
    time_limit: f64,
}

/// State of [`DeliveryReferee`].
#[derive(Default, Serialize, Deserialize)]
pub struct DeliveryRefereeState {
    /// Places reached, the first of which is where the first item is picked up.
    visits: u64,
    /// Arrival time at the newest place, s.
    since: f64,
    in_time: u64,
    /// Sum and maximum of the times, s.
    total_time: f64,
    longest_time: f64,
    last: Option<[f64; 2]>,
    path_length: f64,
    clearance: Option<f64>,
    collisions: u64,
    caused: u64,
    decided: bool,
    #[serde(skip)]
    graph: Option<(String, Option<NavigationGraph>)>,
}

/// Referee of deliveries: number, punctuality and collisions.
/// Deliveries are between the places of a mission.
pub struct DeliveryReferee;

#[module(stage = PostLoop)]
impl Module for DeliveryReferee {
    type Io = DeliveryRefereeIo;
    type Params = DeliveryRefereeParams;
    type State = DeliveryRefereeState;

    fn tick(
        state: &mut DeliveryRefereeState,
        io: &DeliveryRefereeIo,
        params: &DeliveryRefereeParams,
        now: &Tick,
    ) -> Outcome {
        if state.decided {
            return Outcome::Ok;
        }
        state.read_graph(params, now);
        let (Some(truth), Some(mission)) = (io.truth.fresh(), io.mission.get()) else {
            return state.end_in_time(io, params, now);
        };
        let place = Point2 { x: truth.x, y: truth.y };
        state.record(place, params.robot.as_str(), io);
        state.visit(place, mission, params, now.seconds());
        io.metrics.set(state.metrics());
        state.end_in_time(io, params, now)
    }
}

impl DeliveryRefereeState {
    fn read_graph(&mut self, params: &DeliveryRefereeParams, now: &Tick) {
        let file = params.graph_filename.as_str();
        if self.graph.as_ref().is_some_and(|(known, _)| known == file) {
            return;
        }
        let graph = if file.is_empty() { None } else { Some(read_graph(std::path::Path::new(file))) };
        let graph = graph.and_then(|graph| {
            graph.map_err(|error| now.error(format_args!("{error}; name another `graph_filename`"))).ok()
        });
        self.graph = Some((file.into(), graph));
    }

    fn graph(&self) -> Option<&NavigationGraph> {
        self.graph.as_ref()?.1.as_ref()
    }

    fn position(&self, goal: &NavigationGoal) -> Option<Point2> {
        if goal.place.as_str().is_empty() {
            return Some(Point2 { x: goal.x, y: goal.y });
        }
        let [x, y] = self.graph()?.node(goal.place.as_str())?.position;
        Some(Point2 { x, y })
    }

    /// Adds motion, clearance and contacts.
    fn record(&mut self, place: Point2, robot: &str, io: &DeliveryRefereeIo) {
        if let Some([x, y]) = self.last.replace([place.x, place.y]) {
            self.path_length += distance(place, Point2 { x, y });
        }
        if let Some(clearance) = io.clearance.get() {
            let least = self.clearance.unwrap_or(f64::MAX);
            self.clearance = Some(math::min(least, clearance.distance));
        }
        for contacts in io.contacts.iter() {
            for contact in contacts.list.iter() {
                let own = contact.robot.as_str() == robot;
                if own || contact.other.as_str() == robot {
                    self.collisions += 1;
                    let caused = if own { contact.caused } else { contact.caused_by_other };
                    self.caused += u64::from(caused.get());
                }
            }
        }
    }

    /// Counts the place of the mission that is next, if the robot is there.
    fn visit(
        &mut self,
        place: Point2,
        mission: &NavigationMission,
        params: &DeliveryRefereeParams,
        time: f64,
    ) {
        let count = mission.goals.len() as u64;
        if count == 0 {
            return;
        }
        let goal = |number: u64| &mission.goals[(number % count) as usize];
        let here = goal(self.visits);
        let is_there = self.position(here).is_some_and(|goal| distance(goal, place) <= params.goal_tolerance);
        if !is_there {
            return;
        }
        if self.visits > 0 {
            let taken = time - self.since;
            self.total_time += taken;
            self.longest_time = math::max(self.longest_time, taken);
            let way = self.way(goal(self.visits - 1), here);
            self.in_time += u64::from(taken <= params.time_allowance + way / params.velocity_allowance);
        }
        self.visits += 1;
        self.since = time;
    }

    /// Returns the distance between two goals, m: along the route, or straight.
    fn way(&self, from: &NavigationGoal, to: &NavigationGoal) -> f64 {
        let route = self.graph().and_then(|graph| graph.route(from.place.as_str(), to.place.as_str()));
        let straight = || Some(distance(self.position(from)?, self.position(to)?));
        route.map(|route| route.length).or_else(straight).unwrap_or(0.0)
    }

    fn deliveries(&self) -> u64 {
        self.visits.saturating_sub(1)
    }

    fn metrics(&self) -> DeliveryMetrics {
        let deliveries = self.deliveries();
        DeliveryMetrics {
            deliveries,
            in_time: self.in_time,
            mean_time: self.total_time / deliveries.max(1) as f64,
            longest_time: self.longest_time,
            path_length: self.path_length,
            minimum_clearance: self.clearance.unwrap_or(f64::MAX),
            collisions: self.collisions,
            collisions_caused: self.caused,
        }
    }

    /// Sets the verdict.
    fn end_in_time(&mut self, io: &DeliveryRefereeIo, params: &DeliveryRefereeParams, now: &Tick) -> Outcome {
        let (deliveries, in_time) = (self.deliveries(), self.in_time);
        let is_done = deliveries >= params.deliveries;
        self.decided = is_done || now.seconds() >= params.time_limit;
        let mut verdict = Verdict { state: MissionState::RUNNING, ..Verdict::default() };
        if self.decided {
            verdict.outcome = match () {
                () if self.caused > 0 => MissionOutcome::COLLIDED,
                () if is_done && in_time == deliveries => MissionOutcome::GOAL_REACHED,
                () => MissionOutcome::TIMED_OUT,
            };
            let is_well = verdict.outcome == MissionOutcome::GOAL_REACHED;
            verdict.state = if is_well { MissionState::SUCCEEDED } else { MissionState::FAILED };
        }
        // Writing to a text in place can't fail.
        let _ = write!(
            verdict.reason,
            "{deliveries} deliveries, {in_time} in time, {} collisions caused",
            self.caused
        );
        io.verdict.set(verdict);
        Outcome::Ok
    }
}
