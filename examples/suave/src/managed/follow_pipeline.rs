//! Function `inspect`: from point to point along the pipeline.

use serde::{Deserialize, Serialize};
use slate_plugin::prelude::*;

use super::{is_activated, is_near};
use crate::interfaces::{
    FunctionStatus, InspectionProgress, Navigation, PipelineCourse, Setpoint, VehicleMission,
};

/// Ports of the inspection.
#[ports]
pub struct FollowIo {
    navigation: Input<Navigation>,
    /// Course of the pipeline.
    chart: Required<PipelineCourse>,
    /// Mission with the point at which the pipeline was found.
    mission: Required<VehicleMission>,
    /// Points of the path.
    setpoint: Outbox<Setpoint>,
    /// Sign of life.
    active: Output<FunctionStatus>,
    /// Inspected length.
    inspection: Output<InspectionProgress>,
}

/// Parameters of the inspection.
#[params]
pub struct FollowPipelineParams {
    #[param(default = 1.25, range = 0.5..=20.0, unit = "m", doc = "altitude of the inspection")]
    altitude: f64,
    #[param(default = 0.2, range = 0.05..=60.0, unit = "s", doc = "least time between two points")]
    period: f64,
    #[param(default = 0.4, range = 0.01..=5.0, unit = "m", doc = "distance along each axis at which a point is reached")]
    tolerance: f64,
}

/// Progress along the pipeline.
#[derive(Default, Serialize, Deserialize)]
pub struct FollowState {
    /// Time of the last observation, seconds.
    looked: Option<f64>,
    /// Number of reached points.
    reached: u32,
    /// Last reached point, meters.
    last: Option<(f64, f64)>,
    /// Inspected length, meters.
    distance: f64,
}

/// Follows the pipeline from its found point to its end, and back to its start.
/// A new activation restarts it.
pub struct FollowPipeline;

#[module(stage = Skill)]
impl Module for FollowPipeline {
    type Io = FollowIo;
    type Params = FollowPipelineParams;
    type State = FollowState;

    fn tick(state: &mut FollowState, io: &FollowIo, params: &FollowPipelineParams, now: &Tick) -> Outcome {
        if is_activated(now) {
            *state = FollowState::default();
        }
        io.active.set(FunctionStatus { altitude: params.altitude });
        let Some(navigation) = io.navigation.get() else { return Outcome::Degraded };
        if state.looked.is_some_and(|looked| now.seconds() - looked < params.period - 1e-6) {
            return Outcome::Ok;
        }
        state.looked = Some(now.seconds());
        let setpoint_of = |number| {
            let (x, y) = path_point(&io.chart, io.mission.point, number)?;
            Some(Setpoint { x, y, altitude: params.altitude })
        };
        let mut setpoint = setpoint_of(state.reached);
        if let Some(Setpoint { x, y, .. }) =
            setpoint.filter(|setpoint| is_near(navigation, setpoint, params.tolerance))
        {
            if let Some(last) = state.last.replace((x, y)) {
                state.distance += math::hypot(x - last.0, y - last.1);
            }
            state.reached += 1;
            setpoint = setpoint_of(state.reached);
        }
        if let Some(setpoint) = setpoint {
            io.setpoint.send(setpoint);
        }
        io.inspection.set(InspectionProgress { distance: state.distance });
        Outcome::Ok
    }
}

/// Returns a numbered point of the path along the pipeline.
/// The path goes from the found point to the end, and then back to the beginning.
fn path_point(chart: &PipelineCourse, found: u32, number: u32) -> Option<(f64, f64)> {
    let (length, found, number) = (chart.len(), found as usize, number as usize);
    let out = length.saturating_sub(found);
    let index = if number < out { found + number } else { length.checked_sub(number - out + 1)? };
    let point = chart.point(index);
    Some((point.x, point.y))
}
