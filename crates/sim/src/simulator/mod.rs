//! Simulator module.
//! At the beginning of each cycle it advances the world with the actuator commands of the last one, and publishes the
//! measurements of the robots' sensors.

mod convert;
mod imaging;
mod ports;

use std::sync::Arc;

use slate_interfaces::{
    Bumper, Chassis, Clearance, Contacts, DoorState, Echo, HolonomicTwist, Odometry, OmniWheelSpeeds,
    Orientation, Position, SensorAccuracy, Sighting, Sightings, SonarScan, Twist2,
};
use slate_module::prelude::*;
use slate_module::{
    Description, Instance, Params as _, PortCursor, PortDescription, Stage, Trigger, decode, encode,
};

use crate::drive::Velocity;
use crate::geometry::Point;
use crate::hardware::hardware;
use crate::render::RenderedWorld;
use crate::robot::DriveKind;
use crate::scenario::Scenario;
use crate::simulation::{Placement, Simulation};
use convert::{four_wheels, measured, mount, pose2, report, ring, two_wheels};
use ports::{
    Abilities, BumperIo, CameraIo, ChassisIo, DoorIo, FourWheelsIo, HeadIo, ImuIo, LaserIo, OmniIo, PersonIo,
    RobotIo, SightingsIo, SonarIo, TwoWheelsIo, WorldIo,
};

/// Embedded simulator.
#[derive(Debug)]
pub struct Simulator {
    simulation: Simulation,
    /// Sonar scans of the robots, prepared once.
    rings: Vec<SonarScan>,
    /// Chassis of the robots, which never change.
    chassis: Vec<Chassis>,
    /// Errors of the robots' sensors.
    accuracy: Vec<SensorAccuracy>,
    /// Ports of each robot.
    abilities: Vec<Abilities>,
    threads: usize,
    started: bool,
}

impl Instance for Simulator {
    const SECTION: &'static str = "world";

