use slate_module::prelude::*;

/// Report of a camera.
#[interface]
#[derive(PartialEq)]
pub struct CameraState {
    /// Number of the newest picture; 0 before the first.
    pub picture: u64,
    /// Capture time, the agent's time.
    #[unit("ns")]
    pub taken: u64,
    /// Arrival time at the modules, the agent's time.
    #[unit("ns")]
    pub came: u64,
    /// Text of the request.
    pub camera: Text<252>,
    /// Reason of a present failure; empty for none.
    pub problem: Text<252>,
}

/// Reports of a vision master's cameras.
#[interface]
pub struct CameraReport {
    /// Reports in the order of request.
    pub cameras: Sequence<CameraState, 16>,
}
