//! Statistics as a person reads them.

use super::{Batch, Collisions, Spread};
use std::fmt;

/// Format of the terminal: the outcome in one line, then the figures with units.
impl fmt::Display for Batch {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Some(rate) = self.success_rate else {
            return writeln!(formatter, "no runs");
        };
        let [low, high] = self.success_interval.map(|bound| bound * 100.0);
        let succeeded = self.runs - self.failed_seeds.len() as u64;
        writeln!(
            formatter,
            "{}: {succeeded} of {} runs succeeded, {:.1} % (95 % interval {low:.1} to {high:.1} %)",
            self.example,
            self.runs,
            rate * 100.0
        )?;
        let mut line = |name: &str, value: String| writeln!(formatter, "  {name:<23} {value}");
        let outcomes: Vec<_> =
            self.outcomes.iter().map(|(outcome, runs)| format!("{runs} {outcome}")).collect();
        line("outcomes", outcomes.join(", "))?;
        if !self.verdicts.is_empty() {
            let verdicts =
                self.verdicts.iter().map(|(verdict, runs)| format!("{runs} {}", verdict.replace('_', " ")));
            line("verdicts", verdicts.collect::<Vec<_>>().join(", "))?;
        }
        if let Some(spl) = self.spl {
            line("SPL", number(Some(spl)))?;
        }
        for (name, value) in self.collisions.lines() {
            line(name, value)?;
        }
        for (robot, companion) in &self.robots {
            for (name, value) in companion.collisions.lines() {
                line(&format!("{robot}: {name}"), value)?;
            }
        }
        for (why, seeds) in &self.failures {
            let seeds: Vec<String> = seeds.iter().map(u64::to_string).collect();
            line("failed seeds", format!("{}: {why}", seeds.join(", ")))?;
        }
        line("mode", self.mode.clone())?;
        for (name, value) in &self.conditions {
            line(&name.replace('_', " "), value.clone())?;
        }
        self.table(formatter)
    }
}

impl Collisions {
    /// Returns the lines for the terminal, by name.
    fn lines(&self) -> Vec<(&'static str, String)> {
        let (rate, bound) = (self.collisions_caused_per_km, self.collisions_caused_per_km_bound);
        let rate = match bound {
            Some(_) => format!("  ({} per km, with 95 % confidence below {})", number(rate), number(bound)),
            None => String::new(),
        };
        let way = (self.kilometers > 0.0).then(|| ("way of all runs", format!("{:.3} km", self.kilometers)));
        let counts = [
            ("collisions", self.collisions.to_string()),
            ("caused by the robot", format!("{}{rate}", self.collisions_caused)),
        ];
        way.into_iter().chain(counts).collect()
    }
}

impl Batch {
    /// Returns the spreads of all figures.
    fn table(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        let standard = [
            ("simulated time [s]", 2, self.sim_time_s),
            ("time to goal [s]", 2, self.time_to_goal_s),
            ("path length [m]", 2, self.path_length_m),
            ("least clearance [m]", 3, self.min_clearance_m),
            ("route switches", 1, self.route_switches),
            ("reflexes", 1, self.reflexes),
        ];
        let named = |(name, spread): (&String, &Spread)| (self.label(name), 3, Some(*spread));
        let own = self.figures.iter().map(named);
        let others = self.robots.iter().flat_map(|(robot, companion)| {
            let named = companion.figures.iter().map(named);
            named.map(move |(name, decimals, spread)| (format!("{robot}: {name}"), decimals, spread))
        });
        let standard =
            standard.into_iter().map(|(name, decimals, spread)| (name.to_owned(), decimals, spread));
        let rows: Vec<_> = standard.chain(own).chain(others).collect();
        let width = rows.iter().map(|(name, ..)| name.chars().count()).fold(24, usize::max);
        writeln!(
            formatter,
            "\n  {:<width$}{:>10}{:>10}{:>10}{:>10}",
            "", "minimum", "median", "95th %", "maximum"
        )?;
        for (name, decimals, spread) in rows {
            write!(formatter, "  {name:<width$}")?;
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

    /// Returns the name of a figure in the table.
    fn label(&self, name: &str) -> String {
        let unit = self.units.get(name).map_or(String::new(), |unit| format!(" [{unit}]"));
        name.replace('_', " ") + &unit
    }
}

fn number(value: Option<f64>) -> String {
    value.map_or("-".to_owned(), |value| format!("{value:.3}"))
}
