//! Reflexes without an Execute or without a Sensor.

use slate_module::role::{MEASUREMENT, REFLEX};
use slate_module::{Direction, PortDescription};

use super::names::{in_scope, line};
use super::{LinkEnd, LinkSource, ResolvedLink, Survey, scope};

/// Warns of a reflex that reaches no Execute of its robot.
/// Also when the link is left out on purpose: nothing stops the robot then.
pub(super) fn undelivered_reflex(
    survey: &Survey<'_>,
    (module, port): (usize, usize),
    path: &str,
) -> Option<(String, String)> {
    let robot = scope(&survey.modules[module].module.name.value);
    let reaches = |resolved: &ResolvedLink<'_>| match resolved.target {
        LinkSource::Port(other, _) => scope(&survey.modules[other].module.name.value) == robot,
        // Of a robot whose Execute is elsewhere.
        LinkSource::Remote(_) => in_scope(survey, module, is_inbox).is_empty(),
        _ => true,
    };
    let mut own = survey.links.iter().filter(|resolved| resolved.port == (module, LinkEnd::Port(port)));
    if own.any(reaches) {
        return None;
    }
    let help = match &in_scope(survey, module, is_inbox)[..] {
        [] => "no block of its robot takes a reflex".into(),
        inboxes => format!("{}, or set `enabled = false` of its module", line(&inboxes[0], path)),
    };
    Some((format!("outbox `{path}` has no receiver: this reflex has no effect"), help))
}

fn is_inbox(port: &PortDescription) -> bool {
    port.direction == Direction::Inbox && port.role == REFLEX
}

/// Warns of a reflex input without a Sensor, though the robot has one that fits.
/// If the sensor has a rule, the robot stands.
pub(super) fn unmeasured(
    survey: &Survey<'_>,
    module: usize,
    own: &PortDescription,
    path: &str,
) -> Option<(String, String)> {
    let measures = |other: &PortDescription| {
        other.direction == Direction::Output
            && other.role == MEASUREMENT
            && other.descriptor.hash == own.descriptor.hash
    };
    let sensor = in_scope(survey, module, measures)
        .into_iter()
        .next()
        .filter(|_| own.direction == Direction::Input)?;
    let message =
        format!("input `{path}` reads no Sensor: the reflex stops the robot if that sensor has a rule");
    let help = format!("{}, or set `enabled = false` of its module", line(path, &sensor));
    Some((message, help))
}
