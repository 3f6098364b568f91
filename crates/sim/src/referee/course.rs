use serde::{Deserialize, Serialize};
use slate_interfaces::{Clearance, Contacts, MissionOutcome, MissionState, Pose2, Verdict};
use slate_module::prelude::*;
use slate_module::{Description, Instance, Params as _, PortCursor, Stage, Trigger, decode, encode};

use super::motion_record::MotionRecord;
use super::{ended, running, unknown_robot};
use crate::error::key;
use crate::geometry::Point;
use crate::map_path::map_path;
use crate::scenario::Scenario;
use crate::shortest_path::shortest_path;

/// Progress of a run.
#[interface]
pub struct Metrics {
    /// Path length of the robot until its last goal; on a patrol, the whole length.
    #[unit("m")]
    pub path_length: f64,
    /// Shortest path from goal to goal of a disc of the robot's half width.
    /// Obstacles are the static bodies. On a patrol, it leads to the goals reached so far.
    #[unit("m")]
    pub shortest_path: f64,
    /// Number of goals reached, in sequence.
    pub goals_reached: u64,
    /// Time at which it reached the last goal; NaN before.
    /// On a patrol, it is the first time.
    #[unit("s")]
    pub time_to_goal: f64,
    /// Smallest distance to another body.
    #[unit("m")]
    pub minimum_clearance: f64,
    /// Contacts of the robot.
    pub collisions: u64,
    /// Contacts that the robot caused by moving in.
    pub collisions_caused: u64,
}

/// Stay of the robot at its last goal.
#[interface]
pub struct Stay {
    /// Fraction of the time since its arrival at the last goal in which it was near.
    pub held: f64,
}

#[ports]
struct Io {
    /// True pose of the robot.
    #[role("truth")]
    truth: Input<Pose2>,
    /// True clearance.
    #[role("truth")]
    clearance: Input<Clearance>,
    /// All contacts.
    #[role("truth")]
    contacts: Queue<Contacts>,
    /// Verdict on the mission.
    verdict: Output<Verdict>,
    /// Progress of the run.
    metrics: Output<Metrics>,
    /// Stay of the robot at its last goal, if required.
    stay: Output<Stay>,
}

#[params]
struct Params {
    #[param(default = "r2", doc = "name of the robot to judge")]
    robot: Text<28>,
    #[param(default = 0.1, range = 0.0..=10.0, unit = "m", doc = "distance from a goal at which it counts as reached")]
    goal_tolerance: f64,
    #[param(default = 120.0, range = 0.0..=1e9, unit = "s", doc = "time limit to the last goal; the duration of a patrol")]
    time_limit: f64,
    #[param(default = 1, range = 0..=1000000, doc = "laps of its goals; 0 for a patrol: as many as it makes in the time limit, one at least")]
    laps: u64,
    #[param(default = 0.0, range = 0.0..=1e9, unit = "s", doc = "time to stay at the last goal, if it is no patrol")]
    hold_time: f64,
    #[param(default = 0.3, range = 0.0..=10.0, unit = "m", doc = "distance from the goal that counts as staying")]
    hold_tolerance: f64,
    #[param(default = 0.9, range = 0.0..=1.0, doc = "minimum fraction of that time")]
    hold_fraction: f64,
}

/// Referee of a course: the robot must reach its goals in sequence and in time.
/// It may also have to stay at the last one.
#[derive(Debug)]
pub struct Referee {
    goals: Vec<Point>,
    /// Shortest path from the start to the first goal, m.
    first_leg: f64,
    /// Shortest path to each goal from the previous one, m.
    /// That to the first goal begins at the last one.
    legs: Vec<f64>,
    course: GoalProgress,
}

