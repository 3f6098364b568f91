//! Loop closure.

use slate_interfaces::Pose2;
use slate_module::math;
use slate_sorted::SortedSet;

use crate::correlative::{SearchWindow, search};
use crate::graph_slam::GraphSlam;
use crate::parameters::LoopClosureParameters;
use crate::pending_work::{ConstraintSearch, LoopSearch, PendingWork};
use crate::pose_graph::Constraint;
use crate::refine::{Refined, refine};
use crate::se2;
use crate::surface_map::SurfaceMap;

/// Distance between points of a submap that is searched in another one, cells.
const SPACING: f64 = 3.0;
/// Farthest that a scan fits beside where its submap does, m and rad.
const CONSISTENT: [f64; 2] = [0.25, 0.05];
/// Thinning of a scan's points against another submap: one of so many.
const THINNED: usize = 2;
/// Numbers of scans of a unit of work that are examined, and matched.
const MAX_EXAMINED: usize = 500;
const MAX_MATCHED: usize = 8;

impl GraphSlam {
    /// Does a unit of the deferred work; returns true if more is left.
    /// [`track`](Self::track) and [`request_finish`](Self::request_finish) defer it. In a unit, a submap is searched in
    /// another one, a few scans are matched with one, or the graph is optimized.
    pub fn work(&mut self) -> bool {
        let left = match self.pending.pop_front() {
            None => None,
            Some(PendingWork::Loops(search)) => self.search_loop(search).map(PendingWork::Loops),
            Some(PendingWork::Constraints(search)) => {
                self.search_constraints(search).map(PendingWork::Constraints)
            }
        };
        if let Some(left) = left {
            self.pending.push_front(left);
        }
        !self.pending.is_empty()
    }

    /// Returns true if work is left.
    pub fn has_work(&self) -> bool {
        !self.pending.is_empty()
    }

    /// Searches a submap in the next earlier one near it.
    /// Returns the remaining search. After the last one, the graph is optimized.
    pub(crate) fn search_loop(&mut self, mut search: LoopSearch) -> Option<LoopSearch> {
        let LoopSearch { submap, other, .. } = search;
        let Some(near) = (other..submap).find(|other| self.may_close(submap, *other)) else {
            if search.found > 0 {
                self.optimize();
            }
            return None;
        };
        if search.query.is_empty() {
            search.query = self.query(submap);
        }
        let before = self.graph.constraints.len();
        self.close_loop(submap, near, &search.query);
        search.found += self.graph.constraints.len() - before;
        search.other = near + 1;
        Some(search)
    }

    /// Returns true if a submap may close a loop with an earlier one.
    fn may_close(&self, submap: usize, other: usize) -> bool {
        let (earlier, later) = (self.submaps[other].nodes(), self.submaps[submap].nodes());
        earlier.end <= later.start && self.is_near(submap, other)
    }

    /// Returns true if a scan of one submap is near one of the other.
    fn is_near(&self, submap: usize, other: usize) -> bool {
        let most = self.parameters.loops.max_distance;
        let poses = &self.graph.poses;
        self.submaps[submap].nodes().any(|node| {
            self.submaps[other].nodes().any(|other| se2::distance(poses[node], poses[other]) < most)
        })
    }

    /// Points of a submap in its frame, thinned.
    fn query(&self, submap: usize) -> Vec<[f64; 2]> {
        let map = &self.submaps[submap].map;
        let mut taken = SortedSet::new();
        let spacing = SPACING * map.resolution();
        let points = map.cells().map(|(_, cell)| [f64::from(cell.x), f64::from(cell.y)]);
        let is_new = |point: &[f64; 2]| taken.insert(point.map(|value| (value / spacing).floor() as i64));
        points.filter(is_new).collect()
    }

    /// Refines a guess, one that is rough with surfaces of twice the distance first.
    fn refine_near(&self, map: &SurfaceMap, points: &[[f64; 2]], guess: Pose2, is_rough: bool) -> Refined {
        let radius = self.parameters.matching.correspondence_distance;
        let guess = if is_rough { refine(map, points, guess, 2.0 * radius, None).pose } else { guess };
        refine(map, points, guess, radius, None)
    }

