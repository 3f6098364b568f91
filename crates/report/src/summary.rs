use crate::Error;
use serde::{Deserialize, Serialize};
use std::fmt;

use slate_sorted::SortedMap;

/// Outcome of a run.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Outcome {
    /// The goal was reached, without a caused collision.
    /// Where holding the goal is the mission, it was held as well.
    // The alias, as the one below, is of summaries from before the judge's own word had its field.
    #[serde(alias = "gap_kept")]
    GoalReached,
    /// A collision was caused, whatever else was achieved.
    Collided,
    /// The time for the run was up before the task was done.
    #[serde(alias = "gap_left", alias = "goal_left")]
    TimedOut,
    /// The run was stopped from outside.
    Stopped,
    /// The run ended with an error.
    Failed,
}

impl Outcome {
    /// Returns true if the run did its task and caused no collision.
    pub fn is_success(self) -> bool {
        self == Outcome::GoalReached
    }
}

impl fmt::Display for Outcome {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.write_str(match self {
            Outcome::GoalReached => "goal reached",
            Outcome::Collided => "collided",
            Outcome::TimedOut => "timed out",
            Outcome::Stopped => "stopped",
            Outcome::Failed => "failed",
        })
    }
}

/// Figures of one run.
/// Lengths and times are finite; JSON has only `null` for others, which cannot be read back.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Summary {
    /// Name of the example.
    pub example: String,
    /// Seed of all random streams.
    pub seed: u64,
    /// Execution mode of the agent: staged, threaded, ...
    pub mode: String,
    /// Conditions of the figures: `sensor_profile`, `noise`, `speed`, ...
    #[serde(default)]
    pub conditions: SortedMap<String, String>,
    /// Outcome of the run.
    pub outcome: Outcome,
    /// The judge's own word for the outcome, such as `gap_left` for `timed_out`.
    /// `None` if it has no other word.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub verdict: Option<String>,
    /// Message about the outcome, such as the error.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub message: Option<String>,
    /// Simulated time from start to end, seconds.
    pub sim_time_s: f64,
    /// Wall time from start to end, seconds.
    /// The only figure that differs between equal runs.
    pub wall_time_s: f64,
    /// Time at which the robot reached its last goal, seconds; `None` if it did not.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub time_to_goal_s: Option<f64>,
    /// Length of the robot's path, meters; none of a run without a judge.
    #[serde(default)]
    pub path_length_m: Option<f64>,
    /// Length of the shortest path without collision from start to goal, meters.
    /// `None` for a run without a judge.
    #[serde(default)]
    pub shortest_path_m: Option<f64>,
    /// Contacts of the robot with anything.
    pub collisions: u64,
    /// Contacts where the robot was the one moving in.
    pub collisions_caused: u64,
    /// Smallest distance of the robot to anything, meters.
    /// `None` in an empty world.
    pub min_clearance_m: Option<f64>,
    /// Number of changes of the active route between deliberative and reactive.
    pub route_switches: u64,
    /// Actions pushed by reactive models.
    pub reflexes: u64,
    /// Further figures, by the referee's name: `gap_in_band`, ...
    #[serde(default, skip_serializing_if = "SortedMap::is_empty")]
    pub figures: SortedMap<String, f64>,
    /// Figures of further robots, by robot and the referee's name: `path_length`, ...
    #[serde(default, skip_serializing_if = "SortedMap::is_empty")]
    pub robots: SortedMap<String, SortedMap<String, f64>>,
    /// The units of `figures` and of those in `robots`, by name; none for pure numbers.
    #[serde(default, skip_serializing_if = "SortedMap::is_empty")]
    pub units: SortedMap<String, String>,
    /// Steps of the main loop.
    pub ticks: u64,
    /// Digest of everything the run computed; equal runs have equal digests.
    pub digest: String,
}

impl Summary {
    /// Returns true if the task was done without a caused collision.
    pub fn succeeded(&self) -> bool {
        self.outcome.is_success()
    }

    /// Returns true if the last goal was reached, with or without collisions.
    pub fn reached_goal(&self) -> bool {
        self.time_to_goal_s.is_some() || self.outcome == Outcome::GoalReached
    }

