//! Mission of the vehicle: search for the pipeline, then inspect it.

use serde::{Deserialize, Serialize};
use slate_plugin::prelude::*;

use crate::interfaces::{PipelineView, VehicleMission, VehicleTask};

/// Ports of the mission.
#[ports]
pub struct MissionIo {
    /// Pipeline in the camera's image.
    view: Input<PipelineView>,
    /// Present task.
    mission: Output<VehicleMission>,
}

/// State of the mission.
#[derive(Default, Serialize, Deserialize)]
pub struct MissionMemory {
    /// Point at which the pipeline was found.
    found: Option<u32>,
}

/// Searches until the camera sees the pipeline, and inspects from then on.
pub struct PipelineMission;

#[module(stage = SensorAcquire)]
impl Module for PipelineMission {
    type Io = MissionIo;
    type Params = ();
    type State = MissionMemory;

    fn tick(memory: &mut MissionMemory, io: &MissionIo, _: &(), now: &Tick) -> Outcome {
        if memory.found.is_none()
            && let Some(view) = io.view.get().filter(|view| view.seen.get())
        {
            memory.found = Some(view.point);
            now.info(format_args!("mission: the pipeline is found"));
        }
        let task = if memory.found.is_some() { VehicleTask::INSPECT } else { VehicleTask::SEARCH };
        io.mission.set(VehicleMission { point: memory.found.unwrap_or_default(), task });
        Outcome::Ok
    }
}