#[derive(Debug, Default, Serialize, Deserialize)]
struct GoalProgress {
    #[serde(alias = "conduct")]
    record: MotionRecord,
    /// Number of reached goals.
    reached: u64,
    /// Time of reaching all goals, s.
    arrived: Option<f64>,
    /// Cycles since then, and those near the goal.
    stay: (u64, u64),
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
            describes_hardware: false,
            hardware: Vec::new(),
        })
    }

    fn create(setup: &Setup<'_>, params: &[u8]) -> Result<Self, Refusal> {
        let table = setup.section.ok_or("the referee needs a [world] table")?;
        let scenario = Scenario::new(table, setup.seed).map_err(|error| Refusal(error.to_string()))?;
        let params: Params = slate_module::read_params(params)?;
        let robot = scenario.placements.iter().find(|placement| placement.name == params.robot.as_str());
        let robot = robot.ok_or_else(|| unknown_robot(setup, params.robot.as_str(), &scenario))?;
        let outline = robot.description.outline();
        let half_width = outline.points.iter().map(|point| point.y).fold(0.0, math::max);
        let bodies = scenario.static_outlines();
        let goals = scenario.goals_of(params.robot.as_str());
        let way = |from: Point, to: Point| {
            let length = match &scenario.world.map {
                Some(map) => map_path(map, &bodies[map.walls..], from, to, half_width),
                None => shortest_path(&bodies, from, to, half_width),
            };
            length.ok_or_else(|| format!("world.goals: no path to the goal ({}, {})", to.x, to.y))
        };
        let (Some(first), Some(last)) = (goals.first(), goals.last()) else {
            let setting = format!("world.goals.{}", key(params.robot.as_str()));
            return Err(format!("{setting}: expected at least one goal, found none").into());
        };
        let mut legs = vec![way(*last, *first)?];
        for leg in goals.windows(2) {
            legs.push(way(leg[0], leg[1])?);
        }
        let first_leg = way(robot.pose.point(), *first)?;
        Ok(Self { goals, first_leg, legs, course: GoalProgress::default() })
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
    /// Returns the length of the shortest path to `goals` goals in sequence, m.
    fn shortest_path(&self, goals: u64) -> f64 {
        let Some(more) = goals.checked_sub(1) else { return 0.0 };
        let (laps, rest) = (more / self.legs.len() as u64, more as usize % self.legs.len());
        let lap: f64 = self.legs.iter().sum();
        self.first_leg + laps as f64 * lap + self.legs[1..=rest].iter().sum::<f64>()
    }

    fn judge(&mut self, io: &Io, params: &Params, now: &Tick) -> Outcome {
        if self.course.decided {
            return Outcome::Ok;
        }
        let is_patrol = params.laps == 0;
        let time_is_up = now.seconds() >= params.time_limit;
        let (Some(truth), Some(clearance)) = (io.truth.fresh(), io.clearance.fresh()) else {
            // Without a truth there is nothing to judge, and no robot arrives anywhere.
            if time_is_up && (is_patrol || self.course.arrived.is_none()) {
                self.course.decided = true;
                let reason = "the robot did not arrive in time";
                io.verdict.set(ended(MissionOutcome::TIMED_OUT, reason, self.course.record.caused));
            }
            return Outcome::Degraded;
        };
        let course = &mut self.course;
        let place = course.record.add_position(truth, is_patrol || course.arrived.is_none());
        course.record.add_contacts(params.robot.as_str(), clearance, &io.contacts);
        let all = params.laps.max(1).saturating_mul(self.goals.len() as u64);
        let distance =
            |number: u64| place.minus(self.goals[(number % self.goals.len() as u64) as usize]).norm();
        if (is_patrol || course.reached < all) && distance(course.reached) <= params.goal_tolerance {
            course.reached += 1;
            if course.reached == all {
                course.arrived = Some(now.seconds());
            }
        }
        let last_distance = distance(all - 1);
        let verdict = course.verdict(io, params, last_distance, now.seconds());
        course.decided = verdict.state != MissionState::RUNNING;
        io.verdict.set(verdict);
        io.metrics.set(self.metrics(if is_patrol { self.course.reached } else { all }));
        Outcome::Ok
    }

    /// Returns the progress of the run, with the shortest path to `goals` goals.
    fn metrics(&self, goals: u64) -> Metrics {
        let GoalProgress { record, reached, arrived, .. } = self.course;
        Metrics {
            path_length: record.length,
            shortest_path: self.shortest_path(goals),
            goals_reached: reached,
            time_to_goal: arrived.unwrap_or(f64::NAN),
            minimum_clearance: record.clearance,
            collisions: record.collisions,
            collisions_caused: record.caused,
        }
    }
}

impl GoalProgress {
    /// Returns the verdict at a time, s, and a distance from the last goal, m.
    fn verdict(&mut self, io: &Io, params: &Params, last_distance: f64, time: f64) -> Verdict {
        let (is_patrol, time_is_up) = (params.laps == 0, time >= params.time_limit);
        let caused = self.record.caused;
        let end = |outcome, reason| ended(outcome, reason, caused);
        match self.arrived {
            _ if is_patrol && !time_is_up => running("on patrol"),
            Some(_) if is_patrol => end(MissionOutcome::GOAL_REACHED, "patrol completed"),
            Some(_) if params.hold_time <= 0.0 => end(MissionOutcome::GOAL_REACHED, "goal reached"),
            Some(arrived) => {
                self.stay.0 += 1;
                self.stay.1 += u64::from(last_distance <= params.hold_tolerance);
                let held = self.stay.1 as f64 / self.stay.0 as f64;
                io.stay.set(Stay { held });
                match time - arrived >= params.hold_time {
                    false => running("at the goal"),
                    true if held >= params.hold_fraction => {
                        end(MissionOutcome::GOAL_REACHED, "goal reached and held")
                    }
                    true => end(MissionOutcome::GOAL_LEFT, "goal reached, and left for too long"),
                }
            }
            None if time_is_up => end(MissionOutcome::TIMED_OUT, "time is up"),
            None => running("on the way"),
        }
    }
}
