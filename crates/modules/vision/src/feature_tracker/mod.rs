//! Features as places in the map: tracked, examined, reported once.

mod ports;
mod sight;
mod track;
mod viewpoint;

use serde::{Deserialize, Serialize};
use slate_grid::Geometry;
use slate_interfaces::{OccupancyGrid, Pose2};
use slate_module::prelude::*;

pub use ports::{
    ExaminationResult, ExaminationSwitch, FeatureCandidate, FeatureTrackerIo, FeatureTrackerParams,
    FoundVictim, FoundVictims,
};
use sight::CameraView;
use track::{FeatureTrack, TrackState};
use viewpoint::{FreeSpace, viewpoint};

/// Largest number of cells of a map.
const MAX_CELLS: usize = 1 << 22;
/// Most tracks, and most victims that are reported.
const MAX_TRACKS: usize = 32;
/// Time between two choices of the place to look from, ns.
const CHOICE: u64 = 1_000_000_000;

/// Tracks features of images in the map, and reports each once it is sure of it.
///
/// A detection gives a bearing by camera, head and pose. Its range is that of the floor at the lower edge of its box, or that of
/// the wall behind it on the map where that is nearer. A track is a position with covariance, by a Kalman filter of a
/// constant state (Thrun, Burgard and Fox, *Probabilistic Robotics*, 3.2). It is a candidate until it has been seen often enough from
/// near, and rejected when an examination ends without that.
pub struct FeatureTracker;

/// State of [`FeatureTracker`].
#[derive(Default, Serialize, Deserialize)]
pub struct FeatureTrackerState {
    tracks: Vec<FeatureTrack>,
    /// Number of the newest report.
    reports: u32,
    examination: Option<Examination>,
    /// Place to look from, of the examined or of the nearest candidate.
    viewpoint: Option<[f64; 3]>,
    chosen_at: Option<u64>,
}

/// Examination of a candidate.
#[derive(Clone, Copy, Serialize, Deserialize)]
struct Examination {
    /// Place of the track in the list; they are never moved while one continues.
    track: usize,
    since: u64,
}

#[module(stage = WorldState)]
impl Module for FeatureTracker {
    type Io = FeatureTrackerIo;
    type Params = FeatureTrackerParams;
    type State = FeatureTrackerState;

    fn tick(
        state: &mut FeatureTrackerState,
        io: &FeatureTrackerIo,
        params: &FeatureTrackerParams,
        now: &Tick,
    ) -> Outcome {
        let pose = io.robot_pose.fresh().filter(|pose| pose.is_known());
        if let (Some(features), Some(pose)) = (io.features.updated(), pose)
            && let Some(view) = CameraView::of(io, pose)
        {
            let map = io.map.get().and_then(|map| Some((Geometry::of(map, MAX_CELLS)?, map)));
            for feature in
                features.list.iter().filter(|feature| feature.label.as_str() == params.label.as_str())
            {
                if let Some(sight) = view.locate(feature, map, params) {
                    state.take(&sight, params, now);
                }
            }
        }
        state.forget(params, now);
        state.report(io, params, now);
        let is_examining = io.examine.get().is_some_and(|examine| examine.is_active.get());
        state.examine(io, is_examining, pose, params, now);
        state.show_candidate(io, (pose, io.map.get()), params, now);
        Outcome::Ok
    }
}

impl FeatureTrackerState {
    /// Adds a sight to the track that it belongs to, or begins one.
    fn take(&mut self, sight: &sight::FeatureSight, params: &FeatureTrackerParams, now: &Tick) {
        let of_track =
            |(at, track): (usize, &FeatureTrack)| Some((track.distance(sight, params.merge_distance)?, at));
        let near = self.tracks.iter().enumerate().filter_map(of_track);
        let nearest = near.min_by(|(a, _), (b, _)| a.total_cmp(b));
        match nearest {
            Some((_, at)) => self.tracks[at].update(sight, now.now()),
            None if self.tracks.len() < MAX_TRACKS => self.tracks.push(FeatureTrack::new(sight, now.now())),
            None => {}
        }
    }

    /// Drops tracks that were seen a few times long ago.
    fn forget(&mut self, params: &FeatureTrackerParams, now: &Tick) {
        if self.examination.is_none() {
            let min_hits = params.candidate_hits;
            self.tracks.retain(|track| !track.is_spurious(min_hits, params.spurious_after, now.now()));
        }
    }

