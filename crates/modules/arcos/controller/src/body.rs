//! The robot that the controller moves, in its world.

use slate_sim::drive::Wheels;
use slate_sim::geometry::Pose;
use slate_sim::robot::RobotDescription;
use slate_sim::world::{DescriptionError, World};
use slate_sim::{Placement, Simulation};

/// A step of the physics, nanoseconds.
const STEP: u64 = 10_000_000;

/// A Pioneer 3-DX among walls.
#[derive(Debug)]
pub struct SimulatedPioneer {
    simulation: Simulation,
    drive: slate_sim::robot::DriveDescription,
}

impl SimulatedPioneer {
    /// Puts the robot into a world, by the name of one that comes with the simulator or by a file's path.
    ///
    /// # Errors
    /// When the world is unknown, or the robot does not fit at its pose.
    pub fn new(world: &str, pose: Pose, seed: u64) -> Result<Self, DescriptionError> {
        let description = RobotDescription::load("pioneer_p3dx")?;
        let drive = description.drive;
        let placement =
            Placement { name: "pioneer".into(), description, sonar: "real".into(), pose, script: None };
        let simulation = Simulation::new(&World::load(world)?, &[placement], seed, STEP)?;
        Ok(Self { simulation, drive })
    }

    /// Lets time pass up to that one, nanoseconds since the beginning.
    pub fn advance(&mut self, now: u64) {
        while self.simulation.now() + STEP <= now {
            self.simulation.step();
        }
    }

    /// Turns the wheels so that the robot drives at `linear` m/s and turns at `angular` rad/s.
    pub fn drive(&mut self, linear: f64, angular: f64) {
        let turn = angular * self.drive.track / 2.0;
        let wheels = Wheels {
            left: (linear - turn) / self.drive.wheel_radius,
            right: (linear + turn) / self.drive.wheel_radius,
        };
        self.simulation.command(0, wheels);
    }

    /// Where the wheels say the robot is, since it was put there.
    pub fn odometry(&self) -> Pose {
        self.simulation.odometry(0).0
    }

    /// The speeds of the left and the right wheel over the floor, m/s.
    pub fn wheels(&self) -> (f64, f64) {
        let (_, (linear, angular)) = self.simulation.odometry(0);
        let turn = angular * self.drive.track / 2.0;
        (linear - turn, linear + turn)
    }

    /// Lets the sonars hear.
    pub fn listen(&mut self) {
        self.simulation.sense();
    }

    /// Last range of a sonar, metres.
    pub fn range(&self, sonar: usize) -> Option<f64> {
        let (echoes, _) = self.simulation.sonar(0)?;
        echoes.get(sonar).map(|echo| echo.range)
    }

    /// Whether anything presses on the front bumper, and on the back one.
    pub fn bumpers(&self) -> (bool, bool) {
        let felt = self.simulation.felt(0);
        (felt.front, felt.back)
    }

    /// Where the robot really is.
    pub fn pose(&self) -> Pose {
        self.simulation.pose(0)
    }
}
