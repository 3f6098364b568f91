//! Adaptive Monte Carlo localization as a block.

mod params;

use serde::{Deserialize, Serialize};
use slate_grid::Geometry;
use slate_interfaces::{LaserScan, OccupancyGrid, Odometry, ParticleCloud, Pose2, PoseEstimate, Transform};
use slate_mapek::RobotModel;
use slate_mapek::prelude::*;
use slate_module::Stamp;
use slate_module::prelude::*;

use crate::inputs::{FaultyInput, InputFault, OdometryCheck, ScanCheck, ends_of_beams, laser_mount};
use crate::{LikelihoodField, MOST_CELLS, MonteCarloLocalization, SensorModel};
pub use params::AmclParams;

/// Ports of [`Amcl`].
#[ports]
pub struct AmclIo {
    /// Scan of the laser.
    scan: Observed<LaserScan>,
    /// Odometry of the wheels.
    odometry: Observed<Odometry>,
    /// Map of the building, as of a `map_server`.
    map: Input<OccupancyGrid>,
    /// Robot model, from Knowledge: it has the mount of the laser.
    /// Without it, the laser is at the robot's origin.
    robot: Input<RobotModel>,
    /// Manual pose reset, as RViz's `initialpose`.
    initial_pose: Inbox<Pose2>,
    /// Number of a global localization request, `reinitialize_global_localization`.
    /// Each new one starts a localization anywhere in the map.
    global_localization: Inbox<GlobalLocalization>,
    /// Particles of the newest update.
    #[capacity(20_000)]
    particles: Output<ParticleCloud>,
    /// Frame of the odometry in that of the map.
    map_to_odom: Output<Transform>,
    /// Frame of the robot in that of the odometry.
    odom_to_base: Output<Transform>,
}

/// Request of a localization anywhere in the map.
#[interface]
#[derive(PartialEq)]
pub struct GlobalLocalization {
    /// Number of the request, for its sender.
    pub number: u64,
}

/// Adaptive Monte Carlo localization in a known map, with the parameters of Nav2.
///
/// An invalid input is named in the log, and the block is degraded: its pose is not published, so that it becomes stale,
/// until the input has recovered.
pub struct Amcl;

/// State of [`Amcl`].
#[derive(Default, Serialize, Deserialize)]
pub struct AmclState {
    localization: Option<MonteCarloLocalization>,
    scan: ScanCheck,
    odometry: OdometryCheck,
    fault: Option<InputFault>,
    /// Likelihood field and its source; recomputed after a restart.
    #[serde(skip)]
    field: Option<(FieldSource, LikelihoodField)>,
    #[serde(skip)]
    points: Vec<[f64; 2]>,
}

/// Inputs from which a likelihood field was computed.
#[derive(Clone, Copy, PartialEq)]
struct FieldSource {
    /// Stamp of the map.
    /// Another linked property may have the same sequence number.
    map: Stamp,
    model: SensorModel,
    occupied_threshold: i64,
}

impl Analyze for Amcl {
    const NAME: &'static str = "amcl";
    const DOC: &'static str = "Localizes the robot in a map with a particle filter.";
    type Observed = AmclIo;
    type Params = AmclParams;
    type State = AmclState;
    type Value = PoseEstimate;

    fn process(state: &mut AmclState, io: &AmclIo, params: &AmclParams, now: &Tick) -> Option<PoseEstimate> {
        state.check(io, params);
        let has_inputs = io.map.get().is_some() && io.odometry.get().is_some() && io.scan.get().is_some();
        // Devices take a while to begin, and to be in the robot model.
        if now.seconds() < params.scan_timeout
            && !(has_inputs && laser_mount(io.robot.get(), params.laser.as_str()).is_ok())
        {
            return None;
        }
        let fault = state.step(io, params, now).err();
        InputFault::report(&mut state.fault, fault, now);
        if state.fault.is_some() || !(io.odometry.is_new() || io.scan.is_new()) {
            return None;
        }
        let (estimate, odometry) = (state.localization.as_ref()?.estimate()?, io.odometry.get()?);
        if params.tf_broadcast.get() {
            io.map_to_odom.set(params.frames().map_to_odom(&estimate.pose, &odometry.pose, now));
        }
        if params.odom_broadcast.get() {
            io.odom_to_base.set(params.frames().odom_to_base(&odometry.pose, now));
        }
        Some(estimate)
    }

    fn is_degraded(state: &AmclState) -> bool {
        state.fault.is_some()
    }
}

impl AmclState {
    /// Checks new inputs.
    /// A fault lasts until the next valid value of the same input.
    fn check(&mut self, io: &AmclIo, params: &AmclParams) {
        let odometry = io.odometry.get();
        if let Some(odometry) = odometry.filter(|_| io.odometry.is_new()) {
            self.odometry.check(odometry, io.odometry.stamp().time, params.velocity_limits());
            if self.odometry.fault().is_err() {
                self.scan.rebase();
                if let Some(localization) = &mut self.localization {
                    localization.rebase(odometry.pose);
                }
            }
        }
        if let Some(scan) = io.scan.get().filter(|_| io.scan.is_new()) {
            let pose = odometry.map(|odometry| &odometry.pose).filter(|pose| pose.is_known());
            self.scan.check(scan, io.scan.stamp().time, pose);
        }
    }

