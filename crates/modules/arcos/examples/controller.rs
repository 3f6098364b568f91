//! Simulated Pioneer on a pseudo-terminal.
//! Run it with `cargo run -p slate-arcos --example controller`.

use std::path::PathBuf;
use std::time::Duration;

use clap::Parser;
use slate_arcos_controller::{Controller, ControllerError, ControllerOptions, Faults};

/// Simulate a Pioneer's controller and robot on a pseudo-terminal
#[derive(Parser)]
struct Arguments {
    /// World that comes with the simulator, or a file
    #[arg(long, default_value = "rocs_arena")]
    world: String,
    /// Start pose of the robot: x and y in meters, theta in radians
    #[arg(long, default_value = "0.6,0.8,0", value_parser = pose, allow_hyphen_values = true)]
    at: Pose,
    /// Path that leads to the pseudo-terminal
    #[arg(long)]
    link: Option<PathBuf>,
    /// Seed of the random numbers
    #[arg(long, default_value_t = 0)]
    seed: u64,
    /// Probability that a byte on the line is lost
    #[arg(long, default_value_t = 0.0)]
    drop: f64,
    /// Probability that a byte on the line is damaged
    #[arg(long, default_value_t = 0.0)]
    corrupt: f64,
    /// Number of seconds after which the robot falls silent for ten, repeatedly
    #[arg(long)]
    silent_after: Option<u64>,
}

/// x, y, theta.
type Pose = [f64; 3];

fn pose(text: &str) -> Result<Pose, String> {
    let numbers: Result<Vec<f64>, _> = text.split(',').map(|number| number.trim().parse()).collect();
    let numbers = numbers.map_err(|error| error.to_string())?;
    numbers.try_into().map_err(|_| "expected x,y,theta such as 0.6,0.8,0".into())
}

fn main() {
    if let Err(error) = run(Arguments::parse()) {
        eprintln!("{error}");
        std::process::exit(1);
    }
}

fn run(arguments: Arguments) -> Result<(), ControllerError> {
    let Arguments { world, at, link, seed, drop, corrupt, silent_after } = arguments;
    let faults = Faults { drop, corrupt, ..Faults::default() };
    let controller = Controller::start(ControllerOptions { world, at, seed, link, faults })?;
    println!("{}", controller.path().display());
    let mut shown = [f64::NAN; 3];
    for second in 0_u64.. {
        if let Some(after) = silent_after {
            let silent = second % (after + 10) >= after;
            controller.set_faults(Faults { silent, ..faults });
        }
        let pose = controller.pose();
        if pose != shown {
            let [x, y, theta] = pose;
            println!("{second} s: at {x:.3} {y:.3} m, {theta:.3} rad");
            shown = pose;
        }
        std::thread::sleep(Duration::from_secs(1));
    }
    Ok(())
}
