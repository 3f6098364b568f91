use crate::{
    Error, Summary,
    statistics::{percentile, sum, wilson_interval},
};
use serde::{Deserialize, Serialize};
use std::{collections::BTreeMap, fmt};

/// Statistics over the summaries of many runs, independent of the order in which they come. Statistics of nothing are
/// none (`null` in JSON).
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Batch {
    /// Name of the example; `various` if the runs differ.
    pub example: String,
    /// How the agents ran; `various` if the runs differ.
    pub mode: String,
    /// Under what conditions the figures hold; `various` where the runs differ.
    pub conditions: BTreeMap<String, String>,
    /// Number of runs.
    pub runs: u64,
    /// Share of the runs that reached the goal.
    pub success_rate: Option<f64>,
    /// 95 % Wilson interval of the success rate.
    pub success_interval: [f64; 2],
    /// Contacts of the robot with anything, over all runs.
    pub collisions: u64,
    /// Contacts where the robot was the one moving in, over all runs.
    pub collisions_caused: u64,
    /// The latter per kilometre of all ways together.
    pub collisions_caused_per_km: Option<f64>,
    /// Success weighted by path length: the mean over all runs of 0 for a failure and else the shortest way divided by
    /// the way that was gone, at most 1.
    pub spl: Option<f64>,
    /// Seeds of the runs that did not reach the goal, ascending.
    pub failed_seeds: Vec<u64>,
    /// Simulated time of all runs, also the failed, seconds.
    pub sim_time_s: Option<Spread>,
    /// Length of the ways, metres.
    pub path_length_m: Option<Spread>,
    /// Smallest distances to anything, metres, over the runs where there was anything.
    pub min_clearance_m: Option<Spread>,
    /// Route switches per run.
    pub route_switches: Option<Spread>,
    /// Reflexes per run.
    pub reflexes: Option<Spread>,
}

/// How the values of a figure are spread over the runs. Percentiles are interpolated linearly between the two nearest
/// ranks, counted from the smallest value (0th) to the largest (100th): type 7 of Hyndman and Fan, the default of R and
/// NumPy.
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
    /// The spread of the finite ones of `values`; none without any.
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
    /// The statistics of `summaries`.
    pub fn of(summaries: &[Summary]) -> Batch {
        let runs = summaries.len() as u64;
        let per_run = |total: f64| (runs > 0).then(|| total / runs as f64);
        let successes = summaries.iter().filter(|summary| summary.succeeded()).count() as u64;
        let mut failed_seeds: Vec<u64> =
            summaries.iter().filter(|summary| !summary.succeeded()).map(|summary| summary.seed).collect();
        failed_seeds.sort_unstable();
        let collisions_caused = summaries.iter().map(|summary| summary.collisions_caused).sum();
        let kilometres = sum(summaries.iter().map(|summary| summary.path_length_m)) / 1000.0;
        let spread = |figure: fn(&Summary) -> f64| Spread::of(summaries.iter().map(figure));
        Batch {
            example: shared(summaries.iter().map(|summary| summary.example.as_str())),
            mode: shared(summaries.iter().map(|summary| summary.mode.as_str())),
            conditions: shared_conditions(summaries),
            runs,
            success_rate: per_run(successes as f64),
            success_interval: wilson_interval(successes, runs),
            collisions: summaries.iter().map(|summary| summary.collisions).sum(),
            collisions_caused,
            collisions_caused_per_km: (kilometres > 0.0).then(|| collisions_caused as f64 / kilometres),
            spl: per_run(sum(summaries.iter().map(weighted_success))),
            failed_seeds,
            sim_time_s: spread(|summary| summary.sim_time_s),
            path_length_m: spread(|summary| summary.path_length_m),
            min_clearance_m: Spread::of(summaries.iter().filter_map(|summary| summary.min_clearance_m)),
            route_switches: spread(|summary| summary.route_switches as f64),
            reflexes: spread(|summary| summary.reflexes as f64),
        }
    }

    /// The statistics as one line of JSON, without line feed.
    ///
    /// # Errors
    /// If the JSON encoder refuses a value, which no value of these fields makes it do.
    pub fn json_line(&self) -> Result<String, Error> {
        Ok(serde_json::to_string(self)?)
    }
}

fn weighted_success(summary: &Summary) -> f64 {
    let (length, shortest) = (summary.path_length_m, summary.shortest_path_m);
    if !summary.succeeded() {
        0.0
    } else if length <= shortest {
        1.0
    } else {
        shortest / length
    }
}

/// The value that all have, else `various`; nothing of nothing.
fn shared<'a>(mut values: impl Iterator<Item = &'a str>) -> String {
    let first = values.next().unwrap_or_default();
    if values.all(|value| value == first) { first.to_owned() } else { "various".to_owned() }
}

fn shared_conditions(summaries: &[Summary]) -> BTreeMap<String, String> {
    let names = summaries.iter().flat_map(|summary| summary.conditions.keys());
    names
        .map(|name| {
            let values =
                summaries.iter().map(|summary| summary.conditions.get(name).map_or("", String::as_str));
            (name.clone(), shared(values))
        })
        .collect()
}

/// For the terminal: what happened in one line, then the figures with their units.
impl fmt::Display for Batch {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Some(rate) = self.success_rate else {
            return writeln!(formatter, "no runs");
        };
        let [low, high] = self.success_interval.map(|bound| bound * 100.0);
        let reached = self.runs - self.failed_seeds.len() as u64;
        writeln!(
            formatter,
            "{}: {reached} of {} runs reached the goal, {:.1} % (95 % interval {low:.1} to {high:.1} %)",
            self.example,
            self.runs,
            rate * 100.0
        )?;
        let mut line = |name: &str, value: String| writeln!(formatter, "  {name:<23} {value}");
        let number = |value: Option<f64>| value.map_or("-".to_owned(), |value| format!("{value:.3}"));
        line("SPL", number(self.spl))?;
        let caused = number(self.collisions_caused_per_km);
        line("collisions", self.collisions.to_string())?;
        line("caused by the robot", format!("{}  ({caused} per km)", self.collisions_caused))?;
        if !self.failed_seeds.is_empty() {
            let seeds: Vec<String> = self.failed_seeds.iter().map(u64::to_string).collect();
            line("failed seeds", seeds.join(", "))?;
        }
        line("mode", self.mode.clone())?;
        for (name, value) in &self.conditions {
            line(&name.replace('_', " "), value.clone())?;
        }
        writeln!(
            formatter,
            "\n  {:<24}{:>10}{:>10}{:>10}{:>10}",
            "", "minimum", "median", "95th %", "maximum"
        )?;
        for (name, decimals, spread) in [
            ("simulated time [s]", 2, self.sim_time_s),
            ("path length [m]", 2, self.path_length_m),
            ("least clearance [m]", 3, self.min_clearance_m),
            ("route switches", 1, self.route_switches),
            ("reflexes", 1, self.reflexes),
        ] {
            write!(formatter, "  {name:<24}")?;
            match spread {
                Some(Spread { minimum, median, p95, maximum }) => {
                    for value in [minimum, median, p95, maximum] {
                        write!(formatter, "{value:>10.decimals$}")?;
                    }
                    writeln!(formatter)?;
                }
                None => writeln!(formatter, "{0:>10}{0:>10}{0:>10}{0:>10}", "-")?,
            }
        }
        Ok(())
    }
}
