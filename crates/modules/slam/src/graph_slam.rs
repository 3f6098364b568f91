//! Graph SLAM of submaps.

use std::collections::VecDeque;

use nalgebra::Matrix3;
use serde::{Deserialize, Serialize};
use slate_interfaces::Pose2;

use crate::parameters::{GraphSlamParameters, InvalidSlamParameter};
use crate::pending_work::PendingWork;
use crate::pose_graph::{Constraint, PoseGraph};
use crate::saved::SavedPose;
use crate::scan_increment::ScanIncrement;
use crate::scan_matcher::match_scan;
use crate::se2;
use crate::search_grids::SearchGrids;
use crate::submap::Submap;

/// 2D laser SLAM with a pose graph.
/// Scans are matched with submaps, and loops are closed between these (Hess, Kohler, Rapp and Andor, 2016, *Real-time
/// loop closure in 2D LIDAR SLAM*).
///
/// Each scan is matched with the older one of two overlapping submaps, in a frame that drifts. A submap that has all of
/// its scans is searched in the earlier ones near it, by branch and bound; its scans are then matched one by one, and
/// each match is a constraint of the graph.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct GraphSlam {
    pub(crate) parameters: GraphSlamParameters,
    pub(crate) nodes: Vec<ScanNode>,
    pub(crate) submaps: Vec<Submap>,
    pub(crate) graph: PoseGraph,
    /// Searches that scans have left for later, in their order.
    pub(crate) pending: VecDeque<PendingWork>,
    odometry_jumps: usize,
    /// Inverse covariance of the newest scan's pose in its own frame.
    /// `None` for the first scan.
    information: Option<Matrix3<f64>>,
    /// Grids of the search of loops; rebuilt after a restore.
    #[serde(skip)]
    pub(crate) search_grids: SearchGrids,
}

/// Scan.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) struct ScanNode {
    #[serde(with = "SavedPose")]
    pub odometry: Pose2,
    /// Pose in the frame of scan matching, which drifts.
    #[serde(with = "SavedPose")]
    pub local: Pose2,
    /// Ends of beams in the robot's frame.
    pub points: Vec<[f64; 2]>,
}

impl GraphSlam {
    /// Returns a SLAM without scans.
    ///
    /// # Errors
    /// A parameter that no SLAM can have.
    pub fn new(parameters: GraphSlamParameters) -> Result<Self, InvalidSlamParameter> {
        parameters.check()?;
        Ok(Self {
            parameters,
            nodes: Vec::new(),
            submaps: Vec::new(),
            graph: PoseGraph::default(),
            pending: VecDeque::new(),
            odometry_jumps: 0,
            information: None,
            search_grids: SearchGrids::default(),
        })
    }

    /// Inserts a scan; returns the robot's pose in the map frame.
    /// A scan is the pose of the odometry, and the ends of beams in the robot's frame, m. The map frame is that of the
    /// first scan.
    ///
    /// Points that are not finite or beyond `max_laser_range` are left out. An odometry that is unknown counts as that
    /// of the scan before; beyond `max_odometry_increment` from that one, no motion is assumed.
    pub fn insert(&mut self, odometry: Pose2, points: &[[f64; 2]]) -> Pose2 {
        self.track(odometry, points);
        while self.work() {}
        self.newest_pose()
    }

    /// Inserts a scan as [`insert`](Self::insert), but defers the search of loops.
    /// [`work`](Self::work) does that search.
    pub fn track(&mut self, odometry: Pose2, points: &[[f64; 2]]) -> Pose2 {
        let most = self.parameters.matching.max_laser_range;
        let is_fit = |[x, y]: &&[f64; 2]| x * x + y * y <= most * most;
        let points: Vec<[f64; 2]> = points.iter().filter(is_fit).copied().collect();
        let before = self.nodes.last().map_or(Pose2::default(), |node| node.odometry);
        let odometry = if odometry.is_known() { odometry } else { before };
        match self.nodes.last() {
            None => self.nodes.push(ScanNode { odometry, local: Pose2::default(), points }),
            Some(last) => {
                let GraphSlamParameters { matching, odometry: drift, .. } = &self.parameters;
                let increment = ScanIncrement::between(last.odometry, odometry, matching, drift);
                let predicted = se2::compose(last.local, increment.pose);
                self.odometry_jumps += usize::from(increment.is_jump);
                self.nodes.push(ScanNode { odometry, local: predicted, points });
                self.match_newest(&increment);
            }
        }
        self.place_newest();
        self.fill_submaps();
        self.newest_pose()
    }

    /// Closes the last submaps and loops, and optimizes the graph.
    /// More scans may follow.
    pub fn finish(&mut self) {
        self.request_finish();
        while self.work() {}
    }

    /// Leaves all that [`finish`](Self::finish) does for [`work`](Self::work).
    pub fn request_finish(&mut self) {
        self.finish_growing(|_, _| true);
        self.pending.extend([true, false].map(PendingWork::constraints));
    }

    /// Returns the number of scans.
    pub fn scans(&self) -> usize {
        self.nodes.len()
    }

