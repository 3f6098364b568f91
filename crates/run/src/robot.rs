//! Programs that are robots.

use std::process::ExitCode;

use clap::{CommandFactory, FromArgMatches, Parser};
use slate_mapek::Robot;
use slate_module::Plugin;
use slate_runtime::configuration::{Database, Options};
use slate_runtime::isolation;
use slate_runtime::snapshot::Snapshot;

use crate::{Application, EXTRA_TABLES, PATHS, RunContext, RunError, RunOptions, output, run};

/// Arguments of a robot's program.
#[derive(Debug, Parser)]
struct ProgramArguments {
    #[command(flatten)]
    options: RunOptions,

    /// Print the configuration of the robot as TOML, and exit
    #[arg(long)]
    toml: bool,
}

/// Runs a robot as a program.
pub trait RunRobot {
    /// Runs the robot like `slate run`.
    /// With its options, display, web console, report and exit code.
    ///
    /// It is all that `main` does. Options are those of `slate run`, and `--toml`, which prints the configuration. An invalid robot
    /// is refused with the lines of the program, exit code 2.
    fn run(self) -> ExitCode;

    /// Returns the application that [`run`](RunRobot::run) runs.
    /// `sets` are settings of the command line, `path=value`.
    ///
    /// # Errors
    /// If the robot or its configuration is invalid.
    fn application(&self, sets: &[&str]) -> Result<Application, RunError>;
}

impl<B> RunRobot for Robot<B> {
    fn run(self) -> ExitCode {
        // An isolated module is this program, started once more.
        isolation::enter(&plugins(&self));
        match run_program(&self) {
            Ok(code) if output::is_lost() => ExitCode::from(code.max(RunError::EXIT)),
            Ok(code) => ExitCode::from(code),
            Err(error) => {
                error.print();
                ExitCode::from(RunError::EXIT)
            }
        }
    }

    fn application(&self, sets: &[&str]) -> Result<Application, RunError> {
        let sets = sets.iter().map(|set| (*set).to_owned()).collect();
        application(self, Options { sets, ..Options::default() })
    }
}

fn run_program<B>(robot: &Robot<B>) -> Result<u8, RunError> {
    let command = ProgramArguments::command().about(format!("Run the robot {}", robot.name()));
    let parsed = command.try_get_matches().and_then(|matches| ProgramArguments::from_arg_matches(&matches));
    let ProgramArguments { options, toml } = match parsed {
        Ok(arguments) => arguments,
        // Help is not an error; clap prints both where they belong.
        Err(error) => {
            // A closed stream leaves no place to report to.
            let _ = error.print();
            return Ok(if error.use_stderr() { RunError::EXIT } else { 0 });
        }
    };
    output::set_json(options.common.json);
    if toml {
        output::line(robot.to_toml()?.trim_end());
        return Ok(0);
    }
    let snapshot = options.resume.as_ref().map(Snapshot::read).transpose()?;
    let layers = Options {
        defaults: options.defaults(),
        sets: options.sets(),
        host: options.common.host.clone(),
        ..Options::default()
    };
    let context = RunContext { snapshot, ..RunContext::default() };
    run(application(robot, layers)?, &options, context)
}

fn application<B>(robot: &Robot<B>, layers: Options) -> Result<Application, RunError> {
    let extra_tables = EXTRA_TABLES.map(Into::into).to_vec();
    let layers = Options { extra_tables, paths: PATHS.map(Into::into).to_vec(), ..layers };
    let (file, text) = (format!("{}.toml", robot.name()), robot.to_toml_with_places()?);
    let database = Database::from_text(&file, &text, layers)?;
    let name = database.current().agent_name().to_owned();
    Ok(Application::new(&name, database, plugins(robot)))
}

/// Returns the kinds of the robot's blocks, of its world, and of the simulator.
fn plugins<B>(robot: &Robot<B>) -> Vec<Plugin> {
    let simulator = slate_sim::plugin();
    let own = robot.plugins(std::slice::from_ref(&simulator));
    [vec![simulator], own].concat()
}
