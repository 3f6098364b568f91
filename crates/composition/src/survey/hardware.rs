//! Consistency of a RobotModel with the robot's devices and its blocks' needs.

use std::fmt::Write;

use slate_module::role::MEASUREMENT;
use slate_module::{Direction, Hardware, HardwareDevice};

use super::block::Block;
use super::names::{split_module, split_port};
use super::{LinkEnd, LinkSource, Survey, scope};
use crate::diagnostic_collector::DiagnosticCollector;
use slate_configuration::{Configuration, ErrorCode, Span};

/// Tolerance of a calibrated drive, relative to that of its driver.
const CALIBRATION_TOLERANCE: f64 = 0.05;

/// Tolerance of equal mounts, m and rad.
const MOUNT_TOLERANCE: f64 = 1e-6;

/// Reports RobotModels of another robot, or without devices that blocks need.
///
/// Robots with modules whose plugins are not loaded (`dormant`) are skipped.
pub(super) fn check_hardware<'a>(
    configuration: &'a Configuration,
    dormant: &[&str],
    survey: &Survey<'a>,
    collector: &mut DiagnosticCollector<'a>,
) {
    for (knowledge, surveyed) in survey.modules.iter().enumerate() {
        let robot = scope(&surveyed.module.name.value);
        let is_known = Block::of(&surveyed.description) == Some(Block::Knowledge)
            && !robot.is_empty()
            && !dormant.iter().any(|name| scope(name) == robot);
        let Some(model) = surveyed.description.hardware.first().filter(|_| is_known) else { continue };
        let checked = RobotModelCheck { configuration, survey, knowledge, robot, model };
        // Consequences of another robot's model are not reported too.
        let found = checked.devices(collector).or_else(|| checked.commands()).or_else(|| checked.sensors());
        if let Some((message, help)) = found {
            collector.add(checked.place(knowledge, model), ErrorCode::Hardware.of(message), help);
        }
    }
}

/// Check of a robot's RobotModel.
struct RobotModelCheck<'s, 'a> {
    configuration: &'a Configuration,
    survey: &'s Survey<'a>,
    /// Module that has the RobotModel.
    knowledge: usize,
    robot: &'s str,
    model: &'s Hardware,
}

