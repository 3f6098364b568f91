//! Sampled trajectories.

use slate_module::{Random, math};

use super::parameters::MppiParameters;
use crate::single::{clamp, small_sin_cos};
use crate::velocity::{MOST_EXCESS, MotionLimits, MotionModel, MotionState};

/// Number of alternating noise sets.
/// A robot that stands still thus samples new trajectories.
const NOISE_SETS: usize = 4;

/// Velocities of a control sequence, a number for each step.
#[derive(Clone, Debug, Default)]
pub(crate) struct ControlSequence {
    pub vx: Vec<f32>,
    pub vy: Vec<f32>,
    pub wz: Vec<f32>,
}

impl ControlSequence {
    pub fn new(steps: usize) -> Self {
        Self { vx: vec![0.0; steps], vy: vec![0.0; steps], wz: vec![0.0; steps] }
    }

    pub fn fill(&mut self, value: f32) {
        for part in [&mut self.vx, &mut self.vy, &mut self.wz] {
            part.fill(value);
        }
    }

    /// Drops the first step and repeats the last one.
    pub fn shift(&mut self) {
        for part in [&mut self.vx, &mut self.vy, &mut self.wz] {
            let last = part.len() - 1;
            part.copy_within(1.., 0);
            part[last] = part[last.saturating_sub(1)];
        }
    }
}

/// Standard normal noise times the standard deviations, computed once.
#[derive(Clone, Debug)]
pub(crate) struct ControlNoise {
    /// Noise of all sets, by set, step and trajectory.
    vx: Vec<f32>,
    vy: Vec<f32>,
    wz: Vec<f32>,
    size: usize,
    set: usize,
}

impl ControlNoise {
    pub fn new(parameters: &MppiParameters, random: &mut Random) -> Self {
        let size = parameters.batch_size * parameters.time_steps;
        let mut draw = |stddev: f64, is_used: bool| {
            let count = if is_used { NOISE_SETS * size } else { 0 };
            (0..count).map(|_| (stddev * random.normal()) as f32).collect()
        };
        let is_omni = parameters.motion_model == MotionModel::Omni;
        Self {
            vx: draw(parameters.vx_std, true),
            wz: draw(parameters.wz_std, true),
            vy: draw(parameters.vy_std, is_omni),
            size,
            set: 0,
        }
    }

    pub fn next_set(&mut self) {
        self.choose_set(self.set + 1);
    }

    /// Returns the present set.
    pub fn set(&self) -> usize {
        self.set
    }

    /// Selects a noise set.
    pub fn choose_set(&mut self, set: usize) {
        self.set = set % NOISE_SETS;
    }

    fn row(noise: &[f32], set: usize, size: usize, step: usize, batch: usize) -> &[f32] {
        let from = set * size + step * batch;
        noise.get(from..from + batch).unwrap_or(&[])
    }

    pub fn vx(&self, step: usize, batch: usize) -> &[f32] {
        Self::row(&self.vx, self.set, self.size, step, batch)
    }

    pub fn vy(&self, step: usize, batch: usize) -> &[f32] {
        Self::row(&self.vy, self.set, self.size, step, batch)
    }

    pub fn wz(&self, step: usize, batch: usize) -> &[f32] {
        Self::row(&self.wz, self.set, self.size, step, batch)
    }
}

/// Limits in single precision, for one step.
#[derive(Clone, Copy, Debug)]
struct StepLimits {
    vx: [f32; 2],
    vy: f32,
    wz: f32,
    /// Largest changes.
    up: f32,
    down: f32,
    aside: f32,
    turn: f32,
}

impl StepLimits {
    fn new(limits: &MotionLimits, seconds: f64) -> Self {
        Self {
            vx: [limits.vx_min as f32, limits.vx_max as f32],
            vy: limits.vy_max as f32,
            wz: limits.wz_max as f32,
            up: (limits.ax_max * seconds) as f32,
            down: (limits.ax_min * seconds) as f32,
            aside: (limits.ay_max * seconds) as f32,
            turn: (limits.az_max * seconds) as f32,
        }
    }

