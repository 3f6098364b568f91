use std::collections::BTreeMap;

use super::super::value::Value;
use super::proposal::Texts;
use super::*;

impl Database {
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
        let Shared { main, options, .. } = &*self.shared;
        let others = state.session.texts();
        let others: Vec<_> = others.iter().map(|text| Written { text, equals: None }).collect();
        let request = Request { waiting: &state.waiting, changes: &others, ..Request::new(main, options) };
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
        self.proposal(state, &written, Texts::Known(files)).0
    }
}
