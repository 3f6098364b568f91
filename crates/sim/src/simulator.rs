//! The simulator as a module: it lets the world go on at the beginning of each cycle, with the commands that the
//! actuators got in the last one, and shows what the robots' sensors measure.

use slate_interfaces::{
    Bumper, Chassis, Clearance, Contact, Contacts, Echo, FourWheelSpeeds, LaserScan, Odometry, Orientation,
    Pose2, Position, Quaternion, SensorAccuracy, Sighting, Sightings, SonarPlacement, SonarScan, Transform,
    Twist2, WheelSpeeds,
};
use slate_module::prelude::*;
use slate_module::{
    Description, Instance, Params as _, PortCursor, PortDescription, Stage, Trigger, decode, encode,
};

use crate::drive::{FourWheels, Wheels};
use crate::geometry::{Point, Pose};
use crate::hardware::hardware;
use crate::robot::DriveKind;
use crate::scenario::Scenario;
use crate::simulation::{Placement, Simulation};

/// Command of a robot's two wheels; names of ports begin with the robot's.
#[ports]
struct TwoWheelsIo {
    /// Wheel command.
    #[role("actuation")]
    wheels: Input<WheelSpeeds>,
}

/// Command of a robot's four wheels.
#[ports]
struct FourWheelsIo {
    /// Wheel command.
    #[role("actuation")]
    wheels: Input<FourWheelSpeeds>,
}

/// What each robot knows of its own body.
#[ports]
struct ChassisIo {
    /// Geometry and limits.
    chassis: Output<Chassis>,
    /// Errors of the sensors; nothing as long as they are exact.
    accuracy: Output<SensorAccuracy>,
}

/// Outputs of a robot with sonars.
#[ports]
struct SonarIo {
    /// Scan of the sonars.
    sonar: Output<SonarScan>,
}

/// Outputs of each robot.
#[ports]
struct RobotIo {
    /// Position of the positioning system.
    position: Output<Position>,
    /// Heading of the compass.
    orientation: Output<Orientation>,
    /// Odometry of the wheels.
    odometry: Output<Odometry>,
    /// Where the robot really is; for referees and reports, not for the robot.
    #[role("truth")]
    truth: Output<Pose2>,
    /// True clearance; for referees and reports, not for the robot.
    #[role("truth")]
    clearance: Output<Clearance>,
}

/// Outputs of a robot with bumpers.
#[ports]
struct BumperIo {
    /// State of the bumpers.
    bumper: Output<Bumper>,
}

/// Outputs of a robot with a laser scanner.
#[ports]
struct LaserIo {
    /// Scan of the laser scanner.
    laser: Output<LaserScan>,
    /// Where the laser scanner is mounted on the robot.
    laser_mount: Output<Transform>,
}

/// Outputs of a robot with a detector of robots.
#[ports]
struct SightingsIo {
    /// The robots that it sees.
    sightings: Output<Sightings>,
}

/// Outputs of the world.
#[ports]
struct WorldIo {
    /// The contacts that began in the last cycle; for referees, not for robots.
    #[role("truth")]
    contacts: Output<Contacts>,
}

/// The embedded simulator.
#[derive(Debug)]
pub struct Simulator {
    simulation: Simulation,
    /// Rings as their interface shows them, made once.
    rings: Vec<SonarScan>,
    /// The bodies, which never change.
    chassis: Vec<Chassis>,
    /// Errors of the robots' sensors.
    accuracy: Vec<SensorAccuracy>,
    /// Which ports the robots have.
    abilities: Vec<Abilities>,
    threads: usize,
    started: bool,
}

/// Which ports a robot has.
#[derive(Clone, Copy, Debug)]
struct Abilities {
    drive: DriveKind,
    sonar: bool,
    bumper: bool,
    laser: bool,
    robot_sensor: bool,
}

impl Abilities {
    fn of(scenario: &Scenario, placement: &Placement) -> Self {
        Self {
            drive: placement.description.drive.kind,
            sonar: !placement.sonar.is_empty(),
            bumper: placement.description.bumper.is_some(),
            laser: scenario.lasers.contains_key(&placement.name),
            robot_sensor: placement.robot_sensor().is_some(),
        }
    }

