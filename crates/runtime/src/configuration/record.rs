//! What an agent records of itself.

use std::path::PathBuf;

use slate_blackboard::Pattern;

use super::build::Build;
use super::model::Record;
use super::source::Spanned;
use super::value::Table;

const KNOWN: [&str; 7] = ["enabled", "file", "select", "exclude", "chunk", "within", "buffer"];

impl Build<'_> {
    pub(super) fn record(&mut self, root: &Table) -> Record {
        let mut record = Record::default();
        let Some(table) = self.problems.table(root, "record") else { return record };
        self.problems.unknown_keys(table, "in [record]", &KNOWN);
        record.enabled = self.problems.flag(table, "enabled").is_some_and(|flag| flag.value);
        let file = self.problems.text(table, "file", "run.mcap");
        record.file = file.map(|file| Spanned::new(PathBuf::from(&file.value), file.span));
        if let Some(select) = self.patterns(table, "select") {
            record.select = select;
        }
        record.exclude = self.patterns(table, "exclude").unwrap_or_default();
        for (name, place) in [("chunk", &mut record.chunk), ("buffer", &mut record.buffer)] {
            let Some(value) = table.get(name) else { continue };
            let size = self.problems.size(name, value).unwrap_or(*place);
            if size > LARGEST {
                let help = format!("write a size such as {name} = \"4MiB\"");
                self.problems.add(value.span, format!("`{name}` can't be more than 256 MiB"), help);
            }
            *place = size;
        }
        record.within = self.problems.duration(table, "within").map_or(record.within, |within| within.value);
        record
    }

    fn patterns(&mut self, table: &Table, name: &str) -> Option<Vec<Pattern>> {
        let texts = self.problems.texts(name, table.get(name)?, "/r2/**");
        let pattern = |text: Spanned<String>| {
            let wrong = |error: slate_blackboard::PatternError| {
                self.problems.add(text.span, error.to_string(), format!("write {name} = [\"/r2/**\"]"));
            };
            Pattern::parse(&text.value).map_err(wrong).ok()
        };
        Some(texts.into_iter().filter_map(pattern).collect())
    }
}

/// What readers of such files take as one piece, and more than any robot needs, bytes.
const LARGEST: u64 = 256 << 20;
