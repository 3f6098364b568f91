/// A table of a report; also a file of comma-separated values.
#[derive(Clone, Debug, Default)]
pub(super) struct Table {
    /// Name of its file, without an extension.
    pub name: String,
    pub columns: Vec<Column>,
    pub rows: Vec<Vec<String>>,
}

#[derive(Clone, Debug)]
pub(super) struct Column {
    pub name: String,
    pub unit: String,
    pub is_number: bool,
    /// Set if each cell has the names of modules, one or several.
    is_modules: bool,
}

/// Maximum number of names shown in a cell.
const MAX_NAMES: usize = 3;

impl Column {
    /// Returns the number of modules in a cell if they are too many to read at once.
    pub fn collapsed_count(&self, cell: &str) -> Option<usize> {
        let count = cell.split(", ").count();
        (self.is_modules && count > MAX_NAMES).then_some(count)
    }
}

impl Table {
    /// Creates an empty table.
    /// Columns are written `name`, or `#name` for numbers, `#name/unit` for numbers with a unit, and `*name` for names
    /// of modules with commas between.
    pub fn new(name: &str, columns: &[&str]) -> Self {
        let column = |text: &&str| {
            let (is_modules, text) = text.strip_prefix('*').map_or((false, *text), |text| (true, text));
            let (is_number, text) = text.strip_prefix('#').map_or((false, text), |text| (true, text));
            let (name, unit) = match is_number {
                true => text.split_once('/').unwrap_or((text, "")),
                false => (text, ""),
            };
            Column { name: name.into(), unit: unit.into(), is_number, is_modules }
        };
        Self { name: name.into(), columns: columns.iter().map(column).collect(), rows: Vec::new() }
    }

    pub fn row(&mut self, cells: impl IntoIterator<Item = String>) {
        self.rows.push(cells.into_iter().collect());
    }

    pub fn is_empty(&self) -> bool {
        self.rows.is_empty()
    }

    /// Returns the table as CSV (RFC 4180, line feeds); the names contain the units.
    pub fn csv(&self) -> String {
        let head = self.columns.iter().map(|Column { name, unit, .. }| {
            let unit = unit.replace('/', "_per_");
            let name = name.replace(' ', "_");
            if unit.is_empty() { name } else { format!("{name}_{unit}") }
        });
        let mut text = line(head);
        for row in &self.rows {
            text.push_str(&line(row.iter().cloned()));
        }
        text
    }
}

fn line(cells: impl Iterator<Item = String>) -> String {
    let cells = cells.map(|cell| match cell.contains([',', '"', '\n', '\r']) {
        true => format!("\"{}\"", cell.replace('"', "\"\"")),
        false => cell,
    });
    cells.collect::<Vec<_>>().join(",") + "\n"
}

/// Seconds with milliseconds.
pub(super) fn seconds(nanoseconds: u64) -> String {
    format!("{:.3}", nanoseconds as f64 * 1e-9)
}
