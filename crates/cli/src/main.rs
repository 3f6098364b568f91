//! The `slate` command.

mod arguments;
mod bag;
mod batch;
mod config;
mod connection;
mod console;
mod course;
mod deployment;
mod display;
mod examples;
mod failure;
mod link;
mod log;
mod mission;
mod module;
mod observation;
mod output;
mod peers;
mod plugin;
mod property;
mod replay;
mod run;
mod scene;
mod snapshot;
mod stop;
mod trace;

use std::process::ExitCode;

use clap::Parser;

use arguments::{Arguments, Verb};
use failure::Failure;

fn main() -> ExitCode {
    // An isolated module is this program, started once more.
    slate::runtime::isolation::enter(&examples::plugins());
    let arguments = match Arguments::try_parse() {
        Ok(arguments) => arguments,
        Err(error) => {
            // Help and version are no errors; what is asked for goes to stdout, a complaint to stderr.
            let code = if error.use_stderr() { 2 } else { 0 };
            let _ = error.print();
            return ExitCode::from(code);
        }
    };
    match done(&arguments.verb) {
        Ok(_) if output::is_lost() => ExitCode::from(2),
        Ok(code) => ExitCode::from(code),
        Err(failure) => {
            failure.print();
            ExitCode::from(failure.code())
        }
    }
}

/// Does what is asked, and returns what the process ends with.
fn done(verb: &Verb) -> Result<u8, Failure> {
    let well = match verb {
        Verb::Run(options) => return run::run(options),
        Verb::Replay(options) => return replay::replay(options),
        Verb::Batch(options) => batch::batch(options),
        Verb::Examples => examples::list(),
        Verb::Plugin(verb) => plugin::plugin(verb),
        Verb::Module(verb) => module::module(verb),
        Verb::Link(options) => link::link(options),
        Verb::Unlink(options) => link::unlink(options),
        Verb::Peers(options) => peers::peers(options),
        Verb::Trace(options) => trace::trace(options),
        Verb::Log(options) => log::log(options),
        Verb::Get { url, json, agent } => property::get(agent, url, *json),
        Verb::List { pattern, json, agent } => property::list(agent, pattern.as_deref(), *json),
        Verb::Snapshot(verb) => snapshot::snapshot(verb),
        Verb::Bag(verb) => bag::bag(verb),
        Verb::Config(verb) => config::config(verb),
        Verb::Stop { reason, agent } => stop::stop(agent, reason),
        Verb::Reset(agent) => stop::reset(agent),
        Verb::Arm { actuator, agent } => stop::arm(agent, actuator.as_deref()),
    };
    well.map(|well| u8::from(!well))
}
