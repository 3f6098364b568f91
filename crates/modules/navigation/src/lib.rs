//! Blocks of a robot on wheels that navigates by a laser scanner.
//!
//! | block | here |
//! |---|---|
//! | Analyze | [`LocalCostmap`], the obstacles around the robot; [`GlobalCostmap`], the costs of the map |
//! | Plan | [`RoutePlanner`], paths and actions for the goals of the mission |
//! | Execute | [`NavigationActions`]: `NavigateTo`, `FollowPath`, `Dock`, recoveries, `Halt` |
//! | Knowledge | [`NavigationKnowledge`]: that of any wheeled robot, mission, controller, rules of the collision stop |
//! | ReactiveModel | [`CollisionStop`] |
//!
//! [`ObstacleAvoidance`] is a module of robots without blocks. [`DeliveryReferee`] judges deliveries. The algorithms are those of `slate_planning`, `slate_local_planning` and
//! `slate_navigation_graph`.

mod actions;
mod body;
mod collision_stop;
mod controller;
mod costs;
mod delivery_referee;
mod frames;
mod global_costmap;
mod knowledge;
mod knowledge_params;
mod local_costmap;
mod local_plan;
mod local_window;
mod mission;
mod obstacle_avoidance;
mod obstacles;
mod route_planner;
mod scan_memory;
mod settings;

pub use actions::{
    BackUp, ClearCostmap, Dock, DockArguments, FollowPath, Halt, NavigateTo, NavigateToArguments,
    NavigationActions, Spin, Wait,
};
pub use body::{CostmapClear, NavigationBody};
pub use collision_stop::{CollisionRules, CollisionSensors, CollisionStop};
pub use delivery_referee::{
    DeliveryMetrics, DeliveryReferee, DeliveryRefereeIo, DeliveryRefereeParams, DeliveryRefereeState,
};
pub use global_costmap::{
    GlobalCostmap, GlobalCostmapIo, GlobalCostmapParams, GlobalCostmapState, KeepOutZone,
};
pub use knowledge::{NavigationKnowledge, NavigationKnowledgeState, NavigationModels};
pub use knowledge_params::NavigationKnowledgeParams;
pub use local_costmap::{LocalCostmap, LocalCostmapIo, LocalCostmapParams, LocalCostmapState};
pub use local_plan::{LocalPlan, LocalPlanPoint};
pub use mission::{
    NavigationCommand, NavigationGoal, NavigationMission, NavigationRequest, NavigationState,
    NavigationStatus, PlaceName,
};
pub use obstacle_avoidance::{
    AvoidanceStatus, ObstacleAvoidance, ObstacleAvoidanceIo, ObstacleAvoidanceParams, ObstacleAvoidanceState,
};
pub use obstacles::ObstaclePoints;
pub use route_planner::{RoutePlanner, RoutePlannerIo, RoutePlannerParams, RoutePlannerState};
pub use settings::{ControllerSettings, LocalPlannerChoice};

use slate_plugin::mapek::{AnalyzeBlock, ExecuteBlock, KnowledgeBlock, PlanBlock, ReactiveBlock};
use slate_plugin::prelude::*;

/// Largest number of cells of a costmap.
const MOST_CELLS: usize = 1 << 20;

plugin!(
    AnalyzeBlock<LocalCostmap>,
    AnalyzeBlock<GlobalCostmap>,
    PlanBlock<RoutePlanner>,
    ExecuteBlock<NavigationActions>,
    KnowledgeBlock<NavigationKnowledge>,
    ReactiveBlock<CollisionStop>,
    DeliveryReferee,
    ObstacleAvoidance,
);