    /// Reports the candidates that are sure.
    fn report(&mut self, io: &FeatureTrackerIo, params: &FeatureTrackerParams, now: &Tick) {
        let mut is_new = false;
        for track in self.tracks.iter_mut().filter(|track| track.is_sure(params)) {
            self.reports += 1;
            track.report(self.reports, now.now());
            is_new = true;
            let [x, y, z] = track.position();
            now.info(format_args!("victim {} at {x:.2}, {y:.2}, {z:.2} m", self.reports));
        }
        // A reported one is placed better by each further sight.
        if is_new || io.features.is_new() {
            let victims = self.tracks.iter().filter_map(|track| track.found());
            let mut list: Vec<FoundVictim> = victims.take(MAX_TRACKS).collect();
            list.sort_by_key(|victim| victim.id);
            io.victims.set(FoundVictims { list: Sequence::new(&list) });
        }
    }

    /// Begins and ends the examination of a candidate.
    fn examine(
        &mut self,
        io: &FeatureTrackerIo,
        is_examining: bool,
        pose: Option<&Pose2>,
        params: &FeatureTrackerParams,
        now: &Tick,
    ) {
        if !is_examining {
            self.examination = None;
            return;
        }
        if self.examination.is_none() {
            let track = self.candidate(pose, params);
            self.examination = track.map(|track| Examination { track, since: now.now() });
            (self.viewpoint, self.chosen_at) = (None, None);
        }
        if let Some(Examination { track, since }) = self.examination
            && self.tracks[track].state == TrackState::Candidate
            && now.now().saturating_sub(since) as f64 >= params.examination_timeout * 1e9
        {
            self.tracks[track].state = TrackState::Rejected;
        }
        // Without a candidate there is nothing to examine.
        let state =
            self.examination.map_or(TrackState::Rejected, |examined| self.tracks[examined.track].state);
        io.result.set(ExaminationResult {
            has_succeeded: (state == TrackState::Reported).into(),
            has_failed: (state == TrackState::Rejected).into(),
        });
    }

    /// The candidate that is nearest to the robot.
    fn candidate(&self, pose: Option<&Pose2>, params: &FeatureTrackerParams) -> Option<usize> {
        let pose = pose?;
        let away = |track: &FeatureTrack| {
            let [x, y, _] = track.position();
            math::hypot(x - pose.x, y - pose.y)
        };
        let candidates = self.tracks.iter().enumerate().filter(|(_, track)| track.is_candidate(params));
        candidates.min_by(|(_, a), (_, b)| away(a).total_cmp(&away(b))).map(|(at, _)| at)
    }

