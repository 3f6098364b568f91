//! Configuration text and changes; a refusal has its place and changes nothing.

use crate::input::Input;
use slate_runtime::configuration::{Configuration, Database, Options};

/// Configuration to which changes are made.
pub const TEXT: &str = r#"
agent.name = "base" # who it is
[modules.counter]
every = "10ms"
params.step = 3
[modules.relay]
enabled = false
[links]
"relay/input" = { from = "counter/number", stale = "1s" }
[actuators.wheel]
command = "relay/wheel"
limits = { value = [-1.0, 1.0] }
[log]
level = "info"
"#;

/// Part of a script that is a change: a path and a value, each with its length.
/// A whole text stands at its end.
pub const CHANGE: u8 = 1;
/// A change is taken back at a path.
pub const REVERT: u8 = 2;

/// Plays a script.
pub fn run(script: &[u8]) {
    let mut script = Input(script);
    let database = Database::from_text("base.toml", TEXT, Options::default()).expect("it is right");
    loop {
        let refused = match script.byte() {
            CHANGE => {
                let (path, value) = (text(script.counted()), text(script.counted()));
                let before = settings(&database);
                let refused = database.set(&[(path, value)]).err();
                (refused, before)
            }
            REVERT => {
                let before = settings(&database);
                (database.take_back(&text(script.counted())).err(), before)
            }
            _ => break,
        };
        if let (Some(report), before) = refused {
            let _ = report.render(true);
            assert_eq!(settings(&database), before, "what was refused changed something: {report}");
        }
    }
    let written = text(script.0);
    // Included files belong to the author of the text.
    if written.contains("include") {
        return;
    }
    match Configuration::from_text("base.toml", &written, &Options::default()) {
        Ok(configuration) => drop(configuration.settings("")),
        Err(report) => {
            let shown = report.render(true);
            assert!(!shown.is_empty(), "nothing is shown of {report}");
        }
    }
}

fn text(bytes: &[u8]) -> String {
    String::from_utf8_lossy(bytes).into_owned()
}

fn settings(database: &Database) -> Vec<(String, String)> {
    let settings = database.get("").expect("everything is a path");
    settings.into_iter().map(|setting| (setting.path, format!("{:?}", setting.value))).collect()
}
