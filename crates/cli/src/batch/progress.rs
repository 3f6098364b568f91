//! Progress of a batch on stderr.
//! On a terminal a line that is renewed, elsewhere a line now and then.

use std::io::{IsTerminal, Write};
use std::time::{Duration, Instant};

use crossterm::cursor::MoveToColumn;
use crossterm::queue;
use crossterm::terminal::{Clear, ClearType, size};
use slate::report::Summary;

use crate::clock::now;

/// Period at which the progress line is checked for an update.
pub const CHECK_PERIOD: Duration = Duration::from_millis(500);

/// Period of lines where they stay.
const LINE_PERIOD: Duration = Duration::from_secs(30);

/// Number of parts of the runs after each of which a line is printed.
const MAX_PARTS: u64 = 10;

/// Progress display of the runs, until dropped.
pub struct BatchProgress {
    runs: u64,
    done: u64,
    succeeded: u64,
    collisions_caused: u64,
    start: Instant,
    terminal: bool,
    /// Time of the last line.
    printed: Instant,
}

impl BatchProgress {
    /// Creates the progress of a batch at its beginning.
    pub fn new(runs: u64) -> Self {
        let (start, terminal) = (now(), std::io::stderr().is_terminal());
        Self { runs, done: 0, succeeded: 0, collisions_caused: 0, start, terminal, printed: start }
    }

    /// Counts a finished run.
    pub fn note(&mut self, summary: &Summary) {
        let part = |done: u64| u128::from(done) * u128::from(MAX_PARTS) / u128::from(self.runs);
        let is_next_part = part(self.done) < part(self.done + 1);
        self.done += 1;
        self.succeeded += u64::from(summary.succeeded());
        let of_others = summary.robots.values().filter_map(|figures| figures.get("collisions_caused"));
        self.collisions_caused += summary.collisions_caused + of_others.sum::<f64>() as u64;
        // After the last run, its figures follow.
        let is_due = if self.terminal { self.printed.elapsed() >= CHECK_PERIOD } else { is_next_part };
        if is_due && self.done < self.runs {
            self.print();
        }
    }

    /// Updates the line as time passes.
    pub fn show(&mut self) {
        if self.terminal || self.printed.elapsed() >= LINE_PERIOD {
            self.print();
        }
    }

    fn print(&mut self) {
        self.printed = now();
        let text = self.text();
        let mut out = std::io::stderr().lock();
        // A closed output is ignored.
        let _ = if self.terminal {
            // A line that wraps could not be written over. Some terminals don't know their width.
            let columns = size().ok().filter(|(columns, _)| *columns > 0).map_or(80, |(columns, _)| columns);
            let text: String = text.chars().take(usize::from(columns - 1)).collect();
            let _ = queue!(out, MoveToColumn(0), Clear(ClearType::CurrentLine));
            write!(out, "{text}").and_then(|()| out.flush())
        } else {
            writeln!(out, "{text}")
        };
    }

    fn text(&self) -> String {
        let Self { runs, done, succeeded, collisions_caused, .. } = self;
        let collisions = if *collisions_caused == 1 { "collision" } else { "collisions" };
        let mut text =
            format!("{done} of {runs} runs, {succeeded} succeeded, {collisions_caused} {collisions} caused");
        if *done > 0 {
            let left = self.start.elapsed().as_secs_f64() * (runs - done) as f64 / *done as f64;
            text += &format!(", {} left", duration(left));
        }
        text
    }
}

impl Drop for BatchProgress {
    fn drop(&mut self) {
        if self.terminal {
            let mut out = std::io::stderr().lock();
            let _ = queue!(out, MoveToColumn(0), Clear(ClearType::CurrentLine));
            let _ = out.flush();
        }
    }
}

/// Returns a duration in its two greatest units.
fn duration(seconds: f64) -> String {
    let seconds = seconds.round() as u64;
    let (minutes, hours) = (seconds / 60, seconds / 3600);
    match (hours, minutes) {
        (0, 0) => format!("{seconds} s"),
        (0, _) => format!("{minutes} min {} s", seconds % 60),
        _ => format!("{hours} h {} min", minutes % 60),
    }
}

#[cfg(test)]
mod tests {
    use super::duration;

    #[test]
    fn a_duration_has_its_two_greatest_units() {
        let texts = [0.4, 59.6, 200.0, 7384.0].map(duration);
        assert_eq!(texts, ["0 s", "1 min 0 s", "3 min 20 s", "2 h 3 min"]);
    }
}
