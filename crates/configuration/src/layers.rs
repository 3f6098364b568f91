use std::path::Path;
use std::sync::Arc;

use toml_edit::{Document, TomlError};

use super::agents::AgentTables;
use super::change::Change;
use super::files::{FileWalk, Files, Unreadable};
use super::path;
use super::problems::{Problem, Problems, suggestion};
use super::scope::flatten;
use super::senders::merge_layer;
use super::set::{Written, parse_set};
use super::source::{SettingSource, SourceKind, Sources, Span, TextPlace};
use super::value::{Table, TableEntry, Value};
use crate::error_code::ErrorCode;

/// Name of the table with the variants.
pub(super) const CHOICES: &str = "choices";

/// Reader of a configuration's texts, which merges their settings.
#[derive(Default)]
pub(super) struct Layers {
    pub(super) sources: Sources,
    pub(super) problems: Problems,
    pub(super) merged: Table,
    /// True if a text is missing from `merged`.
    /// An apparent error in `merged` may then be none.
    pub(super) incomplete: bool,
    /// Read files, and those that include the current one.
    pub(super) walk: FileWalk,
    /// The tables of single settings.
    pub(super) flat_sets: Vec<Table>,
    /// Agents that the texts describe, and the wanted one.
    pub(super) agents: AgentTables,
    /// True while the wanted agent's table is read.
    pub(super) own: bool,
    /// True if the agent may run on another machine with other files.
    pub(super) elsewhere: bool,
    /// The application's settings that are paths.
    pub(super) paths: Vec<Vec<String>>,
    /// Path and text of the program's embedded files.
    pub(super) embedded: Vec<(&'static str, &'static str)>,
    /// Text that includes the current one in the end.
    root: Option<usize>,
    ranks: usize,
}

impl Layers {
    /// Makes empty layers, for that agent if there are several.
    pub(super) fn of(agent: Option<String>, files: Files, elsewhere: bool) -> Self {
        Self { agents: AgentTables::of(agent), walk: FileWalk::of(files), elsewhere, ..Self::default() }
    }

    pub(super) fn defaults(&mut self) {
        self.text(
            "built-in defaults".into(),
            SourceKind::Default,
            None,
            include_str!("defaults.toml").into(),
        );
    }

    /// Reads a file; `requested_at` is the place of the `include`.
    pub(super) fn file(&mut self, path: &Path, requested_at: Option<Span>) {
        match self.walk.enter(path) {
            Ok(Some(text)) => {
                self.text(crate::printable(path), SourceKind::File, Some(path), text);
                self.walk.leave();
            }
            Ok(None) => {}
            Err(Unreadable { reason, help }) => {
                self.incomplete = true;
                if self.elsewhere {
                    return;
                }
                let hint = match requested_at {
                    Some(_) => "an included file is found relative to the one that includes it",
                    None => "give the path of a TOML file",
                };
                let message = ErrorCode::Syntax
                    .of(format!("can't read the configuration {}: {reason}", crate::printable(path)));
                let help = Some(help.unwrap_or(hint).into());
                self.problems.0.push(Problem { span: requested_at, message, help });
            }
        }
    }

    /// Reads a text; included files are relative to `path`, or else to `name`.
    pub(super) fn text(&mut self, name: String, kind: SourceKind, path: Option<&Path>, text: Arc<str>) {
        let id = self.push(name, kind, path, Arc::clone(&text));
        let document = match Document::parse(Arc::clone(&self.sources.0[id].text)) {
            Ok(document) => document,
            Err(error) => {
                self.incomplete = true;
                return self.problems.0.push(syntax_problem(&error, id, &text));
            }
        };
        let mut table = Table::of_item(document.as_table(), id, &mut self.problems);
        self.sources.0[id].document = Some(document);
        let agents = table.entries.remove("agents");
        let is_root = self.root.is_none();
        self.root.get_or_insert(id);
        self.table(id, table);
        if let Some(agents) = agents {
            self.table_of_wanted(id, &agents);
        }
        if is_root {
            self.root = None;
        }
    }

    /// Returns the embedded file that an embedded text includes.
    /// It is empty if it was read before.
    fn take_embedded(&mut self, id: usize, path: &Path) -> Option<Arc<str>> {
        if self.sources.0[id].path().is_some() {
            return None;
        }
        let (_, text) = self.embedded.iter_mut().find(|(own, _)| Path::new(own) == path)?;
        Some(std::mem::take(text).into())
    }

    /// Merges a text, or the part of it that is a source of its own.
    pub(super) fn table(&mut self, id: usize, mut table: Table) {
        if let Some(TableEntry { value, .. }) = table.entries.remove("include") {
            let source = &self.sources.0[id];
            let folder = source.path().unwrap_or(Path::new(&source.name)).parent().map(Path::to_owned);
            for file in self.problems.texts("include", &value, "common.toml") {
                let path = folder.clone().unwrap_or_default().join(&file.value);
                match self.take_embedded(id, &path) {
                    Some(text) => self.text(crate::printable(&path), SourceKind::File, None, text),
                    None => self.file(&path, Some(file.span)),
                }
            }
        }
        if let Some(folder) = self.sources.0[id].path().and_then(Path::parent) {
            for path in &self.paths {
                beside(&mut table, path, folder);
            }
        }
        // After the included ones, which this text overrides.
        self.rank(id);
        let flat = flatten(table, &mut self.problems);
        merge_layer(&mut self.merged, flat);
    }

