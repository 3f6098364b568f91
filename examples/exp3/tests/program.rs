//! EXP3 as a program is EXP3 as a configuration.
#![allow(clippy::unwrap_used, clippy::panic, reason = "a test that fails panics")]

use slate::run::{Application, RunRobot};
use slate::runtime::configuration::{Configuration, Options};
use slate::runtime::{self, Agent, Rate};

#[allow(dead_code, reason = "a test has a main function of its own")]
#[path = "../examples/exp3.rs"]
mod experiment;

fn read(text: &str, seed: u64) -> Configuration {
    let options = Options {
        sets: vec![format!("agent.seed={seed}")],
        extra_tables: slate::run::EXTRA_TABLES.map(Into::into).to_vec(),
        ..Options::default()
    };
    Configuration::from_text("exp3.toml", text, &options).unwrap()
}

/// The digest of ten seconds.
fn digest(configuration: &Configuration, plugins: &[slate::module::Plugin]) -> u64 {
    let options = runtime::Options { rate: Rate::Max, armed: true, ..runtime::Options::default() };
    let mut agent = Agent::load(configuration, plugins, options).unwrap();
    for _ in 0..500 {
        agent.step();
    }
    agent.digest().unwrap()
}

#[test]
fn program_of_exp3_prints_the_shipped_configuration() {
    let settings = |text: &str| -> Vec<(String, String)> {
        let settings = read(text, 0).settings("").unwrap();
        settings.into_iter().map(|setting| (setting.path, setting.value.to_string())).collect()
    };
    let printed = experiment::robots().to_toml().unwrap();
    assert_eq!(
        settings(&printed),
        settings(slate_exp3::CONFIGURATION),
        "parameters with their default are left out"
    );
}

#[test]
fn program_of_exp3_runs_as_the_shipped_configuration() {
    for seed in 1..=2 {
        let Application { configuration, plugins, .. } =
            experiment::robots().application(&[&format!("agent.seed={seed}")]).unwrap();
        let shipped = read(slate_exp3::CONFIGURATION, seed);
        assert_eq!(digest(&configuration, &plugins), digest(&shipped, &plugins), "seed {seed}");
    }
}