    /// Returns the summary as one line of JSON, without line feed.
    ///
    /// # Errors
    /// If the JSON encoder refuses a value, which no value of these fields makes it do.
    pub fn json_line(&self) -> Result<String, Error> {
        Ok(serde_json::to_string(self)?)
    }

    /// Returns the outcome in words: the judge's own ones, if it has any.
    pub fn outcome_text(&self) -> String {
        self.verdict.as_ref().map_or_else(|| self.outcome.to_string(), |verdict| verdict.replace('_', " "))
    }

    /// Returns the headline of the run.
    pub fn headline(&self) -> String {
        // A message that only repeats the outcome is left out.
        let message = self.message.as_ref().filter(|message| **message != self.outcome_text());
        self.title() + &message.map_or(String::new(), |message| format!(": {message}"))
    }

    /// Formats a figure with its unit.
    /// Whole numbers, such as counts, have no decimals.
    fn measured(&self, name: &str, value: f64) -> String {
        let decimals = if value.fract() == 0.0 { 0 } else { 3 };
        let unit = self.units.get(name).map_or("", String::as_str);
        format!("{value:.decimals$} {unit}").trim_end().to_owned()
    }

    /// Returns the figures with their units, by name.
    pub(crate) fn rows(&self) -> Vec<(String, String)> {
        let mut rows = Vec::new();
        let mut row = |name: &str, value: String| rows.push((name.to_owned(), value));
        if let Some(length) = self.path_length_m {
            let shortest = self.shortest_path_m.map(|shortest| format!("  (shortest {shortest:.2} m)"));
            row("path length", format!("{length:.2} m{}", shortest.unwrap_or_default()));
            if let Some(time) = self.time_to_goal_s {
                row("time to goal", format!("{time:.2} s"));
            }
            let caused = self.collisions_caused;
            row("collisions", format!("{}  (caused by the robot: {caused})", self.collisions));
            let clearance = self.min_clearance_m.map(|meters| format!("{meters:.3} m"));
            row("least clearance", clearance.unwrap_or_else(|| "no obstacle".to_owned()));
        }
        if self.path_length_m.is_some() || self.route_switches + self.reflexes > 0 {
            row("route switches", self.route_switches.to_string());
            row("reflexes", self.reflexes.to_string());
        }
        for (name, value) in &self.figures {
            row(&name.replace('_', " "), self.measured(name, *value));
        }
        for (robot, figures) in &self.robots {
            for (name, value) in figures {
                row(&format!("{robot}: {}", name.replace('_', " ")), self.measured(name, *value));
            }
        }
        row("simulated time", format!("{:.2} s  ({} ticks)", self.sim_time_s, self.ticks));
        let speed = if self.wall_time_s > 0.0 {
            format!("  ({:.1} times real time)", self.sim_time_s / self.wall_time_s)
        } else {
            String::new()
        };
        row("wall time", format!("{:.3} s{speed}", self.wall_time_s));
        row("mode", self.mode.clone());
        for (name, value) in &self.conditions {
            row(&name.replace('_', " "), value.clone());
        }
        row("digest", self.digest.clone());
        rows
    }

    /// Returns the headline without the message, which may be long.
    pub(crate) fn title(&self) -> String {
        let Summary { example, seed, sim_time_s, .. } = self;
        format!("{example}, seed {seed}: {} after {sim_time_s:.1} s", self.outcome_text())
    }

    /// Returns the conditions in one line.
    pub(crate) fn caption(&self) -> String {
        let conditions =
            self.conditions.iter().map(|(name, value)| format!("{}: {value}", name.replace('_', " ")));
        let mode = [format!("mode: {}", self.mode)];
        mode.into_iter().chain(conditions).collect::<Vec<_>>().join("  ·  ")
    }
}

/// Format of the terminal: the headline, then the figures with their units.
impl fmt::Display for Summary {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        writeln!(formatter, "{}", self.headline())?;
        self.rows().iter().try_for_each(|(name, value)| writeln!(formatter, "  {name:<15} {value}"))
    }
}
