use serde::{Deserialize, Serialize};
use slate_interfaces::{CameraInfo, PanTiltCommand, PanTiltState};
use slate_module::prelude::*;

use crate::detection::{ImageDetection, ImageDetections};

/// Ports of [`FeatureSeeker`].
#[ports]
pub struct FeatureSeekerIo {
    /// Features of the newest image.
    features: Input<ImageDetections>,
    /// Calibration of the camera.
    camera_info: Input<CameraInfo>,
    /// State of the head.
    head: Input<PanTiltState>,
    /// Mode of the seeker.
    mode: Input<SeekerMode>,
    /// Commanded direction of the head.
    pantilt_position: Output<PanTiltCommand>,
}

/// Mode of a seeker.
#[interface]
#[derive(PartialEq)]
pub struct SeekerMode {
    /// Focus: 0 scans ahead, 1 keeps the surest feature in the image's middle.
    pub focus: f64,
}

/// Parameters of [`FeatureSeeker`].
#[params]
pub struct FeatureSeekerParams {
    #[param(default = 1.4, range = 0.0..=3.1, unit = "rad", doc = "pan to both sides up to which it scans")]
    scan_angle: f64,
    #[param(default = 0.6, range = 0.01..=5.0, unit = "rad/s", doc = "velocity of the scan")]
    scan_velocity: f64,
    #[param(default = 0.15, range = -1.5..=1.5, unit = "rad", doc = "tilt of the scan, downwards")]
    scan_tilt: f64,
    #[param(default = 2.6, range = 0.0..=3.1, unit = "rad", doc = "the same when it has lost what it was focused on")]
    search_angle: f64,
    #[param(default = 1.5, range = 0.0..=60.0, unit = "s", doc = "time without the feature after which it searches")]
    lost_after: f64,
    #[param(default = "victim", doc = "label of the features")]
    label: Text<60>,
}

/// Moves a camera in promising directions: OpenRDK's `featureSeeker`.
pub struct FeatureSeeker;

/// State of [`FeatureSeeker`].
#[derive(Serialize, Deserialize)]
pub struct FeatureSeekerState {
    /// Pan and tilt that it commands.
    command: [f64; 2],
    /// Direction of the scan: 1 to the left.
    direction: f64,
    /// When it saw the feature that it is focused on, ns.
    seen: Option<u64>,
}

impl Default for FeatureSeekerState {
    fn default() -> Self {
        Self { command: [0.0; 2], direction: 1.0, seen: None }
    }
}

#[module(stage = Skill)]
impl Module for FeatureSeeker {
    type Io = FeatureSeekerIo;
    type Params = FeatureSeekerParams;
    type State = FeatureSeekerState;

    fn tick(
        state: &mut FeatureSeekerState,
        io: &FeatureSeekerIo,
        params: &FeatureSeekerParams,
        now: &Tick,
    ) -> Outcome {
        let is_focused = io.mode.get().is_some_and(|mode| mode.focus >= 0.5);
        if !is_focused {
            state.seen = None;
        } else if let (Some(features), Some(camera), Some(head)) =
            (io.features.updated(), io.camera_info.get(), io.head.get())
        {
            let is_sought = |feature: &&ImageDetection| feature.label.as_str() == params.label.as_str();
            if let Some(feature) = features.list.iter().find(is_sought) {
                state.point_at(feature, camera, head);
                state.seen = Some(now.now());
            }
        }
        let is_kept =
            state.seen.is_some_and(|seen| now.now().saturating_sub(seen) as f64 <= params.lost_after * 1e9);
        if !is_kept {
            let angle = if is_focused { params.search_angle } else { params.scan_angle };
            state.scan(angle, params, now.elapsed());
        }
        let [pan, tilt] = state.command;
        io.pantilt_position.set(PanTiltCommand { pan, tilt });
        Outcome::Ok
    }
}

impl FeatureSeekerState {
    /// Commands the head so that a feature is in the middle of the image.
    fn point_at(&mut self, feature: &ImageDetection, camera: &CameraInfo, head: &PanTiltState) {
        let [fx, _, cx, _, fy, cy, ..] = camera.k;
        let (right, down) = (math::atan2(feature.x - cx, fx), math::atan2(feature.y - cy, fy));
        if right.is_finite() && down.is_finite() {
            self.command = [head.pan - right, head.tilt + down];
        }
    }

    /// Goes on with the scan, from side to side.
    fn scan(&mut self, angle: f64, params: &FeatureSeekerParams, seconds: f64) {
        let [pan, _] = self.command;
        let next = pan + self.direction * params.scan_velocity * seconds;
        if next.abs() > angle && next * self.direction > 0.0 {
            self.direction = -self.direction;
        }
        self.command = [math::clamp(next, -params.search_angle, params.search_angle), params.scan_tilt];
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "a test that fails panics")]

    use slate_module::testing::Fixture;

    use super::*;

    #[test]
    fn a_focused_seeker_turns_to_the_feature_and_else_scans() {
        let mut seeker = Fixture::<FeatureSeeker>::new();
        let info = CameraInfo::pinhole([320, 240], [277.0, 277.0, 159.5, 119.5], [0.0; 2]);
        seeker.set("camera_info", info);
        seeker.set("head", PanTiltState { pan: 0.5, tilt: 0.1, ..PanTiltState::default() });
        let mut widest = 0.0;
        for _ in 0..200 {
            seeker.advance(50_000_000);
            seeker.tick();
            let command = seeker.output::<PanTiltCommand>("pantilt_position").unwrap();
            widest = math::max(widest, command.pan.abs());
        }
        assert!(widest > 1.35 && widest < 1.5, "{widest} rad");
        // A feature to the right and below the middle.
        let feature =
            ImageDetection { x: 239.5, y: 149.5, label: Text::new("victim"), ..ImageDetection::default() };
        seeker.set("features", ImageDetections { time: 0, list: Sequence::new(&[feature]) });
        seeker.set("mode", SeekerMode { focus: 1.0 });
        seeker.advance(50_000_000);
        seeker.tick();
        let command = seeker.output::<PanTiltCommand>("pantilt_position").unwrap();
        assert!((command.pan - 0.5 + 0.281).abs() < 0.01 && (command.tilt - 0.1 - 0.108).abs() < 0.01);
    }
}
