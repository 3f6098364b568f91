//! Agent with one module that does nothing at 100 Hz.
//! It prints a line after its first cycle, and ends when its input ends.

use std::io::Read;
use std::process::ExitCode;

use slate_module::Plugin;
use slate_module::prelude::*;
use slate_runtime::configuration::{Database, Options as Layers};
use slate_runtime::{Agent, Control, Options};

/// No ports.
#[ports]
pub struct NoIo {}

/// Does nothing.
pub struct Idle;

#[module(stage = Think)]
impl Module for Idle {
    type Io = NoIo;
    type Params = ();
    type State = ();

    fn tick(_: &mut (), _: &NoIo, _: &(), _: &Tick) -> Outcome {
        Outcome::Ok
    }
}

const TEXT: &str = "[loop]\nperiod = \"10ms\"\n[log.targets]\nconsole = false\n[modules.idle]\n";

fn run() -> Result<(), String> {
    let database = Database::from_text("minimal.toml", TEXT, Layers::default());
    let database = database.map_err(|error| format!("{error:?}"))?;
    let agent = Agent::load_with(&database, &[Plugin::linked::<Idle>()], Options::default());
    let mut agent = agent.map_err(|error| error.to_string())?;
    let stopper = agent.stopper();
    std::thread::spawn(move || {
        let _ = std::io::stdin().read(&mut [0]);
        stopper.stop();
    });
    let observer = |cycle: &slate_runtime::Cycle<'_>| {
        if cycle.number == 1 {
            println!("runs");
        }
        Control::Continue
    };
    agent.run(Box::new(observer)).map(drop).map_err(|error| error.to_string())
}

fn main() -> ExitCode {
    match run() {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("error: {error}");
            ExitCode::FAILURE
        }
    }
}