    fn describe(setup: &Setup<'_>) -> Result<Description, Refusal> {
        let scenario = scenario(setup)?;
        let mut ports = WorldIo::describe();
        let mut add = |name: &str, own: Vec<PortDescription>| {
            let named =
                |port: PortDescription| PortDescription { name: format!("{name}/{}", port.name), ..port };
            ports.extend(own.into_iter().map(named));
        };
        for placement in &scenario.placements {
            add(&placement.name, Abilities::of(&scenario, placement).ports());
        }
        let people = scenario.moving.people.iter().flat_map(|people| people.starts());
        people.for_each(|(name, _)| add(name, PersonIo::describe()));
        scenario.moving.doors.keys().for_each(|name| add(name, DoorIo::describe()));
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
        let mut simulation = Simulation::with_moving(
            &scenario.world,
            &scenario.placements,
            &scenario.moving,
            setup.seed,
            scenario.step,
        )
        .map_err(|error| Refusal(error.to_string()))?;
        simulation.set_threads(scenario.threads);
        let rings = (0..simulation.robot_count()).map(|robot| ring(&simulation, robot)).collect();
        let chassis = scenario.placements.iter().map(|placement| placement.description.chassis()).collect();
        let accuracy = scenario.placements.iter().map(Placement::accuracy).collect();
        let abilities = scenario.placements.iter().map(|placement| Abilities::of(&scenario, placement));
        let abilities = abilities.collect();
        // Painted once, and only for cameras.
        let mut world = None;
        let paint = || Arc::new(RenderedWorld::new(&scenario.world, scenario.moving.people.is_some()));
        for (robot, placement) in scenario.placements.iter().enumerate() {
            let name = &placement.name;
            if let Some(laser) = scenario.lasers.get(name) {
                simulation.mount_laser(robot, laser, setup.seed);
            }
            if scenario.imus.contains(name) {
                simulation.mount_imu(robot, placement.imu(), setup.seed);
            }
            if let Some(camera) = scenario.cameras.get(name) {
                simulation.mount_camera(robot, camera, world.get_or_insert_with(paint), setup.seed);
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
            let Abilities { drive, sonar, bumper, laser, robot_sensor, imu, camera, head } =
                self.abilities[robot];
            // A wheel command of now takes effect in the next cycle.
            match drive {
                DriveKind::Differential => {
                    let wheels = ports.with(|io: &TwoWheelsIo| two_wheels(io.wheels.get()));
                    self.simulation.command(robot, wheels);
                }
                DriveKind::SkidSteer => {
                    let wheels = ports.with(|io: &FourWheelsIo| four_wheels(io.wheels.get()));
                    self.simulation.command(robot, wheels);
                }
                DriveKind::Omni => ports.with(|io: &OmniIo| self.command_omni(robot, io)),
            }
            ports.with(|io: &ChassisIo| {
                io.chassis.set(self.chassis[robot]);
                if is_first && self.accuracy[robot] != SensorAccuracy::default() {
                    io.accuracy.set(self.accuracy[robot]);
                }
            });
            if sonar {
                ports.with(|io: &SonarIo| self.publish_echoes(robot, io));
            }
            ports.with(|io: &RobotIo| self.show(robot, io));
            if bumper {
                ports.with(|io: &BumperIo| self.feel(robot, io));
            }
            if laser {
                ports.with(|io: &LaserIo| {
                    if is_first {
                        self.publish_mount(robot, io);
                    }
                    self.scan(robot, io);
                });
            }
            if robot_sensor {
                ports.with(|io: &SightingsIo| self.see(robot, io));
            }
            if imu {
                ports.with(|io: &ImuIo| self.show_imu(robot, io, is_first));
            }
            if camera.is_some() {
                ports.with(|io: &CameraIo| imaging::show_image(&mut self.simulation, robot, io, is_first));
            }
            if head {
                ports.with(|io: &HeadIo| imaging::move_head(&mut self.simulation, robot, io, now.now()));
            }
        }
        self.show_moving(ports);
        Outcome::Ok
    }

    fn save(&self) -> Result<Vec<u8>, Refusal> {
        encode(&(self.started, &self.simulation))
    }

    fn restore(&mut self, state: &[u8]) -> Result<(), Refusal> {
        let (started, simulation) = decode(state)?;
        self.started = started;
        self.simulation.resume(simulation);
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

    fn command_omni(&mut self, robot: usize, io: &OmniIo) {
        let (wheels, twist) = (io.wheels.get(), io.twist.get());
        match twist.filter(|_| wheels.is_none() || io.twist.stamp().time > io.wheels.stamp().time) {
            Some(HolonomicTwist { x, y, angular }) => {
                let velocity = Velocity { forward: *x, left: *y, turn: *angular };
                self.simulation.command_velocity(robot, velocity);
            }
            // The wheels stand before the first command.
            None => {
                let OmniWheelSpeeds { speeds } = wheels.copied().unwrap_or(OmniWheelSpeeds::ZERO);
                self.simulation.command_omni(robot, speeds);
            }
        }
    }

    fn publish_echoes(&mut self, robot: usize, io: &SonarIo) {
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

    fn show_moving(&self, ports: &mut PortCursor) {
        for (_, pose) in self.simulation.people() {
            ports.with(|io: &PersonIo| io.truth.set(pose2(pose)));
        }
        for (_, leaf, opening) in self.simulation.doors() {
            ports.with(|io: &DoorIo| {
                io.door.set(DoorState { opening, is_open: (opening >= 1.0).into() });
                io.truth.set(pose2(leaf));
            });
        }
    }

    fn feel(&self, robot: usize, io: &BumperIo) {
        let bumper_contacts = self.simulation.bumper_contacts(robot);
        io.bumper.set(Bumper { front: bumper_contacts.front.into(), back: bumper_contacts.back.into() });
    }

    fn publish_mount(&self, robot: usize, io: &LaserIo) {
        let Some(laser) = self.simulation.laser(robot) else { return };
        io.laser_mount.set(mount("laser", laser.description().mount));
    }

    fn show_imu(&mut self, robot: usize, io: &ImuIo, is_first: bool) {
        if let Some(imu) = self.simulation.imu(robot).filter(|_| is_first) {
            io.imu_mount.set(mount("imu", imu.mount));
        }
        let Some(reading) = self.simulation.shown_imu(robot) else { return };
        let Some(imu) = self.simulation.imu(robot) else { return };
        io.imu.set(measured(&reading, imu));
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
