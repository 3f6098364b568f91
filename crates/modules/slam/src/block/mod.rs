//! SLAM as a block.

mod interfaces;
mod live_slam;
mod params;
mod travel;

use serde::{Deserialize, Serialize};
use slate_interfaces::{LaserScan, OccupancyGrid, Odometry, Point2, Pose2, PoseEstimate, Transform};
use slate_localization::inputs::{
    FaultyInput, InputFault, OdometryCheck, ScanCheck, ends_of_beams, laser_mount,
};
use slate_mapek::RobotModel;
use slate_mapek::prelude::*;
use slate_module::prelude::*;

use crate::live_map::LiveMap;
use crate::saved::SavedPose;
use crate::se2;
pub use interfaces::{SlamEdge, SlamEdgeKind, SlamGraph, SlamStatus};
use live_slam::LiveSlam;
pub use params::SlamParams;
use travel::OdometryTravel;

/// Ports of [`Slam`].
#[ports]
pub struct SlamIo {
    /// Scan of the laser.
    scan: Observed<LaserScan>,
    /// Odometry of the wheels.
    odometry: Observed<Odometry>,
    /// Robot model, from Knowledge: it has the mount of the laser.
    /// Without it, the laser is at the robot's origin.
    robot: Input<RobotModel>,
    /// Manual pose reset, as RViz's `initialpose`: the next scan is matched there.
    initial_pose: Inbox<Pose2>,
    /// Map of all scans.
    #[capacity(4_194_304)]
    map: Output<OccupancyGrid>,
    /// Pose graph, for views.
    #[capacity(16_384)]
    pose_graph: Output<SlamGraph>,
    /// Progress.
    status: Output<SlamStatus>,
    /// Frame of the odometry in that of the map.
    map_to_odom: Output<Transform>,
    /// Frame of the robot in that of the odometry.
    odom_to_base: Output<Transform>,
}

/// 2D SLAM from odometry and laser scans: pose and map.
/// By a pose graph or a particle filter.
///
/// A scan is inserted after some travel, and between two of them the pose continues by the odometry. Loops are searched in
/// units of which a step makes some, so that no step takes long; their number is a parameter and depends on no clock, so a
/// run repeats. An invalid input is named in the log, and the pose is not published until it has recovered.
pub struct Slam;

/// State of [`Slam`].
#[derive(Default, Serialize, Deserialize)]
pub struct SlamState {
    slam: Option<LiveSlam>,
    scan: ScanCheck,
    odometry: OdometryCheck,
    fault: Option<InputFault>,
    travel: OdometryTravel,
    /// Travel at the newest scan.
    #[serde(with = "SavedPose")]
    inserted: Pose2,
    /// Time of that insertion, ns.
    /// `is_finished` is true if all scans were matched with all submaps since.
    inserted_at: u64,
    is_finished: bool,
    map: LiveMap,
    /// Time of the map's publication; `is_changed` is true after a later change.
    published_at: Option<u64>,
    is_changed: bool,
    /// True if the log holds a warning that the map is full.
    is_cut: bool,
    #[serde(skip)]
    points: Vec<[f64; 2]>,
    /// Poses of the scans in the map frame.
    #[serde(skip)]
    poses: Vec<Pose2>,
}

impl Analyze for Slam {
    const NAME: &'static str = "slam";
    const DOC: &'static str = "Maps a building with a laser, and localizes the robot in it.";
    type Observed = SlamIo;
    type Params = SlamParams;
    type State = SlamState;
    type Value = PoseEstimate;

