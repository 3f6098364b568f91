//! RobotModel of a robot: it lists the Sensors that the robot's Knowledge reads.
//! Other blocks find their sensors there (RoCS, 4.2).

use slate_module::role::MEASUREMENT;
use slate_module::{Direction, PortDescription};

use super::block::{Block, is_sensed};
use super::{LinkEnd, LinkSource, Survey, scope};
use crate::diagnostic_collector::DiagnosticCollector;
use slate_configuration::{Configuration, ErrorCode};

/// Reports missing sensors of Monitors, and unlisted ones of other blocks.
/// The other blocks are ReactiveModels and Executes.
///
/// Robots with modules whose plugins are not loaded (`dormant`) are skipped.
pub(super) fn check_robot_models<'a>(
    configuration: &'a Configuration,
    dormant: &[&str],
    survey: &Survey<'a>,
    collector: &mut DiagnosticCollector<'a>,
) {
    for module in 0..survey.modules.len() {
        let robot = scope(&survey.modules[module].module.name.value);
        if robot.is_empty() || dormant.iter().any(|name| scope(name) == robot) {
            continue;
        }
        match Block::of(&survey.modules[module].description) {
            Some(Block::Monitor) => check_required_sensors(configuration, survey, module, collector),
            Some(Block::Knowledge) => check_named_sensors(survey, module, collector),
            Some(Block::Reactive | Block::Execute) => {
                if let Some(model) = ListedSensors::of(survey, robot) {
                    check_listed(configuration, survey, module, &model, collector);
                }
            }
            _ => {}
        }
    }
}

/// Knowledge of a robot, and the Sensors that its RobotModel lists.
struct ListedSensors {
    knowledge: usize,
    /// Inputs of the Knowledge, named like the sensors, with their sources.
    /// The sources are outputs, as indices of module and port.
    sensors: Vec<(usize, (usize, usize))>,
}

impl ListedSensors {
    /// Returns those of a robot whose Knowledge takes measurements.
    fn of(survey: &Survey<'_>, robot: &str) -> Option<Self> {
        let knowledge = survey.modules.iter().position(|surveyed| {
            scope(&surveyed.module.name.value) == robot
                && Block::of(&surveyed.description) == Some(Block::Knowledge)
                && surveyed.description.ports.iter().any(takes_measurements)
        })?;
        Some(Self { knowledge, sensors: sensors_of(survey, knowledge).collect() })
    }

    fn lists(&self, sensor: (usize, usize)) -> bool {
        self.sensors.iter().any(|(_, listed)| *listed == sensor)
    }

    /// Returns the listed sensors as text for messages.
    fn list(&self, survey: &Survey<'_>) -> String {
        let names = self.sensors.iter().map(|(input, (sensor, port))| {
            let surveyed = &survey.modules[*sensor];
            let interface = surveyed.description.ports[*port].descriptor.name;
            let name = &survey.modules[self.knowledge].description.ports[*input].name;
            let module = surveyed.module.name.value.rsplit('/').next().unwrap_or_default();
            if module == name {
                format!("`{name}` ({interface})")
            } else {
                format!("`{name}` ({interface} of `{module}`)")
            }
        });
        let names: Vec<_> = names.collect();
        if names.is_empty() { "no sensor".into() } else { names.join(", ") }
    }
}

fn takes_measurements(port: &PortDescription) -> bool {
    is_sensed(&port.role) && matches!(port.direction, Direction::Input | Direction::Queue)
}

