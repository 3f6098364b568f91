//! A frame from outside of the agent.

use slate_interfaces::Transform;
use slate_module::prelude::*;

/// Transform in, transform out.
#[ports]
pub struct FrameIo {
    /// Transform from outside, such as one of `/tf` of ROS.
    transform: Input<Transform>,
    /// The same, which the frame tree has.
    frame: Output<Transform>,
}

/// Brings the transform of a frame from outside into the frame tree.
pub struct Frame;

#[module(stage = SensorAcquire)]
impl Module for Frame {
    type Io = FrameIo;
    type Params = ();
    type State = ();

    fn tick(_: &mut (), io: &FrameIo, _: &(), _: &Tick) -> Outcome {
        if let Some(transform) = io.transform.updated() {
            io.frame.set(*transform);
        }
        Outcome::Ok
    }
}
