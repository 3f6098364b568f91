//! `slate` command.

// Its macros print to stderr without a panic.
#[macro_use(eprint, eprintln)]
extern crate slate_run;

mod api;
mod arguments;
mod bag;
mod batch;
mod browse;
mod changes;
mod check;
mod codes;
mod complete;
mod completions;
mod condition;
mod config;
mod connection;
mod deployment;
mod doctor;
mod duration;
mod endpoint;
mod evaluate;
#[cfg(feature = "console")]
mod export;
mod failure;
mod features;
mod gates;
mod goal;
mod graph;
mod interface;
mod interrupt;
mod link;
mod local_agents;
mod log;
mod man;
mod map;
mod mcp;
mod mission;
mod module;
mod new;
mod offline;
mod peers;
mod playback_console;
mod plugin;
mod process;
mod property;
mod ps;
mod record;
mod recording;
mod replay;
mod report;
mod role;
mod ros;
mod run;
mod run_options;
mod send;
mod snapshot;
mod stat;
mod stop;
mod teleop;
mod token;
mod top;
mod trace;
mod tree;
mod urls;
mod value_input;
mod value_text;
mod wait;
mod watch;
mod words;

use std::io::Write;
use std::process::ExitCode;

use clap::{ColorChoice, CommandFactory, FromArgMatches};

use arguments::{Arguments, Verb};
use failure::Failure;
use slate_robotics_cli::examples;
use slate_run::{clock, number, output, scene};

fn main() -> ExitCode {
    // An isolated module is this program, started once more.
    slate::runtime::isolation::enter(&examples::plugins());
    completions::answer();
    let arguments = match parsed() {
        Ok(arguments) => arguments,
        // Help and version are not errors; requested text goes to stdout, errors to stderr.
        Err(Failure::Words(error)) if !error.use_stderr() => {
            output::note(error.print().and_then(|()| std::io::stdout().flush()));
            return ExitCode::from(if output::is_lost() { 2 } else { 0 });
        }
        Err(failure) => {
            failure.print();
            return ExitCode::from(failure.code());
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

/// Parses the arguments, with colors as requested.
fn parsed() -> Result<Arguments, Failure> {
    let words = words::with_agent_behind(words::of_stop(std::env::args_os().collect()));
    let is_said = |wanted: &str| words.iter().take_while(|word| *word != "--").any(|word| word == wanted);
    output::set_json(is_said("--json"));
    let mut command = words::with_negative_values(Arguments::command());
    let said = words.iter().zip(words.iter().skip(1).map(Some).chain([None])).find_map(|(word, next)| {
        match word.to_str()?.split_once('=') {
            Some(("--color", when)) => Some(when.to_owned()),
            None if word == "--color" => next?.to_str().map(str::to_owned),
            _ => None,
        }
    });
    command = match said.as_deref() {
        Some("always") => command.color(ColorChoice::Always),
        Some("never") => command.color(ColorChoice::Never),
        _ => command,
    };
    words::check_leading(&words, &command)?;
    let matches = command.try_get_matches_from(words).map_err(Failure::Words)?;
    let arguments = Arguments::from_arg_matches(&matches).map_err(Failure::Words)?;
    output::set_color(arguments.color);
    Ok(arguments)
}

/// Runs the command; returns the exit code.
fn done(verb: &Verb) -> Result<u8, Failure> {
    let well = match verb {
        Verb::Run(verb) => return run::run(verb),
        Verb::Replay(options) => return replay::replay(options),
        Verb::Try(options) => return replay::try_module(options),
        Verb::Batch(options) => batch::batch(options),
        Verb::Examples { json } => {
            examples::list(*json);
            Ok(true)
        }
        Verb::Plugin(verb) => plugin::plugin(verb),
        Verb::Module(verb) => module::module(verb),
        Verb::Link(options) => link::link(options),
        Verb::Unlink(options) => link::unlink(options),
        Verb::Peers(options) => peers::peers(options),
        Verb::Trace(options) => trace::trace(options),
        Verb::Log(options) => log::log(options),
        Verb::Get { url, json, agent } => return property::get(agent, url, *json),
        Verb::Set { url, value, json, agent } => property::set(agent, url, value, *json),
        Verb::Send(options) => send::send(options),
        Verb::Watch(options) => return watch::watch(options),
        Verb::Wait(options) => wait::wait(options),
        Verb::Stat(options) => return stat::stat(options),
        Verb::Ros(verb) => return ros::ros(verb),
        Verb::Tree(options) => tree::tree(options),
        Verb::Top(options) => top::top(options),
        Verb::New(options) => new::new(options),
        Verb::Api(options) => api::api(options),
        Verb::Console(options) => browse::console(options),
        Verb::Goal(options) => goal::goal(options),
        Verb::Teleop(options) => teleop::teleop(options),
        Verb::Mcp(options) => mcp::mcp(options),
        Verb::Man { folder } => man::man(folder),
        Verb::Doctor(options) => return doctor::doctor(options),
        Verb::Evaluate(verb) => return evaluate::evaluate(verb),
        Verb::Interface(verb) => return interface::interface(verb),
        Verb::Explain { codes, json } => codes::explain(codes, *json),
        Verb::Completions { shell } => completions::completions(*shell),
        Verb::Check(options) => return check::check(options),
        Verb::Graph(options) => graph::graph(options),
        Verb::Ps { json } => ps::ps(*json),
        Verb::List { pattern, json, agent } => property::list(agent, pattern.as_deref(), *json),
        Verb::Snapshot(verb) => snapshot::snapshot(verb),
        Verb::Map(verb) => map::map(verb),
        Verb::Mission(verb) => return mission::mission(verb),
        Verb::Bag(verb) => bag::bag(verb),
        Verb::Report(options) => report::report(options),
        Verb::Record(verb) => record::record(verb),
        Verb::Config(verb) => config::config(verb),
        Verb::Stop(options) => return stop::stop(options),
        Verb::Reset(options) => stop::reset(options),
        Verb::Arm(options) => stop::arm(options),
    };
    well.map(|well| u8::from(!well))
}
