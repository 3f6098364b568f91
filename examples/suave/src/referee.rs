//! Metrics of the exemplar: search time, inspected length, reaction times.

use serde::{Deserialize, Serialize};
use slate_plugin::interfaces::{MissionOutcome, MissionState, Verdict};
use slate_plugin::prelude::*;

use crate::interfaces::{
    FunctionStatus, InspectionProgress, PipelineView, ThrusterHealth, VehicleMission, VehicleTask,
    WaterVisibility,
};

/// Metrics of a run; what does not apply is NaN.
#[interface]
pub struct SuaveMetrics {
    /// Time until the pipeline was found; the time limit if it was not.
    #[unit("s")]
    pub search_time: f64,
    /// Length of pipeline inspected.
    #[unit("m")]
    pub distance_inspected: f64,
    /// Mean of all reaction times.
    #[unit("s")]
    pub reaction_time: f64,
    /// Mean time from another visibility until the altitude for it is set.
    #[unit("s")]
    pub visibility_reaction_time: f64,
    /// Time from a thruster's failure until its recovery is active.
    #[unit("s")]
    pub thruster_reaction_time: f64,
    /// Time from the sight of the pipeline until its inspection is active.
    #[unit("s")]
    pub inspection_reaction_time: f64,
    /// Disturbances that the manager answered.
    pub disturbances_answered: u64,
    /// Number of disturbances.
    pub disturbances: u64,
}

/// Ports of the referee.
#[ports]
pub struct RefereeIo {
    view: Input<PipelineView>,
    visibility: Input<WaterVisibility>,
    thrusters: Input<ThrusterHealth>,
    mission: Input<VehicleMission>,
    #[stale(after = "150ms")]
    search: Input<FunctionStatus>,
    #[stale(after = "150ms")]
    follow: Input<FunctionStatus>,
    #[stale(after = "150ms")]
    recovery: Input<FunctionStatus>,
    inspection: Input<InspectionProgress>,
    /// Verdict on the mission.
    verdict: Output<Verdict>,
    /// Metrics of the run.
    metrics: Output<SuaveMetrics>,
}

/// Parameters of the referee.
#[params]
pub struct RefereeParams {
    #[param(default = 300.0, range = 1.0..=1e9, unit = "s", doc = "time of the mission")]
    time_limit: f64,
    #[param(default = 3.25, range = 0.0..=100.0, unit = "m", doc = "visibility from which the high altitude is due")]
    high_visibility: f64,
    #[param(default = 2.25, range = 0.0..=100.0, unit = "m", doc = "visibility from which the medium altitude is due")]
    medium_visibility: f64,
    #[param(default = 3.0, range = 0.5..=20.0, unit = "m", doc = "high altitude")]
    high_altitude: f64,
    #[param(default = 2.0, range = 0.5..=20.0, unit = "m", doc = "medium altitude")]
    medium_altitude: f64,
    #[param(default = 1.0, range = 0.5..=20.0, unit = "m", doc = "low altitude")]
    low_altitude: f64,
}

/// Reactions to a kind of disturbance.
#[derive(Clone, Copy, Default, Serialize, Deserialize)]
struct Reactions {
    /// Time of the disturbance that waits for its answer, seconds.
    pending: Option<f64>,
    disturbances: u64,
    answered: u64,
    /// Sum of the reaction times, seconds.
    total: f64,
}

impl Reactions {
    fn disturb(&mut self, now: f64) {
        self.pending = Some(now);
        self.disturbances += 1;
    }

    fn answer(&mut self, now: f64) {
        if let Some(since) = self.pending.take() {
            self.answered += 1;
            self.total += now - since;
        }
    }

    fn mean(&self) -> f64 {
        if self.answered > 0 { self.total / self.answered as f64 } else { f64::NAN }
    }
}

/// Progress of the run.
#[derive(Default, Serialize, Deserialize)]
pub struct RefereeState {
    found: Option<f64>,
    /// Required altitude (meters), its start, and the previous one's (seconds).
    due: f64,
    due_since: f64,
    due_before: f64,
    /// Altitude that is set, and since when, meters and seconds.
    set: f64,
    set_since: f64,
    failed: u32,
    visibility: Reactions,
    thrusters: Reactions,
    inspection: Reactions,
    decided: bool,
}