impl<'s> RobotModelCheck<'s, '_> {
    /// Returns the setting that names a module's hardware, or else the module's name.
    fn place(&self, module: usize, hardware: &Hardware) -> Span {
        let module = self.survey.modules[module].module;
        let prefix = format!("{}: ", hardware.setting);
        let place = module.place_of(&prefix).or_else(|| self.configuration.place_of(&prefix));
        place.unwrap_or(module.name.span)
    }

    fn name(&self, module: usize) -> &'s str {
        &self.survey.modules[module].module.name.value
    }

    /// Returns whether a module belongs to the robot.
    fn is_own(&self, module: usize) -> bool {
        scope(self.name(module)) == self.robot
    }

    fn block(&self, module: usize) -> Option<Block> {
        Block::of(&self.survey.modules[module].description)
    }

    /// Returns the hardware that a port of a simulator or driver belongs to.
    fn hardware_of(&self, module: usize, port: usize) -> Option<&'s Hardware> {
        if self.block(module) == Some(Block::Knowledge) {
            return None;
        }
        let description = &self.survey.modules[module].description;
        let name = &description.ports[port].name;
        description.hardware.iter().find(|hardware| name.starts_with(&hardware.ports))
    }

    /// Returns the simulators and drivers of the robot, with their hardware.
    /// These are the ones that the robot moves, and others that its Sensors read.
    fn own_hardware(&self) -> Vec<(usize, &'s Hardware)> {
        let (mut moved, mut read): (Vec<(usize, &Hardware)>, Vec<_>) = (Vec::new(), Vec::new());
        for resolved in &self.survey.links {
            let (reader, LinkEnd::Port(port)) = resolved.port else { continue };
            let commands = match resolved.target {
                LinkSource::Port(writer, _) => {
                    self.is_own(writer) && self.block(writer) == Some(Block::Actuator)
                }
                LinkSource::Command(gate) => {
                    scope(&self.configuration.actuators()[gate].name.value) == self.robot
                }
                _ => false,
            };
            if let Some(hardware) = self.hardware_of(reader, port).filter(|_| commands) {
                moved.push((reader, hardware));
            }
            if let LinkSource::Port(writer, output) = resolved.target
                && self.is_own(reader)
                && self.block(reader) == Some(Block::Sensor)
                && let Some(hardware) = self.hardware_of(writer, output)
            {
                read.push((writer, hardware));
            }
        }
        // A Sensor may read a part of another robot of the simulator that moves this one.
        read.retain(|(module, _)| !moved.iter().any(|(other, _)| other == module));
        moved.append(&mut read);
        let mut own: Vec<(usize, &Hardware)> = Vec::new();
        for (module, hardware) in moved {
            if !own.iter().any(|(other, known)| *other == module && known.ports == hardware.ports) {
                own.push((module, hardware));
            }
        }
        own
    }

    /// Compares the robot's devices with its RobotModel.
    /// Returns the error and the help if they differ.
    fn devices(&self, collector: &DiagnosticCollector<'_>) -> Option<(String, String)> {
        self.own_hardware().into_iter().find_map(|(module, hardware)| {
            let found = differences(self.model, hardware);
            if found.is_empty() {
                return None;
            }
            let (knowledge, device) = (self.name(self.knowledge), self.name(module));
            let place = collector.place(self.place(module, hardware));
            let message = format!(
                "the RobotModel of `{}` is that of a `{}`, and `{device}` has a `{}` there ({place}): {}",
                self.robot,
                self.model.robot,
                hardware.robot,
                found.join("; ")
            );
            let other = setting(device, hardware);
            let help = format!("name one robot in {} and in {other}", setting(knowledge, self.model));
            Some((message, help))
        })
    }

    /// Finds a command of Execute whose interface differs from that in the RobotModel.
    fn commands(&self) -> Option<(String, String)> {
        let gates = self.configuration.actuators().iter();
        gates.filter(|gate| scope(&gate.name.value) == self.robot).find_map(|gate| {
            let name = gate.name.value.rsplit('/').next().unwrap_or_default();
            let listed = self.model.actuator(name)?;
            gate.commands.iter().find_map(|command| {
                let path = command.value.path_in("");
                let (module, rest) = split_module(&self.survey.modules, &path)?;
                let ports = &self.survey.modules[module].description.ports;
                let port = ports.iter().find(|port| port.name == split_port(ports, rest).0)?;
                if port.direction != Direction::Command || port.descriptor.name == listed.interface {
                    return None;
                }
                let message = format!(
                    "`/{path}` commands `{}` by {}, and the RobotModel of `{}`, a `{}`, has `{name}` for {}",
                    gate.name.value, port.descriptor.name, self.robot, self.model.robot, listed.interface
                );
                Some((message, self.help(&format!("an Execute that commands {}", listed.interface))))
            })
        })
    }

    /// Finds a block that reads a device which the RobotModel lacks but could list.
    /// The block is a Monitor, a ReactiveModel or an Execute.
    fn sensors(&self) -> Option<(String, String)> {
        let modules = &self.survey.modules;
        self.survey.links.iter().find_map(|resolved| {
            let ((reader, LinkEnd::Port(port)), LinkSource::Port(sensor, output)) =
                (resolved.port, resolved.target)
            else {
                return None;
            };
            let block = self.block(reader).filter(|block| {
                matches!(block, Block::Monitor | Block::Reactive | Block::Execute) && self.is_own(reader)
            })?;
            let measured = &modules[sensor].description.ports[output];
            let is_device = measured.role == MEASUREMENT && self.is_own(sensor) && !self.is_derived(sensor);
            let interface = measured.descriptor.name;
            let mut inputs = modules[self.knowledge].description.ports.iter();
            let can_list = inputs
                .any(|port| port.role == MEASUREMENT && port.descriptor.hash == measured.descriptor.hash);
            if !is_device || !can_list || !modules[reader].module.enabled.value {
                return None;
            }
            if self.model.sensor(interface).is_some() {
                return None;
            }
            let message = format!(
                "{} `{}` needs a sensor of {interface} for `{}`, and the RobotModel of `{}`, a `{}`, has {}",
                noun(block),
                self.name(reader),
                modules[reader].description.ports[port].name,
                self.robot,
                self.model.robot,
                list(&self.model.sensors)
            );
            Some((message, self.help(&format!("a robot with one, or remove `{}`", self.name(reader)))))
        })
    }

    /// Returns whether a Sensor derives its measurements from other Sensors.
    fn is_derived(&self, sensor: usize) -> bool {
        self.survey.links.iter().any(|resolved| {
            matches!(resolved.target, LinkSource::Port(source, _)
                if resolved.port.0 == sensor && self.block(source) == Some(Block::Sensor))
        })
    }

    fn help(&self, other: &str) -> String {
        let knowledge = self.name(self.knowledge);
        format!("name the robot that it is in {}, or choose {other}", setting(knowledge, self.model))
    }
}

