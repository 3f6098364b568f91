//! Parameters of the Knowledge of a robot that navigates.

use slate_plugin::prelude::*;
use slate_wheeled::knowledge::WheeledKnowledgeParams;

use crate::collision_stop::CollisionRules;
use crate::mission::{PlaceName, SavedGoal};
use crate::settings::{ControllerSettings, LocalPlannerChoice};

/// Parameters of [`NavigationKnowledge`](crate::NavigationKnowledge).
/// They have Nav2's names.
#[params]
#[derive(PartialEq)]
pub struct NavigationKnowledgeParams {
    #[param(default = "", doc = "robot's description: `pioneer_p3dx`, `summit_xl`, or the path of a file")]
    pub robot: Text<252>,
    #[param(
        default = "vrep",
        follows = ["world.robots.{robot}.profile", "world.profile"],
        doc = "profile of its sensors, which a simulated world sets by its own key; a sensor without it has its first one"
    )]
    pub profile: Text<28>,
    #[param(
        default = "",
        follows = ["world.robots.{robot}.sonar", "world.robots.{robot}.profile", "world.sonar"],
        doc = "profile of the sonars, if it differs from the robot's"
    )]
    pub sonar: Text<28>,
    #[param(
        default = "",
        follows = ["world.robots.{robot}.robot_sensor", "world.robots.{robot}.profile", "world.robot_sensor"],
        doc = "profile of the robot sensor, if it differs from the robot's"
    )]
    pub robot_sensor: Text<28>,
    #[param(default = Sequence::default(), doc = "places of the first mission, by their names in the navigation graph")]
    pub places: Sequence<PlaceName, 16>,
    #[param(default = Sequence::default(), doc = "points of the first mission, if it has no places, meters")]
    pub goals: Sequence<Point2, 16>,
    #[param(default = false, doc = "repeat the mission from its first goal")]
    pub is_loop: Bool,
    #[param(default = "mppi", doc = "local planner: mppi or dwa")]
    pub local_planner: Text<28>,
    #[param(default = 600, range = 10..=10_000, doc = "sampled trajectories of MPPI")]
    pub batch_size: u32,
    #[param(default = 56, range = 4..=200, doc = "steps of a trajectory")]
    pub time_steps: u32,
    #[param(default = 0.05, range = 0.01..=1.0, unit = "s", doc = "time of a step, and between two plans")]
    pub model_dt: f64,
    #[param(default = 0.5, range = 0.05..=3.0, unit = "m/s", doc = "maximum velocity forward")]
    pub vx_max: f64,
    #[param(default = -0.15, range = -3.0..=0.0, unit = "m/s", doc = "minimum velocity; negative backwards")]
    pub vx_min: f64,
    #[param(default = 1.5, range = 0.1..=5.0, unit = "rad/s", doc = "maximum angular velocity")]
    pub wz_max: f64,
    #[param(default = 1.0, range = 0.05..=10.0, unit = "m/s^2", doc = "maximum acceleration")]
    pub ax_max: f64,
    #[param(default = 3.0, range = 0.05..=20.0, unit = "rad/s^2", doc = "maximum angular acceleration")]
    pub az_max: f64,
    #[param(default = 0.2, range = 0.01..=3.0, unit = "m/s", doc = "standard deviation of sampled velocities")]
    pub vx_std: f64,
    #[param(default = 0.4, range = 0.01..=5.0, unit = "rad/s", doc = "standard deviation of sampled angular velocities")]
    pub wz_std: f64,
    #[param(default = 1.7, range = 0.2..=20.0, unit = "m", doc = "length of the path ahead that is followed")]
    pub prune_distance: f64,
    #[param(default = 0.1, range = 0.0..=2.0, unit = "m", doc = "distance between footprint and obstacle below which a trajectory is very costly")]
    pub collision_margin_distance: f64,
    #[param(default = 0.55, range = 0.0..=5.0, unit = "m", doc = "distance up to which an obstacle makes a trajectory costly")]
    pub inflation_radius: f64,
    #[param(default = 5.0, range = 1.0..=30.0, unit = "m", doc = "side of the window with obstacles around the robot")]
    pub window_size: f64,
    #[param(default = 0.15, range = 0.01..=5.0, unit = "m", doc = "distance from a goal at which it counts as reached")]
    pub xy_goal_tolerance: f64,
    #[param(default = 0.15, range = 0.01..=3.2, unit = "rad", doc = "error of the heading at which it counts as reached")]
    pub yaw_goal_tolerance: f64,
    #[param(default = 0.3, range = 0.01..=5.0, unit = "m", doc = "distance within which the robot makes no progress")]
    pub required_movement_radius: f64,
    #[param(default = 8.0, range = 0.5..=600.0, unit = "s", doc = "time without progress after which the robot is stuck")]
    pub movement_time_allowance: f64,
    #[param(default = 6, range = 0..=100, doc = "recoveries without progress after which an action fails")]
    pub number_of_retries: u32,
    #[param(default = 1, doc = "seed of the noise of MPPI")]
    pub seed: u64,
    #[param(default = 0.6, range = 0.0..=10.0, unit = "s", doc = "time to a collision at the present velocity below which the robot stops; 0 for no stop")]
    pub time_before_collision: f64,
    #[param(default = 0.03, range = 0.0..=1.0, unit = "m", doc = "margin around the footprint in which a point is a collision")]
    pub collision_distance: f64,
    #[param(default = 3, range = 1..=100, doc = "points of a scan from which something is an obstacle")]
    pub min_points: u32,
    #[param(default = 0.5, range = 0.05..=10.0, unit = "s", doc = "age of a scan from which the robot stops")]
    pub source_timeout: f64,
}