    #[inline(always)]
    fn vx(&self, wanted: f32, now: f32) -> f32 {
        clamp(clamp(wanted, self.vx[0], self.vx[1]), now + self.down, now + self.up)
    }

    #[inline(always)]
    fn vy(&self, wanted: f32, now: f32) -> f32 {
        clamp(clamp(wanted, -self.vy, self.vy), now - self.aside, now + self.aside)
    }

    #[inline(always)]
    fn wz(&self, wanted: f32, now: f32) -> f32 {
        clamp(clamp(wanted, -self.wz, self.wz), now - self.turn, now + self.turn)
    }
}

/// Sampled trajectories; arrays by step, then by trajectory.
/// Positions are relative to the middle of the obstacle field.
#[derive(Clone, Debug)]
pub(crate) struct Rollouts {
    pub batch: usize,
    pub steps: usize,
    pub vx: Vec<f32>,
    /// Empty unless the robot is omnidirectional.
    pub vy: Vec<f32>,
    pub wz: Vec<f32>,
    pub x: Vec<f32>,
    pub y: Vec<f32>,
    pub yaw: Vec<f32>,
    pub cosine: Vec<f32>,
    pub sine: Vec<f32>,
    limits: StepLimits,
    is_omni: bool,
    /// Turn of a step at 1 rad/s.
    turn: f32,
    seconds: f32,
}

/// Pose in single precision, with sine and cosine of its heading, and a velocity.
#[derive(Clone, Copy, Debug)]
pub(crate) struct RolloutStart {
    pub x: f32,
    pub y: f32,
    pub yaw: f32,
    pub cosine: f32,
    pub sine: f32,
    pub vx: f32,
    pub vy: f32,
    pub wz: f32,
}

impl RolloutStart {
    pub fn new(robot: &MotionState, center: [f64; 2]) -> Self {
        let yaw = slate_module::math::wrap_angle(robot.pose.theta);
        Self {
            x: (robot.pose.x - center[0]) as f32,
            y: (robot.pose.y - center[1]) as f32,
            yaw: yaw as f32,
            cosine: slate_module::math::cos(yaw) as f32,
            sine: slate_module::math::sin(yaw) as f32,
            vx: robot.velocity.vx as f32,
            vy: robot.velocity.vy as f32,
            wz: robot.velocity.wz as f32,
        }
    }

    /// Returns the start with its velocity clamped to a few times the limits.
    /// It turns by at most 1 rad in a step.
    pub fn within(self, limits: &MotionLimits, seconds: f64) -> Self {
        let held = |value: f32, most: f64| clamp(value, -most as f32, most as f32);
        let fastest = math::max(limits.vx_max.abs(), limits.vx_min.abs());
        Self {
            vx: held(self.vx, MOST_EXCESS * fastest),
            vy: held(self.vy, MOST_EXCESS * limits.vy_max),
            wz: held(self.wz, math::min(MOST_EXCESS * limits.wz_max, 1.0 / seconds)),
            ..self
        }
    }
}

impl Rollouts {
    pub fn new(parameters: &MppiParameters, batch: usize) -> Self {
        let steps = parameters.time_steps;
        let array = || vec![0.0_f32; steps * batch];
        let is_omni = parameters.motion_model == MotionModel::Omni;
        Self {
            batch,
            steps,
            vx: array(),
            vy: if is_omni { array() } else { Vec::new() },
            wz: array(),
            x: array(),
            y: array(),
            yaw: array(),
            cosine: array(),
            sine: array(),
            limits: StepLimits::new(&parameters.limits, parameters.model_dt),
            is_omni,
            turn: (parameters.model_dt * parameters.motion_model.turn_share()) as f32,
            seconds: parameters.model_dt as f32,
        }
    }

