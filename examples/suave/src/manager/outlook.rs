//! Analyzes of the managing loop.
//! Requirements of another visibility, a thruster and the mission.

use serde::{Deserialize, Serialize};
use slate_plugin::module::Level;
use slate_plugin::prelude::*;

use super::health::VisibilityTrend;
use super::knowledge::SearchModel;
use crate::interfaces::{
    Function, FunctionDesign, FunctionDesigns, ThrusterHealth, VehicleMission, VehicleTask,
};

/// Design that is due.
#[interface]
#[derive(PartialEq)]
pub struct DueDesign {
    /// Number of the change, from 1.
    pub change: u64,
    /// Place of the design among all.
    pub place: u32,
}

/// Percept and knowledge of [`SearchOutlook`].
#[ports]
pub struct ObservedVisibility {
    visibility: Observed<VisibilityTrend>,
    designs: Required<FunctionDesigns>,
    model: Required<SearchModel>,
}

/// Parameters of [`SearchOutlook`].
#[params]
pub struct OutlookParams {
    #[param(default = true, doc = "climb in time for a rising visibility")]
    anticipates: Bool,
}

/// Design that is due.
#[derive(Default, Serialize, Deserialize)]
pub struct OutlookState {
    change: u64,
    place: Option<usize>,
}

/// Reports the best search design for the predicted visibility.
/// The prediction is for the time when the vehicle is at its altitude.
pub struct SearchOutlook;

impl Analyze for SearchOutlook {
    const NAME: &'static str = "search_outlook";
    const DOC: &'static str = "Reports the search design that the visibility allows.";
    type Observed = ObservedVisibility;
    type Params = OutlookParams;
    type State = OutlookState;
    type Value = DueDesign;

    fn process(
        state: &mut OutlookState,
        observed: &ObservedVisibility,
        params: &OutlookParams,
        now: &Tick,
    ) -> Option<DueDesign> {
        let (seen, designs, model) = (observed.visibility.updated()?, &observed.designs, &observed.model);
        let altitude = state.place.and_then(|place| designs.list.get(place)).map_or(0.0, |own| own.altitude);
        let is_rising = params.anticipates.get() && altitude > 0.0 && seen.rate > 0.0;
        let is_suitable = |design: &FunctionDesign| {
            // An altitude that it has climbed to in time is kept until the visibility falls.
            let climb = math::max(design.altitude - altitude, 0.0) / model.vertical_speed;
            let rise = if is_rising { seen.rate * climb } else { 0.0 };
            let is_kept = is_rising && design.altitude <= altitude;
            is_kept || seen.distance + rise >= model.visibility(design.altitude, design.visibility)
        };
        let best = designs.best(Function::SEARCH, is_suitable)?;
        if state.place.replace(best) == Some(best) {
            return None;
        }
        state.change += 1;
        let fields = [
            ("change", state.change.into()),
            ("visibility_m", seen.distance.into()),
            ("design", designs.name(best).into()),
        ];
        now.log_with(Level::Info, format_args!("change: the visibility asks for another search"), &fields);
        Some(DueDesign { change: state.change, place: u32::try_from(best).unwrap_or_default() })
    }
}

/// Change of the thrusters' health.
#[interface]
#[derive(PartialEq)]
pub struct ThrusterChange {
    /// Number of the change, from 1.
    pub change: u64,
    /// Failed thrusters; bit 0 is thruster 1.
    pub failed: u32,
}

/// Percept of [`PassThrusters`].
#[ports]
pub struct ObservedThrusters {
    thrusters: Observed<ThrusterHealth>,
}

/// Last report.
#[derive(Default, Serialize, Deserialize)]
pub struct ThrusterMemory {
    change: u64,
    failed: u32,
}

/// Reports thrusters that fail and recover.
pub struct PassThrusters;

impl Analyze for PassThrusters {
    const NAME: &'static str = "tell_thrusters";
    const DOC: &'static str = "Reports thrusters that fail and recover.";
    type Observed = ObservedThrusters;
    type Params = ();
    type State = ThrusterMemory;
    type Value = ThrusterChange;

    fn process(
        memory: &mut ThrusterMemory,
        observed: &ObservedThrusters,
        _: &(),
        now: &Tick,
    ) -> Option<ThrusterChange> {
        let failed = observed.thrusters.updated()?.failed;
        if std::mem::replace(&mut memory.failed, failed) == failed {
            return None;
        }
        memory.change += 1;
        let fields = [("change", memory.change.into()), ("failed", failed.into())];
        now.log_with(Level::Warn, format_args!("change: the health of the thrusters"), &fields);
        Some(ThrusterChange { change: memory.change, failed })
    }
}

/// Change of the mission's task.
#[interface]
#[derive(PartialEq)]
pub struct TaskChange {
    /// Number of the change, from 1.
    pub change: u64,
    /// New task.
    pub task: VehicleTask,
}

/// Percept of [`PassTask`].
#[ports]
pub struct ObservedMission {
    mission: Observed<VehicleMission>,
}

/// Last report.
#[derive(Default, Serialize, Deserialize)]
pub struct TaskMemory {
    change: u64,
    task: Option<VehicleTask>,
}

/// Reports the task of the mission.
pub struct PassTask;

impl Analyze for PassTask {
    const NAME: &'static str = "tell_task";
    const DOC: &'static str = "Reports another task of the mission.";
    type Observed = ObservedMission;
    type Params = ();
    type State = TaskMemory;
    type Value = TaskChange;

    fn process(
        memory: &mut TaskMemory,
        observed: &ObservedMission,
        _: &(),
        now: &Tick,
    ) -> Option<TaskChange> {
        let task = observed.mission.updated()?.task;
        if memory.task.replace(task) == Some(task) {
            return None;
        }
        memory.change += 1;
        let fields = [("change", memory.change.into()), ("task", task.name().into())];
        now.log_with(Level::Info, format_args!("change: another task"), &fields);
        Some(TaskChange { change: memory.change, task })
    }
}
