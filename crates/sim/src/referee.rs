//! The judge of a mission: it sees the truth, and no robot sees the judge.

use serde::{Deserialize, Serialize};
use slate_interfaces::{Clearance, Contacts, MissionState, Pose2, Verdict};
use slate_module::prelude::*;
use slate_module::{Description, Instance, Params as _, PortCursor, Stage, Trigger, decode, encode};

use crate::geometry::Point;
use crate::scenario::Scenario;
use crate::shortest_path::shortest_path;

/// How a run went so far.
#[interface]
pub struct Metrics {
    /// The way of the robot.
    #[unit("m")]
    pub path_length: f64,
    /// The shortest way of a disc of half the robot's width among what does not move.
    #[unit("m")]
    pub shortest_path: f64,
    /// The least distance to another body.
    #[unit("m")]
    pub minimum_clearance: f64,
    /// Contacts of the robot.
    pub collisions: u64,
    /// Contacts in which the robot was one that moved in.
    pub collisions_caused: u64,
}

#[ports]
struct Io {
    /// Where the robot really is.
    truth: Input<Pose2>,
    /// How far the nearest other body really is.
    clearance: Input<Clearance>,
    /// All contacts.
    contacts: Queue<Contacts>,
    /// How the mission stands.
    verdict: Output<Verdict>,
    /// How the run went so far.
    metrics: Output<Metrics>,
}

#[params]
struct Params {
    #[param(default = "r2", doc = "the robot that is judged")]
    robot: Text<28>,
    #[param(default = 0.1, range = 0.0..=10.0, unit = "m", doc = "the goal is reached within this distance")]
    tolerance: f64,
    #[param(default = 120.0, range = 0.0..=1e9, unit = "s", doc = "the time that the mission may take")]
    time_limit: f64,
}

/// Judges whether a robot reaches its goal in time.
#[derive(Debug)]
pub struct Referee {
    goal: Point,
    shortest: f64,
    course: Course,
}

#[derive(Debug, Serialize, Deserialize)]
struct Course {
    last: Option<Point>,
    length: f64,
    clearance: f64,
    collisions: u64,
    caused: u64,
    decided: bool,
}

impl Instance for Referee {
    const SECTION: &'static str = "world";

    fn describe(_: &Setup<'_>) -> Result<Description, Refusal> {
        Ok(Description {
            ports: Io::describe(),
            params: Params::DESCRIPTOR,
            parameters: Params::parameters(),
            stage: Stage::PostLoop,
            trigger: Trigger::Stage,
            deadline: None,
            unique: String::new(),
        })
    }

    fn create(setup: &Setup<'_>, params: &[u8]) -> Result<Self, Refusal> {
        let table = setup.section.ok_or("the referee needs a [world] table")?;
        let scenario = Scenario::new(table, setup.seed).map_err(|error| Refusal(error.to_string()))?;
        let params: Params = slate_module::read_params(params)?;
        let robot = scenario.placements.iter().find(|placement| placement.name == params.robot.as_str());
        let robot = robot.ok_or_else(|| format!("no robot `{}` in the world", params.robot))?;
        let outline = robot.description.outline();
        let half_width = outline.points.iter().map(|point| point.y).fold(0.0, math::max);
        let shortest =
            shortest_path(&scenario.static_outlines(), robot.pose.point(), scenario.goal, half_width)
                .ok_or("there is no way to the goal")?;
        let course =
            Course { last: None, length: 0.0, clearance: f64::MAX, collisions: 0, caused: 0, decided: false };
        Ok(Self { goal: scenario.goal, shortest, course })
    }

    fn tick(&mut self, ports: &mut PortCursor, params: &[u8], now: &Tick) -> Outcome {
        let Ok(params) = slate_module::read_params::<Params>(params) else { return Outcome::Failed };
        ports.with(|io: &Io| self.judge(io, &params, now))
    }

    fn save(&self) -> Result<Vec<u8>, Refusal> {
        encode(&self.course)
    }

    fn restore(&mut self, state: &[u8]) -> Result<(), Refusal> {
        self.course = decode(state)?;
        Ok(())
    }
}

impl Referee {
    fn judge(&mut self, io: &Io, params: &Params, now: &Tick) -> Outcome {
        let course = &mut self.course;
        if course.decided {
            return Outcome::Ok;
        }
        let late = now.seconds() >= params.time_limit;
        let verdict = |state, reason: &str| Verdict { state, reserved: [0; 3], reason: Text::new(reason) };
        let (Some(truth), Some(clearance)) = (io.truth.fresh(), io.clearance.fresh()) else {
            // Without a truth there is nothing to judge, and no robot arrives anywhere.
            if late {
                course.decided = true;
                io.verdict.set(verdict(MissionState::FAILED, "the robot was never seen to arrive in time"));
            }
            return Outcome::Degraded;
        };
        let place = Point::new(truth.x, truth.y);
        if let Some(last) = course.last.replace(place) {
            course.length += place.minus(last).norm();
        }
        course.clearance = math::min(course.clearance, clearance.distance);
        for contacts in io.contacts.iter() {
            for contact in contacts.list.iter() {
                let own = contact.robot.as_str() == params.robot.as_str();
                if own || contact.other.as_str() == params.robot.as_str() {
                    course.collisions += 1;
                    let caused = if own { contact.caused } else { contact.caused_by_other };
                    course.caused += u64::from(caused.get());
                }
            }
        }
        let reached = place.minus(self.goal).norm() <= params.tolerance;
        let verdict = if reached {
            verdict(MissionState::SUCCEEDED, "goal reached")
        } else if late {
            verdict(MissionState::FAILED, "time is up")
        } else {
            verdict(MissionState::RUNNING, "on the way")
        };
        course.decided = verdict.state != MissionState::RUNNING;
        io.verdict.set(verdict);
        io.metrics.set(Metrics {
            path_length: course.length,
            shortest_path: self.shortest,
            minimum_clearance: course.clearance,
            collisions: course.collisions,
            collisions_caused: course.caused,
        });
        Outcome::Ok
    }
}
