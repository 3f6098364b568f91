//! Faults, each in one row.

use slate_sorted::SortedMap;

use super::table::{Table, seconds};

/// Maximum number of faults kept.
const MAX_FAULTS: usize = 10_000;

/// Maximum time between two counts of one lasting fault, nanoseconds.
const MAX_FAULT_GAP: u64 = 1_000_000_000;

/// Faults in the order of their times.
/// A fault of several modules at once is one entry, and so is a lasting one: a stopped robot is not reported for each
/// module and in each cycle.
#[derive(Debug, Default)]
pub(super) struct Faults {
    all: Vec<Fault>,
    /// Places of counted faults that may continue, by module and fault.
    counted: SortedMap<(String, String), usize>,
}

#[derive(Debug)]
struct Fault {
    from: u64,
    until: u64,
    modules: String,
    what: String,
    /// Number of a counted fault's occurrences, and total until then.
    count: Option<(f64, f64)>,
}

impl Faults {
    /// Adds a single event of a module.
    pub fn note(&mut self, time: u64, modules: &str, what: String) {
        self.push(Fault { from: time, until: time, modules: modules.into(), what, count: None });
    }

    /// Adds a fault that happened `more` times again, and `all` times in total.
    pub fn count(&mut self, time: u64, modules: &str, what: &str, more: f64, all: f64) {
        let key = (modules.to_owned(), what.to_owned());
        let open = self.counted.get(&key).and_then(|at| self.all.get_mut(*at));
        match open.filter(|own| time.saturating_sub(own.until) <= MAX_FAULT_GAP) {
            Some(own) => {
                let before = own.count.map_or(0.0, |(more, _)| more);
                (own.until, own.count) = (time, Some((before + more, all)));
            }
            None => {
                self.counted.insert(key, self.all.len());
                let (modules, what) = (modules.into(), what.into());
                self.push(Fault { from: time, until: time, modules, what, count: Some((more, all)) });
            }
        }
    }

    fn push(&mut self, fault: Fault) {
        if self.all.len() < MAX_FAULTS {
            self.all.push(fault);
        }
    }

    pub fn table(&self) -> Table {
        let mut table = Table::new("faults", &["#from/s", "#until/s", "*who", "what"]);
        let mut rows: Vec<(&Fault, String, Vec<&str>)> = Vec::new();
        let mut indices = SortedMap::new();
        for own in &self.all {
            let what = match own.count {
                Some((more, all)) => format!("{}: {more} more, {all} in all", own.what),
                None => own.what.clone(),
            };
            let index = *indices.entry((own.from, own.until, what.clone())).or_insert(rows.len());
            match rows.get_mut(index).filter(|(.., modules)| !modules.contains(&own.modules.as_str())) {
                Some((.., modules)) => modules.push(&own.modules),
                None => rows.push((own, what, vec![&own.modules])),
            }
        }
        for (own, what, modules) in rows {
            table.row([seconds(own.from), seconds(own.until), modules.join(", "), what]);
        }
        table
    }
}
