//! Entry of a port on the board.

use slate_module::Direction;

use super::BuildPlan;
use crate::LinkEnd;
use crate::survey::LinkSource;

/// Entry of a port on the board.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum PlannedPort {
    /// Values that the module writes.
    Output,
    /// Messages that the module receives, or that wait there for a bridge.
    Messages,
    /// Another name of the source that the port reads directly.
    Alias(LinkSource),
    /// A property of its own, which links fill.
    Converted,
    /// A value that tools set.
    Setting,
    /// Nothing but the inbox of another module, to which it sends.
    Sent(LinkSource),
    /// Nothing.
    Nothing,
}

impl PlannedPort {
    /// Returns the entry of a module's port.
    pub fn of(plan: BuildPlan<'_, '_>, module: usize, port: usize) -> Self {
        let linked = plan.link(module, LinkEnd::Port(port)).map(|resolved| resolved.target);
        match plan.port(module, port).direction {
            Direction::Output | Direction::Debug | Direction::Command => Self::Output,
            Direction::Inbox => Self::Messages,
            Direction::Input | Direction::Queue => match linked {
                Some(source) => Self::Alias(source),
                None if plan.is_converted(module, LinkEnd::Port(port)) => Self::Converted,
                None => Self::Setting,
            },
            Direction::Aspect | Direction::Provider => Self::Nothing,
            Direction::Outbox => match linked {
                Some(inbox) => Self::Sent(inbox),
                None if plan.configuration.is_outgoing(&plan.port_path(module, port)) => Self::Messages,
                None => Self::Nothing,
            },
        }
    }
}
