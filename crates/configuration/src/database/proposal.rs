use std::convert::Infallible;

use slate_sorted::SortedMap;

use super::*;

/// Valid configuration, ready to take effect.
#[derive(Clone, Debug)]
#[must_use = "nothing changes until it is committed"]
pub struct Proposal {
    database: Database,
    configuration: Arc<Configuration>,
    session: ChangeSession,
    files: Files,
    changes: Vec<Change>,
    waiting: Vec<Change>,
    covered: Vec<Change>,
    /// Generation on which it is based.
    generation: u64,
}

/// Files that a proposal is read from.
pub(super) enum ProposalFiles {
    /// The files of the state.
    Known(Files),
    /// Edited files, of which some settings may have to wait.
    Edited(Files),
}

impl Proposal {
    /// The whole configuration with the changes.
    pub fn configuration(&self) -> &Arc<Configuration> {
        &self.configuration
    }

    /// The changes, in the order of the paths.
    pub fn changes(&self) -> &[Change] {
        &self.changes
    }

    /// Changes of edited files that wait for the next start.
    /// They are those of [`Database::waiting`] once this is committed.
    pub fn waiting(&self) -> &[Change] {
        &self.waiting
    }

    /// Edits of settings that were changed at run time.
    /// They are those of [`Database::covered`] once this is committed.
    pub fn covered(&self) -> &[Change] {
        &self.covered
    }

    /// Applies the proposal, and calls the handlers of its changes.
    ///
    /// The calls are complete when this returns, unless a handler calls it, or another thread calls the handlers:
    /// then that thread continues with these changes, so that all handlers see all changes in one order.
    ///
    /// # Errors
    /// The configuration has changed since this was proposed.
    pub fn commit(self) -> Result<Vec<Change>, Report> {
        self.apply().ok_or_else(|| {
            refusal(
                "the configuration has changed since the proposal was made",
                "propose again; nothing was changed by this one",
            )
        })
    }

    /// Applies the proposal; `None` if it was overtaken.
    pub fn apply(self) -> Option<Vec<Change>> {
        self.apply_after(|_| Ok::<(), Infallible>(())).map(|Ok(changes)| changes)
    }

    /// Applies the proposal if `work` succeeds with its configuration.
    /// No other change is possible meanwhile. `None`, without a call of `work`, if the proposal was overtaken.
    ///
    /// # Errors
    /// The error of `work`; nothing is changed then.
    pub fn apply_after<E>(
        self,
        work: impl FnOnce(&Configuration) -> Result<(), E>,
    ) -> Option<Result<Vec<Change>, E>> {
        let Self { database, configuration, session, files, changes, waiting, covered, generation } = self;
        let shared = &database.shared;
        {
            let _turn = lock(&shared.turn);
            if lock(&shared.state).generation != generation {
                return None;
            }
            if let Err(error) = work(&configuration) {
                return Some(Err(error));
            }
            let mut state = lock(&shared.state);
            *state =
                DatabaseState { configuration, session, files, waiting, covered, generation: generation + 1 };
            shared.handlers.queue(&changes);
        }
        shared.handlers.deliver(&database);
        Some(Ok(changes))
    }
}

impl Database {
    /// Proposes changes, each a path and a value as of `--set`, later ones last.
    ///
    /// Files are not read again, so that nothing else changes.
    ///
    /// # Errors
    /// All errors in any of them, and the objections of the validators.
    pub fn propose(&self, changes: &[(impl AsRef<str>, impl AsRef<str>)]) -> Result<Proposal, Report> {
        let changes: Vec<_> = changes
            .iter()
            .map(|(path, value)| (path.as_ref().to_owned(), value.as_ref().to_owned()))
            .collect();
        self.propose_instead(&[], &changes)
    }

    /// Proposes changes in place of the session's changes at some paths.
    /// Changes of the session at and below the paths are reverted; the new ones are as in [`propose`](Self::propose).
    ///
    /// # Errors
    /// As of [`propose`](Self::propose), and invalid paths.
    pub fn propose_instead(
        &self,
        taken_back: &[&str],
        changes: &[(String, String)],
    ) -> Result<Proposal, Report> {
        let mut state = self.state();
        for path in taken_back {
            let prefix = Prefix::parse(path, state.configuration.described_as())?;
            state.session.0.retain(|change| !prefix.holds(&change.path));
        }
        let texts: Vec<_> =
            changes.iter().map(|(path, value)| (format!("{path}={value}"), path.len())).collect();
        let written: Vec<_> =
            texts.iter().map(|(text, equals)| Written { text, equals: Some(*equals) }).collect();
        let files = state.files.clone();
        self.proposal(state, &written, ProposalFiles::Known(files)).0
    }

