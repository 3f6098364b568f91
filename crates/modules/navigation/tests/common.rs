//! A Pioneer among columns, without an agent.
#![allow(clippy::unwrap_used, reason = "a test that fails panics")]

use slate_avoidance::Footprint;
use slate_navigation::{
    ControllerSettings, LocalPlannerChoice, NavigationActions, NavigationKnowledgeParams, ObstaclePoints,
};
use slate_plugin::interfaces::{Odometry, Path, Point2, Pose2, Twist2, WheelSpeeds};
use slate_plugin::mapek::{ExecuteBlock, ExecuteStatus, PlanStep, Planned};
use slate_plugin::module::math;
use slate_plugin::module::testing::Fixture;
use slate_plugin::prelude::*;
use slate_wheeled::knowledge::WheeledModel;

pub const CYCLE: u64 = 50_000_000;
/// Radius of a column, m.
const RADIUS: f64 = 0.15;

/// A Pioneer at a pose.
pub fn model(pose: Pose2) -> WheeledModel {
    let mut model = WheeledModel::load("pioneer_p3dx", "vrep").unwrap();
    model.robot.pose = pose;
    model
}

pub fn settings() -> ControllerSettings {
    let params = NavigationKnowledgeParams::default();
    ControllerSettings {
        planner: LocalPlannerChoice::MPPI,
        batch_size: 200,
        time_steps: params.time_steps,
        model_dt: params.model_dt,
        vx_max: params.vx_max,
        vx_min: params.vx_min,
        wz_max: params.wz_max,
        ax_max: params.ax_max,
        az_max: params.az_max,
        vx_std: params.vx_std,
        wz_std: params.wz_std,
        prune_distance: params.prune_distance,
        collision_margin_distance: params.collision_margin_distance,
        inflation_radius: params.inflation_radius,
        window_size: params.window_size,
        xy_goal_tolerance: params.xy_goal_tolerance,
        yaw_goal_tolerance: params.yaw_goal_tolerance,
        required_movement_radius: params.required_movement_radius,
        movement_time_allowance: 2.0,
        number_of_retries: params.number_of_retries,
        seed: params.seed,
    }
}

/// Points on the rims of columns.
pub fn rims(columns: &[[f64; 2]]) -> Vec<[f64; 2]> {
    let rim = |[x, y]: [f64; 2]| {
        (0..24).map(move |k| {
            let angle = f64::from(k) * std::f64::consts::PI / 12.0;
            [x + RADIUS * math::cos(angle), y + RADIUS * math::sin(angle)]
        })
    };
    columns.iter().flat_map(|column| rim(*column)).collect()
}

/// Execute of a Pioneer that drives as it is commanded. Its odometry began elsewhere than the map.
pub struct Scene {
    pub execute: Fixture<ExecuteBlock<NavigationActions>>,
    pub pose: Pose2,
    pub twist: Twist2,
    pub path: Vec<[f64; 2]>,
    /// Inputs that are not set.
    pub missing: Vec<&'static str>,
    obstacles: Vec<[f64; 2]>,
    footprint: Footprint,
    /// Least distance to an obstacle so far, m.
    pub clearance: f64,
    ticket: u64,
}

impl Scene {
    pub fn new(pose: Pose2, columns: &[[f64; 2]]) -> Self {
        let footprint = Footprint::of(&model(pose).chassis.outline).unwrap();
        let mut execute = Fixture::new();
        execute.set("controller", settings());
        Self {
            execute,
            pose,
            twist: Twist2::ZERO,
            path: Vec::new(),
            missing: Vec::new(),
            obstacles: rims(columns),
            footprint,
            clearance: f64::INFINITY,
            ticket: 0,
        }
    }

    /// A copy that continues from here with the saved state alone.
    pub fn resumed(&self) -> Self {
        let mut execute = Fixture::new();
        execute.set("controller", settings());
        execute.restore(&self.execute.save().unwrap()).unwrap();
        let (footprint, obstacles) = (self.footprint.clone(), self.obstacles.clone());
        let (path, missing) = (self.path.clone(), Vec::new());
        Self { execute, footprint, obstacles, path, missing, ..*self }
    }

    pub fn request(&mut self, action: ActionRequest) {
        self.ticket += 1;
        let planned = Planned { epoch: 0, ticket: self.ticket, action, step: PlanStep::REPLACE };
        self.execute.push("plan", planned);
    }

    /// In the odometry frame.
    fn odometry(&self, [x, y]: [f64; 2]) -> [f64; 2] {
        let (sine, cosine) = (math::sin(0.5), math::cos(0.5));
        [1.0 + x * cosine - y * sine, -2.0 + x * sine + y * cosine]
    }

    fn set_inputs(&mut self) {
        let is_set = |name: &str| !self.missing.contains(&name);
        let [x, y] = self.odometry([self.pose.x, self.pose.y]);
        let odometry = Pose2 { x, y, theta: math::wrap_angle(self.pose.theta + 0.5) };
        let points: Vec<_> = self.obstacles.iter().map(|point| self.odometry(*point)).collect();
        if is_set("robot") {
            self.execute.set("robot", model(self.pose));
        }
        if is_set("odometry") {
            self.execute.set("odometry", Odometry { pose: odometry, twist: self.twist });
        }
        if is_set("obstacles") {
            self.execute.write::<ObstaclePoints>("obstacles", points.len(), |obstacles| {
                obstacles.pose = odometry;
                for (place, [x, y]) in obstacles.points.iter_mut().zip(&points) {
                    *place = Point2 { x: *x, y: *y };
                }
            });
        }
        if is_set("path") {
            let path = &self.path;
            self.execute.write::<Path>("path", path.len(), |value| {
                for (place, [x, y]) in value.points.iter_mut().zip(path) {
                    *place = Point2 { x: *x, y: *y };
                }
            });
        }
    }

    /// A cycle; returns the commanded velocity.
    pub fn step(&mut self) -> Twist2 {
        self.set_inputs();
        for name in std::mem::take(&mut self.missing) {
            self.execute.expire(name);
        }
        self.execute.advance(CYCLE);
        self.execute.tick();
        let speeds = self.execute.output::<WheelSpeeds>("wheels").unwrap_or_default();
        self.twist = model(self.pose).robot.drive.twist_of(speeds);
        let seconds = CYCLE as f64 * 1e-9;
        let theta = self.pose.theta + 0.5 * seconds * self.twist.angular;
        self.pose.x += seconds * self.twist.linear * math::cos(theta);
        self.pose.y += seconds * self.twist.linear * math::sin(theta);
        self.pose.theta = math::wrap_angle(self.pose.theta + seconds * self.twist.angular);
        let (sine, cosine) = (math::sin(self.pose.theta), math::cos(self.pose.theta));
        for [x, y] in &self.obstacles {
            let (across, up) = (x - self.pose.x, y - self.pose.y);
            let distance = self.footprint.distance(across * cosine + up * sine, up * cosine - across * sine);
            self.clearance = math::min(self.clearance, distance);
        }
        self.twist
    }

    /// Steps until an action has ended, at most for that many cycles; returns how it ended.
    pub fn run(&mut self, cycles: u32) -> Option<Ending> {
        for _ in 0..cycles {
            self.step();
            if let Some(ended) = self.status().and_then(|status| status.ended.last().copied()) {
                return Some(ended.ending);
            }
        }
        None
    }

    pub fn status(&self) -> Option<ExecuteStatus> {
        self.execute.output("status")
    }

    /// The actions that run.
    pub fn tree(&self) -> String {
        self.status().map(|status| status.tree.as_str().to_owned()).unwrap_or_default()
    }
}
