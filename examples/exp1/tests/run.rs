//! EXP1 as a program, as a user calls it. This file is the program, too: its tests start it once more.
#![allow(clippy::unwrap_used, clippy::panic, reason = "a test that fails panics")]

use std::path::PathBuf;
use std::process::{Command, ExitCode, Output};

use slate::module::Sequence;
use slate::prelude::*;
use slate::run::{Application, EXTRA_TABLES, MissionOptions, MissionRun, ModeName};
use slate::runtime::Rate;
use slate::runtime::configuration::{Database, Options};
use slate::sim::devices::SimulatedSonar;
use slate_wheeled::knowledge::WheeledKnowledge;

#[allow(dead_code, reason = "this file has a main function of its own")]
#[path = "../examples/exp1.rs"]
mod program;

/// Says which robot the program is.
const ROBOT: &str = "SLATE_TEST_ROBOT";

/// EXP1 with a Monitor that reads a property that is not there, and its line.
fn unfit() -> (Robot, u32) {
    let ear = Robot::new("r9").monitor::<slate_wheeled::monitors::RangeMonitor>("ear");
    let (ear, line) = (ear.link("sonar", "/simulator/r2/snoar"), line!());
    (program::robot().with(ear), line)
}

/// EXP1 with a Knowledge without a rule for its reflexes, and its line.
fn without_rules() -> (Robot, u32) {
    let (knows, line) = (Robot::new("r9").knowledge::<WheeledKnowledge>("knowledge"), line!());
    let knows = knows.params(|params| {
        params.robot = "pioneer_p3dx".into();
        params.sensor_rules = Sequence::new(&[]);
    });
    (program::robot().with(knows), line)
}

/// EXP1 with a robot that reads the Pioneer's sonar and takes itself for another one, or for none, and its line.
fn of_another(robot: &str) -> (Robot, u32) {
    let reads = Robot::new("r9").sensor::<SimulatedSonar>("sonar").link("source", "/simulator/r2/sonar");
    let (knows, line) = (reads.knowledge::<WheeledKnowledge>("knowledge"), line!());
    (program::robot().with(knows.params(|params| params.robot = robot.into())), line)
}

fn main() -> ExitCode {
    match std::env::var(ROBOT).as_deref() {
        Ok("exp1") => return program::robot().run(),
        Ok("unfit") => return unfit().0.run(),
        Ok("without_rules") => return without_rules().0.run(),
        Ok("summit") => return of_another("summit_xl").0.run(),
        Ok("nobody") => return of_another("").0.run(),
        _ => {}
    }
    const TESTS: [(&str, fn()); 5] = [
        ("a program runs as slate run does", runs_as_slate_run_does),
        ("a program prints its configuration", prints_its_configuration),
        ("a program names the line of what does not fit", names_the_line),
        ("a program names the line of a RobotModel of another robot", names_the_other_robot),
        ("a program refuses unknown options", refuses_unknown_options),
    ];
    for (name, test) in TESTS {
        test();
        println!("test {name} ... ok");
    }
    ExitCode::SUCCESS
}

/// Calls the program in a folder of its own.
fn call(robot: &str, folder: &str, arguments: &[&str]) -> (Output, PathBuf) {
    let folder = PathBuf::from(env!("CARGO_TARGET_TMPDIR")).join(format!("exp1-{folder}"));
    let _ = std::fs::remove_dir_all(&folder);
    std::fs::create_dir_all(&folder).unwrap();
    let mut command = Command::new(std::env::current_exe().unwrap());
    let output = command.args(arguments).env(ROBOT, robot).current_dir(&folder).output().unwrap();
    (output, folder)
}

fn text(bytes: &[u8]) -> String {
    String::from_utf8_lossy(bytes).into_owned()
}

