use std::path::PathBuf;

use slate_sorted::SortedMap;
use toml_edit::DocumentMut;

use super::super::files;
use super::super::layers::CHOICES;
use super::super::path::render;
use super::super::value::{Table, TableEntry};
use super::*;

/// Destination of saved changes.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum SaveTo {
    /// Each to the file that contains its value, or else to the main file.
    #[default]
    Origin,
    /// All to the file of this machine, [`Options::host`].
    Host,
}

/// File with a new text.
struct Edited {
    path: PathBuf,
    canonical: PathBuf,
    text: Arc<str>,
}

impl Database {
    /// Writes the changes made at run time into the files; returns their paths.
    /// All comments and everything else stay as written. Settings of the command line are not saved.
    ///
    /// Each file is replaced in one step.
    ///
    /// # Errors
    /// A file was changed on the disk since it was read, can't be written, or has no place for the change; or any file
    /// was edited and is refused. Nothing is written then, unless the disk fails between two files.
    pub fn save(&self, to: SaveTo) -> Result<Vec<PathBuf>, Report> {
        self.save_or_list(to, false)
    }

    /// Returns the files that [`save`](Database::save) would write; writes nothing.
    ///
    /// # Errors
    /// As of [`save`](Database::save), except for errors of writing.
    pub fn saved_files(&self, to: SaveTo) -> Result<Vec<PathBuf>, Report> {
        self.save_or_list(to, true)
    }

    fn save_or_list(&self, to: SaveTo, only_lists: bool) -> Result<Vec<PathBuf>, Report> {
        // The edited files will have another content once they are mended.
        if let Some(refused) = self.refused_edit() {
            let first = Diagnostic::without_place(
                "nothing is saved: a file was edited and is refused, so its previous settings stay in force",
                Some("fix its errors, then save again".into()),
            );
            return Err([&[first], refused.diagnostics()].concat().into());
        }
        let _turn = lock(&self.shared.turn);
        let state = self.state();
        covered::refuse(&state.covered)?;
        let edited = self.edit(&state, to)?;
        let mut files = state.files.clone();
        for file in &edited {
            files.replace(&file.canonical, &file.text);
        }
        let saved = self.reread(&state, files)?;
        for file in &edited {
            if files::read(&file.path).ok().as_ref() != state.files.get(&file.path) {
                return Err(refusal(
                    format!("{} was changed on the disk since it was read", crate::printable(&file.path)),
                    "take that over first (reload it; a watched file is by itself), then save again",
                ));
            }
        }
        if only_lists {
            return Ok(edited.into_iter().map(|file| file.path).collect());
        }
        for file in &edited {
            write::replace(&file.canonical, &file.text).map_err(|error| {
                refusal(
                    format!("can't write {}: {error}", crate::printable(&file.path)),
                    "make the file and its folder writable, reload, and save again",
                )
            })?;
        }
        *lock(&self.shared.state) = saved;
        Ok(edited.into_iter().map(|file| file.path).collect())
    }

    /// Returns the files with the changes in them.
    fn edit(&self, state: &DatabaseState, to: SaveTo) -> Result<Vec<Edited>, Report> {
        let configuration = &*state.configuration;
        let mut documents: SortedMap<usize, DocumentMut> = SortedMap::new();
        let of_others = self.files_of_others(configuration);
        let is_of_others =
            |path: &Path| state.files.get(path).is_none_or(|file| of_others.contains(&file.canonical));
        let mut gone = Vec::new();
        for (path, _, present) in differences(&configuration.files, &configuration.merged) {
            let Some(value) = present.filter(|value| of_session(configuration, value.span)) else {
                gone.extend(replaced(configuration, &path).filter(|_| present.is_none()).map(<[_]>::to_vec));
                continue;
            };
            let source = match (to, &self.shared.options.host) {
                (SaveTo::Origin, _) => {
                    home::home(configuration, &path).or_else(|| home::main_file(configuration))
                }
                (SaveTo::Host, Some(host)) => home::file(configuration, host),
                (SaveTo::Host, None) => None,
            };
            let place = source.map(|id| home::place(configuration, id, is_of_others));
            let Some((source, place)) =
                place.and_then(|place| Some((configuration.sources().get(place.text)?, place)))
            else {
                return Err(refusal(
                    "no file of this machine to save to",
                    "name one when the agent is started",
                ));
            };
            let (Some(_), Some(document)) = (source.path(), source.document()) else {
                return Err(refusal(
                    format!("`{}` can't be saved: {} is built in and no file", render(&path), source.name()),
                    "save to the file of this machine, or start from a file",
                ));
            };
            let document = documents.entry(place.text).or_insert_with(|| document.clone().into_mut());
            edit::set(edit::part(document, &place.table), &path, value);
        }
        // Last, as what is new takes over the comments.
        for path in gone {
            if let Some(place) = home::home(configuration, &path)
                .map(|id| home::place(configuration, id, is_of_others))
                .filter(|place| place.stands)
                && let Some(document) =
                    configuration.sources().get(place.text).and_then(SettingSource::document)
            {
                let document = documents.entry(place.text).or_insert_with(|| document.clone().into_mut());
                let document = edit::part(document, &place.table);
                let table = &path[..path.len() - 1];
                let is_empty = |entry: &TableEntry| entry.value.as_table().is_some_and(Table::is_empty);
                if configuration.merged.entry(table).is_some_and(is_empty) {
                    edit::empty(document, table);
                } else {
                    edit::take_out(document, &path);
                }
            }
        }
        let edited = documents.into_iter().filter_map(|(id, document)| {
            let source = configuration.sources().get(id)?;
            let path = source.path()?.to_owned();
            let canonical = state.files.get(&path)?.canonical.clone();
            let text = as_before(source.text(), document.to_string());
            (text != source.text()).then(|| Edited { path, canonical, text: text.into() })
        });
        Ok(edited.collect())
    }

