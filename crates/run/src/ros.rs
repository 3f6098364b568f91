//! How a run takes part in ROS, of either generation.

use std::sync::Arc;

use slate_control::ControlSurface;
use slate_runtime::Agent;
use slate_runtime::configuration::Report;

use crate::RunError;
use crate::ros1::Ros1Run;
use crate::ros2::RunBridge;

/// Nodes of ROS that an agent is, as long as this lives.
pub struct RosBridges {
    ros1: Option<Ros1Run>,
    ros2: Option<RunBridge>,
}

impl RosBridges {
    /// Joins the graphs that a configuration names; nothing is sent or set yet.
    pub fn open(agent: &Agent, surface: &Arc<ControlSurface>) -> Result<Self, Report> {
        Ok(Self { ros2: RunBridge::open(agent, surface)?, ros1: Ros1Run::open(agent, surface)? })
    }

    /// Begins to send and to set inputs.
    pub fn start(&mut self, agent: &Agent) -> Result<(), RunError> {
        self.ros2.as_mut().map_or(Ok(()), |own| own.start(agent))?;
        self.ros1.as_mut().map_or(Ok(()), |own| own.start(agent))
    }
}
