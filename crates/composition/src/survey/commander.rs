//! Modules that command actuators.

use slate_module::Direction;

use super::block::Block;
use super::{Survey, scope};
use slate_configuration::Configuration;

/// Returns whether an actuator takes its command from that port.
pub fn is_of_actuator(configuration: &Configuration, path: &str) -> bool {
    let mut commands = configuration.actuators().iter().flat_map(|actuator| &actuator.commands);
    commands.any(|command| command.value.path_in("") == path)
}

/// Returns whether a module commands an actuator.
pub fn commands_actuator(configuration: &Configuration, survey: &Survey<'_>, module: usize) -> bool {
    let surveyed = &survey.modules[module];
    let mut ports = surveyed.description.ports.iter().filter(|port| port.direction == Direction::Command);
    ports.any(|port| is_of_actuator(configuration, &format!("{}/{}", surveyed.module.name.value, port.name)))
}

/// Returns whether a robot has blocks that decide about its motion.
pub fn decides(survey: &Survey<'_>, robot: &str) -> bool {
    survey.modules.iter().any(|surveyed| {
        scope(&surveyed.module.name.value) == robot
            && matches!(
                Block::of(&surveyed.description),
                Some(Block::Plan | Block::Execute | Block::Reactive)
            )
    })
}
