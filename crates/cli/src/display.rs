//! The live display: how the robots stand, ten times a second. It reads by copying, so the run never waits for it.

use std::collections::VecDeque;
use std::fmt::Write as _;
use std::io::{IsTerminal, Write};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, PoisonError};
use std::thread::JoinHandle;
use std::time::Duration;

use crossterm::cursor::{MoveToColumn, MoveUp};
use crossterm::queue;
use crossterm::style::Stylize;
use crossterm::terminal::{Clear, ClearType, size};
use slate::module::Level;
use slate::record::Route;
use slate::runtime::log::{LogTarget, MemoryTarget, Record};

use crate::mission::Mission;
use crate::observation::Observation;
use crate::output;

/// The log of a run whose display owns the terminal: above the robots, and kept for the report.
#[derive(Clone, Default)]
pub struct Lines {
    pub kept: MemoryTarget,
    /// What is not shown yet.
    fresh: Arc<Mutex<VecDeque<Record>>>,
}

impl Lines {
    fn fresh(&self) -> VecDeque<Record> {
        std::mem::take(&mut self.fresh.lock().unwrap_or_else(PoisonError::into_inner))
    }
}

impl LogTarget for Lines {
    fn write(&mut self, record: &Record) {
        self.kept.write(record);
        let mut fresh = self.fresh.lock().unwrap_or_else(PoisonError::into_inner);
        // More than that passes too fast to be read.
        if fresh.len() < MemoryTarget::CAPACITY {
            fresh.push_back(record.clone());
        }
    }
}

/// Shows a run until it is dropped.
pub struct Display {
    stop: Arc<AtomicBool>,
    thread: Option<JoinHandle<()>>,
}

impl Display {
    /// Begins to show a run.
    pub fn start(name: &str, seed: u64, mission: &Mission, lines: &Lines) -> Self {
        let stop = Arc::new(AtomicBool::new(false));
        let (stopped, observation) = (Arc::clone(&stop), Arc::clone(&mission.observation));
        let title = format!("{name}, seed {seed}");
        let (clock, lines) = (mission.agent.clock(), lines.clone());
        let thread = std::thread::Builder::new()
            .name("display".into())
            .spawn(move || show(&title, &observation, &clock, &lines, &stopped))
            .ok();
        Self { stop, thread }
    }
}

impl Drop for Display {
    fn drop(&mut self) {
        self.stop.store(true, Ordering::Release);
        if let Some(thread) = self.thread.take() {
            // A display that failed has shown what it could.
            let _ = thread.join();
        }
    }
}

fn show(title: &str, observation: &Observation, clock: &dyn Fn() -> u64, log: &Lines, stop: &AtomicBool) {
    let mut out = std::io::stdout();
    let (terminal, colour) = (out.is_terminal(), output::has_colour(&out));
    let period = if terminal { Duration::from_millis(100) } else { Duration::from_secs(1) };
    output::line(title);
    let mut lines = 0;
    loop {
        let last = stop.load(Ordering::Acquire);
        // A line that wraps could not be drawn over again.
        let width = if terminal { size().map_or(80, |(columns, _)| columns.into()) } else { usize::MAX };
        let text = frame(observation, clock(), colour, width);
        if terminal {
            if lines > 0 {
                let _ = queue!(out, MoveUp(lines));
            }
            let _ = queue!(out, MoveToColumn(0), Clear(ClearType::FromCursorDown));
            lines = text.lines().count() as u16;
            log.fresh().iter().for_each(|line| output::line(said(line, colour)));
        }
        let _ = out.write_all(text.as_bytes());
        let _ = out.flush();
        if last {
            break;
        }
        // Short naps, so that the end of the run is not waited for.
        let mut left = period;
        while !left.is_zero() && !stop.load(Ordering::Acquire) {
            let nap = left.min(Duration::from_millis(20));
            std::thread::sleep(nap);
            left -= nap;
        }
    }
}

/// A line of the log.
fn said(record: &Record, colour: bool) -> String {
    let text = record.to_string();
    match record.level {
        _ if !colour => text,
        Level::Error => text.red().to_string(),
        Level::Warn => text.yellow().to_string(),
        _ => text,
    }
}

/// A line per robot, none longer than `width`.
fn frame(observation: &Observation, now: u64, colour: bool, width: usize) -> String {
    let mut text = String::new();
    for robot in &observation.robots {
        let Some(state) = robot.now() else { continue };
        let mut line = format!(
            "t {:5.1} s {:3} ({:+.2}, {:+.2}) m {:+4.0} deg",
            now as f64 * 1e-9,
            robot.name,
            state.x,
            state.y,
            state.theta.to_degrees()
        );
        if let Some(clearance) = state.clearance {
            let _ = write!(line, " clear {clearance:.2} m");
        }
        let before = line.chars().count();
        if let Some(route) = state.route {
            let _ = write!(line, " {:12}", route.name());
        }
        // The whole tree of actions where there is room, else the one at its root.
        let room = width.saturating_sub(line.chars().count() + 2);
        let action = if state.tree.chars().count() <= room { &state.tree } else { &state.action };
        let _ = write!(line, " {action}");
        let line: String = line.trim_end().chars().take(width.saturating_sub(1)).collect();
        let (figures, action): (String, String) =
            (line.chars().take(before).collect(), line.chars().skip(before).collect());
        text.push_str(&figures);
        match state.route {
            Some(Route::Deliberative) if colour => {
                let _ = write!(text, "{}", action.red());
            }
            Some(Route::Reactive) if colour => {
                let _ = write!(text, "{}", action.blue());
            }
            _ => text.push_str(&action),
        }
        text.push('\n');
    }
    text
}