    fn ports(self) -> Vec<PortDescription> {
        let mut ports = match self.drive {
            DriveKind::Differential => TwoWheelsIo::describe(),
            DriveKind::SkidSteer => FourWheelsIo::describe(),
        };
        ports.extend(ChassisIo::describe());
        if self.sonar {
            ports.extend(SonarIo::describe());
        }
        ports.extend(RobotIo::describe());
        if self.bumper {
            ports.extend(BumperIo::describe());
        }
        if self.laser {
            ports.extend(LaserIo::describe());
        }
        if self.robot_sensor {
            ports.extend(SightingsIo::describe());
        }
        ports
    }
}

impl Instance for Simulator {
    const SECTION: &'static str = "world";

    fn describe(setup: &Setup<'_>) -> Result<Description, Refusal> {
        let scenario = scenario(setup)?;
        let mut ports = WorldIo::describe();
        for placement in &scenario.placements {
            for mut port in Abilities::of(&scenario, placement).ports() {
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
            describes_hardware: false,
            hardware: scenario.placements.iter().map(|placement| hardware(&scenario, placement)).collect(),
        })
    }

    fn create(setup: &Setup<'_>, _: &[u8]) -> Result<Self, Refusal> {
        let scenario = scenario(setup)?;
        if !setup.period.is_multiple_of(scenario.step) {
            return Err(format!(
                "the main loop's period ({} ns) is not a multiple of the physics step ({} ns)",
                setup.period, scenario.step
            )
            .into());
        }
        let mut simulation =
            Simulation::new(&scenario.world, &scenario.placements, setup.seed, scenario.step)
                .map_err(|error| Refusal(error.to_string()))?;
        simulation.set_threads(scenario.threads);
        let rings = (0..simulation.robot_count()).map(|robot| ring(&simulation, robot)).collect();
        let chassis = scenario.placements.iter().map(|placement| placement.description.chassis()).collect();
        let accuracy = scenario.placements.iter().map(Placement::accuracy).collect();
        let abilities = scenario.placements.iter().map(|placement| Abilities::of(&scenario, placement));
        let abilities = abilities.collect();
        for (robot, Placement { name, .. }) in scenario.placements.iter().enumerate() {
            if let Some(laser) = scenario.lasers.get(name) {
                simulation.mount_laser(robot, laser, setup.seed);
            }
            simulation.set_faults(robot, scenario.faults.get(name).map_or(&[], Vec::as_slice));
        }
        Ok(Self {
            simulation,
            rings,
            chassis,
            accuracy,
            abilities,
            threads: scenario.threads,
            started: false,
        })
    }

    fn tick(&mut self, ports: &mut PortCursor, _: &[u8], now: &Tick) -> Outcome {
        if self.started {
            self.advance((now.elapsed() * 1e9 + 0.5) as u64);
        }
        let is_first = !self.started;
        self.started = true;
        let contacts = self.simulation.take_contacts();
        ports.with(|io: &WorldIo| {
            if !contacts.is_empty() {
                let list: Vec<_> = contacts.iter().map(report).collect();
                io.contacts.set(Contacts { list: Sequence::new(&list) });
            }
        });
        for robot in 0..self.simulation.robot_count() {
            let Abilities { drive, sonar, bumper, laser, robot_sensor } = self.abilities[robot];
            // A wheel command of now takes effect in the next cycle.
            let wheels = match drive {
                DriveKind::Differential => ports.with(|io: &TwoWheelsIo| two_wheels(io.wheels.get())),
                DriveKind::SkidSteer => ports.with(|io: &FourWheelsIo| four_wheels(io.wheels.get())),
            };
            self.simulation.command(robot, wheels);
            ports.with(|io: &ChassisIo| {
                io.chassis.set(self.chassis[robot]);
                if is_first && self.accuracy[robot] != SensorAccuracy::default() {
                    io.accuracy.set(self.accuracy[robot]);
                }
            });
            if sonar {
                ports.with(|io: &SonarIo| self.hear(robot, io));
            }
            ports.with(|io: &RobotIo| self.show(robot, io));
            if bumper {
                ports.with(|io: &BumperIo| self.feel(robot, io));
            }
            if laser {
                ports.with(|io: &LaserIo| {
                    if is_first {
                        self.tell_mount(robot, io);
                    }
                    self.scan(robot, io);
                });
            }
            if robot_sensor {
                ports.with(|io: &SightingsIo| self.see(robot, io));
            }
        }
        Outcome::Ok
    }

