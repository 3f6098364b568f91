//! Resolution of links between ports, and the conversion of their values.

mod delay;
mod ends;
mod external;
mod fit;
mod messages;
mod missing_slash;
mod remote;
mod sinks;
mod sources;

use slate_blackboard::is_within;

use super::names::join;
use super::{LinkEnd, ResolvedLink, Survey};
use crate::catalogue::Catalogue;
use crate::diagnostic_collector::DiagnosticCollector;
pub use external::bridge_refusal;
pub use messages::ungated_command;
pub use remote::{carrier_mismatch, path as remote_path};
use sinks::LinkSink;
use slate_configuration::ErrorCode;
use slate_configuration::{Configuration, Link};
use sources::LinkSources;

pub(super) fn survey_links<'a>(
    configuration: &'a Configuration,
    dormant: &[&'a str],
    catalogue: &Catalogue,
    survey: &mut Survey<'a>,
    collector: &mut DiagnosticCollector<'a>,
) {
    let own: Vec<Option<LinkSink>> = configuration
        .links()
        .iter()
        .map(|link| sinks::sink(configuration, survey, dormant, link, collector))
        .collect();
    check_overlaps(configuration, &own, survey, collector);
    external::check_arriving(configuration, survey, dormant, &own, collector);
    survey.remote = remote::all(configuration, catalogue);
    survey.carriers.clone_from(&catalogue.carriers);
    survey.has_jpeg = catalogue.has_jpeg;
    let mut sources = LinkSources::new(configuration, dormant, survey, &own, collector);
    let mut links: Vec<_> = (0..own.len()).filter_map(|link| sources.resolve_link(link)).collect();
    external::check_leaving(configuration, &mut sources);
    let LinkSources { absent, mismatches, .. } = sources;
    links.sort_by_cached_key(|resolved| {
        join(&survey.end_path(resolved.port.0, resolved.port.1), &resolved.field)
    });
    delay::set_delays(configuration, survey, &mut links);
    survey.absent = absent;
    survey.mismatches = mismatches;
    survey.links = links;
}

/// Reports links that fill the same part of a port, or share an outbox.
fn check_overlaps<'a>(
    configuration: &'a Configuration,
    sinks: &[Option<LinkSink>],
    survey: &Survey<'a>,
    collector: &mut DiagnosticCollector<'a>,
) {
    for (i, sink) in sinks.iter().enumerate() {
        let Some(sink) = sink else { continue };
        let earlier = sinks[..i].iter().zip(configuration.links());
        let other = earlier.filter_map(|(other, link)| Some((other.as_ref()?, link))).find(|(other, _)| {
            (other.module, other.link_end) == (sink.module, sink.link_end)
                && (is_within(&other.field, &sink.field) || is_within(&sink.field, &other.field))
        });
        let Some((_, other)) = other else { continue };
        let name = &survey.modules[sink.module].module.name.value;
        let Link { to, from, .. } = &configuration.links()[i];
        if sink.sends {
            let message = format!("`{}` sends to `{}` already", from.value, other.to.value);
            collector.add(from.span, ErrorCode::TwoSources.of(message), "an outbox sends to one inbox");
            continue;
        }
        let message = ErrorCode::TwoSources
            .of(format!("`{}` of `{name}` is linked already, by `{}`", to.value, other.to.value));
        collector.add(to.span, message, "link each field once, or the whole input");
    }
}

/// Returns the name of a port in messages.
fn end_name<'s>(survey: &'s Survey<'_>, module: usize, link_end: LinkEnd) -> &'s str {
    match link_end {
        LinkEnd::Port(port) => &survey.modules[module].description.ports[port].name,
        LinkEnd::Enabled => "enabled",
        LinkEnd::Params => "params",
    }
}

impl Survey<'_> {
    /// Returns the path of a port, a switch or the parameters.
    pub fn end_path(&self, module: usize, link_end: LinkEnd) -> String {
        join(&self.modules[module].module.name.value, end_name(self, module, link_end))
    }
}

impl ResolvedLink<'_> {
    /// Returns whether the port is linked as a whole to a value of its own type.
    pub fn is_plain(&self) -> bool {
        matches!(self.conversion, super::LinkConversion::Plain)
    }
}
