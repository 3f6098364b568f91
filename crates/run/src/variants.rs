//! Variants of an application: settings that a setting of its own chooses.

use slate_mapek::VariantChoice;
use slate_runtime::configuration::Configuration;

use crate::RunError;

/// Returns the settings of the variants that a configuration chooses.
///
/// # Errors
/// If it chooses a variant that is none of a choice.
pub fn chosen_settings(
    configuration: &Configuration,
    choices: &[VariantChoice],
) -> Result<Vec<String>, RunError> {
    let mut sets = Vec::new();
    for (choice, variants) in choices {
        let Some(chosen) = configuration.value(choice) else { continue };
        let name = chosen.value.as_str().unwrap_or_default();
        let Some((_, settings)) = variants.iter().find(|(known, _)| *known == name) else {
            let known: Vec<_> = variants.iter().map(|(known, _)| *known).collect();
            let help = format!("there are {}", known.join(", "));
            let diagnostic =
                configuration.diagnostic(chosen.span, format!("no {choice} `{name}`"), Some(help));
            return Err(RunError::Configuration(diagnostic.into()));
        };
        sets.extend(settings.iter().map(|set| (*set).to_owned()));
    }
    Ok(sets)
}
