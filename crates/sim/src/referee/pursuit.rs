use std::fmt::Write;

use serde::{Deserialize, Serialize};
use slate_interfaces::{Clearance, Contacts, MissionOutcome, MissionState, Pose2, Verdict};
use slate_module::prelude::*;
use slate_module::{Description, Instance, Params as _, PortCursor, Stage, Trigger, decode, encode};

use super::motion_record::MotionRecord;
use super::{ended, running, unknown_robot};
use crate::scenario::Scenario;

/// Performance of a following robot so far.
#[interface]
pub struct Pursuit {
    /// Fraction of the time with a gap within the limits.
    /// Counted since the gap was first within them.
    pub gap_in_band: f64,
    /// First time of a gap within the limits.
    #[unit("s")]
    pub time_to_band: f64,
    /// Current gap, between the reference points of the robots.
    #[unit("m")]
    pub gap: f64,
    /// Median gap since the first time within the limits, to 2 cm.
    #[unit("m")]
    pub median_gap: f64,
    /// Minimum gap.
    #[unit("m")]
    pub minimum_gap: f64,
    /// Maximum gap since the first time within the limits.
    #[unit("m")]
    pub maximum_gap: f64,
    /// Path length of the follower.
    #[unit("m")]
    pub path_length: f64,
    /// Minimum clearance of the follower.
    #[unit("m")]
    pub minimum_clearance: f64,
    /// Contacts of the follower.
    pub collisions: u64,
    /// Contacts that the follower caused.
    pub collisions_caused: u64,
}

#[ports]
pub struct PursuitIo {
    /// True pose of the leader.
    #[role("truth")]
    leader: Input<Pose2>,
    /// True pose of the follower.
    #[role("truth")]
    follower: Input<Pose2>,
    /// True clearance of the follower.
    #[role("truth")]
    clearance: Input<Clearance>,
    /// All contacts.
    #[role("truth")]
    contacts: Queue<Contacts>,
    /// Verdict on the leader's course, which ends this mission.
    course: Input<Verdict>,
    /// Verdict on this mission.
    verdict: Output<Verdict>,
    /// Progress of the run.
    metrics: Output<Pursuit>,
}

#[params]
pub struct PursuitParams {
    #[param(default = "r3", doc = "name of the following robot")]
    robot: Text<28>,
    #[param(default = 0.8, range = 0.0..=100.0, unit = "m", doc = "minimum gap")]
    min_gap: f64,
    #[param(default = 2.0, range = 0.0..=100.0, unit = "m", doc = "maximum gap")]
    max_gap: f64,
    #[param(default = 0.95, range = 0.0..=1.0, doc = "minimum fraction of the time with a gap between")]
    min_fraction: f64,
}

/// Histogram of the gap, in bins of 2 cm.
#[derive(Debug, Serialize, Deserialize)]
struct GapCounts(Vec<u64>);

impl GapCounts {
    /// Width of a bin, m.
    const BIN_WIDTH: f64 = 0.02;
    /// Number of bins; greater gaps count in the last one.
    const STEPS: usize = 512;

    fn add(&mut self, gap: f64) {
        let step = ((gap / Self::BIN_WIDTH) as usize).min(Self::STEPS - 1);
        // A state of another edition may have fewer.
        if let Some(count) = self.0.get_mut(step) {
            *count += 1;
        }
    }

    /// Returns the center of the median's bin, m; 0 for an empty histogram.
    fn median(&self) -> f64 {
        let all: u64 = self.0.iter().sum();
        let mut seen = 0;
        let reaches_half = |count: &u64| {
            seen += count;
            2 * seen >= all
        };
        let step = if all > 0 { self.0.iter().position(reaches_half) } else { None };
        step.map_or(0.0, |step| (step as f64 + 0.5) * Self::BIN_WIDTH)
    }
}

impl Default for GapCounts {
    fn default() -> Self {
        Self(vec![0; Self::STEPS])
    }
}

/// State of the referee.
#[derive(Debug, Default, Serialize, Deserialize)]
pub struct PursuitCourse {
    #[serde(alias = "conduct")]
    record: MotionRecord,
    /// First time of a gap within the limits, s.
    since: Option<f64>,
    /// Cycles since then, and those with a gap within the limits.
    cycles: (u64, u64),
    /// Histogram of the gaps since then.
    gaps: GapCounts,
    /// Smallest and largest gap, m.
    extremes: Option<(f64, f64)>,
    decided: bool,
}

/// Referee of a pursuit: the robot must follow another at a safe distance.
#[derive(Debug)]
pub struct PursuitReferee(PursuitCourse);

impl Instance for PursuitReferee {
    const SECTION: &'static str = "world";

    fn describe(_: &Setup<'_>) -> Result<Description, Refusal> {
        Ok(Description {
            ports: PursuitIo::describe(),
            params: PursuitParams::DESCRIPTOR,
            parameters: PursuitParams::parameters(),
            stage: Stage::PostLoop,
            trigger: Trigger::Stage,
            deadline: None,
            unique: String::new(),
            describes_hardware: false,
            hardware: Vec::new(),
        })
    }

