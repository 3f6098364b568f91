//! The programs of EXP1 to EXP3 are their shipped configurations.
#![allow(clippy::unwrap_used, clippy::panic, reason = "a test that fails panics")]

use slate::mapek::Robot;
use slate::module::Plugin;
use slate::run::{Application, EXTRA_TABLES, RunRobot};
use slate::runtime::configuration::{Configuration, Options};
use slate::runtime::{self, Agent, Rate};
use slate_wheeled::knowledge::WheeledKnowledge;

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

/// A configuration, and the files that it includes.
type Shipped = (&'static str, &'static [(&'static str, &'static str)]);

/// Each experiment's program, and its configuration.
const EXPERIMENTS: [(Program, Shipped); 3] = [
    (exp1::robot, (slate_exp1::CONFIGURATION, &[])),
    (exp2::robot, (slate_exp2::CONFIGURATION, slate_exp2::EMBEDDED)),
    (exp3::robots, (slate_exp3::CONFIGURATION, slate_exp3::EMBEDDED)),
];

fn read((text, embedded): (&str, &'static [(&'static str, &'static str)]), seed: u64) -> Configuration {
    let options = Options {
        sets: vec![format!("agent.seed={seed}")],
        extra_tables: EXTRA_TABLES.map(Into::into).to_vec(),
        embedded,
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
    let settings = |configuration: Configuration| -> Vec<(String, String)> {
        let settings = configuration.settings("").unwrap();
        settings.into_iter().map(|setting| (setting.path, setting.value.to_string())).collect()
    };
    for (robot, shipped) in EXPERIMENTS {
        let printed = robot().to_toml().unwrap();
        let [printed, shipped] = [read((&printed, &[]), 0), read(shipped, 0)].map(settings);
        assert_eq!(printed, shipped, "parameters with their default are left out");
    }
}

#[test]
fn programs_of_the_experiments_equal_the_shipped_configurations() {
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

/// Knowledge of another robot, with rules for its reflexes.
const RULES: &str = r#"
[robots.r9.modules]
knowledge.kind = "wheeled_knowledge"

[robots.r9.modules.knowledge.params]
robot = "pioneer_p3dx"
min_separation = 0.9
wall_distance = -0.6
wall_timeout = 2.0
release_velocity = 0.2
"#;

#[test]
fn rules_of_reflexes_are_the_same_in_a_program_and_in_toml() {
    let robot = Robot::new("r9").knowledge::<WheeledKnowledge>("knowledge").params(|params| {
        params.robot = "pioneer_p3dx".into();
        params.min_separation = 0.9;
        params.wall_distance = -0.6;
        params.wall_timeout = 2.0;
        params.release_velocity = 0.2;
    });
    let Application { configuration, plugins, .. } =
        exp1::robot().with(robot.finish()).application(&["agent.seed=1"]).unwrap();
    let written = read((&format!("{}{RULES}", slate_exp1::CONFIGURATION), &[]), 1);
    let options = || runtime::Options { rate: Rate::Max, armed: true, ..runtime::Options::default() };
    let [program, file] = [&configuration, &written].map(|configuration| {
        let mut agent = Agent::load(configuration, &plugins, options()).unwrap();
        for _ in 0..10 {
            agent.step();
        }
        let rules = agent.board().read("r9/knowledge/rules").unwrap().unwrap().0;
        (rules.to_string(), agent.digest())
    });
    assert!(program.0.contains("-0.6") && program.1.is_some(), "{program:?}");
    assert_eq!(program, file);
    let outside = Robot::new("r9")
        .knowledge::<WheeledKnowledge>("knowledge")
        .params(|params| params.release_velocity = 9.0);
    let refusal = outside.finish().to_toml().unwrap_err().to_string();
    assert!(refusal.contains("release_velocity") && refusal.contains("0.01"), "{refusal}");
}

#[test]
fn one_key_chooses_the_profile_of_world_and_robot_models() {
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