    /// Proposes other values at some paths, each as of `--set`.
    /// They replace the session's changes there. A path without a value returns to the files and the command line; if
    /// these have none, it gets that of `unset`, and a link is removed.
    ///
    /// # Errors
    /// As of [`propose`](Self::propose).
    pub fn replace(
        &self,
        settings: &[(String, Option<String>)],
        unset: &SortedMap<String, String>,
    ) -> Result<Proposal, Report> {
        let mut state = self.state();
        for (path, _) in settings {
            let prefix = Prefix::parse(path, state.configuration.described_as())?;
            state.session.0.retain(|change| !prefix.holds(&change.path));
        }
        let SharedDatabase { main, options, .. } = &*self.shared;
        let others = state.session.texts();
        let others: Vec<_> = others.iter().map(|text| Written { text, equals: None }).collect();
        let request =
            ReadRequest { waiting: &state.waiting, changes: &others, ..ReadRequest::new(main, options) };
        let without = read(&request, state.files.clone()).result?;
        let mut changes = Vec::new();
        for (path, value) in settings {
            let is_link = path.starts_with("links.");
            let said = without.value(path).map(|said| &said.value);
            let said = said.filter(|said| !(is_link && **said == Value::Bool(false))).map(Value::to_string);
            if said == *value {
                continue;
            }
            if is_link {
                // First it is taken away, so that nothing is left of what was said of it besides.
                changes.push((path, "false".to_owned()));
            }
            let value = value.clone().or_else(|| unset.get(path).cloned());
            changes.extend(value.map(|value| (path, value)));
        }
        let texts: Vec<_> =
            changes.iter().map(|(path, value)| (format!("{path}={value}"), path.len())).collect();
        let written: Vec<_> =
            texts.iter().map(|(text, equals)| Written { text, equals: Some(*equals) }).collect();
        let files = state.files.clone();
        self.proposal(state, &written, ProposalFiles::Known(files)).0
    }

    /// Proposes to revert the session's changes at a path and below it.
    /// An empty path selects all of them.
    ///
    /// # Errors
    /// The path is invalid, or the configuration is invalid without the changes.
    pub fn revert(&self, path: &str) -> Result<Proposal, Report> {
        self.propose_instead(&[path], &[])
    }

    /// Reverts the session's changes at a path and below it.
    /// It calls [`revert`](Self::revert) and [`commit`](Proposal::commit), again if another thread was faster.
    ///
    /// # Errors
    /// As of [`revert`](Self::revert).
    pub fn take_back(&self, path: &str) -> Result<Vec<Change>, Report> {
        loop {
            if let Some(changes) = self.revert(path)?.apply() {
                return Ok(changes);
            }
        }
    }

    /// Proposes the present content of the files; the session stays above it.
    ///
    /// # Errors
    /// All errors in any of the layers, and the objections of the validators.
    pub fn reload(&self) -> Result<Proposal, Report> {
        self.proposal(self.state(), &[], ProposalFiles::Edited(Files::default())).0
    }

    /// Returns the problems of edited files that can't take effect.
    /// Their earlier content stays in effect.
    pub fn refused_edit(&self) -> Option<Report> {
        let state = self.state();
        let now = state.files.fresh(&Files::default());
        if state.files.hold_in(&now) {
            return None;
        }
        self.proposal(state, &[], ProposalFiles::Edited(now)).0.err()
    }

    /// Reads changes on top of a state; also returns the files that were read.
    pub(super) fn proposal(
        &self,
        state: DatabaseState,
        changes: &[Written<'_>],
        texts: ProposalFiles,
    ) -> (Result<Proposal, Report>, Files) {
        let DatabaseState {
            configuration: before, mut session, mut waiting, mut covered, generation, ..
        } = state;
        let earlier = session.texts();
        let earlier = earlier.iter().map(|text| Written { text, equals: None });
        let written: Vec<_> = earlier.chain(changes.iter().copied()).collect();
        let SharedDatabase { main, options, .. } = &*self.shared;
        let request = |waiting: &[Change], files| {
            read(&ReadRequest { waiting, changes: &written, ..ReadRequest::new(main, options) }, files)
        };
        let is_edited = matches!(texts, ProposalFiles::Edited(_));
        let read = match texts {
            ProposalFiles::Known(files) => request(&waiting, files),
            ProposalFiles::Edited(files) => {
                let read = request(&[], files);
                let wait =
                    |configuration| self.shared.checks.waiting(configuration, &list(&before, configuration));
                waiting = read.result.as_ref().map_or(Vec::new(), wait);
                if waiting.is_empty() { read } else { request(&waiting, read.files) }
            }
        };
        let files = read.files;
        let result = read.result.and_then(|configuration| {
            let new = read.changes.len() - changes.len();
            let mut set_again = ChangeSession::default();
            for change in &read.changes[new..] {
                session.add(change);
                set_again.add(change);
            }
            if is_edited {
                let news = covered::by_session(&session, &before, &configuration);
                covered.retain(|old| !news.iter().any(|new| new.names == old.names));
                covered.extend(news);
            }
            covered.retain(|covered| session.has(&covered.names) && !set_again.has(&covered.names));
            let changes = list(&before, &configuration);
            // Everything was read and nothing is changed yet; shown are the texts as they were given.
            self.shared.checks.validate(&configuration, &changes)?;
            Ok(Proposal {
                database: self.clone(),
                configuration: Arc::new(configuration),
                session,
                files: files.clone(),
                changes,
                waiting,
                covered,
                generation,
            })
        });
        (result, files)
    }
}

fn list(before: &Configuration, after: &Configuration) -> Vec<Change> {
    let all = &before.merged;
    let change = |(names, before, after): super::super::compare::ValuePair<'_>| Change {
        path: path::render(&names),
        before: before.map(|value| value.value.clone()),
        after: after.map(|value| value.value.clone()),
        known: (0..names.len()).rev().find(|known| all.entry(&names[..*known]).is_some()).unwrap_or(0),
        names,
    };
    differences(&before.merged, &after.merged).into_iter().map(change).collect()
}