impl NavigationKnowledgeParams {
    /// Returns the parameters of any wheeled robot's Knowledge.
    /// Without its single goal.
    pub(crate) fn wheeled(&self) -> WheeledKnowledgeParams {
        WheeledKnowledgeParams {
            robot: self.robot,
            profile: self.profile,
            sonar: self.sonar,
            robot_sensor: self.robot_sensor,
            has_goal: false.into(),
            ..WheeledKnowledgeParams::default()
        }
    }

    /// Goals of the first mission.
    pub(crate) fn first_goals(&self) -> Vec<SavedGoal> {
        match self.places.is_empty() {
            true => self.goals.iter().map(SavedGoal::from).collect(),
            false => self.places.iter().map(SavedGoal::from).collect(),
        }
    }

    /// Settings of the local planner.
    ///
    /// # Errors
    /// It is unknown.
    pub(crate) fn controller(&self) -> Result<ControllerSettings, Refusal> {
        let planner = match self.local_planner.as_str() {
            "mppi" => LocalPlannerChoice::MPPI,
            "dwa" => LocalPlannerChoice::DWA,
            other => {
                return Err(Refusal(format!("params.local_planner: expected mppi or dwa, found `{other}`")));
            }
        };
        Ok(ControllerSettings {
            planner,
            batch_size: self.batch_size,
            time_steps: self.time_steps,
            model_dt: self.model_dt,
            vx_max: self.vx_max,
            vx_min: self.vx_min,
            wz_max: self.wz_max,
            ax_max: self.ax_max,
            az_max: self.az_max,
            vx_std: self.vx_std,
            wz_std: self.wz_std,
            prune_distance: self.prune_distance,
            collision_margin_distance: self.collision_margin_distance,
            inflation_radius: self.inflation_radius,
            window_size: self.window_size,
            xy_goal_tolerance: self.xy_goal_tolerance,
            yaw_goal_tolerance: self.yaw_goal_tolerance,
            required_movement_radius: self.required_movement_radius,
            movement_time_allowance: self.movement_time_allowance,
            number_of_retries: self.number_of_retries,
            seed: self.seed,
        })
    }

    /// Rules of the collision stop.
    pub(crate) fn collision_rules(&self) -> CollisionRules {
        CollisionRules {
            time_before_collision: self.time_before_collision,
            collision_distance: self.collision_distance,
            source_timeout: self.source_timeout,
            min_points: self.min_points,
        }
    }
}
