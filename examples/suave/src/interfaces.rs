//! Interfaces between the vehicle, its functions and their managers.

use slate_plugin::interfaces::Point2;
use slate_plugin::prelude::*;

/// Forces of the six thrusters, forward or up positive.
#[interface]
#[derive(PartialEq)]
pub struct ThrusterForces {
    /// Thruster 1.
    #[unit("N")]
    pub front_right: f64,
    /// Thruster 2.
    #[unit("N")]
    pub front_left: f64,
    /// Thruster 3.
    #[unit("N")]
    pub rear_right: f64,
    /// Thruster 4.
    #[unit("N")]
    pub rear_left: f64,
    /// Thruster 5.
    #[unit("N")]
    pub vertical_right: f64,
    /// Thruster 6.
    #[unit("N")]
    pub vertical_left: f64,
}

impl ThrusterForces {
    /// No force.
    pub const ZERO: Self = Self {
        front_right: 0.0,
        front_left: 0.0,
        rear_right: 0.0,
        rear_left: 0.0,
        vertical_right: 0.0,
        vertical_left: 0.0,
    };

    /// Returns the forces of thrusters 1 to 6.
    pub fn new(forces: [f64; 6]) -> Self {
        let [front_right, front_left, rear_right, rear_left, vertical_right, vertical_left] = forces;
        Self { front_right, front_left, rear_right, rear_left, vertical_right, vertical_left }
    }

    /// Returns the forces of thrusters 1 to 6.
    pub fn all(&self) -> [f64; 6] {
        let Self { front_right, front_left, rear_right, rear_left, vertical_right, vertical_left } = *self;
        [front_right, front_left, rear_right, rear_left, vertical_right, vertical_left]
    }
}

/// Health of the thrusters.
#[interface]
#[derive(PartialEq)]
pub struct ThrusterHealth {
    /// Failed thrusters; bit 0 is thruster 1.
    pub failed: u32,
}

/// Estimate of the vehicle's navigation filter, in the frame of the map.
#[interface]
#[derive(PartialEq)]
pub struct Navigation {
    /// Position to the east.
    #[unit("m")]
    pub x: f64,
    /// Position to the north.
    #[unit("m")]
    pub y: f64,
    /// Above the seabed.
    #[unit("m")]
    pub altitude: f64,
    /// Counter-clockwise from the east.
    #[unit("rad")]
    pub heading: f64,
    /// Velocity to the east.
    #[unit("m/s")]
    pub velocity_x: f64,
    /// Velocity to the north.
    #[unit("m/s")]
    pub velocity_y: f64,
    /// Velocity up.
    #[unit("m/s")]
    pub velocity_z: f64,
    /// Counter-clockwise.
    #[unit("rad/s")]
    pub turn_rate: f64,
}

/// Visibility of the water.
#[interface]
#[derive(PartialEq)]
pub struct WaterVisibility {
    /// Greatest distance at which the camera sees.
    #[unit("m")]
    pub distance: f64,
}

/// Course of the pipeline.
#[interface]
pub struct PipelineCourse {
    /// Corners, in order.
    pub corners: Sequence<Point2, 16>,
}

/// Number of points on a piece of the pipeline.
const POINTS: usize = 20;

impl PipelineCourse {
    /// Returns the number of points of the path along the pipeline.
    pub fn len(&self) -> usize {
        self.corners.len().saturating_sub(1) * POINTS
    }

    /// Returns whether the path has no point.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Returns a point of the path.
    /// The last one for an index beyond the end, the origin for an empty path.
    pub fn point(&self, index: usize) -> Point2 {
        let index = index.min(self.len().saturating_sub(1));
        let (piece, share) = (index / POINTS, (index % POINTS + 1) as f64 / POINTS as f64);
        let (Some(from), Some(to)) = (self.corners.get(piece), self.corners.get(piece + 1)) else {
            return Point2::default();
        };
        Point2 { x: from.x + (to.x - from.x) * share, y: from.y + (to.y - from.y) * share }
    }
}

/// Pipeline in the camera's image.
#[interface]
#[derive(PartialEq)]
pub struct PipelineView {
    /// First point of the path that is seen.
    pub point: u32,
    /// True if any part of the pipeline is seen.
    pub seen: Bool,
}

