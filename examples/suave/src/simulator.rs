//! Water, the pipeline and the vehicle in it; drives the clock of the run.

use std::f64::consts::PI;

use serde::{Deserialize, Serialize};
use slate_plugin::interfaces::Pose2;
use slate_plugin::prelude::*;

use crate::interfaces::{
    Navigation, PipelineCourse, PipelineView, ThrusterForces, ThrusterHealth, ThrusterRestart,
    WaterVisibility,
};
use crate::vehicle::Vehicle;

/// Ports of the simulator.
#[ports]
pub struct WaterIo {
    /// Forces that passed the gate.
    #[role("actuation")]
    thrust: Input<ThrusterForces>,
    /// Thrusters to restart.
    repairs: Inbox<ThrusterRestart>,
    /// Course of the pipeline.
    pipeline: Required<PipelineCourse>,
    /// Estimate of the navigation filter.
    navigation: Output<Navigation>,
    /// Measured visibility of the water.
    visibility: Output<WaterVisibility>,
    /// Health of the thrusters, as their controllers report it.
    thrusters: Output<ThrusterHealth>,
    /// Pipeline in the camera's image.
    view: Output<PipelineView>,
    /// Course of the pipeline in the chart.
    chart: Output<PipelineCourse>,
    /// True pose; for referees and reports, not for the vehicle.
    #[role("truth")]
    truth: Output<Pose2>,
}

/// Parameters of the simulator; the defaults are the published scenario.
#[params]
pub struct WaterParams {
    #[param(default = -17.0, unit = "m", doc = "x of the start")]
    start_x: f64,
    #[param(default = 2.57, unit = "m", doc = "y of the start")]
    start_y: f64,
    #[param(default = 1.5, range = 0.2..=20.0, unit = "m", doc = "altitude of the start")]
    start_altitude: f64,
    #[param(default = 0.015, range = 0.0..=10.0, unit = "m", doc = "greatest offset of the start to the north, drawn for each seed")]
    start_spread: f64,
    #[param(default = 1.25, range = 0.0..=100.0, unit = "m", doc = "least visibility")]
    visibility_min: f64,
    #[param(default = 3.75, range = 0.0..=100.0, unit = "m", doc = "greatest visibility")]
    visibility_max: f64,
    #[param(default = 80.0, range = 1.0..=1e6, unit = "s", doc = "period of the visibility")]
    visibility_period: f64,
    #[param(default = 0.0, range = 0.0..=1e6, unit = "s", doc = "greatest shift of the visibility in time, drawn for each seed")]
    visibility_shift_spread: f64,
    #[param(default = 1, range = 1..=6, doc = "thruster that fails")]
    failing_thruster: u64,
    #[param(default = 35.0, range = 0.0..=1e9, unit = "s", doc = "time of its failure")]
    failure_time: f64,
    #[param(default = 0.0, range = 0.0..=1e6, unit = "s", doc = "greatest offset of that time to either side, drawn for each seed")]
    failure_time_spread: f64,
    #[param(default = std::f64::consts::FRAC_PI_3, range = 0.01..=3.0, unit = "rad", doc = "field of view of the camera, which looks down")]
    field_of_view: f64,
    #[param(default = 0.5, range = 0.0..=10.0, unit = "m", doc = "height of the pipeline above the seabed")]
    pipeline_height: f64,
    #[param(default = 0.2, range = 0.0..=10.0, unit = "m", doc = "standard deviation of the navigation filter's drift")]
    drift_stddev: f64,
    #[param(default = 60.0, range = 0.1..=1e6, unit = "s", doc = "correlation time of the drift")]
    drift_time: f64,
    #[param(default = 0.1, range = 0.0..=2.0, unit = "m/s", doc = "greatest current, drawn for each seed with its direction")]
    max_current: f64,
}

/// State of the world.
#[derive(Default, Serialize, Deserialize)]
pub struct WaterState {
    vehicle: Vehicle,
    /// Error of the navigation filter, meters.
    drift: [f64; 2],
    /// Velocity of the water, m/s.
    current: [f64; 2],
    /// Shift of the visibility in time, seconds.
    shift: f64,
    /// Time of the failure, seconds; none after it.
    failure: Option<f64>,
    /// Failed thrusters; bit 0 is thruster 1.
    failed: u32,
    started: bool,
}

/// Step of the physics, seconds.
const TIME_STEP: f64 = 0.01;

/// Water, pipeline and vehicle.
pub struct SuaveSimulator;

