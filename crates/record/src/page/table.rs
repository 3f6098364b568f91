/// What a report tells in rows; also a file of comma-separated values.
#[derive(Clone, Debug, Default)]
pub(super) struct Table {
    /// What its file is called, without an extension.
    pub name: String,
    pub columns: Vec<Column>,
    pub rows: Vec<Vec<String>>,
}

#[derive(Clone, Debug)]
pub(super) struct Column {
    pub name: String,
    pub unit: String,
    pub is_number: bool,
}

impl Table {
    /// Columns are written `name`, or `#name` for one of numbers, `#name/unit` for one of numbers with a unit.
    pub fn new(name: &str, columns: &[&str]) -> Self {
        let column = |text: &&str| {
            let (is_number, text) = text.strip_prefix('#').map_or((false, *text), |text| (true, text));
            let (name, unit) = match is_number {
                true => text.split_once('/').unwrap_or((text, "")),
                false => (text, ""),
            };
            Column { name: name.into(), unit: unit.into(), is_number }
        };
        Self { name: name.into(), columns: columns.iter().map(column).collect(), rows: Vec::new() }
    }

    pub fn row(&mut self, cells: impl IntoIterator<Item = String>) {
        self.rows.push(cells.into_iter().collect());
    }

    pub fn is_empty(&self) -> bool {
        self.rows.is_empty()
    }

    /// RFC 4180 with line feeds; units stand in the names.
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
