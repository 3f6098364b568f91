//! EXP1's robot when its sensors lie, stop, hang or crash, and when its own blocks do: the wheels stand
//! still or continue safely, and the robot comes back and reaches its goal.
#![allow(clippy::panic, clippy::unwrap_used, clippy::nonminimal_bool, reason = "a test that fails panics")]

mod crashes;
mod frozen;
mod hangs;
mod health;
mod reflexes;
mod sensors;
mod trouble;

use slate::blackboard::Board;
use slate::blackboard::interface::Value;
use slate::module::Plugin;
use slate::runtime::configuration::{self, Configuration};
use slate::runtime::{Agent, Mode, Options, Rate};

use crashes::{CrashingPlanner, CrashingReflex};
use health::FailingWheels;
use trouble::Trouble;

const STAGED: (Mode, Rate) = (Mode::Staged, Rate::Max);

/// EXP1 with the troublemaker between simulator and robot.
fn agent(sets: &[&str]) -> Agent {
    agent_in(STAGED, sets)
}

fn agent_in((mode, rate): (Mode, Rate), sets: &[&str]) -> Agent {
    let mut links = String::new();
    for sensor in ["position", "orientation", "sonar"] {
        links += &format!(
            "\"trouble/{sensor}_in\" = \"simulator/r2/{sensor}\"\n\"r2/{sensor}/source\" = \"trouble/{sensor}\"\n"
        );
    }
    let text =
        slate_exp1::CONFIGURATION.replacen("[links]\n", &format!("[modules.trouble]\n[links]\n{links}"), 1);
    let options = configuration::Options {
        sets: sets.iter().map(|set| (*set).to_owned()).collect(),
        extra_tables: ["world", "report"].map(Into::into).to_vec(),
        ..configuration::Options::default()
    };
    let configuration = Configuration::from_text("exp1.toml", &text, &options).unwrap();
    let plugins = [
        slate::sim::plugin(),
        slate_wheeled::plugin(),
        Plugin::linked::<Trouble>(),
        slate::mapek::plan::<CrashingPlanner>().into(),
        slate::mapek::reactive::<CrashingReflex>().into(),
        slate::mapek::actuator::<FailingWheels>().into(),
    ];
    let options = Options { mode, rate, armed: true, ..Options::default() };
    Agent::load(&configuration, &plugins, options).unwrap()
}

fn number(board: &Board, path: &str) -> f64 {
    board.read(path).unwrap().and_then(|(value, _)| value.as_f64()).unwrap()
}

fn wheels(board: &Board) -> [f64; 2] {
    ["left", "right"].map(|side| number(board, &format!("r2/wheels/command/{side}")))
}

/// The judge's verdict.
fn verdict(board: &Board) -> String {
    let state = board.read("referee/verdict/state").unwrap().map(|(value, _)| value);
    state.as_ref().and_then(Value::as_str).unwrap_or("RUNNING").to_owned()
}

/// What Execute runs.
fn tree(agent: &Agent) -> String {
    let tree = agent.board().read("r2/execute/status/tree").unwrap().map(|(value, _)| value);
    tree.as_ref().and_then(Value::as_str).unwrap_or_default().to_owned()
}

/// Runs to the verdict; every command on the way is finite.
fn finish(agent: &mut Agent) {
    while verdict(agent.board()) == "RUNNING" {
        agent.step();
        assert!(wheels(agent.board()).iter().all(|speed| speed.is_finite()));
    }
    assert_eq!(verdict(agent.board()), "SUCCEEDED", "at {} s", agent.now() as f64 * 1e-9);
    assert_eq!(number(agent.board(), "referee/metrics/collisions_caused"), 0.0);
}
