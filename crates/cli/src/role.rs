//! Roles as values of options.

use clap::builder::{PossibleValue, PossibleValuesParser, TypedValueParser};
use slate::control::Role;

/// Returns a parser of the names of roles.
pub fn parser() -> impl TypedValueParser<Value = Role> {
    let value = |role: Role| PossibleValue::new(role.name()).help(rights(role));
    PossibleValuesParser::new(Role::ALL.map(value)).try_map(|name| Role::by_name(&name).ok_or("unknown role"))
}

fn rights(role: Role) -> &'static str {
    match role {
        Role::Viewer => "Read, and stop the actuators",
        Role::Operator => "Also drive, set goals, arm, and reset a stop",
        Role::Developer => "Also change parameters, links, modules and plugins",
    }
}