    /// Adds settings of the command line or of run time.
    /// They change what the files set up, and must not add modules or actuators by mistake.
    pub(super) fn sets<'a>(&mut self, kind: SourceKind, settings: impl IntoIterator<Item = Written<'a>>) {
        for Written { text, equals } in settings {
            let id = self.setting(kind, text);
            let Some(table) = parse_set(text, equals, id, &mut self.problems) else { continue };
            self.sources.0[id].place.own = table.entries.contains_key("agents");
            let (incomplete, problems) = (self.incomplete, &mut self.problems);
            let Some(mut table) = self.agents.of_wanted(kind, table, incomplete, problems) else { continue };
            if let Some(TableEntry { key, .. }) = table.entries.remove("include") {
                self.problems.add(key, "only a file includes others", "write `include` in the file");
            }
            if let Some(TableEntry { key, .. }) = table.entries.remove(CHOICES) {
                let help = "change the file, or set what the variant sets";
                self.problems.add(key, "a setting chooses a variant, and can't change one", help);
            }
            let mut flat = flatten(table, &mut self.problems);
            // A change of before, which is read again.
            let was_good = kind == SourceKind::Change && equals.is_none();
            if !self.incomplete {
                self.refuse_new(was_good, &mut flat, "modules", "module", &["kind"]);
                self.refuse_new(was_good, &mut flat, "actuators", "actuator", &["command", "commands"]);
            }
            merge_layer(&mut self.merged, flat.clone());
            self.flat_sets.push(flat);
        }
    }

    /// Removes unknown modules and actuators from a setting.
    /// A module or actuator that the setting founds, such as by its `kind`, is kept.
    pub(super) fn refuse_new(
        &mut self,
        was_good: bool,
        setting: &mut Table,
        section: &str,
        what: &str,
        founding: &[&str],
    ) {
        let existing = self.merged.get(section).and_then(|section| section.as_table());
        let known: Vec<&str> = existing.into_iter().flat_map(Table::iter).map(|(name, _)| name).collect();
        let Some(Value::Table(table)) = setting.entries.get_mut(section).map(|entry| &mut entry.value.value)
        else {
            return;
        };
        let for_one = match self.agents.known.is_empty() {
            true => "",
            false => "; a setting of one agent begins with `agents.`, its name and a dot",
        };
        let problems = &mut self.problems;
        table.entries.retain(|name, entry| {
            let founded =
                entry.value.as_table().is_some_and(|t| founding.iter().any(|key| t.get(key).is_some()));
            let good = founded || known.contains(&name.as_str());
            if !good {
                let help = if was_good {
                    format!("it was there when this was changed: put it back, or revert the change with `slate config revert {}`", path::render(&[section.into(), name.clone()]))
                } else {
                    suggestion(name, &known) + for_one
                };
                problems.add(entry.key, format!("no {what} is called `{name}`"), help);
            }
            good
        });
    }

    /// Notes the agents of a text, and merges the table of the wanted one.
    fn table_of_wanted(&mut self, text: usize, agents: &TableEntry) {
        if self.own {
            let help = "one agent has no others in it: write them in the file that includes this one";
            return self.problems.add(agents.key, "`agents` stands in what belongs to one agent", help);
        }
        if !self.agents.note(agents, &mut self.problems) {
            return;
        }
        let Some(wanted) = self.agents.chosen() else { return };
        let part = self.part(text, vec!["agents".into(), wanted.clone()], true);
        let document = self.sources.0[text].document.as_ref();
        let own = document
            .and_then(|document| document.get("agents")?.as_table_like()?.get(&wanted)?.as_table_like());
        let Some(own) = own else { return };
        let mut table = Table::of_item(own, part, &mut self.problems);
        // It is noted.
        table.entries.remove("runs");
        self.agents.note_name(&table);
        self.own = true;
        self.table(part, table);
        self.own = false;
    }

    /// Names the agent after its table, unless the table sets another name.
    pub(super) fn name_agent(&mut self) {
        if let Some(name) = self.agents.own_name() {
            self.merged.merge(name);
        }
    }

    /// Reduces the settings to those of the wanted agent.
    /// The same reduction is made in the tables of the files' settings.
    pub(super) fn divide<const N: usize>(
        &mut self,
        mut of_files: [Table; N],
        extra_tables: &[String],
    ) -> [Table; N] {
        let Some(wanted) = self.agents.chosen().filter(|_| !self.incomplete) else { return of_files };
        let Self { agents, merged, sources, flat_sets: changes, problems, .. } = self;
        let division = &agents.division;
        for table in &mut of_files {
            division.leave(&wanted, table, sources, extra_tables, &[], &mut Problems::default());
        }
        agents.clock_elsewhere = division.leave(&wanted, merged, sources, extra_tables, changes, problems);
        of_files
    }

    /// Reverts changes of files that only the next start can make.
    /// They are reverted here and in the files' settings, which it returns.
    pub(super) fn hold(&mut self, waiting: &[Change], mut of_files: Table) -> Table {
        for Change { path, before, names, known, .. } in waiting {
            let Some(value) = before else {
                take_out(&mut self.merged, names, *known);
                take_out(&mut of_files, names, *known);
                continue;
            };
            let text = format!("{path}={value}");
            let id = self.setting(SourceKind::Waiting, &text);
            if let Some(table) = parse_set(&text, Some(path.len()), id, &mut self.problems) {
                merge_layer(&mut self.merged, table.clone());
                merge_layer(&mut of_files, table);
            }
        }
        of_files
    }

    /// Adds a source of one setting, above the present ones.
    pub(super) fn setting(&mut self, kind: SourceKind, text: &str) -> usize {
        self.sources.0.push(SettingSource::setting(kind, text));
        let id = self.sources.0.len() - 1;
        self.rank(id);
        id
    }

    fn push(&mut self, name: String, kind: SourceKind, path: Option<&Path>, text: Arc<str>) -> usize {
        let (path, id) = (path.map(Path::to_owned), self.sources.0.len());
        let place = TextPlace { root: self.root.unwrap_or(id), own: self.own, ..TextPlace::default() };
        self.sources.0.push(SettingSource {
            name,
            kind,
            path,
            text,
            rank: usize::MAX,
            place,
            document: None,
        });
        id
    }

    /// Adds a source for a table of a text; `own` if it is the wanted agent's alone.
    pub(super) fn part(&mut self, text: usize, table: Vec<String>, own: bool) -> usize {
        let SettingSource { name, kind, path, text: whole, place, .. } = &self.sources.0[text];
        let place = TextPlace { root: place.root, part_of: Some(text), table, own };
        let (name, path, text) = (name.clone(), path.clone(), Arc::clone(whole));
        self.sources.0.push(SettingSource {
            name,
            kind: *kind,
            path,
            text,
            rank: usize::MAX,
            place,
            document: None,
        });
        self.sources.0.len() - 1
    }

    pub(super) fn rank(&mut self, id: usize) {
        self.sources.0[id].rank = self.ranks;
        self.ranks += 1;
    }
}

