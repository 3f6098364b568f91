use slate_interfaces::PanTiltCommand;
use slate_module::prelude::*;

/// Ports of [`PanTiltController`].
#[ports]
pub struct PanTiltControllerIo {
    /// Setpoint of the head; without a value, the parameters give it.
    position: Input<PanTiltCommand>,
    /// Command of the head.
    command: Output<PanTiltCommand>,
}

/// Parameters of [`PanTiltController`].
#[params]
pub struct PanTiltControllerParams {
    #[param(default = 0.0, range = -3.2..=3.2, unit = "rad", doc = "pan without a `position`, counter-clockwise")]
    pan: f64,
    #[param(default = 0.0, range = -1.6..=1.6, unit = "rad", doc = "tilt without a `position`, downwards")]
    tilt: f64,
}

/// Commands a pan-tilt head.
pub struct PanTiltController;

#[module(stage = Act)]
impl Module for PanTiltController {
    type Io = PanTiltControllerIo;
    type Params = PanTiltControllerParams;
    type State = ();

    fn tick((): &mut (), io: &PanTiltControllerIo, params: &PanTiltControllerParams, _: &Tick) -> Outcome {
        let PanTiltControllerParams { pan, tilt } = *params;
        io.command.set(io.position.get().copied().unwrap_or(PanTiltCommand { pan, tilt }));
        Outcome::Ok
    }
}