    fn process(state: &mut SlamState, io: &SlamIo, params: &SlamParams, now: &Tick) -> Option<PoseEstimate> {
        state.check(io, params);
        let has_inputs = io.odometry.get().is_some() && io.scan.get().is_some();
        // Devices take a while to begin, and to be in the robot model.
        let has_mount = laser_mount(io.robot.get(), params.laser.as_str()).is_ok();
        if now.seconds() < params.scan_timeout && !(has_inputs && has_mount) {
            return None;
        }
        let fault = state.step(io, params, now).err();
        InputFault::report(&mut state.fault, fault, now);
        state.work(params, now);
        state.draw(params, now);
        state.publish(io, params, now);
        if state.fault.is_some() || !(io.odometry.is_new() || io.scan.is_new()) {
            return None;
        }
        let (estimate, odometry) = (state.estimate(params)?, io.odometry.get()?);
        if params.tf_broadcast.get() {
            io.map_to_odom.set(params.frames().map_to_odom(&estimate.pose, &odometry.pose, now));
        }
        if params.odom_broadcast.get() {
            io.odom_to_base.set(params.frames().odom_to_base(&odometry.pose, now));
        }
        Some(estimate)
    }

    fn is_degraded(state: &SlamState) -> bool {
        state.fault.is_some()
    }
}

impl SlamState {
    /// Checks new inputs.
    /// A fault lasts until the next valid value of the same input.
    fn check(&mut self, io: &SlamIo, params: &SlamParams) {
        let odometry = io.odometry.get();
        if let Some(odometry) = odometry.filter(|_| io.odometry.is_new()) {
            self.odometry.check(odometry, io.odometry.stamp().time, params.velocity_limits());
            if self.odometry.fault().is_err() {
                self.scan.rebase();
                self.travel.rebase(odometry.pose);
            }
        }
        if let Some(scan) = io.scan.get().filter(|_| io.scan.is_new()) {
            let pose = odometry.map(|odometry| &odometry.pose).filter(|pose| pose.is_known());
            self.scan.check(scan, io.scan.stamp().time, pose);
        }
    }

    /// Takes new inputs.
    fn step(&mut self, io: &SlamIo, params: &SlamParams, now: &Tick) -> Result<(), InputFault> {
        if self.slam.is_none() {
            self.slam = Some(LiveSlam::new(params).map_err(InputFault::parameter)?);
        }
        let odometry = io.odometry.get().ok_or(InputFault::new(FaultyInput::Odometry, "has no value yet"))?;
        self.odometry.fault()?;
        // Without a scan, too, so that the pose continues by the odometry.
        self.travel.advance(odometry.pose);
        let is_reset = self.reset(io, params, now);
        let scan = io.scan.get().ok_or(InputFault::new(FaultyInput::Scan, "has no value yet"))?;
        self.scan.fault(params.scan_timeout, now)?;
        let mount = laser_mount(io.robot.get(), params.laser.as_str())?;
        if !(io.scan.is_new() && (is_reset || self.has_traveled(params))) {
            return Ok(());
        }
        ends_of_beams(scan, &mount, params.beams(), &mut self.points);
        if let Some(slam) = &mut self.slam {
            slam.insert(self.travel.pose(), &self.points, now);
        }
        self.inserted = self.travel.pose();
        (self.inserted_at, self.is_finished) = (now.now(), false);
        Ok(())
    }

    /// Handles manual poses; returns true if there was one.
    fn reset(&mut self, io: &SlamIo, params: &SlamParams, now: &Tick) -> bool {
        let mut is_reset = false;
        for pose in io.initial_pose.iter() {
            let newest = self.slam.as_ref().and_then(|slam| slam.poses().last().copied());
            match newest.filter(|_| pose.is_known()) {
                // The way there counts as motion, with the uncertainty of one.
                Some(newest) => {
                    let way = se2::relative(se2::compose(params.start(), newest), *pose);
                    self.travel.move_to(se2::compose(self.inserted, way));
                    is_reset = true;
                }
                None => {
                    now.warn(format_args!(
                        "initial pose refused: expected numbers, after the first scan; before it, `map_start_x` and the others have the pose"
                    ));
                    pose.refuse(1);
                }
            }
        }
        is_reset
    }

    /// Returns true if the robot has moved enough for another scan.
    fn has_traveled(&self, params: &SlamParams) -> bool {
        let is_first = self.slam.as_ref().is_none_or(|slam| slam.poses().is_empty());
        let moved = se2::relative(self.inserted, self.travel.pose());
        let [distance, angle] = params.minimum_travel();
        is_first || math::hypot(moved.x, moved.y) >= distance || moved.theta.abs() >= angle
    }

