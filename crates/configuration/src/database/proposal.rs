use std::collections::BTreeMap;
use std::convert::Infallible;

use super::*;

/// A configuration that is valid and could hold from now on.
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
    /// The generation that it starts from.
    generation: u64,
}

/// The files that a proposal is read from.
pub(super) enum ProposalFiles {
    /// The files of the state.
    Known(Files),
    /// Others, of which some settings may have to wait.
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

    /// Changes of edited files that wait for the next start, as [`Database::waiting`] once this is committed.
    pub fn waiting(&self) -> &[Change] {
        &self.waiting
    }

    /// Edits of settings that were changed at run time, as [`Database::covered`] once this is committed.
    pub fn covered(&self) -> &[Change] {
        &self.covered
    }

    /// Makes it the configuration that holds, and calls the handlers of what changes.
    ///
    /// They were called when this returns, unless it is called by one of them or while another thread calls them:
    /// then that one goes on with these changes, so that all handlers see all changes in one order.
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

    /// Makes it hold; nothing if it was overtaken.
    pub fn apply(self) -> Option<Vec<Change>> {
        self.apply_after(|_| Ok::<(), Infallible>(())).map(|Ok(changes)| changes)
    }

    /// Does `work` with the new configuration while nobody can change it, and makes it hold when that succeeds. Nothing
    /// is done if it was overtaken.
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
    /// Reads the configuration with changes, each a path and a value as `--set` takes them, later ones last.
    ///
    /// Files are not read again, so that nothing else changes.
    ///
    /// # Errors
    /// Everything that is wrong with any of them, and what the validators object to.
    pub fn propose(&self, changes: &[(impl AsRef<str>, impl AsRef<str>)]) -> Result<Proposal, Report> {
        let changes: Vec<_> = changes
            .iter()
            .map(|(path, value)| (path.as_ref().to_owned(), value.as_ref().to_owned()))
            .collect();
        self.propose_instead(&[], &changes)
    }

    /// The configuration without the session's changes at some paths and below them, and with other changes, as
    /// [`propose`](Self::propose) takes them, in their place.
    ///
    /// # Errors
    /// As of [`propose`](Self::propose), and what is no path.
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

    /// The configuration with other values at some paths, each as `--set` takes it, whatever the session says there.
    /// What has none is as the files and the command line say; if they say anything, it is as `unset` says instead, and a
    /// link is taken away.
    ///
    /// # Errors
    /// As of [`propose`](Self::propose).
    pub fn replace(
        &self,
        settings: &[(String, Option<String>)],
        unset: &BTreeMap<String, String>,
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

    /// The configuration without the session's changes at a path and below it; an empty path is all of them.
    ///
    /// # Errors
    /// The path is none, or what remains doesn't hold without them.
    pub fn revert(&self, path: &str) -> Result<Proposal, Report> {
        self.propose_instead(&[path], &[])
    }

    /// Takes back what the session has changed at a path and below it: [`revert`](Self::revert) and
    /// [commit](Proposal::commit), again if somebody else was faster.
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

    /// The configuration with the files as they are on the disk now; the session stays on top.
    ///
    /// # Errors
    /// Everything that is wrong with any of the layers, and what the validators object to.
    pub fn reload(&self) -> Result<Proposal, Report> {
        self.proposal(self.state(), &[], ProposalFiles::Edited(Files::default())).0
    }

    /// What is wrong with files that were edited since they were read and can't be taken over; what they said before
    /// goes on to hold.
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
