//! Participation of a run in DDS and in ROS, of either generation.

use std::sync::Arc;

use slate_control::ControlSurface;
use slate_runtime::Agent;
use slate_runtime::configuration::Report;

use crate::RunError;
use crate::dds::DdsRun;
use crate::ros1::Ros1Run;
use crate::ros2::RunBridge;

/// DDS participant and ROS nodes of an agent, as long as this value lives.
pub struct RosBridges {
    dds: Option<DdsRun>,
    ros1: Option<Ros1Run>,
    ros2: Option<RunBridge>,
}

impl RosBridges {
    /// Joins the graphs of a configuration; nothing is sent or set yet.
    pub fn open(agent: &Agent, surface: &Arc<ControlSurface>) -> Result<Self, Report> {
        Ok(Self {
            dds: DdsRun::open(agent, surface)?,
            ros2: RunBridge::open(agent, surface)?,
            ros1: Ros1Run::open(agent, surface)?,
        })
    }

    /// Begins to send and to set inputs.
    pub fn start(&mut self, agent: &Agent) -> Result<(), RunError> {
        self.dds.as_mut().map_or(Ok(()), |own| own.start(agent))?;
        self.ros2.as_mut().map_or(Ok(()), |own| own.start(agent))?;
        self.ros1.as_mut().map_or(Ok(()), |own| own.start(agent))
    }
}