#[module(stage = PreLoop)]
impl Module for SuaveSimulator {
    type Io = WaterIo;
    type Params = WaterParams;
    type State = WaterState;

    fn tick(world: &mut WaterState, io: &WaterIo, params: &WaterParams, now: &Tick) -> Outcome {
        if !world.started {
            world.begin(params, now);
        }
        for repair in io.repairs.iter().filter(|repair| (1..=6).contains(&repair.thruster)) {
            world.failed &= !(1 << (repair.thruster - 1));
        }
        if world.failure.is_some_and(|time| now.seconds() >= time) {
            world.failure = None;
            world.failed |= 1 << (params.failing_thruster - 1);
        }
        let thrust = io.thrust.fresh().map_or([0.0; 6], ThrusterForces::all);
        world.advance(thrust, params, now);
        world.show(io, params, now);
        Outcome::Ok
    }
}

impl WaterState {
    fn begin(&mut self, params: &WaterParams, now: &Tick) {
        now.random(|random| {
            let offset = random.uniform(-params.start_spread, params.start_spread);
            self.vehicle.position = [params.start_x, params.start_y + offset, params.start_altitude];
            let (speed, direction) = (random.uniform(0.0, params.max_current), random.uniform(-PI, PI));
            self.current = [speed * math::cos(direction), speed * math::sin(direction)];
            self.shift = random.uniform(0.0, params.visibility_shift_spread);
            let spread = params.failure_time_spread;
            self.failure = Some(params.failure_time + random.uniform(-spread, spread));
        });
        self.started = true;
    }

    fn advance(&mut self, mut thrust: [f64; 6], params: &WaterParams, now: &Tick) {
        for (number, force) in thrust.iter_mut().enumerate() {
            if self.failed & (1 << number) != 0 {
                *force = 0.0;
            }
        }
        let steps = (now.elapsed() / TIME_STEP + 0.5) as u64;
        for _ in 0..steps {
            self.vehicle.advance(thrust, self.current, TIME_STEP);
        }
        // A Gauss-Markov process, exact for any step.
        let kept = math::exp(-now.elapsed() / params.drift_time);
        let stir = params.drift_stddev * (1.0 - kept * kept).sqrt();
        for error in &mut self.drift {
            *error = kept * *error + stir * now.random(|random| random.normal());
        }
    }

    fn visibility(&self, params: &WaterParams, now: &Tick) -> f64 {
        let (low, high) = (params.visibility_min, params.visibility_max);
        let phase = 2.0 * PI * (now.seconds() + self.shift) / params.visibility_period;
        (low + high) / 2.0 + (high - low) / 2.0 * math::cos(phase)
    }

    fn show(&self, io: &WaterIo, params: &WaterParams, now: &Tick) {
        let Vehicle { position: [x, y, altitude], heading, velocity, turn_rate } = self.vehicle;
        io.navigation.set(Navigation {
            x: x + self.drift[0],
            y: y + self.drift[1],
            altitude,
            heading,
            velocity_x: velocity[0],
            velocity_y: velocity[1],
            velocity_z: velocity[2],
            turn_rate,
        });
        let visibility = self.visibility(params, now);
        io.visibility.set(WaterVisibility { distance: visibility });
        io.thrusters.set(ThrusterHealth { failed: self.failed });
        io.view.set(self.observe(&io.pipeline, visibility, params));
        io.chart.set(*io.pipeline);
        io.truth.set(Pose2 { x, y, theta: heading });
    }

    /// Computes the camera's view of the pipeline.
    /// The camera looks straight down: its image is a square on the plane of the pipeline, which it sees if the water
    /// is clear enough.
    fn observe(&self, pipeline: &PipelineCourse, visibility: f64, params: &WaterParams) -> PipelineView {
        let [x, y, altitude] = self.vehicle.position;
        let distance = altitude - params.pipeline_height;
        if distance <= 0.0 || distance > visibility {
            return PipelineView::default();
        }
        let half = distance * math::tan(params.field_of_view / 2.0);
        let (sine, cosine) = (math::sin(self.vehicle.heading), math::cos(self.vehicle.heading));
        let is_inside = |index: &usize| {
            let point = pipeline.point(*index);
            let (east, north) = (point.x - x, point.y - y);
            let (forward, left) = (cosine * east + sine * north, cosine * north - sine * east);
            forward.abs() <= half && left.abs() <= half
        };
        match (0..pipeline.len()).find(is_inside) {
            // The longest path has 300 points.
            Some(index) => PipelineView { point: index as u32, seen: true.into() },
            None => PipelineView::default(),
        }
    }
}
