//! Driving by keys.
//!
//! A terminal tells which keys are pressed, and not when they are let go; it repeats one that is held. So a key commands for a
//! short while, and its repetition renews that; between keys the robot is held still, whatever its plan wants. Whatever becomes of
//! this program, of the terminal or of the connection behind it: the agent ends what was commanded last by its own clock.

mod drive;
mod keys;

use std::io::{IsTerminal, Read, Write};
use std::time::{Duration, Instant};

use clap::Args;
use crossterm::cursor::MoveToColumn;
use crossterm::queue;
use crossterm::terminal::{Clear, ClearType, disable_raw_mode, enable_raw_mode};
use rustix::event::{PollFd, PollFlags, Timespec, poll};
use serde_json::Value;
use slate::control::{Client, ClientError};

use crate::clock::now;
use crate::connection::AgentOption;
use crate::failure::Failure;
use crate::interrupt::{self, is_interrupted};
use crate::output;
use drive::Drive;
use keys::Key;

#[derive(Debug, Args)]
pub struct TeleopOptions {
    /// Actuator, such as `r2/wheels` [default: the only one]
    actuator: Option<String>,

    /// Linear velocity, m/s
    #[arg(long, value_name = "M/S", default_value_t = 0.3, value_parser = positive)]
    speed: f64,

    /// Angular velocity, rad/s
    #[arg(long, value_name = "RAD/S", default_value_t = 0.8, value_parser = positive)]
    turn: f64,

    #[command(flatten)]
    agent: AgentOption,
}

fn positive(text: &str) -> Result<f64, String> {
    match text.parse::<f64>() {
        Ok(number) if number.is_finite() && number > 0.0 => Ok(number),
        _ => Err("expected a positive number, such as 0.3".into()),
    }
}

/// Time to wait for keys before the robot is commanded to stand still again.
/// A command holds for three times as long.
const KEY_POLL_PERIOD: Timespec = Timespec { tv_sec: 0, tv_nsec: 50_000_000 };

/// Time that a key counts, longer than the period of its repetition.
const KEY_DURATION: Duration = Duration::from_millis(150);

/// Factor by which + and - change the velocity.
const VELOCITY_STEP: f64 = 1.25;

const KEY_HELP: &str = "w a s d or arrows: drive, q e z c: curves, x: halt, + -: speed,\n\
                    space: stop all actuators, Esc: quit; the robot stands still while no key is held";

/// Raw mode of the terminal until dropped: keys arrive at once, without echo.
struct RawTerminal;

impl RawTerminal {
    fn begin() -> Result<Self, Failure> {
        enable_raw_mode().map_err(|source| Failure::File { path: "the terminal".into(), source })?;
        Ok(Self)
    }
}

impl Drop for RawTerminal {
    fn drop(&mut self) {
        let _ = disable_raw_mode();
    }
}

/// Drives until the driver quits.
pub fn teleop(options: &TeleopOptions) -> Result<bool, Failure> {
    if !std::io::stdin().is_terminal() {
        return Err(Failure::NoTerminal);
    }
    let mut client = options.agent.connect()?;
    let actuator = match &options.actuator {
        Some(name) => name.trim_start_matches('/').to_owned(),
        None => only_actuator(&mut client)?,
    };
    let controls =
        client.take_controls(&actuator, &format!("slate teleop, process {}", std::process::id()))?;
    let drive = Drive::of(&mut client, &controls)?;
    interrupt::catch();
    eprintln!("{KEY_HELP}");
    let driven = {
        let _raw = RawTerminal::begin()?;
        run(&mut client, &actuator, &drive, (options.speed, options.turn))
    };
    eprintln!();
    match driven {
        Err(Failure::Agent(ClientError::Lost { name, .. })) => eprintln!("agent `{name}` has ended"),
        driven => {
            driven?;
            client.leave_controls()?;
            eprintln!("control of {actuator} is released");
        }
    }
    Ok(true)
}

/// Returns the only actuator.
fn only_actuator(client: &mut Client) -> Result<String, Failure> {
    let names: Vec<_> = client.controls()?.into_iter().map(|holder| holder.actuator).collect();
    match <[String; 1]>::try_from(names) {
        Ok([name]) => Ok(name),
        Err(known) => Err(Failure::NoActuator { known }),
    }
}

fn run(client: &mut Client, actuator: &str, drive: &Drive, speeds: (f64, f64)) -> Result<(), Failure> {
    let mut stdin = std::io::stdin().lock();
    let (speed, turn) = speeds;
    let mut factor = 1.0;
    let mut driven: Option<Instant> = None;
    loop {
        if is_interrupted() {
            return Ok(());
        }
        let mut motion = None;
        for key in read_keys(&mut stdin)? {
            match key {
                Key::Drive(forward, left) => motion = Some((forward, left)),
                Key::Halt => (motion, driven) = (None, None),
                Key::Faster => factor *= VELOCITY_STEP,
                Key::Slower => factor /= VELOCITY_STEP,
                Key::Stop => client.stop("by a person at the keyboard")?,
                Key::Quit => return Ok(()),
            }
        }
        let command = match motion {
            Some((forward, left)) => {
                driven = Some(now());
                Some(drive.command(forward * speed * factor, left * turn * factor))
            }
            None if driven.is_some_and(|driven| driven.elapsed() < KEY_DURATION) => None,
            None => Some(drive.command(0.0, 0.0)),
        };
        let Some(command) = command else { continue };
        let gate = client.command(command)?;
        show(actuator, (speed * factor, turn * factor), &gate);
    }
}

/// Reads the keys pressed since, and waits briefly for one.
fn read_keys(stdin: &mut std::io::StdinLock<'_>) -> Result<Vec<Key>, Failure> {
    let lost = |source| Failure::File { path: "the terminal".into(), source };
    let mut polled = [PollFd::new(&*stdin, PollFlags::IN)];
    match poll(&mut polled, Some(&KEY_POLL_PERIOD)) {
        Ok(0) => return Ok(Vec::new()),
        Ok(_) => {}
        // A signal came, and is looked at.
        Err(rustix::io::Errno::INTR) => return Ok(Vec::new()),
        Err(error) => return Err(lost(error.into())),
    }
    // Larger than what the reader keeps for itself, so that what is polled is all that there is.
    let mut bytes = vec![0; 64 << 10];
    match stdin.read(&mut bytes) {
        // The terminal is closed.
        Ok(0) => Ok(vec![Key::Quit]),
        Ok(count) => Ok(keys::parse(&bytes[..count])),
        Err(error) if error.kind() == std::io::ErrorKind::Interrupted => Ok(Vec::new()),
        Err(error) => Err(lost(error)),
    }
}

/// Shows speeds and gate in a line that is written over.
fn show(actuator: &str, (speed, turn): (f64, f64), gate: &Value) {
    let mut out = std::io::stderr();
    if !out.is_terminal() {
        return;
    }
    let text = |name: &str| gate.get(name).and_then(Value::as_str).unwrap_or("-").to_lowercase();
    let hint = match text("mode").as_str() {
        "disarmed" => format!(": slate arm {actuator}"),
        "stopped" => ": slate reset, then slate arm".into(),
        _ => String::new(),
    };
    let line = format!(
        "{actuator} {}{hint}, source {}; {speed:.2} m/s, {turn:.2} rad/s",
        text("mode"),
        text("priority"),
    );
    let _ = queue!(out, MoveToColumn(0), Clear(ClearType::CurrentLine));
    let _ = write!(out, "{}", output::harmless(line));
    let _ = out.flush();
}
