use slate_blackboard::Access;
use slate_module::Direction;
use slate_runtime::Composer;

use crate::error::NetworkError;
use crate::settings::{NetworkInput, NetworkSettings};

/// Whether the inputs that settings name are there and no link fills them.
///
/// # Errors
/// The first that can't read from the network.
pub fn check_inputs(composer: &Composer, settings: &NetworkSettings) -> Result<(), NetworkError> {
    settings.read.iter().try_for_each(|(input, reading)| check(composer, input, reading))
}

fn check(composer: &Composer, input: &str, reading: &NetworkInput) -> Result<(), NetworkError> {
    let wrong = |reason: String, help| {
        Err(NetworkError::Input { input: input.into(), reason, help, place: reading.place })
    };
    let (property, field) = match composer.board().find(input) {
        Ok(found) => found,
        Err(error) => return wrong(error.to_string(), "`slate list` shows the inputs"),
    };
    let whole = input.strip_suffix(&field).unwrap_or(input).trim_end_matches('/');
    if property.path() != whole {
        let reason = format!("it is linked, from /{}", property.path());
        return wrong(reason, "take the link out of [links]");
    }
    let port = composer.port(whole);
    if port.is_none_or(|port| port.direction != Direction::Input) || property.access() != Access::Setting {
        let reason = "it is no input that holds one value".to_owned();
        return wrong(
            reason,
            "name an input; queues, parameters and outputs can't read from the network yet",
        );
    }
    match composer.hand_refusal(whole) {
        Some(reason) => wrong(reason, "let its link fill it, and name an input of a module before that"),
        None => Ok(()),
    }
}
