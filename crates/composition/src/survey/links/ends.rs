//! Ends of a link and their names in messages.

use super::end_name;
use super::sinks::LinkSink;
use crate::survey::names::join;
use crate::survey::{Absent, LinkSource, Survey};
use slate_configuration::Configuration;

/// Property and a field of it.
pub(super) struct TargetField {
    pub target: LinkSource,
    pub field: String,
    /// Selection of last cycle's value by a link of an input between.
    pub previous: bool,
}

impl TargetField {
    pub fn new(target: LinkSource, field: impl Into<String>) -> Self {
        Self { target, field: field.into(), previous: false }
    }
}

/// Returns the name of the target of a link in messages.
pub(super) fn target_name(
    configuration: &Configuration,
    survey: &Survey<'_>,
    absent: &[Absent],
    target: LinkSource,
) -> String {
    match target {
        LinkSource::Absent(index) => absent[index].path.clone(),
        LinkSource::Remote(index) => survey.remote[index].name(),
        other => survey.path(configuration, other),
    }
}

/// Returns the name of the port of a link in messages.
pub(super) fn sink_name(survey: &Survey<'_>, sink: &LinkSink) -> String {
    let module = &survey.modules[sink.module].module.name.value;
    join(&format!("{module}/{}", end_name(survey, sink.module, sink.link_end)), &sink.field)
}
