//! Frame from outside of the agent.

use slate_interfaces::Transform;
use slate_module::prelude::*;

/// Transform in, transform out.
#[ports]
pub struct ExternalFrameIo {
    /// Transform from outside, such as one of `/tf` of ROS.
    transform: Input<Transform>,
    /// Transform of the frame for the frame tree.
    frame: Output<Transform>,
}

/// Brings the transform of a frame from outside into the frame tree.
pub struct ExternalFrame;

#[module(stage = SensorAcquire)]
impl Module for ExternalFrame {
    type Io = ExternalFrameIo;
    type Params = ();
    type State = ();

    fn tick(_: &mut (), io: &ExternalFrameIo, _: &(), _: &Tick) -> Outcome {
        if let Some(transform) = io.transform.updated() {
            io.frame.set(*transform);
        }
        Outcome::Ok
    }
}