    fn close_loop(&mut self, submap: usize, other: usize, query: &[[f64; 2]]) {
        let LoopClosureParameters { search_distance, search_angle, min_score, .. } = self.parameters.loops;
        let (anchor, later) = (self.submaps[other].anchor, self.submaps[submap].anchor);
        let guess = se2::relative(self.graph.poses[anchor], self.graph.poses[later]);
        let window = SearchWindow { distance: search_distance, angle: search_angle, penalty: 0.0 };
        let resolution = self.parameters.matching.resolution;
        let grids = self.search_grids.of(other, &self.submaps[other].map);
        let found = search(grids, resolution, query, guess, window, min_score);
        let Some(found) = found else { return };
        let map = &self.submaps[other].map;
        let fit = self.refine_near(map, query, found.pose, true);
        let nodes = self.submaps[submap].nodes();
        let local = |node: usize| se2::relative(self.nodes[later].local, self.nodes[node].local);
        let constraints: Vec<Constraint> = nodes
            .filter_map(|node| self.constraint(other, node, se2::compose(fit.pose, local(node)), false))
            .collect();
        self.graph.constraints.extend(constraints);
    }

    /// Returns the constraint between a submap and a scan.
    /// It starts from a guess of the scan's pose in the submap; `None` if the scan does not fit there.
    fn constraint(&self, submap: usize, node: usize, guess: Pose2, is_rough: bool) -> Option<Constraint> {
        let submap = &self.submaps[submap];
        let points: Vec<[f64; 2]> = self.nodes[node].points.iter().step_by(THINNED).copied().collect();
        let found = self.refine_near(&submap.map, &points, guess, is_rough);
        let is_consistent = se2::distance(found.pose, guess) < CONSISTENT[0]
            && math::angle_between(found.pose.theta, guess.theta).abs() < CONSISTENT[1];
        let is_fit = is_consistent && found.inliers >= self.parameters.loops.min_inliers;
        is_fit.then_some(Constraint {
            from: submap.anchor,
            to: node,
            relative: found.pose,
            information: found.information * THINNED as f64,
            is_robust: true,
        })
    }

    /// Matches some scans with submaps near them, from the known poses.
    /// Returns the remaining search. After the last one, the constraints replace those of earlier searches, and the
    /// graph is optimized.
    pub(crate) fn search_constraints(&mut self, mut search: ConstraintSearch) -> Option<ConstraintSearch> {
        let (mut looks, mut matches) = (0, 0);
        while search.submap < self.submaps.len() {
            if search.node >= self.nodes.len() {
                (search.submap, search.node) = (search.submap + 1, 0);
                continue;
            }
            if looks == MAX_EXAMINED || matches == MAX_MATCHED {
                return Some(search);
            }
            looks += 1;
            let found = self.constraint_beside(search.submap, search.node, search.is_rough);
            matches += usize::from(found.is_some());
            search.found.extend(found.flatten());
            search.node += 1;
        }
        self.graph.constraints.retain(|constraint| !constraint.is_robust);
        self.graph.constraints.append(&mut search.found);
        self.optimize();
        None
    }

    /// Returns the constraint between a submap and a scan of others.
    /// It starts from their poses: `None` if the scan is not near, and inside of it `None` if it does not fit.
    fn constraint_beside(&self, submap: usize, node: usize, is_rough: bool) -> Option<Option<Constraint>> {
        let poses = &self.graph.poses;
        let nodes = self.submaps[submap].nodes();
        let most = self.parameters.loops.max_distance;
        let is_near = || nodes.clone().any(|other| se2::distance(poses[node], poses[other]) < most);
        (!nodes.contains(&node) && is_near()).then(|| {
            let guess = se2::relative(poses[self.submaps[submap].anchor], poses[node]);
            self.constraint(submap, node, guess, is_rough)
        })
    }
}