    /// Rolls all trajectories out from a start.
    /// The controls are the mean plus noise, if any.
    pub fn run(&mut self, start: &RolloutStart, mean: &ControlSequence, noise: Option<&ControlNoise>) {
        for step in 0..self.steps {
            self.set_controls(step, start, mean, noise);
            self.integrate(step, start);
        }
    }

    fn set_controls(
        &mut self,
        step: usize,
        start: &RolloutStart,
        mean: &ControlSequence,
        noise: Option<&ControlNoise>,
    ) {
        let (batch, limits) = (self.batch, self.limits);
        let noise_vx = noise.map_or(&[][..], |noise| noise.vx(step, batch));
        let noise_vy = noise.map_or(&[][..], |noise| noise.vy(step, batch));
        let noise_wz = noise.map_or(&[][..], |noise| noise.wz(step, batch));
        let (vx, vy, wz) = (mean.vx[step], mean.vy[step], mean.wz[step]);
        fill_row(&mut self.vx, (step, batch), start.vx, vx, noise_vx, |wanted, now| limits.vx(wanted, now));
        fill_row(&mut self.wz, (step, batch), start.wz, wz, noise_wz, |wanted, now| limits.wz(wanted, now));
        if self.is_omni {
            let limit = |wanted, now| limits.vy(wanted, now);
            fill_row(&mut self.vy, (step, batch), start.vy, vy, noise_vy, limit);
        }
    }

    fn integrate(&mut self, step: usize, start: &RolloutStart) {
        let (batch, turn, seconds) = (self.batch, self.turn, self.seconds);
        let row = step * batch..(step + 1) * batch;
        let before = step.saturating_sub(1) * batch;
        if step == 0 {
            self.x[..batch].fill(start.x);
            self.y[..batch].fill(start.y);
            self.yaw[..batch].fill(start.yaw);
            self.cosine[..batch].fill(start.cosine);
            self.sine[..batch].fill(start.sine);
        } else {
            for part in [&mut self.x, &mut self.y, &mut self.yaw, &mut self.cosine, &mut self.sine] {
                part.copy_within(before..before + batch, row.start);
            }
        }
        let (x, y) = (&mut self.x[row.clone()], &mut self.y[row.clone()]);
        let (cosine, sine) = (&mut self.cosine[row.clone()], &mut self.sine[row.clone()]);
        let yaw = &mut self.yaw[row.clone()];
        let (vx, wz) = (&self.vx[row.clone()], &self.wz[row.clone()]);
        for k in 0..batch {
            let (c, s) = (cosine[k], sine[k]);
            x[k] += vx[k] * c * seconds;
            y[k] += vx[k] * s * seconds;
        }
        if self.is_omni {
            let vy = &self.vy[row];
            for k in 0..batch {
                let (c, s) = (cosine[k], sine[k]);
                x[k] -= vy[k] * s * seconds;
                y[k] += vy[k] * c * seconds;
            }
        }
        for k in 0..batch {
            let angle = wz[k] * turn;
            let (turn_sine, turn_cosine) = small_sin_cos(angle);
            let (c, s) = (cosine[k], sine[k]);
            cosine[k] = c * turn_cosine - s * turn_sine;
            sine[k] = s * turn_cosine + c * turn_sine;
            yaw[k] += angle;
        }
    }
}

/// Fills a step's controls: the mean plus noise.
/// They are within the limits relative to the step before.
fn fill_row(
    rows: &mut [f32],
    (step, batch): (usize, usize),
    start: f32,
    mean: f32,
    noise: &[f32],
    limit: impl Fn(f32, f32) -> f32,
) {
    let (done, rest) = rows.split_at_mut(step * batch);
    let row = &mut rest[..batch];
    match done.len().checked_sub(batch) {
        Some(from) => row.copy_from_slice(&done[from..]),
        None => row.fill(start),
    }
    if noise.is_empty() {
        row.iter_mut().for_each(|value| *value = limit(mean, *value));
    } else {
        row.iter_mut().zip(noise).for_each(|(value, noise)| *value = limit(mean + noise, *value));
    }
}