    /// Writes the examined or else the nearest candidate, and where to look at it from.
    fn show_candidate(
        &mut self,
        io: &FeatureTrackerIo,
        (pose, map): (Option<&Pose2>, Option<&OccupancyGrid>),
        params: &FeatureTrackerParams,
        now: &Tick,
    ) {
        let shown = self.examination.map(|examined| examined.track).or_else(|| self.candidate(pose, params));
        let Some(track) = shown.map(|shown| &self.tracks[shown]) else {
            io.candidate.set(FeatureCandidate::default());
            return;
        };
        let [x, y, z] = track.position();
        let is_there = track.is_candidate(params).into();
        io.candidate.set(FeatureCandidate { x, y, z, hits: track.hits, is_there });
        let is_due = self.chosen_at.is_none_or(|at| now.now().saturating_sub(at) >= CHOICE);
        let (Some(pose), Some(map), true) = (pose, map, is_due) else { return };
        self.chosen_at = Some(now.now());
        let Some(geometry) = Geometry::of(map, MAX_CELLS) else { return };
        let around = FreeSpace { geometry, cells: &map.data, clearance: params.viewpoint_clearance };
        // One that is still free stays, so that the robot does not turn back and forth.
        let kept = self.viewpoint.filter(|kept| around.sees(*kept, [x, y], params.view_distance));
        let chosen = kept.or_else(|| viewpoint(&around, [x, y], pose, params.view_distance));
        self.viewpoint = chosen.or(Some([pose.x, pose.y, math::atan2(y - pose.y, x - pose.x)]));
        if let Some([x, y, theta]) = self.viewpoint {
            io.view_pose.set(Pose2 { x, y, theta });
        }
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "a test that fails panics")]

    use slate_interfaces::{CameraInfo, Position, Transform};
    use slate_module::testing::Fixture;

    use super::*;
    use crate::detection::{ImageDetection, ImageDetections};

    const FOCAL: f64 = 277.0;
    const HEIGHT: f64 = 0.6;

    fn tracker() -> Fixture<FeatureTracker> {
        let mut tracker = Fixture::<FeatureTracker>::new();
        let info = CameraInfo::pinhole([320, 240], [FOCAL, FOCAL, 159.5, 119.5], [0.0; 2]);
        tracker.set("camera_info", info);
        let translation = Position { x: 0.15, y: 0.0, z: HEIGHT };
        tracker.set("camera_base", Transform { translation, ..Transform::default() });
        tracker
    }

    /// Shows the tracker a victim of 0.4 m at a place, from a pose, after 70 ms.
    fn show(tracker: &mut Fixture<FeatureTracker>, pose: Pose2, [x, y]: [f64; 2]) {
        tracker.advance(70_000_000);
        let (sine, cosine) = (math::sin(pose.theta), math::cos(pose.theta));
        let (dx, dy) = (x - pose.x, y - pose.y);
        let (ahead, left) = (cosine * dx + sine * dy - 0.15, cosine * dy - sine * dx);
        let [bottom, top] = [HEIGHT, HEIGHT - 0.4].map(|below| 119.5 + FOCAL * below / ahead);
        let box_of = ImageDetection {
            x: 159.5 - FOCAL * left / ahead,
            y: 0.5 * (bottom + top),
            width: 20.0,
            height: bottom - top,
            confidence: 0.8,
            label: Text::new("victim"),
        };
        tracker.set("robot_pose", pose);
        tracker.set("features", ImageDetections { time: 0, list: Sequence::new(&[box_of]) });
        tracker.tick();
    }

    fn found(tracker: &Fixture<FeatureTracker>) -> Vec<FoundVictim> {
        tracker.output::<FoundVictims>("victims").map_or(Vec::new(), |victims| victims.list.to_vec())
    }

    #[test]
    fn a_victim_seen_often_is_reported_once_and_in_its_place() {
        let mut tracker = tracker();
        for k in 0..30 {
            let k = f64::from(k);
            show(&mut tracker, Pose2 { x: 0.03 * k, y: 0.02 * k, theta: 0.01 * k }, [3.2, 0.9]);
        }
        let victims = found(&tracker);
        assert_eq!(victims.len(), 1);
        let away = math::hypot(victims[0].x - 3.2, victims[0].y - 0.9);
        assert!(away < 0.02 && (victims[0].z - 0.2).abs() < 0.05, "{away} m, {victims:?}");
        // Another one far from it is another victim.
        (0..30).for_each(|_| show(&mut tracker, Pose2 { x: 0.0, y: 0.0, theta: 1.0 }, [1.2, 1.9]));
        assert_eq!(found(&tracker).iter().map(|victim| victim.id).collect::<Vec<_>>(), [1, 2]);
    }

    #[test]
    fn a_candidate_is_rejected_when_its_examination_finds_nothing() {
        let mut tracker = tracker();
        // From far away it is not sure.
        let pose = Pose2::default();
        (0..4).for_each(|_| show(&mut tracker, pose, [3.6, 0.5]));
        let candidate = tracker.output::<FeatureCandidate>("candidate").unwrap();
        assert!(candidate.is_there.get() && found(&tracker).is_empty());
        tracker.set("examine", ExaminationSwitch { is_active: Bool::TRUE });
        let result = |tracker: &mut Fixture<FeatureTracker>, seconds: u64| {
            tracker.advance(seconds * 1_000_000_000);
            tracker.set("robot_pose", pose);
            tracker.tick();
            let result = tracker.output::<ExaminationResult>("result").unwrap();
            (result.has_succeeded.get(), result.has_failed.get())
        };
        assert_eq!(result(&mut tracker, 0), (false, false));
        assert_eq!(result(&mut tracker, 24), (false, false));
        assert_eq!(result(&mut tracker, 2), (false, true));
        tracker.set("examine", ExaminationSwitch { is_active: Bool::FALSE });
        tracker.tick();
        assert!(!tracker.output::<FeatureCandidate>("candidate").unwrap().is_there.get());
    }

    #[test]
    fn a_victim_in_a_wall_is_as_far_as_the_wall() {
        let mut tracker = tracker();
        // A wall at x = 2; of the victim in it, the lower edge is as high as the camera.
        tracker.write::<OccupancyGrid>("map", 80 * 80, |map| {
            map.origin = Pose2 { x: -2.0, y: -2.0, theta: 0.0 };
            (map.resolution, map.width, map.height) = (0.05, 80, 80);
            map.data
                .iter_mut()
                .enumerate()
                .for_each(|(cell, value)| *value = if cell % 80 == 79 { 100 } else { 0 });
        });
        let victim = ImageDetection {
            x: 159.5,
            y: 90.0,
            width: 30.0,
            height: 58.0,
            confidence: 0.9,
            label: Text::new("victim"),
        };
        for _ in 0..20 {
            tracker.advance(70_000_000);
            tracker.set("robot_pose", Pose2::default());
            tracker.set("features", ImageDetections { time: 0, list: Sequence::new(&[victim]) });
            tracker.tick();
        }
        let victims = found(&tracker);
        assert!(victims.len() == 1 && (victims[0].x - 1.85).abs() < 0.06, "{victims:?}");
    }
}
