use slate_module::prelude::*;

/// What of a camera's pictures there is.
#[interface]
#[derive(PartialEq)]
pub struct CameraState {
    /// The number of its newest picture; 0 before the first.
    pub picture: u64,
    /// When that was taken, the agent's time.
    #[unit("ns")]
    pub taken: u64,
    /// When it came to the modules, the agent's time.
    #[unit("ns")]
    pub came: u64,
    /// The text that it was asked for with.
    pub camera: Text<252>,
    /// Why it gives no pictures now; empty when it does.
    pub problem: Text<252>,
}

/// The cameras of a vision master.
#[interface]
pub struct CameraReport {
    /// In the order in which they were asked for.
    pub cameras: Sequence<CameraState, 16>,
}
