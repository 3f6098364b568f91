//! The simulator as a module: it lets the world go on at the beginning of each cycle, with the commands that the
//! actuators got in the last one, and shows what the robots' sensors measure.

use slate_interfaces::{
    Clearance, Contact, Contacts, Echo, Odometry, Orientation, Pose2, Position, SonarPlacement, SonarScan,
    Twist2, WheelSpeeds,
};
use slate_module::prelude::*;
use slate_module::{Description, Instance, Params as _, PortCursor, Stage, Trigger, decode, encode};

use crate::drive::Wheels;
use crate::geometry::Pose;
use crate::scenario::Scenario;
use crate::simulation::Simulation;

/// What a robot of the world offers; each port's name begins with the robot's.
#[ports]
struct RobotIo {
    /// What the wheels are told.
    wheels: Input<WheelSpeeds>,
    /// What the sonars heard.
    sonar: Output<SonarScan>,
    /// What the positioning system says.
    position: Output<Position>,
    /// What the compass says.
    orientation: Output<Orientation>,
    /// What the wheels' encoders say.
    odometry: Output<Odometry>,
    /// Where the robot really is; for judges and reports, not for the robot.
    truth: Output<Pose2>,
    /// How far the nearest other body really is; for judges and reports, not for the robot.
    clearance: Output<Clearance>,
}

/// What the world offers beside its robots.
#[ports]
struct WorldIo {
    /// The contacts that began in the last cycle.
    contacts: Output<Contacts>,
}

/// The embedded simulator.
#[derive(Debug)]
pub struct Simulator {
    simulation: Simulation,
    /// Rings as their interface shows them, made once.
    rings: Vec<SonarScan>,
    started: bool,
}

impl Instance for Simulator {
    const SECTION: &'static str = "world";

    fn describe(setup: &Setup<'_>) -> Result<Description, Refusal> {
        let scenario = scenario(setup)?;
        let mut ports = WorldIo::describe();
        for placement in &scenario.placements {
            for mut port in RobotIo::describe() {
                port.name = format!("{}/{}", placement.name, port.name);
                ports.push(port);
            }
        }
        Ok(Description {
            ports,
            params: <()>::DESCRIPTOR,
            parameters: <()>::parameters(),
            stage: Stage::PreLoop,
            trigger: Trigger::Stage,
            deadline: None,
            unique: String::new(),
        })
    }

    fn create(setup: &Setup<'_>, _: &[u8]) -> Result<Self, Refusal> {
        let scenario = scenario(setup)?;
        if !setup.period.is_multiple_of(scenario.step) {
            return Err(format!(
                "the main loop's period ({} ns) is no multiple of the physics step ({} ns)",
                setup.period, scenario.step
            )
            .into());
        }
        let simulation = Simulation::new(&scenario.world, &scenario.placements, setup.seed, scenario.step)
            .map_err(|error| Refusal(error.to_string()))?;
        let rings = (0..simulation.robot_count()).map(|robot| ring(&simulation, robot)).collect();
        Ok(Self { simulation, rings, started: false })
    }

    fn tick(&mut self, ports: &mut PortCursor, _: &[u8], now: &Tick) -> Outcome {
        if self.started {
            self.advance((now.elapsed() * 1e9 + 0.5) as u64);
        }
        self.started = true;
        let contacts = self.simulation.take_contacts();
        ports.with(|io: &WorldIo| {
            if !contacts.is_empty() {
                let list: Vec<_> = contacts.iter().map(report).collect();
                io.contacts.set(Contacts { list: Sequence::new(&list) });
            }
        });
        for robot in 0..self.simulation.robot_count() {
            ports.with(|io: &RobotIo| self.show(robot, io));
        }
        Outcome::Ok
    }

    fn save(&self) -> Result<Vec<u8>, Refusal> {
        encode(&(self.started, &self.simulation))
    }

    fn restore(&mut self, state: &[u8]) -> Result<(), Refusal> {
        (self.started, self.simulation) = decode(state)?;
        Ok(())
    }
}

fn scenario(setup: &Setup<'_>) -> Result<Scenario, Refusal> {
    let table = setup.section.ok_or("the simulator needs a [world] table")?;
    Scenario::new(table, setup.seed).map_err(|error| Refusal(error.to_string()))
}

impl Simulator {
    fn advance(&mut self, nanoseconds: u64) {
        for _ in 0..nanoseconds / self.simulation.step_time() {
            self.simulation.step();
        }
        self.simulation.sense();
    }

    fn show(&mut self, robot: usize, io: &RobotIo) {
        // What the wheels are told now takes effect in the next cycle.
        self.simulation.command(robot, Wheels { left: io.wheels.left, right: io.wheels.right });
        if let Some((echoes, _)) = self.simulation.sonar(robot) {
            let mut heard = [Echo::default(); 16];
            for (slot, echo) in heard.iter_mut().zip(echoes) {
                *slot = Echo { range: echo.range, heard: echo.heard.into(), reserved: [0; 7] };
            }
            let scan = &mut self.rings[robot];
            scan.echoes = Sequence::new(&heard[..echoes.len().min(16)]);
            io.sonar.set(*scan);
        }
        let measured = self.simulation.measured_pose(robot);
        io.position.set(Position { x: measured.x, y: measured.y, z: 0.0 });
        io.orientation.set(Orientation { theta: measured.theta });
        let (pose, (linear, angular)) = self.simulation.odometry(robot);
        io.odometry.set(Odometry { pose: pose2(pose), twist: Twist2 { linear, angular } });
        io.truth.set(pose2(self.simulation.pose(robot)));
        io.clearance.set(Clearance { distance: self.simulation.clearance(robot) });
    }
}

fn pose2(pose: Pose) -> Pose2 {
    Pose2 { x: pose.x, y: pose.y, theta: pose.theta }
}

fn report(contact: &crate::contact::Contact) -> Contact {
    Contact {
        time: contact.time,
        robot: Text::new(&contact.robot),
        other: Text::new(&contact.other),
        caused: contact.caused.into(),
        caused_by_other: contact.caused_by_other.into(),
        reserved: [0; 6],
    }
}

fn ring(simulation: &Simulation, robot: usize) -> SonarScan {
    let Some((_, ring)) = simulation.sonar(robot) else { return SonarScan::default() };
    let description = ring.description();
    let placements: Vec<_> = description
        .placements
        .iter()
        .map(|[x, y, degrees]| SonarPlacement { x: *x, y: *y, theta: degrees.to_radians() })
        .collect();
    SonarScan {
        field_of_view: description.field_of_view,
        range_min: description.range_min,
        range_max: description.range_max,
        placements: Sequence::new(&placements),
        echoes: Sequence::default(),
    }
}