/// Checks that each `sensor` in a Knowledge's parameters exists on its robot.
/// Items such as the rules of a reflex name it.
fn check_named_sensors<'a>(survey: &Survey<'a>, module: usize, collector: &mut DiagnosticCollector<'a>) {
    let surveyed = &survey.modules[module];
    let items = surveyed.module.params.iter().flat_map(|(name, entry)| {
        let items = entry.value.as_list().unwrap_or_default().iter();
        items.filter_map(move |item| Some((name, item.as_table()?.get("sensor")?)))
    });
    let inputs = || {
        let ports = surveyed.description.ports.iter().enumerate();
        ports.filter(|(_, port)| takes_measurements(port))
    };
    // Robots without a list of sensors have no rules for them either.
    if inputs().next().is_none() {
        return;
    }
    for (parameter, sensor) in items {
        let Some(name) = sensor.as_str() else { continue };
        let is_there = |(number, port): (usize, &PortDescription)| {
            let is_linked =
                survey.links.iter().any(|resolved| resolved.port == (module, LinkEnd::Port(number)));
            port.name == name && (is_linked || surveyed.inputs.contains_key(&number))
        };
        if inputs().any(is_there) {
            continue;
        }
        let knowledge = &surveyed.module.name.value;
        let robot = scope(knowledge);
        let list = ListedSensors::of(survey, robot).map_or_else(String::new, |model| model.list(survey));
        let message = format!(
            "`{parameter}` of `{knowledge}` has a rule for the sensor `{name}`, and the RobotModel of `{robot}` lists {list}"
        );
        let help = match inputs().find(|(_, port)| port.name == name) {
            Some((_, port)) => format!(
                "add a Sensor of {} to the robot, which `{knowledge}/{name}` reads, or remove the rule",
                port.descriptor.name
            ),
            None => "name a sensor of the RobotModel, or remove the rule".into(),
        };
        collector.add(sensor.span, ErrorCode::Name.of(message), help);
    }
}

/// Returns the ports of a module that read Sensors, with their sources.
fn sensors_of<'s>(
    survey: &'s Survey<'_>,
    module: usize,
) -> impl Iterator<Item = (usize, (usize, usize))> + 's {
    survey.links.iter().filter_map(move |resolved| {
        let ((reader, LinkEnd::Port(port)), LinkSource::Port(sensor, output)) =
            (resolved.port, resolved.target)
        else {
            return None;
        };
        let is_sensor = survey.modules[sensor].description.ports[output].role == MEASUREMENT;
        (reader == module && is_sensor).then_some((port, (sensor, output)))
    })
}

/// Checks that a Monitor has each sensor that it needs.
fn check_required_sensors<'a>(
    configuration: &'a Configuration,
    survey: &Survey<'a>,
    module: usize,
    collector: &mut DiagnosticCollector<'a>,
) {
    let surveyed = &survey.modules[module];
    let name = surveyed.module.name.value.as_str();
    for (number, port) in surveyed.description.ports.iter().enumerate() {
        let path = format!("{name}/{}", port.name);
        let has_source = survey.links.iter().any(|resolved| resolved.port == (module, LinkEnd::Port(number)))
            || surveyed.inputs.contains_key(&number)
            || configuration.says_of_port(&path)
            || configuration.is_left_out(&path)
            || collector.undecided.contains(&path);
        if !takes_measurements(port) || has_source || !surveyed.module.enabled.value {
            continue;
        }
        let robot = scope(name);
        let wanted = port.descriptor.name;
        let lists = match ListedSensors::of(survey, robot) {
            Some(model) => format!("the RobotModel of `{robot}` lists {}", model.list(survey)),
            None => format!("robot `{robot}` has none"),
        };
        let message = format!("Monitor `{name}` needs a sensor of {wanted} for `{}`, and {lists}", port.name);
        let help = format!(
            "add a Sensor of {wanted} to the robot, such as a simulated one, remove the Monitor, or write \"/{path}\" = false"
        );
        collector.add(surveyed.module.name.span, ErrorCode::Ends.of(message), help);
    }
}

/// Checks that a ReactiveModel or an Execute reads only listed Sensors.
fn check_listed<'a>(
    configuration: &'a Configuration,
    survey: &Survey<'a>,
    module: usize,
    model: &ListedSensors,
    collector: &mut DiagnosticCollector<'a>,
) {
    let surveyed = &survey.modules[module];
    if !surveyed.module.enabled.value {
        return;
    }
    for (port, sensor) in sensors_of(survey, module) {
        if model.lists(sensor) {
            continue;
        }
        let name = &surveyed.module.name.value;
        let port = &surveyed.description.ports[port].name;
        let read = survey.path(configuration, LinkSource::Port(sensor.0, sensor.1));
        let knowledge = &survey.modules[model.knowledge].module.name.value;
        let message = format!(
            "`{name}/{port}` reads `/{read}`, a sensor that the RobotModel of `{knowledge}` does not list; it lists {}",
            model.list(survey)
        );
        let help = format!("link an input of `{knowledge}` to that sensor, or read one that it lists");
        collector.add(surveyed.module.name.span, ErrorCode::Ends.of(message), help);
    }
}
