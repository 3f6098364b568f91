//! Results as JSON for programs and Markdown for people.

use std::fmt::Write;

use serde::Serialize;

/// Relation of a contestant to Slate.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Role {
    /// Slate itself. The first of a contest is what the others are compared with.
    Slate,
    /// Another system that gives the same guarantees.
    Peer,
    /// Another system that gives fewer, which are named in `bench/README.md`.
    Lesser,
    /// Cost of the machine without any system.
    Floor,
    /// Written for this bench after the description of a system.
    Model,
}

/// A contestant's times for one line of work, nanoseconds.
#[derive(Clone, Debug, Serialize)]
pub struct Row {
    pub work: String,
    pub line: String,
    pub contestant: String,
    pub role: Role,
    pub p50: f64,
    pub p99: f64,
    #[serde(rename = "p99.9")]
    pub p999: f64,
    pub max: f64,
    pub samples: u64,
    /// Allocations per operation in the timed threads; nothing if not counted.
    pub allocations: Option<f64>,
    /// The median beside that of Slate: above 1 is slower than Slate.
    pub ratio: Option<f64>,
    pub provenance: String,
}

/// One number that is no distribution.
#[derive(Clone, Debug, Serialize)]
pub struct Figure {
    pub work: String,
    pub what: String,
    pub value: f64,
    pub unit: &'static str,
    pub provenance: String,
}

/// A contestant that could not take part.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct Absent {
    pub work: String,
    pub contestant: String,
    pub reason: String,
}

/// All that a run has measured.
#[derive(Debug, Default, Serialize)]
pub struct Table {
    /// Command and time of the run.
    pub run: Vec<String>,
    pub rows: Vec<Row>,
    pub figures: Vec<Figure>,
    pub absent: Vec<Absent>,
}

impl Table {
    /// Adds a row, and says it at once.
    pub fn add(&mut self, row: Row) {
        if self.rows.last().is_none_or(|last| (&last.work, &last.line) != (&row.work, &row.line)) {
            println!("{}: {}", row.work, row.line);
        }
        println!("  {}", plain(&row));
        self.rows.push(row);
    }

    /// Adds a figure, and says it at once.
    pub fn figure(&mut self, work: &str, what: impl Into<String>, value: f64, unit: &'static str) {
        self.figure_from(work, what, value, unit, &crate::machine::provenance());
    }

    /// Adds a figure that was measured at another time, and says it at once.
    pub fn figure_from(
        &mut self,
        work: &str,
        what: impl Into<String>,
        value: f64,
        unit: &'static str,
        provenance: &str,
    ) {
        let (work, what, provenance) = (work.to_owned(), what.into(), provenance.to_owned());
        println!("{work}: {what}: {} {unit}", number(value));
        self.figures.push(Figure { work, what, value, unit, provenance });
    }

    /// Says that a contestant is missing, and why.
    pub fn absent(&mut self, work: &str, contestant: &str, reason: impl Into<String>) {
        let absent = Absent { work: work.into(), contestant: contestant.into(), reason: reason.into() };
        // Where something is not installed, it is missing in all lines of the work.
        if !self.absent.contains(&absent) {
            println!("{work}: {contestant} does not take part: {}", absent.reason);
            self.absent.push(absent);
        }
    }

    /// For people.
    pub fn markdown(&self) -> String {
        let mut text = String::new();
        for line in &self.run {
            let _ = writeln!(text, "{line}\n");
        }
        let mut work = "";
        for row in &self.rows {
            if row.work != work {
                work = &row.work;
                let _ = writeln!(
                    text,
                    "\n## {work}\n\n| line | contestant | p50 | p99 | p99.9 | max | allocations | beside Slate | samples \
                     | provenance |\n|---|---|---:|---:|---:|---:|---:|---:|---:|---|"
                );
            }
            let or_none = |value: Option<f64>| value.map_or_else(|| "-".into(), number);
            let _ = writeln!(
                text,
                "| {} | {}{} | {} | {} | {} | {} | {} | {} | {} | {} |",
                row.line,
                row.contestant,
                note(row.role),
                time(row.p50),
                time(row.p99),
                time(row.p999),
                time(row.max),
                or_none(row.allocations),
                or_none(row.ratio),
                row.samples,
                row.provenance
            );
        }
        if !self.figures.is_empty() {
            text.push_str("\n## Figures\n\n| work | what | | provenance |\n|---|---|---:|---|\n");
        }
        for figure in &self.figures {
            let Figure { work, what, value, unit, provenance } = figure;
            let _ = writeln!(text, "| {work} | {what} | {} {unit} | {provenance} |", number(*value));
        }
        if !self.absent.is_empty() {
            text.push_str("\n## Who did not take part\n\n| work | contestant | reason |\n|---|---|---|\n");
        }
        for Absent { work, contestant, reason } in &self.absent {
            let _ = writeln!(text, "| {work} | {contestant} | {reason} |");
        }
        text
    }
}

fn note(role: Role) -> &'static str {
    match role {
        Role::Slate | Role::Peer => "",
        Role::Lesser => " (gives less)",
        Role::Floor => " (floor)",
        Role::Model => " (written for this bench)",
    }
}

fn plain(row: &Row) -> String {
    let ratio = row.ratio.map_or_else(String::new, |ratio| format!("  {ratio:.2} of Slate"));
    let allocations =
        row.allocations.map_or_else(String::new, |count| format!("  {} alloc/op", number(count)));
    format!(
        "{:<44} p50 {:>9}  p99 {:>9}  p99.9 {:>9}  max {:>9}{allocations}{ratio}",
        format!("{}{}", row.contestant, note(row.role)),
        time(row.p50),
        time(row.p99),
        time(row.p999),
        time(row.max)
    )
}

/// Three digits and a unit.
fn time(nanoseconds: f64) -> String {
    let (value, unit) = match nanoseconds {
        below if below < 1e3 => (nanoseconds, "ns"),
        below if below < 1e6 => (nanoseconds * 1e-3, "us"),
        below if below < 1e9 => (nanoseconds * 1e-6, "ms"),
        _ => (nanoseconds * 1e-9, "s"),
    };
    format!("{} {unit}", number(value))
}

/// Three digits.
fn number(value: f64) -> String {
    match value.abs() {
        0.0 => "0".into(),
        below if below < 0.01 => format!("{value:.4}"),
        below if below < 10.0 => format!("{value:.2}"),
        below if below < 100.0 => format!("{value:.1}"),
        _ => format!("{value:.0}"),
    }
}
