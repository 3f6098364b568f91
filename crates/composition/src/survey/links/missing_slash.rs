//! Help for an agent's name without its leading slash.

use slate_configuration::{Configuration, Span};

use crate::survey::names::{split_module, split_port};
use crate::survey::{Implied, Survey};

/// Returns help if a name of a robot's scope needs a leading slash.
/// With the slash it is a name of the agent.
pub fn without_slash(
    configuration: &Configuration,
    survey: &Survey<'_>,
    span: Span,
    path: &str,
) -> Option<String> {
    let written = configuration.text_at(span).trim().trim_matches(['"', '\'']);
    if written.starts_with('/') || written == path || !path.ends_with(&format!("/{written}")) {
        return None;
    }
    let is_port = || {
        let (module, rest) = split_module(&survey.modules, written)?;
        let ports = &survey.modules[module].description.ports;
        let name = split_port(ports, rest).0;
        (Implied::of(name).is_some() || ports.iter().any(|port| port.name == name)).then_some(())
    };
    let of_actuator = |name: &str| {
        let rest = written.strip_prefix(name).and_then(|rest| rest.strip_prefix('/'));
        rest.is_some_and(|rest| matches!(split_port(&[], rest).0, "command" | "gate"))
    };
    let mut actuators = configuration.actuators().iter().map(|actuator| actuator.name.value.as_str());
    let is_known = is_port().is_some() || actuators.any(of_actuator);
    is_known.then(|| format!("did you mean /{written}? Without a slash in front a name is one of its robot"))
}
