use super::super::compare::ValuePair;
use super::*;

/// Returns the edits of settings that the session has changed.
pub(super) fn by_session(
    session: &ChangeSession,
    before: &Configuration,
    after: &Configuration,
) -> Vec<Change> {
    let holds = |names: &[String]| after.merged.entry(names).map(|entry| entry.value.value.clone());
    let change = |(names, _, now): ValuePair<'_>| Change {
        path: path::render(&names),
        before: holds(&names),
        after: now.map(|value| value.value.clone()),
        known: names.len(),
        names,
    };
    differences(&before.files, &after.files)
        .into_iter()
        .filter(|(names, ..)| session.has(names))
        .map(change)
        .filter(|change| match (&change.before, &change.after) {
            (Some(before), Some(after)) => !same(before, after),
            (before, after) => before.is_some() || after.is_some(),
        })
        .collect()
}

/// Refuses to save over edits of a file since it was read.
pub(super) fn refuse(covered: &[Change]) -> Result<(), Report> {
    let text = |value: &Option<Value>| value.as_ref().map_or("nothing".into(), Value::to_string);
    let diagnostic = |change: &Change| {
        let Change { path, before, after, .. } = change;
        Diagnostic::without_place(
            format!(
                "`{path}` was set to {} at run time, and a file was then edited to {}",
                text(before),
                text(after)
            ),
            Some(format!("set it again to save that, or keep the file's with `slate config revert {path}`")),
        )
    };
    if covered.is_empty() { Ok(()) } else { Err(covered.iter().map(diagnostic).collect::<Vec<_>>().into()) }
}
