//! Parameters of a wheeled robot's Knowledge.
//! Description, goal, and the rules of the reflexes.

use std::f64::consts::FRAC_PI_2;

use slate_avoidance::{ReflexRules, SensorRule};
use slate_plugin::interfaces::Point2;
use slate_plugin::prelude::*;
use slate_robots::{RobotDevices, SensorProfiles};

use crate::rules::{BumperReleaseRules, GiveWayRules, KeepWallRules, WheeledRules, default_sensor_rules};

/// Parameters of [`WheeledKnowledge`](crate::knowledge::WheeledKnowledge).
#[params]
#[derive(PartialEq)]
pub struct WheeledKnowledgeParams {
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
    #[param(default = 0.0, unit = "m", doc = "x of the goal")]
    pub goal_x: f64,
    #[param(default = 0.0, unit = "m", doc = "y of the goal")]
    pub goal_y: f64,
    #[param(default = Sequence::default(), doc = "goals that the robot visits in turn, meters, in the place of the single one")]
    pub goals: Sequence<Point2, 16>,
    #[param(default = true, doc = "true: the robot has a goal; false: its Plan has another target")]
    pub has_goal: Bool,
    #[param(default = default_sensor_rules(), doc = "distances ahead of the robot's front below which sensors cause a reflex, in meters")]
    pub sensor_rules: Sequence<SensorRule, 4>,
    #[param(default = 0.3, range = 0.0..=5.0, unit = "s", doc = "additional distance of a reflex per speed")]
    pub reaction_time: f64,
    #[param(default = 0.03, range = 0.0..=1.0, unit = "m", doc = "clearance on both sides of the strip ahead below which a reflex follows")]
    pub side_clearance: f64,
    #[param(default = 0.03, range = 0.0..=1.0, unit = "m", doc = "distance from the footprint below which any echo causes a reflex")]
    pub min_clearance: f64,
    #[param(default = 0.6, range = 0.0..=10.0, unit = "m", doc = "free length of a heading that a reflex turns to")]
    pub free_distance: f64,
    #[param(default = 0.02, range = 0.0..=1.0, unit = "m", doc = "additional clearance on both sides of such a heading")]
    pub turn_clearance: f64,
    #[param(default = 0.2, range = 0.01..=10.0, unit = "m", doc = "length of the drive of a reflex")]
    pub drive_distance: f64,
    #[param(default = 0.3, range = 0.01..=3.0, unit = "m/s", doc = "linear velocity of that drive")]
    pub reflex_velocity: f64,
    #[param(default = 0.08, range = 0.0..=0.3, unit = "m", doc = "clearance from another robot below which the robot drives no nearer to it")]
    pub robot_clearance: f64,
    #[param(default = 0.03, range = 0.0..=0.3, unit = "m", doc = "the same of a turn on the spot")]
    pub robot_turn_clearance: f64,
    #[param(default = 0.3, range = 0.0..=10.0, unit = "m", doc = "additional distance of the sonars' rule, if the sonars err")]
    pub error_distance: f64,
    #[param(default = 0.04, range = 0.0..=1.0, unit = "m", doc = "addition to `side_clearance` and `min_clearance`, if the sonars err")]
    pub error_clearance: f64,
    #[param(default = 0.7, range = 0.0..=10.0, unit = "m", doc = "distance of another robot's center below which a standing robot gives way")]
    pub min_separation: f64,
    #[param(default = 1.2, range = 0.0..=FRAC_PI_2, unit = "rad", doc = "bearing from straight ahead or behind within which it gives way")]
    pub max_give_way_bearing: f64,
    #[param(default = 0.2, range = 0.0..=5.0, unit = "m/s", doc = "linear velocity of giving way")]
    pub give_way_velocity: f64,
    #[param(default = 0.15, range = 0.0..=10.0, unit = "m", doc = "range of the sonars in its direction below which it does not give way")]
    pub give_way_clearance: f64,
    #[param(default = 0.05, range = 0.0..=5.0, unit = "m/s", doc = "linear velocity above which a robot drives on and does not give way")]
    pub standing_velocity: f64,
    #[param(default = 0.5, range = -10.0..=10.0, unit = "m", doc = "distance of the robot's center from a wall that it follows on the left; negative: on the right")]
    pub wall_distance: f64,
    #[param(default = 0.3, range = 0.0..=1.2, unit = "m/s", doc = "linear velocity along a wall")]
    pub wall_velocity: f64,
    #[param(default = 1.2, range = 0.1..=5.0, unit = "rad/s", doc = "maximum angular velocity along a wall")]
    pub max_wall_angular_velocity: f64,
    #[param(default = 0.4, range = 0.05..=10.0, unit = "m", doc = "lookahead distance of pure pursuit along a wall")]
    pub wall_lookahead_distance: f64,
    #[param(default = 1.0, range = 0.0..=10.0, unit = "m", doc = "maximum range at which a wall is followed")]
    pub max_wall_range: f64,
    #[param(default = 4.0, range = 0.0..=60.0, unit = "s", doc = "duration of the arc about the end of a wall")]
    pub wall_timeout: f64,
    #[param(default = 0.4, range = 0.0..=FRAC_PI_2, unit = "rad", doc = "tolerance in direction of a sonar that detects a wall beside the robot")]
    pub wall_side_tolerance: f64,
    #[param(default = 0.6, range = 0.0..=FRAC_PI_2, unit = "rad", doc = "tolerance in direction of a sonar that detects an obstacle ahead of a robot that follows a wall")]
    pub wall_front_tolerance: f64,
    #[param(default = 0.3, range = 0.0..=10.0, unit = "m", doc = "margin over the wall distance at which it turns away from an obstacle ahead")]
    pub wall_front_margin: f64,
    #[param(default = 1.0, range = 0.0..=FRAC_PI_2, unit = "rad", doc = "angle by which it turns away from that")]
    pub wall_turn_angle: f64,
    #[param(default = 0.15, range = 0.01..=1.0, unit = "m/s", doc = "linear velocity away from a contact")]
    pub release_velocity: f64,
    #[param(default = 0.12, range = 0.0..=1.0, unit = "m", doc = "distance to travel after a bumper is released")]
    pub release_distance: f64,
    #[param(default = 3.0, range = 0.1..=60.0, unit = "s", doc = "time after which a robot with a bumper that stays pressed stops")]
    pub release_timeout: f64,
}