    fn create(setup: &Setup<'_>, params: &[u8]) -> Result<Self, Refusal> {
        let table = setup.section.ok_or("the pursuit_referee needs a [world] table")?;
        let scenario = Scenario::new(table, setup.seed).map_err(|error| Refusal(error.to_string()))?;
        let params: PursuitParams = slate_module::read_params(params)?;
        // Else it would count contacts of an unknown robot.
        if !scenario.placements.iter().any(|placement| placement.name == params.robot.as_str()) {
            return Err(unknown_robot(setup, params.robot.as_str(), &scenario));
        }
        Ok(Self(PursuitCourse::default()))
    }

    fn tick(&mut self, ports: &mut PortCursor, params: &[u8], now: &Tick) -> Outcome {
        let Ok(params) = slate_module::read_params(params) else { return Outcome::Failed };
        ports.with(|io: &PursuitIo| self.0.judge(io, &params, now))
    }

    fn save(&self) -> Result<Vec<u8>, Refusal> {
        encode(&self.0)
    }

    fn restore(&mut self, state: &[u8]) -> Result<(), Refusal> {
        self.0 = decode(state)?;
        Ok(())
    }
}

impl PursuitCourse {
    fn judge(&mut self, io: &PursuitIo, params: &PursuitParams, now: &Tick) -> Outcome {
        if self.decided {
            return Outcome::Ok;
        }
        let led = io.course.fresh().copied().unwrap_or_default();
        let all = (io.leader.fresh(), io.follower.fresh(), io.clearance.fresh());
        let (Some(leader), Some(follower), Some(clearance)) = all else {
            // An unseen robot is not judged, but an ended mission stays ended.
            if led.state != MissionState::RUNNING {
                self.decided = true;
                io.verdict.set(match led.state {
                    MissionState::FAILED => self.with_leader(&led),
                    _ => ended(MissionOutcome::OTHER, "the follower was not seen", self.record.caused),
                });
            }
            return Outcome::Degraded;
        };
        self.record.add_position(follower, true);
        self.record.add_contacts(params.robot.as_str(), clearance, &io.contacts);
        let gap = math::hypot(leader.x - follower.x, leader.y - follower.y);
        self.add_gap(gap, (params.min_gap..=params.max_gap).contains(&gap), now.seconds());
        let verdict = self.verdict(&led, params.min_fraction);
        self.decided = verdict.state != MissionState::RUNNING;
        io.verdict.set(verdict);
        io.metrics.set(self.metrics(gap));
        Outcome::Ok
    }

    /// Adds a gap (meters) at a time (seconds).
    fn add_gap(&mut self, gap: f64, is_in_band: bool, time: f64) {
        let extremes = self.extremes.get_or_insert((gap, gap));
        extremes.0 = math::min(extremes.0, gap);
        if is_in_band && self.since.is_none() {
            self.since = Some(time);
            extremes.1 = gap;
        }
        extremes.1 = math::max(extremes.1, gap);
        if self.since.is_some() {
            self.cycles.0 += 1;
            self.cycles.1 += u64::from(is_in_band);
            self.gaps.add(gap);
        }
    }

    /// Returns the fraction of the time with a gap within the limits.
    /// Counted since the gap was first within them.
    fn fraction(&self) -> f64 {
        self.cycles.1 as f64 / math::max(self.cycles.0 as f64, 1.0)
    }

    fn verdict(&self, led: &Verdict, min_fraction: f64) -> Verdict {
        let caused = self.record.caused;
        match led.state {
            MissionState::FAILED => self.with_leader(led),
            MissionState::SUCCEEDED if self.fraction() >= min_fraction => {
                ended(MissionOutcome::GAP_KEPT, "gap kept", caused)
            }
            MissionState::SUCCEEDED => {
                ended(MissionOutcome::GAP_LEFT, "too near or too far for too long", caused)
            }
            _ => running("on the way"),
        }
    }

    /// Returns the progress of the run for a gap, m.
    fn metrics(&self, gap: f64) -> Pursuit {
        let (minimum_gap, maximum_gap) = self.extremes.unwrap_or((gap, gap));
        Pursuit {
            gap_in_band: self.fraction(),
            time_to_band: self.since.unwrap_or_default(),
            gap,
            median_gap: self.gaps.median(),
            minimum_gap,
            maximum_gap,
            path_length: self.record.length,
            minimum_clearance: self.record.clearance,
            collisions: self.record.collisions,
            collisions_caused: self.record.caused,
        }
    }

    /// Returns the verdict after a failure of the leader.
    fn with_leader(&self, led: &Verdict) -> Verdict {
        let mut reason = Text::<64>::new("leader: ");
        // Writing to a text in place can't fail.
        let _ = reason.write_str(led.reason.as_str());
        let outcome = if self.record.caused > 0 { MissionOutcome::COLLIDED } else { led.outcome };
        Verdict { state: MissionState::FAILED, outcome, reason }
    }
}