/// Judges a run as the exemplar does.
pub struct SuaveReferee;

#[module(stage = PostLoop)]
impl Module for SuaveReferee {
    type Io = RefereeIo;
    type Params = RefereeParams;
    type State = RefereeState;

    fn tick(state: &mut RefereeState, io: &RefereeIo, params: &RefereeParams, now: &Tick) -> Outcome {
        if state.decided {
            return Outcome::Ok;
        }
        let time = now.seconds();
        if state.found.is_none() && io.view.get().is_some_and(|view| view.seen.get()) {
            state.found = Some(time);
            state.inspection.disturb(time);
        }
        if io.follow.fresh().is_some() {
            state.inspection.answer(time);
        }
        state.watch_visibility(io, params, time);
        state.watch_thrusters(io, time);
        let verdict =
            |state, reason: &str| Verdict { state, reason: Text::new(reason), ..Verdict::default() };
        state.decided = time >= params.time_limit;
        io.verdict.set(match (state.decided, state.found) {
            (false, None) => verdict(MissionState::RUNNING, "searching"),
            (false, Some(_)) => verdict(MissionState::RUNNING, "inspecting"),
            (true, None) => Verdict {
                outcome: MissionOutcome::TIMED_OUT,
                ..verdict(MissionState::FAILED, "the pipeline was not found in time")
            },
            (true, Some(_)) => verdict(
                MissionState::SUCCEEDED,
                "the pipeline was found, and inspected until the time was up",
            ),
        });
        io.metrics.set(state.metrics(io, math::min(time, params.time_limit)));
        Outcome::Ok
    }
}

impl RefereeState {
    /// Records disturbances of the visibility and the managers' reactions.
    /// A disturbance is another required altitude. It is answered when a manager has set that altitude since the
    /// disturbance before: at once if it did so in advance. One that vanishes by itself is not answered.
    fn watch_visibility(&mut self, io: &RefereeIo, params: &RefereeParams, time: f64) {
        let is_searching = io.mission.get().is_some_and(|mission| mission.task == VehicleTask::SEARCH);
        let (true, Some(visibility)) = (is_searching, io.visibility.get()) else {
            self.visibility.pending = None;
            return;
        };
        let due = match visibility.distance {
            distance if distance >= params.high_visibility => params.high_altitude,
            distance if distance >= params.medium_visibility => params.medium_altitude,
            _ => params.low_altitude,
        };
        if due != self.due {
            (self.due, self.due_before) = (due, self.due_since);
            self.due_since = time;
            self.visibility.disturb(time);
        }
        let Some(search) = io.search.fresh() else { return };
        if search.altitude != self.set {
            self.set = search.altitude;
            self.set_since = time;
        }
        if self.set == due && self.set_since >= self.due_before {
            self.visibility.answer(time);
        }
    }

    fn watch_thrusters(&mut self, io: &RefereeIo, time: f64) {
        let failed = io.thrusters.get().map_or(0, |thrusters| thrusters.failed);
        if failed & !self.failed != 0 {
            self.thrusters.disturb(time);
        }
        self.failed = failed;
        if io.recovery.fresh().is_some() {
            self.thrusters.answer(time);
        }
    }

    fn metrics(&self, io: &RefereeIo, time: f64) -> SuaveMetrics {
        let kinds = [self.visibility, self.thrusters, self.inspection];
        let all = kinds.iter().fold(Reactions::default(), |sum, kind| Reactions {
            pending: None,
            disturbances: sum.disturbances + kind.disturbances,
            answered: sum.answered + kind.answered,
            total: sum.total + kind.total,
        });
        SuaveMetrics {
            search_time: self.found.unwrap_or(time),
            distance_inspected: io.inspection.get().map_or(0.0, |inspection| inspection.distance),
            reaction_time: all.mean(),
            visibility_reaction_time: self.visibility.mean(),
            thruster_reaction_time: self.thrusters.mean(),
            inspection_reaction_time: self.inspection.mean(),
            disturbances_answered: all.answered,
            disturbances: all.disturbances,
        }
    }
}