/// Robot's description and the profiles of its sensors, as parameters name them.
pub(crate) type DescribedRobot = (Text<252>, [Text<28>; 3]);

impl WheeledKnowledgeParams {
    /// Returns the robot's description and the profiles of its sensors.
    pub(crate) fn described(&self) -> DescribedRobot {
        (self.robot, [self.profile, self.sonar, self.robot_sensor])
    }

    /// Reads the description.
    ///
    /// # Errors
    /// Parameters name none, or it is invalid.
    pub(crate) fn devices(&self) -> Result<RobotDevices, Refusal> {
        let Self { profile, sonar, robot_sensor, .. } = self;
        let profiles = SensorProfiles {
            all: profile.as_str(),
            sonar: sonar.as_str(),
            robot_sensor: robot_sensor.as_str(),
        };
        RobotDevices::load(self.robot.as_str(), profiles)
            .map_err(|problem| Refusal(format!("params.{}: {problem}", problem.argument())))
    }

    /// Rules of the reflexes, as they are given: for exact sensors.
    pub fn rules(&self) -> WheeledRules {
        WheeledRules {
            avoid_obstacle: self.avoid_obstacle(),
            give_way: self.give_way(),
            keep_wall: self.keep_wall(),
            bumper_release: self.bumper_release(),
        }
    }

    fn avoid_obstacle(&self) -> ReflexRules {
        ReflexRules {
            reaction_time: self.reaction_time,
            side_clearance: self.side_clearance,
            min_clearance: self.min_clearance,
            free_distance: self.free_distance,
            turn_clearance: self.turn_clearance,
            drive_distance: self.drive_distance,
            linear_velocity: self.reflex_velocity,
            robot_clearance: self.robot_clearance,
            robot_turn_clearance: self.robot_turn_clearance,
            sensors: self.sensor_rules,
        }
    }

    fn give_way(&self) -> GiveWayRules {
        GiveWayRules {
            min_separation: self.min_separation,
            max_bearing: self.max_give_way_bearing,
            linear_velocity: self.give_way_velocity,
            min_clearance: self.give_way_clearance,
            standing_velocity: self.standing_velocity,
        }
    }

    fn keep_wall(&self) -> KeepWallRules {
        KeepWallRules {
            wall_distance: self.wall_distance,
            linear_velocity: self.wall_velocity,
            max_angular_velocity: self.max_wall_angular_velocity,
            lookahead_distance: self.wall_lookahead_distance,
            max_range: self.max_wall_range,
            timeout: self.wall_timeout,
            side_tolerance: self.wall_side_tolerance,
            front_tolerance: self.wall_front_tolerance,
            front_margin: self.wall_front_margin,
            turn_angle: self.wall_turn_angle,
        }
    }

    fn bumper_release(&self) -> BumperReleaseRules {
        BumperReleaseRules {
            linear_velocity: self.release_velocity,
            distance: self.release_distance,
            timeout: self.release_timeout,
        }
    }
}
