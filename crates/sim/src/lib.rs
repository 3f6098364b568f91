//! Embedded simulator: worlds and robots as data, physics, sensors and contacts.
//! It is a time source.
//!
//! Everything depends on the seed alone: the same seed gives the same bytes in every build and on every machine.

mod accuracy;
mod camera;
pub mod contact;
pub mod devices;
pub mod door;
pub mod drive;
mod error;
pub mod fault;
pub mod geometry;
pub mod grid;
mod hardware;
pub mod inertial;
pub mod laser;
pub mod layout;
mod map_path;
pub mod people;
pub mod positioning;
mod profile;
mod rate;
mod referee;
mod render;
pub mod robot;
pub mod robot_sensor;
mod rough_ground;
pub mod scenario;
mod scenery;
pub mod script;
mod section;
mod sensors;
pub mod shortest_path;
pub mod simulation;
mod simulator;
pub mod sonar;
pub mod surroundings;
pub mod touching;
mod viewpoint;
mod wall_map;
mod workers;
pub mod world;
mod world_map;

use slate_mapek::{actuator, sensor};
use slate_module::{ModuleKind, Plugin};

pub use error::DescriptionError;
pub use referee::{Metrics, Pursuit, PursuitReferee, Referee, Stay};
pub use render::RenderedWorld;
pub use scenario::Scenario;
pub use simulation::{MovingBodies, Placement, Simulation};
pub use simulator::Simulator;
pub use wall_map::WorldMap;

/// Returns the plugin with the simulator's modules.
pub fn plugin() -> Plugin {
    Plugin::new(
        "simulation",
        [
            ModuleKind::instance::<Simulator>(
                "simulator",
                "Steps a world, and publishes the measurements of its robots' sensors.",
            ),
            ModuleKind::instance::<Referee>("referee", "Judges whether a robot reaches its goals in time."),
            ModuleKind::instance::<PursuitReferee>(
                "pursuit_referee",
                "Judges whether a robot follows another at a safe distance.",
            ),
            sensor::<devices::SimulatedSonar>(),
            sensor::<devices::SimulatedPosition>(),
            sensor::<devices::SimulatedOrientation>(),
            sensor::<devices::SimulatedOdometry>(),
            sensor::<devices::SimulatedLaser>(),
            sensor::<devices::SimulatedBumper>(),
            sensor::<devices::SimulatedAccuracy>(),
            sensor::<devices::SimulatedRobotSensor>(),
            sensor::<devices::SimulatedImu>(),
            sensor::<devices::SimulatedCamera>(),
            sensor::<devices::SimulatedPanTilt>(),
            actuator::<devices::SimulatedWheels>(),
            actuator::<devices::SimulatedSkidSteerWheels>(),
            actuator::<devices::SimulatedOmniWheels>(),
            actuator::<devices::SimulatedOmniTwist>(),
        ],
    )
}
