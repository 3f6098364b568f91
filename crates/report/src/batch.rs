//! Statistics over many runs.

mod text;

use crate::{
    Error, Outcome, Summary,
    statistics::{percentile, poisson_bound, sum, wilson_interval},
};
use serde::{Deserialize, Serialize};
use slate_sorted::{SortedMap, SortedSet};

/// Statistics over the summaries of many runs.
/// They do not depend on the order of the runs. Statistics without data are `None` (`null` in JSON).
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Batch {
    /// Name of the example; `various` if the runs differ.
    pub example: String,
    /// Execution mode of the agents; `various` if the runs differ.
    pub mode: String,
    /// Conditions of the figures; `various` where the runs differ.
    pub conditions: SortedMap<String, String>,
    /// Number of runs.
    pub runs: u64,
    /// Set if the batch was interrupted before its last run.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub interrupted: bool,
    /// Number of requested runs, if the batch was interrupted.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub runs_asked: Option<u64>,
    /// Number of runs by outcome.
    #[serde(default)]
    pub outcomes: SortedMap<Outcome, u64>,
    /// Number of runs by the judge's own word, such as `gap_kept`.
    #[serde(default, skip_serializing_if = "SortedMap::is_empty")]
    pub verdicts: SortedMap<String, u64>,
    /// Runs that reached their last goal, with or without collisions.
    #[serde(default)]
    pub goals_reached: u64,
    /// Share of the runs that did their task and caused no collision.
    pub success_rate: Option<f64>,
    /// 95 % Wilson interval of the success rate.
    pub success_interval: [f64; 2],
    /// Collisions of the robot, and its distance traveled.
    #[serde(flatten)]
    pub collisions: Collisions,
    /// Success weighted by path length (SPL), at most 1.
    /// The mean over all runs of 0 for a failure, and otherwise of the shortest path's length divided by the traveled
    /// length. `None` if no run has a shortest path.
    pub spl: Option<f64>,
    /// Seeds of the runs that did not do their task or caused a collision, ascending.
    pub failed_seeds: Vec<u64>,
    /// Failed seeds by cause.
    /// The cause is the judge's own word, the outcome, or the error if the outcome is an error.
    #[serde(default, skip_serializing_if = "SortedMap::is_empty")]
    pub failures: SortedMap<String, Vec<u64>>,
    /// Simulated time of all runs, also the failed, seconds.
    pub sim_time_s: Option<Spread>,
    /// Time to the last goal over the runs that reached it, seconds.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub time_to_goal_s: Option<Spread>,
    /// Length of the ways, meters.
    pub path_length_m: Option<Spread>,
    /// Smallest distances to anything, meters, over the runs with any object.
    pub min_clearance_m: Option<Spread>,
    /// Route switches per run.
    pub route_switches: Option<Spread>,
    /// Reflexes per run.
    pub reflexes: Option<Spread>,
    /// Further figures, over the runs that have them: [`Summary::figures`].
    #[serde(default, skip_serializing_if = "SortedMap::is_empty")]
    pub figures: SortedMap<String, Spread>,
    /// Statistics of further robots, by name: [`Summary::robots`].
    #[serde(default, skip_serializing_if = "SortedMap::is_empty")]
    pub robots: SortedMap<String, RobotStatistics>,
    /// The units of figures, by name; none for pure numbers.
    #[serde(default, skip_serializing_if = "SortedMap::is_empty")]
    pub units: SortedMap<String, String>,
}

/// The collisions of a robot over all runs.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Collisions {
    /// Total distance, km.
    #[serde(rename = "kilometres")]
    pub kilometers: f64,
    /// Contacts of the robot with anything.
    pub collisions: u64,
    /// Contacts where the robot was the one moving in.
    pub collisions_caused: u64,
    /// The latter per kilometer.
    pub collisions_caused_per_km: Option<f64>,
    /// Upper bound of the rate of caused collisions, 1/km, at 95 % confidence.
    /// The exact bound for independent events (Poisson). Without a collision it is about 3 divided by the kilometers.
    pub collisions_caused_per_km_bound: Option<f64>,
}