/// Returns the setting that names a module's hardware description, in words.
fn setting(module: &str, hardware: &Hardware) -> String {
    match hardware.setting.as_str() {
        "" => format!("`{module}`"),
        setting if setting.starts_with("params.") => format!("`{setting}` of `{module}`"),
        setting => format!("`{setting}`"),
    }
}

fn noun(block: Block) -> &'static str {
    match block {
        Block::Monitor => "Monitor",
        Block::Reactive => "ReactiveModel",
        _ => "Execute",
    }
}

/// Returns the names of devices with their interfaces.
fn list(devices: &[HardwareDevice]) -> String {
    let names: Vec<_> =
        devices.iter().map(|device| format!("`{}` ({})", device.name, device.interface)).collect();
    if names.is_empty() { "no sensor".into() } else { names.join(", ") }
}

/// Lists the differences between a device and a RobotModel.
/// Properties that only one of them specifies are skipped.
fn differences(model: &Hardware, device: &Hardware) -> Vec<String> {
    let mut found = Vec::new();
    if let (Some(expected), Some(is)) = (model.drive, device.drive) {
        let mut compare = |what: &str, expected: f64, is: f64| {
            if (expected - is).abs() > CALIBRATION_TOLERANCE * is.abs() {
                found.push(format!("{what} of {is} m, not {expected} m"));
            }
        };
        compare("wheels with a radius", expected.wheel_radius, is.wheel_radius);
        compare("a track", expected.track, is.track);
    }
    for is in &device.actuators {
        if let Some(expected) = model.actuator(&is.name).filter(|expected| expected.interface != is.interface)
        {
            found.push(format!("`{}` for {}, not {}", is.name, is.interface, expected.interface));
        }
    }
    for is in &device.sensors {
        let Some(expected) = model.sensor(&is.interface) else { continue };
        if expected.count < is.count {
            found.push(format!("`{}` with {} elements, not {}", expected.name, is.count, expected.count));
        }
        let differs = expected.mount.iter().zip(&is.mount).any(|(a, b)| (a - b).abs() > MOUNT_TOLERANCE);
        if differs {
            found.push(format!(
                "`{}` mounted at {}, not {}",
                expected.name,
                mount(is.mount),
                mount(expected.mount)
            ));
        }
    }
    found
}

fn mount([x, y, heading]: [f64; 3]) -> String {
    let mut text = format!("{x:.3} m, {y:.3} m");
    if heading.abs() > MOUNT_TOLERANCE {
        // A string takes what is written.
        let _ = write!(text, ", {heading:.3} rad");
    }
    text
}