    /// Takes new inputs.
    fn step(&mut self, io: &AmclIo, params: &AmclParams, now: &Tick) -> Result<(), InputFault> {
        self.prepare(io, params)?;
        let (Some((_, field)), Some(localization)) = (&self.field, &mut self.localization) else {
            return Err(InputFault::new(FaultyInput::Map, "has no likelihood field"));
        };
        begin(localization, field, (io, params), now)?;
        let odometry = io.odometry.get().ok_or(InputFault::new(FaultyInput::Odometry, "has no value yet"))?;
        self.odometry.fault()?;
        // Without a scan, too, so that the estimate continues by the odometry, and a jump later is one from here.
        now.random(|random| localization.update(odometry.pose, &[], field, random));
        let scan = io.scan.get().ok_or(InputFault::new(FaultyInput::Scan, "has no value yet"))?;
        self.scan.fault(params.scan_timeout, now)?;
        let mount = laser_mount(io.robot.get(), params.laser.as_str())?;
        if !io.scan.is_new() {
            return Ok(());
        }
        ends_of_beams(scan, &mount, params.beams(), &mut self.points);
        let points = &self.points;
        if now.random(|random| localization.update(odometry.pose, points, field, random)) {
            publish_particles(localization, &io.particles);
        }
        Ok(())
    }

    /// Creates filter and likelihood field when missing or outdated.
    /// They are outdated when the parameters or the map have changed.
    fn prepare(&mut self, io: &AmclIo, params: &AmclParams) -> Result<(), InputFault> {
        let parameters = params.filter();
        match &mut self.localization {
            Some(localization) if *localization.parameters() == parameters => {}
            Some(localization) => localization.set_parameters(parameters).map_err(InputFault::parameter)?,
            None => {
                self.localization =
                    Some(MonteCarloLocalization::new(parameters).map_err(InputFault::parameter)?);
            }
        }
        let map = io
            .map
            .get()
            .ok_or(InputFault::new(FaultyInput::Map, "has no value: link it to a `map_server`"))?;
        let source = FieldSource {
            map: io.map.stamp(),
            model: params.sensor_model().map_err(InputFault::parameter)?,
            occupied_threshold: params.occupied_threshold,
        };
        if io.map.is_new() || self.field.as_ref().is_none_or(|(known, _)| *known != source) {
            // None is left of an earlier map if this one is invalid.
            self.field = None;
            self.field = Some((source, field_of(map, source)?));
        }
        Ok(())
    }
}

/// Computes the likelihood field of a map.
fn field_of(map: &OccupancyGrid, source: FieldSource) -> Result<LikelihoodField, InputFault> {
    let geometry = Geometry::of(map, MOST_CELLS).ok_or(InputFault::new(
        FaultyInput::Map,
        "is invalid: expected 1 to 4194304 cells, and as much data",
    ))?;
    let is_occupied = |cell: usize| i64::from(map.data[cell]) >= source.occupied_threshold;
    // Unknown cells are no place for a robot.
    let is_free = |cell: usize| map.data[cell] >= 0;
    LikelihoodField::new(geometry, is_occupied, is_free, source.model).map_err(InputFault::parameter)
}

/// Starts the filter on request, and while it has no particles.
fn begin(
    localization: &mut MonteCarloLocalization,
    field: &LikelihoodField,
    (io, params): (&AmclIo, &AmclParams),
    now: &Tick,
) -> Result<(), InputFault> {
    let stddev = params.initial_stddev();
    let initial = params.initial_pose();
    if localization.particles().is_empty() {
        match initial {
            Some(pose) => _ = now.random(|random| localization.initialize(pose, stddev, random)),
            None if field.has_free_cells() => {
                now.random(|random| localization.initialize_globally(field, random));
            }
            None => {}
        }
    }
    for pose in io.initial_pose.iter() {
        if !now.random(|random| localization.initialize(*pose, stddev, random)) {
            let Pose2 { x, y, theta } = *pose;
            now.warn(format_args!(
                "invalid initial pose ({x}, {y}, {theta}): expected numbers of at most 1e6"
            ));
            pose.refuse(1);
        }
    }
    for request in io.global_localization.iter() {
        match field.has_free_cells() {
            true => now.random(|random| localization.initialize_globally(field, random)),
            false => request.refuse(1),
        }
    }
    match initial {
        _ if !localization.particles().is_empty() => Ok(()),
        Some(pose) => Err(InputFault::parameter(params::invalid_initial_pose(&pose))),
        None => Err(InputFault::new(FaultyInput::Map, "has no free cell, where the robot may be")),
    }
}

fn publish_particles(localization: &MonteCarloLocalization, output: &Output<ParticleCloud>) {
    let particles = localization.particles();
    let particles = &particles[..particles.len().min(output.capacity())];
    output.write(particles.len(), |cloud| {
        for (shown, particle) in cloud.particles.iter_mut().zip(particles) {
            *shown = *particle;
        }
    });
}