/// The statistics of a further robot that was judged.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct RobotStatistics {
    /// Collisions and distance traveled.
    #[serde(flatten)]
    pub collisions: Collisions,
    /// Figures over the runs that have them.
    pub figures: SortedMap<String, Spread>,
}

impl Collisions {
    fn of(lengths: impl Iterator<Item = f64>, collisions: u64, collisions_caused: u64) -> Self {
        // The sum of nothing is -0.0.
        let kilometers = sum(lengths) / 1000.0 + 0.0;
        let per_km = |count: f64| (kilometers > 0.0).then(|| count / kilometers);
        Self {
            kilometers,
            collisions,
            collisions_caused,
            collisions_caused_per_km: per_km(collisions_caused as f64),
            collisions_caused_per_km_bound: per_km(poisson_bound(collisions_caused)),
        }
    }
}

impl RobotStatistics {
    /// Returns the statistics of the runs with that robot.
    fn of(runs: &[&SortedMap<String, f64>]) -> Self {
        let count = |name: &str| values(runs, name).map(|value| value as u64).sum();
        let lengths = values(runs, "path_length");
        Self {
            collisions: Collisions::of(lengths, count("collisions"), count("collisions_caused")),
            figures: spreads(runs),
        }
    }
}

/// Returns the spread of each figure.
fn spreads(runs: &[&SortedMap<String, f64>]) -> SortedMap<String, Spread> {
    let names: SortedSet<&String> = runs.iter().flat_map(|figures| figures.keys()).collect();
    names.into_iter().filter_map(|name| Some((name.clone(), Spread::of(values(runs, name))?))).collect()
}

fn values(runs: &[&SortedMap<String, f64>], name: &str) -> impl Iterator<Item = f64> {
    runs.iter().filter_map(move |figures| figures.get(name)).copied()
}

/// Distribution of a figure over the runs.
/// Percentiles are interpolated linearly between the two nearest ranks, counted from the smallest value (0th) to the
/// largest (100th): type 7 of Hyndman and Fan, the default of R and NumPy.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Spread {
    /// Smallest value.
    pub minimum: f64,
    /// 50th percentile.
    pub median: f64,
    /// 95th percentile.
    pub p95: f64,
    /// Largest value.
    pub maximum: f64,
}

impl Spread {
    /// Returns the distribution of the finite ones of `values`; `None` without any.
    pub fn of(values: impl Iterator<Item = f64>) -> Option<Spread> {
        let mut values: Vec<f64> = values.filter(|value| value.is_finite()).collect();
        values.sort_by(f64::total_cmp);
        Some(Spread {
            minimum: *values.first()?,
            median: percentile(&values, 50)?,
            p95: percentile(&values, 95)?,
            maximum: *values.last()?,
        })
    }
}