    /// Returns the covariance of x, y and theta of the newest pose.
    /// It is against its submap and the odometry, in the map frame.
    pub fn covariance(&self) -> Matrix3<f64> {
        let turned = self.information.map(|own| se2::turned(own, self.newest_pose().theta));
        turned.and_then(|information| information.try_inverse()).unwrap_or_else(Matrix3::zeros)
    }

    /// Returns the number of scans with an odometry error.
    /// Errors are increments beyond `max_odometry_increment`.
    pub fn odometry_jumps(&self) -> usize {
        self.odometry_jumps
    }

    /// Poses of all scans in the map frame, as known now.
    pub fn poses(&self) -> &[Pose2] {
        &self.graph.poses
    }

    /// Ends of the beams of a scan in the robot's frame, m.
    pub fn points(&self, scan: usize) -> &[[f64; 2]] {
        &self.nodes[scan].points
    }

    /// Returns the graph of poses of scans.
    pub fn graph(&self) -> &PoseGraph {
        &self.graph
    }

    fn newest_pose(&self) -> Pose2 {
        self.graph.poses.last().copied().unwrap_or_default()
    }

    /// Returns the submap that new scans are matched with.
    /// It is the oldest that grows, or the last one if none does.
    fn reference(&self) -> Option<usize> {
        let growing = self.submaps.iter().position(|submap| !submap.is_finished);
        growing.or_else(|| self.submaps.len().checked_sub(1))
    }

    fn match_newest(&mut self, increment: &ScanIncrement) {
        let newest = self.nodes.len() - 1;
        let information = increment.information;
        self.graph.constraints.push(Constraint {
            from: newest - 1,
            to: newest,
            relative: increment.pose,
            information,
            is_robust: false,
        });
        self.information = Some(se2::turned(information, -increment.pose.theta));
        let Some(reference) = self.reference() else { return };
        let Submap { map, anchor, .. } = &self.submaps[reference];
        let anchor_pose = self.nodes[*anchor].local;
        let predicted = se2::relative(anchor_pose, self.nodes[newest].local);
        let prior = se2::turned(information, se2::relative(anchor_pose, self.nodes[newest - 1].local).theta);
        let matching = &self.parameters.matching;
        let found = match_scan(map, &self.nodes[newest].points, predicted, prior, matching);
        if found.inliers < matching.min_inliers {
            return;
        }
        self.graph.constraints.push(Constraint {
            from: *anchor,
            to: newest,
            relative: found.pose,
            information: found.information,
            is_robust: false,
        });
        self.nodes[newest].local = se2::compose(anchor_pose, found.pose);
        let matched = se2::turned(found.information, -found.pose.theta);
        self.information = self.information.map(|odometry| odometry + matched);
    }

    /// Places the newest scan in the map frame.
    /// It is placed by the submap it was matched with, or by the scan before if that submap no longer grows, as
    /// optimization has moved its scans.
    fn place_newest(&mut self) {
        let newest = self.nodes.len() - 1;
        let growing = self.reference().map(|reference| &self.submaps[reference]);
        let growing = growing.filter(|submap| !submap.is_finished);
        let beside = growing.map_or(newest.saturating_sub(1), |submap| submap.anchor);
        let local = self.nodes[newest].local;
        let global = match self.graph.poses.get(beside) {
            Some(pose) => se2::compose(*pose, se2::relative(self.nodes[beside].local, local)),
            None => local,
        };
        self.graph.poses.push(global);
    }

    /// Inserts the newest scan into the submaps that grow.
    fn fill_submaps(&mut self) {
        let newest = self.nodes.len() - 1;
        // No submap reaches farther than two ranges of the laser, whatever its scans.
        let most = self.parameters.matching.max_laser_range;
        let local = self.nodes[newest].local;
        self.finish_growing(|nodes, submap| se2::distance(nodes[submap.anchor].local, local) > most);
        let half = self.parameters.scans_per_submap.div_ceil(2);
        let has_room = |last: &Submap| !last.is_finished && newest - last.anchor < half;
        if !self.submaps.last().is_some_and(has_room) {
            self.submaps.push(Submap::new(self.parameters.matching.resolution, newest));
        }
        let points = &self.nodes[newest].points;
        for submap in self.submaps.iter_mut().filter(|submap| !submap.is_finished) {
            submap.insert(se2::relative(self.nodes[submap.anchor].local, local), points);
        }
        self.finish_growing(|_, submap| submap.scans >= 2 * half);
    }

    /// Finishes the submaps that grow and satisfy a condition.
    fn finish_growing(&mut self, is_full: impl Fn(&[ScanNode], &Submap) -> bool) {
        for submap in 0..self.submaps.len() {
            if !self.submaps[submap].is_finished && is_full(&self.nodes, &self.submaps[submap]) {
                self.finish_submap(submap);
            }
        }
    }

    fn finish_submap(&mut self, submap: usize) {
        self.submaps[submap].is_finished = true;
        self.pending.push_back(PendingWork::loops(submap));
    }

    pub(crate) fn optimize(&mut self) {
        self.graph.optimize(self.parameters.loops.robust_kernel);
    }
}