    /// Closes loops, some units of the work at a time.
    fn work(&mut self, params: &SlamParams, now: &Tick) {
        let Some(slam) = &mut self.slam else { return };
        let is_due = |after: u64| now.now().saturating_sub(self.inserted_at) >= after;
        let has_scans = !slam.poses().is_empty();
        if has_scans && !self.is_finished && params.finish_after().is_some_and(is_due) {
            slam.request_finish();
            self.is_finished = true;
        }
        slam.work(params.background_units());
    }

    /// Draws scans into the map that are new, or whose poses have changed.
    fn draw(&mut self, params: &SlamParams, now: &Tick) {
        let Some(slam) = &self.slam else { return };
        let start = params.start();
        self.poses.clear();
        self.poses.extend(slam.poses().iter().map(|pose| se2::compose(start, *pose)));
        self.is_changed |= self.map.update(&self.poses, |scan| slam.points(scan), &params.map());
        if self.map.is_cut() && !self.is_cut {
            now.warn(format_args!("the map is full: it has no room for all scans; make the cells larger"));
        }
        self.is_cut = self.map.is_cut();
    }

    /// Publishes map and graph, if they have changed and it is time.
    fn publish(&mut self, io: &SlamIo, params: &SlamParams, now: &Tick) {
        let Some(slam) = &self.slam else { return };
        let since = self.published_at.map_or(u64::MAX, |at| now.now().saturating_sub(at));
        if since < params.map_interval() || self.map.cells() == 0 {
            return;
        }
        let is_finishing = params.finish_after().is_some() && !self.is_finished;
        let is_settled = !(slam.has_work() || self.map.is_redrawn() || is_finishing || self.is_changed);
        if self.is_changed {
            io.map.write(self.map.cells(), |grid| self.map.write(grid, &params.map()));
            write_graph(slam, &self.poses, &io.pose_graph);
        }
        io.status.set(SlamStatus {
            scans: self.poses.len() as u32,
            loop_closures: slam.loop_closures().count() as u32,
            is_settled: is_settled.into(),
        });
        (self.published_at, self.is_changed) = (Some(now.now()), false);
    }

    /// Returns the pose now: that of the newest scan, and the travel since.
    fn estimate(&self, params: &SlamParams) -> Option<PoseEstimate> {
        let slam = self.slam.as_ref()?;
        let newest = se2::compose(params.start(), *slam.poses().last()?);
        let pose = se2::compose(newest, se2::relative(self.inserted, self.travel.pose()));
        let covariance = se2::turned(slam.covariance(), params.start().theta);
        let mut rows = [0.0; 9];
        for (at, entry) in rows.iter_mut().enumerate() {
            *entry = covariance[(at / 3, at % 3)];
        }
        Some(PoseEstimate { pose, covariance: rows })
    }
}

/// Writes the edges from scan to scan, and loop closures.
/// As many of the closures as there is room for, evenly chosen.
fn write_graph(slam: &LiveSlam, poses: &[Pose2], output: &Output<SlamGraph>) {
    let position =
        |scan: usize| poses.get(scan).map_or(Point2::default(), |pose| Point2 { x: pose.x, y: pose.y });
    let chain = poses.len().saturating_sub(1).min(output.capacity());
    let closures = slam.loop_closures().count();
    let room = output.capacity() - chain;
    let step = closures.div_ceil(room.max(1)).max(1);
    let shown = if room == 0 { 0 } else { closures.div_ceil(step) };
    output.write(chain + shown, |graph| {
        (graph.scans, graph.loop_closures) = (poses.len() as u32, closures as u32);
        let (odometry, loops) = graph.edges.split_at_mut(chain);
        for (scan, edge) in odometry.iter_mut().enumerate() {
            *edge = SlamEdge { from: position(scan), to: position(scan + 1), kind: SlamEdgeKind::ODOMETRY };
        }
        for (edge, constraint) in loops.iter_mut().zip(slam.loop_closures().step_by(step)) {
            let (from, to) = (position(constraint.from), position(constraint.to));
            *edge = SlamEdge { from, to, kind: SlamEdgeKind::LOOP_CLOSURE };
        }
    });
}