impl Batch {
    /// Returns the statistics of `summaries`.
    pub fn of(summaries: &[Summary]) -> Batch {
        let runs = summaries.len() as u64;
        let per_run = |total: f64| (runs > 0).then(|| total / runs as f64);
        let successes = summaries.iter().filter(|summary| summary.succeeded()).count() as u64;
        let mut failed: Vec<_> = summaries.iter().filter(|summary| !summary.succeeded()).collect();
        failed.sort_by_key(|summary| summary.seed);
        let mut failures: SortedMap<String, Vec<u64>> = SortedMap::new();
        for summary in &failed {
            let why = match &summary.message {
                Some(message) if summary.outcome == Outcome::Failed => message.clone(),
                _ => summary.outcome_text(),
            };
            failures.entry(why).or_default().push(summary.seed);
        }
        let (mut outcomes, mut verdicts) = (SortedMap::new(), SortedMap::new());
        for summary in summaries {
            *outcomes.entry(summary.outcome).or_default() += 1;
            if let Some(verdict) = &summary.verdict {
                *verdicts.entry(verdict.clone()).or_default() += 1;
            }
        }
        let total = |count: fn(&Summary) -> u64| summaries.iter().map(count).sum();
        let companions: SortedSet<&String> =
            summaries.iter().flat_map(|summary| summary.robots.keys()).collect();
        let companion = |name: &String| {
            let runs: Vec<_> = summaries.iter().filter_map(|summary| summary.robots.get(name)).collect();
            (name.clone(), RobotStatistics::of(&runs))
        };
        let spread = |figure: fn(&Summary) -> f64| Spread::of(summaries.iter().map(figure));
        let lengths = || summaries.iter().filter_map(|summary| summary.path_length_m);
        Batch {
            example: shared(summaries.iter().map(|summary| summary.example.as_str())),
            mode: shared(summaries.iter().map(|summary| summary.mode.as_str())),
            conditions: shared_conditions(summaries),
            runs,
            interrupted: false,
            runs_asked: None,
            outcomes,
            verdicts,
            goals_reached: summaries.iter().filter(|summary| summary.reached_goal()).count() as u64,
            success_rate: per_run(successes as f64),
            success_interval: wilson_interval(successes, runs),
            collisions: Collisions::of(
                lengths(),
                total(|summary| summary.collisions),
                total(|summary| summary.collisions_caused),
            ),
            // A mission without a shortest way has nothing to weight by.
            spl: summaries
                .iter()
                .any(|summary| summary.shortest_path_m.is_some())
                .then(|| per_run(sum(summaries.iter().map(weighted_success))))
                .flatten(),
            failed_seeds: failed.iter().map(|summary| summary.seed).collect(),
            failures,
            sim_time_s: spread(|summary| summary.sim_time_s),
            time_to_goal_s: Spread::of(summaries.iter().filter_map(|summary| summary.time_to_goal_s)),
            path_length_m: Spread::of(lengths()),
            min_clearance_m: Spread::of(summaries.iter().filter_map(|summary| summary.min_clearance_m)),
            route_switches: spread(|summary| summary.route_switches as f64),
            reflexes: spread(|summary| summary.reflexes as f64),
            figures: spreads(&summaries.iter().map(|summary| &summary.figures).collect::<Vec<_>>()),
            robots: companions.into_iter().map(companion).collect(),
            units: summaries.iter().flat_map(|summary| summary.units.clone()).collect(),
        }
    }

    /// Returns the statistics of a batch of `requested` runs.
    /// It was interrupted if it has fewer runs.
    #[must_use]
    pub fn out_of(mut self, requested: u64) -> Batch {
        self.interrupted = self.runs < requested;
        self.runs_asked = self.interrupted.then_some(requested);
        self
    }

    /// Returns the statistics as one line of JSON, without line feed.
    ///
    /// # Errors
    /// If the JSON encoder refuses a value, which no value of these fields makes it do.
    pub fn json_line(&self) -> Result<String, Error> {
        Ok(serde_json::to_string(self)?)
    }
}

fn weighted_success(summary: &Summary) -> f64 {
    let (length, shortest) = (summary.path_length_m.unwrap_or(0.0), summary.shortest_path_m.unwrap_or(0.0));
    if !summary.succeeded() {
        0.0
    } else if length <= shortest {
        1.0
    } else {
        shortest / length
    }
}

/// Returns the common value, else `various`; empty without values.
fn shared<'a>(mut values: impl Iterator<Item = &'a str>) -> String {
    let first = values.next().unwrap_or_default();
    if values.all(|value| value == first) { first.to_owned() } else { "various".to_owned() }
}

fn shared_conditions(summaries: &[Summary]) -> SortedMap<String, String> {
    let names = summaries.iter().flat_map(|summary| summary.conditions.keys());
    names
        .map(|name| {
            let values =
                summaries.iter().map(|summary| summary.conditions.get(name).map_or("", String::as_str));
            (name.clone(), shared(values))
        })
        .collect()
}
