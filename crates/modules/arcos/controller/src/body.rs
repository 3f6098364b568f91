//! Robot that the controller moves, in its world.

use slate_sim::drive::Wheels;
use slate_sim::geometry::Pose;
use slate_sim::robot::RobotDescription;
use slate_sim::world::{DescriptionError, World};
use slate_sim::{Placement, Simulation};

/// Step of the physics, nanoseconds.
const TIME_STEP: u64 = 10_000_000;

/// Pioneer 3-DX among walls.
#[derive(Debug)]
pub struct SimulatedPioneer {
    simulation: Simulation,
    drive: slate_sim::robot::DriveDescription,
}

impl SimulatedPioneer {
    /// Places the robot in a world: the name of a bundled one, or a file's path.
    ///
    /// # Errors
    /// When the world is unknown, or the robot does not fit at its pose.
    pub fn new(world: &str, pose: Pose, seed: u64) -> Result<Self, DescriptionError> {
        let description = RobotDescription::load("pioneer_p3dx")?;
        let drive = description.drive;
        let placement =
            Placement { name: "pioneer".into(), description, sonar: "real".into(), pose, script: None };
        let simulation = Simulation::new(&World::load(world)?, &[placement], seed, TIME_STEP)?;
        Ok(Self { simulation, drive })
    }

    /// Advances the simulation to a time, nanoseconds since the beginning.
    pub fn advance(&mut self, now: u64) {
        while self.simulation.now() + TIME_STEP <= now {
            self.simulation.step();
        }
    }

    /// Sets wheel velocities for `linear` in m/s and `angular` in rad/s.
    pub fn drive(&mut self, linear: f64, angular: f64) {
        let turn = angular * self.drive.track / 2.0;
        let wheels = Wheels {
            left: (linear - turn) / self.drive.wheel_radius,
            right: (linear + turn) / self.drive.wheel_radius,
        };
        self.simulation.command(0, wheels);
    }

    /// Returns the pose from wheel odometry, relative to the start.
    pub fn odometry(&self) -> Pose {
        self.simulation.odometry(0).0
    }

    /// Returns the speeds of the left and the right wheel over the floor, m/s.
    pub fn wheels(&self) -> (f64, f64) {
        let (_, (linear, angular)) = self.simulation.odometry(0);
        let turn = angular * self.drive.track / 2.0;
        (linear - turn, linear + turn)
    }

    /// Updates the sonars' echoes.
    pub fn listen(&mut self) {
        self.simulation.sense();
    }

    /// Returns the last range of a sonar, meters.
    pub fn range(&self, sonar: usize) -> Option<f64> {
        let (echoes, _) = self.simulation.sonar(0)?;
        echoes.get(sonar).map(|echo| echo.range)
    }

    /// Returns the contacts of the front and the rear bumper; true if pressed.
    pub fn bumpers(&self) -> (bool, bool) {
        let bumper_contacts = self.simulation.bumper_contacts(0);
        (bumper_contacts.front, bumper_contacts.back)
    }

    /// Returns the true pose.
    pub fn pose(&self) -> Pose {
        self.simulation.pose(0)
    }
}
