//! The `slate` command.

mod arguments;
mod bag;
mod batch;
mod check;
mod codes;
mod complete;
mod condition;
mod config;
mod connection;
mod console;
mod course;
mod deployment;
mod display;
mod doctor;
mod duration;
mod examples;
mod failure;
mod graph;
mod interface;
mod link;
mod log;
mod mission;
mod module;
mod new;
mod observation;
mod output;
mod peers;
mod plugin;
mod process;
mod property;
mod ps;
mod record;
mod replay;
mod report;
mod run;
mod scene;
mod snapshot;
mod stat;
mod stop;
mod top;
mod trace;
mod tree;
mod wait;
mod watch;

use std::process::ExitCode;

use clap::Parser;

use arguments::{Arguments, Verb};
use failure::Failure;

fn main() -> ExitCode {
    // An isolated module is this program, started once more.
    slate::runtime::isolation::enter(&examples::plugins());
    complete::answer();
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
        Verb::Try(options) => return replay::try_module(options),
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
        Verb::Set { url, value, json, agent } => property::set(agent, url, value, *json),
        Verb::Watch(options) => return watch::watch(options),
        Verb::Wait(options) => return wait::wait(options),
        Verb::Stat(options) => return stat::stat(options),
        Verb::Tree(options) => tree::tree(options),
        Verb::Top(options) => top::top(options),
        Verb::New(options) => new::new(options),
        Verb::Doctor(options) => return doctor::doctor(options),
        Verb::Interface(verb) => return interface::interface(verb),
        Verb::Explain { codes, json } => codes::explain(codes, *json),
        Verb::Completions { shell } => complete::completions(*shell),
        Verb::Check(options) => return check::check(options),
        Verb::Graph(options) => graph::graph(options),
        Verb::Ps { json } => ps::ps(*json),
        Verb::List { pattern, json, agent } => property::list(agent, pattern.as_deref(), *json),
        Verb::Snapshot(verb) => snapshot::snapshot(verb),
        Verb::Bag(verb) => bag::bag(verb),
        Verb::Report(options) => report::report(options),
        Verb::Record(verb) => record::record(verb),
        Verb::Config(verb) => config::config(verb),
        Verb::Stop { reason, agent } => stop::stop(agent, reason),
        Verb::Reset(agent) => stop::reset(agent),
        Verb::Arm { actuator, agent } => stop::arm(agent, actuator.as_deref()),
    };
    well.map(|well| u8::from(!well))
}