    fn save(&self) -> Result<Vec<u8>, Refusal> {
        encode(&(self.started, &self.simulation))
    }

    fn restore(&mut self, state: &[u8]) -> Result<(), Refusal> {
        let (started, mut simulation): (bool, Simulation) = decode(state)?;
        simulation.set_map_of(&self.simulation);
        (self.started, self.simulation) = (started, simulation);
        self.simulation.set_threads(self.threads);
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

    fn hear(&mut self, robot: usize, io: &SonarIo) {
        if let Some(echoes) = self.simulation.shown_sonar(robot) {
            let mut heard = [Echo::default(); 16];
            for (slot, echo) in heard.iter_mut().zip(echoes) {
                *slot = Echo { range: echo.range, heard: echo.heard.into() };
            }
            let scan = &mut self.rings[robot];
            scan.echoes = Sequence::new(&heard[..echoes.len().min(16)]);
            io.sonar.set(*scan);
        }
    }

    fn show(&mut self, robot: usize, io: &RobotIo) {
        let fix = self.simulation.shown_fix(robot);
        if let Some(Point { x, y }) = fix.position {
            io.position.set(Position { x, y, z: 0.0 });
        }
        if let Some(theta) = fix.orientation {
            io.orientation.set(Orientation { theta });
        }
        if let Some((pose, (linear, angular))) = self.simulation.shown_odometry(robot) {
            io.odometry.set(Odometry { pose: pose2(pose), twist: Twist2 { linear, angular } });
        }
        io.truth.set(pose2(self.simulation.pose(robot)));
        io.clearance.set(Clearance { distance: self.simulation.clearance(robot) });
    }

    fn feel(&self, robot: usize, io: &BumperIo) {
        let felt = self.simulation.felt(robot);
        io.bumper.set(Bumper { front: felt.front.into(), back: felt.back.into() });
    }

    fn tell_mount(&self, robot: usize, io: &LaserIo) {
        let Some(laser) = self.simulation.laser(robot) else { return };
        let [x, y, degrees] = laser.description().mount;
        let half = degrees.to_radians() / 2.0;
        io.laser_mount.set(Transform {
            parent: Text::new("base_link"),
            child: Text::new("laser"),
            translation: Position { x, y, z: 0.0 },
            rotation: Quaternion { z: math::sin(half), w: math::cos(half), ..Quaternion::IDENTITY },
            fixed: true.into(),
            ..Transform::default()
        });
    }

    fn scan(&mut self, robot: usize, io: &LaserIo) {
        let Some((ranges, laser)) = self.simulation.shown_laser(robot) else { return };
        // No scanner has more beams than an output of this interface has room for.
        io.laser.write(ranges.len(), |scan| {
            scan.angle_min = laser.angle_of(0);
            scan.angle_increment = laser.increment();
            scan.range_min = laser.range_min;
            scan.range_max = laser.range_max;
            scan.ranges.copy_from_slice(ranges);
        });
    }

    fn see(&mut self, robot: usize, io: &SightingsIo) {
        // An older measurement is there already.
        let Some(seen) = self.simulation.shown_sightings(robot) else { return };
        let mut list = [None; 8];
        let length = list.iter_mut().zip(seen).map(|(slot, sighting)| *slot = Some(*sighting)).count();
        let list = list.map(|sighting| {
            sighting.map_or_else(Sighting::default, |seen| {
                let name = Text::new(self.simulation.name(seen.robot));
                Sighting { range: seen.range, bearing: seen.bearing, name }
            })
        });
        io.sightings.set(Sightings { list: Sequence::new(&list[..length]) });
    }
}

/// The wheels stand before the first command.
fn two_wheels(wheels: Option<&WheelSpeeds>) -> FourWheels {
    let WheelSpeeds { left, right } = wheels.copied().unwrap_or(WheelSpeeds::ZERO);
    Wheels { left, right }.into()
}

fn four_wheels(wheels: Option<&FourWheelSpeeds>) -> FourWheels {
    let wheels = wheels.copied().unwrap_or(FourWheelSpeeds::ZERO);
    let FourWheelSpeeds { front_left, front_right, back_left, back_right } = wheels;
    FourWheels { front_left, front_right, back_left, back_right }
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
