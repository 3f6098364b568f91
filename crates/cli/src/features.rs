//! Features of this build.

use std::sync::LazyLock;

use slate_robotics_cli::FEATURES;

/// Version with its features, for `--version`.
pub static VERSION: LazyLock<String> =
    LazyLock::new(|| format!("{}\n{}", env!("CARGO_PKG_VERSION"), describe(&FEATURES)));

/// Features, for the end of `--help`.
pub static HELP: LazyLock<String> = LazyLock::new(|| {
    format!("The agent may also be named first: slate --agent NAME COMMAND\n{}", describe(&FEATURES))
});

fn describe(features: &[(&str, bool)]) -> String {
    let names = |wanted| {
        features.iter().filter(|(_, is_built)| *is_built == wanted).map(|(name, _)| *name).collect::<Vec<_>>()
    };
    let (built, missing) = (names(true), names(false));
    let mut text = match built.is_empty() {
        true => "Features: none".to_owned(),
        false => format!("Features: {}", built.join(", ")),
    };
    if !missing.is_empty() {
        text += &format!(
            "\nNot built in: {} (cargo build --release --features {})",
            missing.join(", "),
            missing.join(",")
        );
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn missing_features_come_with_the_command_that_builds_them() {
        assert_eq!(
            describe(&[("console", true), ("jpeg", false), ("tls", false)]),
            "Features: console\nNot built in: jpeg, tls (cargo build --release --features jpeg,tls)"
        );
        assert_eq!(describe(&[("tls", true)]), "Features: tls");
    }
}
