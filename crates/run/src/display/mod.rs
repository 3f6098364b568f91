//! Live display of a run.
//! Robots, map and events in a terminal, plain lines elsewhere.
//!
//! It reads by copying, so the run never waits for it.

mod frame;
mod history;
mod log;
mod map;
mod styled;

use std::io::{IsTerminal, Write};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

use crossterm::cursor::{MoveToColumn, MoveUp};
use crossterm::queue;
use crossterm::style::Stylize;
use crossterm::terminal::{Clear, ClearType, size};
use slate_module::Level;
use slate_report::Scene;
use slate_runtime::log::Record;

use crate::clock::now;
use crate::mission::MissionRun;
use crate::observation::Observation;
use crate::output;
use frame::FrameLayout;
use history::SeenRun;
pub use log::DisplayLog;

/// Time from one frame to the next.
const FRAME_PERIOD: Duration = Duration::from_millis(100);

/// Time from one line per robot to the next where stdout is not a terminal.
const LINE_PERIOD: Duration = Duration::from_secs(1);

/// Time over which the pace is measured.
const PACE_PERIOD: Duration = Duration::from_secs(1);

/// Name and seed of a run.
pub struct RunTitle {
    pub name: String,
    pub seed: u64,
}

/// Shows a run until it is dropped.
pub struct LiveDisplay {
    stop: Arc<AtomicBool>,
    thread: Option<JoinHandle<()>>,
}

impl LiveDisplay {
    /// Starts to show a run.
    pub fn start(run: &RunTitle, mission: &MissionRun, log: &DisplayLog) -> Self {
        let stop = Arc::new(AtomicBool::new(false));
        let stopped = Arc::clone(&stop);
        let mut view = RunView {
            title: format!("{}, seed {}", run.name, run.seed),
            observation: Arc::clone(&mission.observation),
            scene: mission.scene().clone(),
            clock: Box::new(mission.agent.clock()),
            log: log.clone(),
            seen: SeenRun::default(),
            pace: PaceMeter { since: (now(), 0), factor: None },
        };
        let show = move || match std::io::stdout().is_terminal() {
            true => view.show_frames(&stopped),
            false => view.show_lines(&stopped),
        };
        let thread = std::thread::Builder::new().name("display".into()).spawn(show).ok();
        Self { stop, thread }
    }
}

impl Drop for LiveDisplay {
    fn drop(&mut self) {
        self.stop.store(true, Ordering::Release);
        if let Some(thread) = self.thread.take() {
            // A display that failed has shown what it could.
            let _ = thread.join();
        }
    }
}

/// Run that a display shows.
struct RunView {
    title: String,
    observation: Arc<Observation>,
    scene: Scene,
    clock: Box<dyn Fn() -> u64 + Send>,
    log: DisplayLog,
    seen: SeenRun,
    pace: PaceMeter,
}

impl RunView {
    fn update(&mut self) {
        let time = (self.clock)();
        self.seen.update(&self.observation, time);
        self.pace.note(now(), time);
    }

    /// Draws frames over each other; log lines scroll away above them.
    fn show_frames(&mut self, stop: &AtomicBool) {
        let mut out = std::io::stdout();
        let has_color = output::has_color(&out);
        let mut drawn = 0;
        let mut laid_out: Option<((u16, u16, usize), FrameLayout)> = None;
        loop {
            let is_last = stop.load(Ordering::Acquire);
            self.update();
            let (columns, rows) = size().unwrap_or((80, 24));
            let key = (columns.max(20), rows.max(4), self.seen.robots.len());
            let (_, layout) = match laid_out.take() {
                Some(known) if known.0 == key => laid_out.insert(known),
                _ => {
                    let size = (usize::from(key.0), usize::from(key.1));
                    laid_out.insert((key, FrameLayout::new(&self.scene, key.2, size)))
                }
            };
            let lines = layout.lines(&self.title, self.pace.factor, &self.seen, &self.scene);
            if drawn > 0 {
                let _ = queue!(out, MoveUp(drawn));
            }
            let _ = queue!(out, MoveToColumn(0));
            let fresh = self.log.fresh();
            if !fresh.is_empty() {
                let _ = queue!(out, Clear(ClearType::FromCursorDown));
                fresh.iter().for_each(|record| output::line(log_line(record, has_color)));
            }
            drawn = lines.len() as u16;
            for line in lines {
                // A line that wraps could not be drawn over.
                let _ = write!(out, "{}", line.render(layout.columns - 1, has_color));
                // Not all at once before, as that flickers.
                let _ = queue!(out, Clear(ClearType::UntilNewLine));
                let _ = writeln!(out);
            }
            let _ = queue!(out, Clear(ClearType::FromCursorDown));
            let _ = out.flush();
            if is_last || output::is_unread() {
                return;
            }
            nap(FRAME_PERIOD, stop);
        }
    }

    /// Prints a line per robot each second, and events as they come.
    fn show_lines(&mut self, stop: &AtomicBool) {
        output::line(&self.title);
        let (mut last_event, mut due) = (0, now());
        loop {
            let is_last = stop.load(Ordering::Acquire);
            self.update();
            for own in self.seen.events_from(last_event) {
                output::line(frame::event(own).render(usize::MAX, false));
            }
            last_event = self.seen.event_count;
            if now() >= due || is_last {
                due = now() + LINE_PERIOD;
                let time = self.seen.time as f64 * 1e-9;
                for (name, track) in &self.seen.robots {
                    let line = frame::robot(name, track, true, usize::MAX);
                    output::line(format_args!("{time:7.1} s  {}", line.render(usize::MAX, false)));
                }
            }
            if is_last || output::is_unread() {
                return;
            }
            nap(FRAME_PERIOD, stop);
        }
    }
}

/// Measurement of the agent's time rate.
struct PaceMeter {
    since: (Instant, u64),
    /// Seconds of the agent's time per second of the wall clock.
    /// `None` before it is measured.
    factor: Option<f64>,
}

impl PaceMeter {
    fn note(&mut self, wall: Instant, time: u64) {
        let (before, from) = self.since;
        let passed = wall.saturating_duration_since(before);
        if passed >= PACE_PERIOD {
            self.factor = time.checked_sub(from).map(|time| time as f64 * 1e-9 / passed.as_secs_f64());
            self.since = (wall, time);
        }
    }
}

/// Sleeps, but not beyond the end of the run.
fn nap(period: Duration, stop: &AtomicBool) {
    let mut left = period;
    while !left.is_zero() && !stop.load(Ordering::Acquire) {
        let part = left.min(Duration::from_millis(20));
        std::thread::sleep(part);
        left -= part;
    }
}

/// Returns a line of the log, colored by level.
fn log_line(record: &Record, has_color: bool) -> String {
    let text = record.to_string();
    match record.level {
        _ if !has_color => text,
        Level::Error => text.red().to_string(),
        Level::Warn => text.yellow().to_string(),
        _ => text,
    }
}