/// Setpoint of the vehicle.
#[interface]
#[derive(PartialEq)]
pub struct Setpoint {
    /// Position to the east.
    #[unit("m")]
    pub x: f64,
    /// Position to the north.
    #[unit("m")]
    pub y: f64,
    /// Above the seabed.
    #[unit("m")]
    pub altitude: f64,
}

/// Task of the mission.
#[interface]
#[derive(serde::Serialize, serde::Deserialize)]
pub enum VehicleTask {
    /// Search for the pipeline.
    Search,
    /// Inspect it.
    Inspect,
}

/// State of the mission.
#[interface]
#[derive(PartialEq)]
pub struct VehicleMission {
    /// Point of the path at which the pipeline was found.
    pub point: u32,
    /// Present task.
    pub task: VehicleTask,
}

/// Sign of life of a function that is active.
#[interface]
#[derive(PartialEq)]
pub struct FunctionStatus {
    /// Altitude that it keeps; 0 if it keeps none.
    #[unit("m")]
    pub altitude: f64,
}

/// Progress of the inspection.
#[interface]
#[derive(PartialEq)]
pub struct InspectionProgress {
    /// Length of pipeline inspected.
    #[unit("m")]
    pub distance: f64,
}

/// Request to restart a thruster.
#[interface]
#[derive(PartialEq)]
pub struct ThrusterRestart {
    /// Number of the thruster, from 1.
    pub thruster: u32,
}

/// Function of the vehicle.
#[interface]
#[derive(serde::Serialize, serde::Deserialize)]
pub enum Function {
    /// Generate the search path.
    Search,
    /// Follow the pipeline.
    Inspect,
    /// Maintain motion.
    Motion,
}

impl Function {
    /// All functions.
    pub const ALL: [Self; 3] = [Self::SEARCH, Self::INSPECT, Self::MOTION];

    /// Returns whether a task needs the function.
    pub fn serves(self, task: VehicleTask) -> bool {
        match self {
            Self::SEARCH => task == VehicleTask::SEARCH,
            Self::INSPECT => task == VehicleTask::INSPECT,
            _ => true,
        }
    }
}

/// Design of a function: its settings.
#[interface]
pub struct FunctionDesign {
    /// Quality of the function, 0 to 1; 0 for a design that turns it off.
    pub performance: f64,
    /// Visibility that the design requires; 0 for none.
    #[unit("m")]
    pub visibility: f64,
    /// Altitude; 0 if the design has none.
    #[unit("m")]
    pub altitude: f64,
    /// Function.
    pub function: Function,
    /// True if it needs all thrusters.
    pub all_thrusters: Bool,
    /// Name.
    pub name: Text<28>,
    /// Changes of the configuration, each `path=value` as for `slate config set`.
    pub changes: Sequence<Text<92>, 2>,
}

/// Designs of all functions.
#[interface]
pub struct FunctionDesigns {
    /// Designs; of equals, the first one is chosen.
    pub list: Sequence<FunctionDesign, 12>,
}

impl FunctionDesigns {
    /// Iterates over the designs of a function, each with its place in the list.
    pub fn of(&self, function: Function) -> impl Iterator<Item = (usize, &FunctionDesign)> {
        self.list.iter().enumerate().filter(move |(_, design)| design.function == function)
    }

    /// Returns the place of the design that turns a function off.
    pub fn off(&self, function: Function) -> Option<usize> {
        self.of(function).find(|(_, design)| design.performance <= 0.0).map(|(place, _)| place)
    }

    /// Returns the best suitable design of a function; of equals, the first.
    pub fn best(&self, function: Function, is_suitable: impl Fn(&FunctionDesign) -> bool) -> Option<usize> {
        let mut best: Option<(usize, f64)> = None;
        for (place, design) in self.of(function).filter(|(_, design)| is_suitable(design)) {
            if design.performance > best.map_or(0.0, |(_, performance)| performance) {
                best = Some((place, design.performance));
            }
        }
        best.map(|(place, _)| place)
    }

    /// Iterates over the changes of the design at a place.
    pub fn changes(&self, place: usize) -> impl Iterator<Item = &str> {
        let own = self.list.get(place).into_iter().flat_map(|design| design.changes.iter());
        own.map(|change| change.as_str())
    }

    /// Returns the name of the design at a place.
    pub fn name(&self, place: usize) -> &str {
        self.list.get(place).map_or("none", |design| design.name.as_str())
    }
}
