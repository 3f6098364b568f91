use std::collections::BTreeSet;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use toml_edit::{Document, TomlError};

use super::Options;
use super::problems::{Problem, Problems, suggestion};
use super::scope::flatten;
use super::set::parse_set;
use super::source::{Source, SourceKind, Sources, Span};
use super::value::{Entry, Table, Value};

/// A configuration file is small; anything above is a mistake (bytes).
const LARGEST_FILE: u64 = 16 << 20;

/// Reads the texts of a configuration and merges what they say.
#[derive(Default)]
pub(super) struct Layers {
    pub(super) sources: Sources,
    pub(super) problems: Problems,
    pub(super) merged: Table,
    /// Whether a text is missing from `merged`, so that what seems to be wrong there may be right.
    pub(super) incomplete: bool,
    /// Files that include the current one, outermost first.
    open: Vec<PathBuf>,
    read: BTreeSet<PathBuf>,
    ranks: usize,
}

impl Layers {
    pub(super) fn defaults(&mut self) {
        self.text("built-in defaults".into(), SourceKind::Default, None, include_str!("defaults.toml"));
    }

    /// Reads a file; `asked` is where another one includes it.
    pub(super) fn file(&mut self, path: &Path, asked: Option<Span>) {
        let failed = |this: &mut Self, reason: String, help: &str| {
            this.incomplete = true;
            let message = format!("can't read the configuration {}: {reason}", path.display());
            this.problems.0.push(Problem { span: asked, message, help: Some(help.into()) });
        };
        let hint = match asked {
            Some(_) => "an included file is found relative to the one that includes it",
            None => "give the path of a TOML file",
        };
        let canonical = match path.canonicalize() {
            Ok(canonical) => canonical,
            Err(error) => return failed(self, error.to_string(), hint),
        };
        if self.open.contains(&canonical) {
            return failed(self, "it includes itself".into(), "remove one `include` of the circle");
        }
        if !self.read.insert(canonical.clone()) {
            return;
        }
        let text = match std::fs::metadata(&canonical) {
            Ok(data) if !data.is_file() => return failed(self, "it is no file".into(), hint),
            Ok(data) if data.len() > LARGEST_FILE => return failed(self, "it is too large".into(), hint),
            _ => std::fs::read(&canonical),
        };
        match text.map(String::from_utf8) {
            Ok(Ok(text)) => {
                self.open.push(canonical);
                self.text(path.display().to_string(), SourceKind::File, Some(path), &text);
                self.open.pop();
            }
            Ok(Err(error)) => {
                let line = error.as_bytes()[..error.utf8_error().valid_up_to()]
                    .iter()
                    .filter(|c| **c == b'\n')
                    .count();
                failed(self, format!("line {} is not UTF-8 text", line + 1), "save the file as UTF-8");
            }
            Err(error) => failed(self, error.to_string(), hint),
        }
    }

    /// Reads a text; it includes files from the folder of `path`, or else of `name`.
    pub(super) fn text(&mut self, name: String, kind: SourceKind, path: Option<&Path>, text: &str) {
        let id = self.push(name, kind, path, text);
        let document = match Document::parse(Arc::clone(&self.sources.0[id].text)) {
            Ok(document) => document,
            Err(error) => {
                self.incomplete = true;
                return self.problems.0.push(syntax_problem(&error, id, text));
            }
        };
        let mut table = Table::of_item(document.as_table(), id, &mut self.problems);
        self.sources.0[id].document = Some(document);
        if let Some(Entry { value, .. }) = table.entries.remove("include") {
            let folder = path.unwrap_or(Path::new(&self.sources.0[id].name)).parent().map(Path::to_owned);
            for file in self.problems.texts("include", &value, "common.toml") {
                self.file(&folder.clone().unwrap_or_default().join(&file.value), Some(file.span));
            }
        }
        // After the included ones, which this text overrides.
        self.rank(id);
        let flat = flatten(table, &mut self.problems);
        self.merged.merge(flat);
    }

    /// The settings of the command line; they change what the files set up, and add nothing by mistake.
    pub(super) fn sets(&mut self, options: &Options) {
        for setting in &options.sets {
            let id = self.push("--set".into(), SourceKind::Set, None, setting);
            self.rank(id);
            let Some(mut table) = parse_set(setting, id, &mut self.problems) else { continue };
            if let Some(Entry { key, .. }) = table.entries.remove("include") {
                self.problems.add(key, "only a file includes others", "write `include` in the file");
            }
            let mut flat = flatten(table, &mut self.problems);
            if !self.incomplete {
                self.refuse_new(&mut flat, "modules", "module", &["plugin"]);
                self.refuse_new(&mut flat, "actuators", "actuator", &["command", "commands"]);
            }
            self.merged.merge(flat);
        }
    }

    /// Takes out of a setting what names a module or an actuator that no file has, unless it is set up from the ground.
    fn refuse_new(&mut self, setting: &mut Table, section: &str, what: &str, founding: &[&str]) {
        let existing = self.merged.get(section).and_then(|section| section.as_table());
        let known: Vec<&str> = existing.into_iter().flat_map(Table::iter).map(|(name, _)| name).collect();
        let Some(Value::Table(table)) = setting.entries.get_mut(section).map(|entry| &mut entry.value.value)
        else {
            return;
        };
        let problems = &mut self.problems;
        table.entries.retain(|name, entry| {
            let founded =
                entry.value.as_table().is_some_and(|t| founding.iter().any(|key| t.get(key).is_some()));
            let good = founded || known.contains(&name.as_str());
            if !good {
                let help = suggestion(name, &known);
                problems.add(entry.key, format!("no {what} is called `{name}`"), help);
            }
            good
        });
    }

    fn push(&mut self, name: String, kind: SourceKind, path: Option<&Path>, text: &str) -> usize {
        let path = path.map(Path::to_owned);
        self.sources.0.push(Source { name, kind, path, text: text.into(), rank: usize::MAX, document: None });
        self.sources.0.len() - 1
    }

    fn rank(&mut self, id: usize) {
        self.sources.0[id].rank = self.ranks;
        self.ranks += 1;
    }
}

/// What TOML itself finds wrong, and what to do about it.
fn syntax_problem(error: &TomlError, source: usize, text: &str) -> Problem {
    let range = error.span().unwrap_or(0..0);
    let place = text.get(range.clone()).unwrap_or("").trim();
    let after_equals = text.get(..range.start).is_some_and(|before| before.trim_end().ends_with('='));
    let (message, help) = if error.message() == "duplicate key" {
        let help = "keep one of the two; to override a setting, use a file that includes this one, or --set";
        (format!("`{place}` is set twice"), help.into())
    } else if after_equals && place.is_empty() {
        ("the value is missing".into(), "write a number, true, false, \"text\", [list] or { table }".into())
    } else if after_equals && !place.contains(['"', '\'', '[', '{', '\n']) {
        (format!("`{place}` is no value"), format!("put text in quotes: \"{place}\""))
    } else {
        (error.message().into(), "the file must be TOML, see https://toml.io".into())
    };
    Problem { span: Some(Span { source, start: range.start, end: range.end }), message, help: Some(help) }
}
