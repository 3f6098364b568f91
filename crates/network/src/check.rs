use slate_blackboard::Access;
use slate_runtime::{ExternalPorts, PropertyFacts};

use crate::error::NetworkError;
use crate::settings::{NetworkInput, NetworkOutput, NetworkSettings};

/// Checks the inputs and the published properties that settings name.
/// Both must exist, and no link may fill the inputs.
///
/// # Errors
/// The first input that can't read from the network, or property that can't be published.
pub fn check_properties(ports: &impl ExternalPorts, settings: &NetworkSettings) -> Result<(), NetworkError> {
    settings.read.iter().try_for_each(|(input, reading)| check_input(ports, input, reading))?;
    settings.write.iter().try_for_each(|output| check_output(ports, output))
}

fn check_input(ports: &impl ExternalPorts, input: &str, reading: &NetworkInput) -> Result<(), NetworkError> {
    let is_inbox = ports.find(input).is_ok_and(|(found, _)| found.access() == Access::Messages);
    let checked = match is_inbox {
        true => ports.external_inbox(input).map(drop),
        false => ports.external_input(input).map(drop),
    };
    checked.map_err(|error| NetworkError::Input {
        input: input.into(),
        reason: error.reason,
        help: error.help,
        place: reading.place,
    })
}

fn check_output(ports: &impl ExternalPorts, output: &NetworkOutput) -> Result<(), NetworkError> {
    let wrong = |reason: String, help| {
        let (property, key) = (output.property.clone(), output.key.clone());
        Err(NetworkError::Output { property, key, reason, help, place: output.place })
    };
    match ports.find(&output.property) {
        Err(error) => wrong(error.to_string(), "`slate list` shows the properties"),
        Ok((_, field)) if !field.is_empty() => {
            wrong(format!("`{field}` is a field, and a key has whole values"), "link the property")
        }
        Ok((property, _)) if !property.has_value() => {
            wrong("it takes messages, and has no value".into(), "link an output")
        }
        Ok(_) => Ok(()),
    }
}