/// The digest of the shipped configuration, run as the command does.
fn shipped_digest(seed: u64) -> String {
    let options = Options {
        sets: vec![format!("agent.seed={seed}")],
        extra_tables: EXTRA_TABLES.map(Into::into).to_vec(),
        ..Options::default()
    };
    let database = Database::from_text("exp1.toml", slate_exp1::CONFIGURATION, options).unwrap();
    let plugins = vec![slate::sim::plugin(), slate_wheeled::plugin()];
    let options = MissionOptions {
        mode: ModeName::Staged,
        rate: Rate::Max,
        workers: 0,
        log: Vec::new(),
        trajectory: false,
        follows: false,
        disarmed: false,
    };
    let run = MissionRun::load(Application::new("exp1", database, plugins), options).unwrap();
    run.run().unwrap().summary.digest
}

fn runs_as_slate_run_does() {
    let (output, folder) = call("exp1", "run", &["--headless", "--seed", "3", "--json"]);
    assert_eq!(output.status.code(), Some(0), "{output:?}");
    let said = text(&output.stdout);
    let summary = said.lines().last().unwrap();
    for part in ["\"outcome\":\"goal_reached\"", "\"example\":\"exp1\"", &shipped_digest(3)] {
        assert!(summary.contains(part), "{part}: {summary}");
    }
    for file in ["trajectory.svg", "summary.json"] {
        assert!(folder.join("runs/exp1-3").join(file).is_file(), "{file} of the report");
    }
    let (output, _) = call("exp1", "variant", &["--headless", "--set", "controller=other"]);
    assert!(text(&output.stderr).contains("expected one of rocs, rocs-fixed, slate"), "{output:?}");
    for choice in ["planner=local", "controller=rocs", "pace=robots"] {
        let (output, _) = call(
            "exp1",
            "choice",
            &["--headless", "--set", choice, "--set", "modules.referee.params.time_limit=2.0"],
        );
        assert!(text(&output.stdout).contains("time is up"), "{choice}: {output:?}");
    }
    let late = "modules.referee.params.time_limit=1.0";
    let (output, _) = call("exp1", "late", &["--headless", "--set", late]);
    assert_eq!(output.status.code(), Some(1), "{output:?}");
}

fn prints_its_configuration() {
    let (output, folder) = call("exp1", "toml", &["--toml"]);
    assert_eq!(output.status.code(), Some(0), "{output:?}");
    assert_eq!(text(&output.stdout), program::robot().to_toml().unwrap());
    assert!(!folder.join("runs").exists(), "nothing ran");
}

fn names_the_line() {
    let (output, folder) = call("unfit", "unfit", &["--headless"]);
    assert_eq!(output.status.code(), Some(2), "{output:?}");
    let said = text(&output.stderr);
    assert!(said.contains("snoar"), "{said}");
    assert!(said.contains(&format!("# {}:{}", file!(), unfit().1)), "{said}");
    assert!(!folder.join("runs").exists(), "nothing ran");
    let (output, _) = call("without_rules", "without_rules", &["--headless"]);
    assert_eq!(output.status.code(), Some(2), "{output:?}");
    let said = text(&output.stderr);
    assert!(said.contains("`r9/knowledge`") && said.contains("expected a rule such as"), "{said}");
    assert!(said.contains("sensor_rules = []"), "{said}");
    assert!(said.contains(&format!("# {}:{}", file!(), without_rules().1)), "{said}");
}

fn names_the_other_robot() {
    for (robot, words) in [
        ("summit", "error[S017]: the RobotModel of `r9` is that of a `summit_xl`, and `simulator` has a"),
        ("nobody", "r9/knowledge: params.robot: no robot is named; expected one of pioneer_p3dx, summit_xl"),
    ] {
        let (output, folder) = call(robot, robot, &["--headless"]);
        assert_eq!(output.status.code(), Some(2), "{output:?}");
        // A message is broken into lines.
        let said = text(&output.stderr).replace("\n  │ ", " ");
        assert!(said.contains(words), "{said}");
        assert!(said.contains(&format!("# {}:{}", file!(), of_another("").1)), "{said}");
        assert!(!folder.join("runs").exists(), "nothing ran");
    }
}

fn refuses_unknown_options() {
    let (output, _) = call("exp1", "option", &["--fly"]);
    assert_eq!(output.status.code(), Some(2), "{output:?}");
    assert!(text(&output.stderr).contains("--fly"), "{output:?}");
}