/// Removes the value at a path.
/// Tables above it that become empty are removed too, except those of the first `known` names.
fn take_out(table: &mut Table, path: &[String], known: usize) {
    table.remove(path);
    let parents = (known + 1..path.len()).rev().map(|depth| &path[..depth]);
    for parent in parents {
        match table.entry(parent).map(|entry| entry.value.as_table().is_some_and(Table::is_empty)) {
            Some(true) => table.remove(parent),
            _ => return,
        }
    }
}

/// Makes a path in a file's table relative to the file's folder.
/// Names are left unchanged.
fn beside(table: &mut Table, path: &[String], folder: &Path) {
    let Some((name, rest)) = path.split_first() else { return };
    let named = table.entries.iter_mut().filter(|(own, _)| name == "*" || *own == name);
    for (_, entry) in named {
        match &mut entry.value.value {
            Value::Table(inner) => beside(inner, rest, folder),
            Value::Text(text) if rest.is_empty() && is_path(text) => {
                *text = folder.join(&*text).to_string_lossy().into_owned();
            }
            _ => {}
        }
    }
}

/// Returns true if a text is the path of a file.
/// Else it is the name of a part of the application.
fn is_path(text: &str) -> bool {
    let extensions = [".toml", ".yaml", ".pnml", ".xml", ".lua", ".golog"];
    text.contains('/') || extensions.iter().any(|extension| text.ends_with(extension))
}

/// Returns the problem of a syntax error, with help.
fn syntax_problem(error: &TomlError, source: usize, text: &str) -> Problem {
    let range = error.span().unwrap_or(0..0);
    let place = text.get(range.clone()).unwrap_or("").trim();
    let after_equals = text.get(..range.start).is_some_and(|before| before.trim_end().ends_with('='));
    let (message, help) = if error.message() == "duplicate key" {
        let help = "keep one of the two; to override a setting, use a file that includes this one, or --set";
        (ErrorCode::Key.of(format!("`{place}` is set twice")), help.into())
    } else if after_equals && place.is_empty() {
        (
            ErrorCode::Syntax.of("the value is missing"),
            "write a number, true, false, \"text\", [list] or { table }".into(),
        )
    } else if after_equals && !place.contains(['"', '\'', '[', '{', '\n']) {
        (
            ErrorCode::Value.of(format!("expected a value, found `{place}`")),
            format!("put text in quotes: \"{place}\""),
        )
    } else {
        (ErrorCode::Syntax.of(error.message()), "the file must be TOML, see https://toml.io".into())
    };
    Problem { span: Some(Span { source, start: range.start, end: range.end }), message, help: Some(help) }
}
