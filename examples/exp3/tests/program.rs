//! The programs of EXP1 to EXP3 are their shipped configurations.
#![allow(clippy::unwrap_used, clippy::panic, reason = "a test that fails panics")]

use slate::mapek::Robot;
use slate::module::Plugin;
use slate::run::{Application, EXTRA_TABLES, RunRobot};
use slate::runtime::configuration::{Configuration, Options};
use slate::runtime::{self, Agent, Rate};

#[allow(dead_code, reason = "a test has a main function of its own")]
#[path = "../../exp1/examples/exp1.rs"]
mod exp1;
#[allow(dead_code, reason = "a test has a main function of its own")]
#[path = "../../exp2/examples/exp2.rs"]
mod exp2;
#[allow(dead_code, reason = "a test has a main function of its own")]
#[path = "../examples/exp3.rs"]
mod exp3;

/// Makes the robots of an experiment.
type Program = fn() -> Robot;

/// Each experiment's program, and its configuration.
const EXPERIMENTS: [(Program, &str); 3] = [
    (exp1::robot, slate_exp1::CONFIGURATION),
    (exp2::robot, slate_exp2::CONFIGURATION),
    (exp3::robots, slate_exp3::CONFIGURATION),
];

fn read(text: &str, seed: u64) -> Configuration {
    let options = Options {
        sets: vec![format!("agent.seed={seed}")],
        extra_tables: EXTRA_TABLES.map(Into::into).to_vec(),
        ..Options::default()
    };
    Configuration::from_text("experiment.toml", text, &options).unwrap()
}

/// The digest of ten seconds.
fn digest(configuration: &Configuration, plugins: &[Plugin]) -> u64 {
    let options = runtime::Options { rate: Rate::Max, armed: true, ..runtime::Options::default() };
    let mut agent = Agent::load(configuration, plugins, options).unwrap();
    for _ in 0..500 {
        agent.step();
    }
    agent.digest().unwrap()
}

#[test]
fn programs_of_the_experiments_print_the_shipped_configurations() {
    let settings = |text: &str| -> Vec<(String, String)> {
        let settings = read(text, 0).settings("").unwrap();
        settings.into_iter().map(|setting| (setting.path, setting.value.to_string())).collect()
    };
    for (robot, shipped) in EXPERIMENTS {
        let printed = robot().to_toml().unwrap();
        assert_eq!(settings(&printed), settings(shipped), "parameters with their default are left out");
    }
}

#[test]
fn programs_of_the_experiments_run_as_the_shipped_configurations() {
    for (robot, shipped) in EXPERIMENTS {
        for seed in 1..=2 {
            let set = format!("agent.seed={seed}");
            let Application { configuration, plugins, .. } = robot().application(&[&set]).unwrap();
            let name = configuration.value("agent.name").map(|name| name.value.to_string());
            let shipped = read(shipped, seed);
            assert_eq!(digest(&configuration, &plugins), digest(&shipped, &plugins), "{name:?}, seed {seed}");
        }
    }
}

#[test]
fn one_key_chooses_the_profile_of_the_world_and_of_all_robot_models() {
    for (robot, _) in EXPERIMENTS {
        for (set, expected) in [(vec![], "vrep"), (vec!["world.profile=real"], "real")] {
            let Application { configuration, plugins, .. } = robot().application(&set).unwrap();
            let agent = Agent::load(&configuration, &plugins, runtime::Options::default()).unwrap();
            let knowing = configuration.modules().iter().filter(|it| it.name.value.ends_with("/knowledge"));
            let profiles: Vec<_> = knowing
                .map(|it| {
                    let path = format!("{}/params/profile", it.name.value);
                    agent.board().read(&path).unwrap().unwrap().0.as_str().unwrap().to_owned()
                })
                .collect();
            assert!(!profiles.is_empty() && profiles.iter().all(|it| *it == expected), "{profiles:?}");
        }
    }
}