    /// Returns the files that other agents of the same file read too.
    fn files_of_others(&self, configuration: &Configuration) -> SortedSet<PathBuf> {
        let SharedDatabase { main, options, .. } = &*self.shared;
        let others = configuration.described.iter().flat_map(|described| &described.others);
        let read = others.flat_map(|other| {
            let options = Options { agent: Some(other.clone()), ..options.clone() };
            read(&ReadRequest { elsewhere: true, ..ReadRequest::new(main, &options) }, Files::default()).paths
        });
        read.collect()
    }

    /// Returns the state after the files are written.
    /// It has the same settings, with as few changes of the session as possible.
    fn reread(&self, state: &DatabaseState, files: Files) -> Result<DatabaseState, Report> {
        let SharedDatabase { main, options, .. } = &*self.shared;
        let before = &state.configuration;
        // The next start has what waits.
        if !state.waiting.is_empty() {
            read(&ReadRequest::new(main, options), files.clone()).result?;
        }
        let without =
            read(&ReadRequest { waiting: &state.waiting, ..ReadRequest::new(main, options) }, files)
                .result_and_files()?;
        let mut session = state.session.clone();
        // Changes of settings of the command line stay.
        session.0.retain(|change| {
            let value = |configuration: &Configuration| {
                configuration.merged.entry(&change.path).map(|entry| entry.value.value.clone())
            };
            match (value(&without.0), value(before)) {
                (Some(saved), Some(present)) => !same(&saved, &present),
                (None, None) => false,
                _ => true,
            }
        });
        let texts = session.texts();
        let written: Vec<_> = texts.iter().map(|text| Written { text, equals: None }).collect();
        let (configuration, files) = if written.is_empty() {
            without
        } else {
            let request =
                ReadRequest { waiting: &state.waiting, changes: &written, ..ReadRequest::new(main, options) };
            read(&request, without.1).result_and_files()?
        };
        let lost = differences(&before.merged, &configuration.merged).into_iter().map(|(path, ..)| path);
        // A change that was saved into a variant.
        let lost = lost.filter(|path| path.first().is_none_or(|first| first != CHOICES));
        let unsaved = differences(&configuration.files, &configuration.merged)
            .into_iter()
            .filter(|(_, _, present)| present.is_some_and(|value| of_session(&configuration, value.span)));
        if let Some(path) = lost.chain(unsaved.map(|(path, ..)| path)).next() {
            return Err(refusal(
                format!("`{}` can't be saved: the files would not have the same meaning", render(&path)),
                "write this change into the file by hand",
            ));
        }
        let (waiting, generation) = (state.waiting.clone(), state.generation + 1);
        Ok(DatabaseState {
            configuration: Arc::new(configuration),
            session,
            files,
            waiting,
            covered: Vec::new(),
            generation,
        })
    }
}

impl ReadOutcome {
    fn result_and_files(self) -> Result<(Configuration, Files), Report> {
        Ok((self.result?, self.files))
    }
}

/// Returns the path that a table of the session has removed.
/// The table replaced the one that contained the setting.
fn replaced<'a>(configuration: &Configuration, path: &'a [String]) -> Option<&'a [String]> {
    let depth = (1..path.len()).rev().find(|depth| configuration.merged.entry(&path[..*depth]).is_some())?;
    let table = &configuration.merged.entry(&path[..depth])?.value;
    (table.as_table().is_some() && of_session(configuration, table.span)).then(|| &path[..=depth])
}

fn of_session(configuration: &Configuration, span: super::super::source::Span) -> bool {
    configuration.sources.of(span).kind() == SourceKind::Change
}

/// Returns the text with the byte order mark and the line ends of the old one.
fn as_before(old: &str, new: String) -> String {
    let new = if old.contains("\r\n") { new.replace("\r\n", "\n").replace('\n', "\r\n") } else { new };
    match old.strip_prefix('\u{feff}') {
        Some(_) if !new.starts_with('\u{feff}') => format!("\u{feff}{new}"),
        _ => new,
    }
}
