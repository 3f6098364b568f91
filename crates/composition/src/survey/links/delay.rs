//! Delays of links that read a value of the last cycle.

use slate_configuration::Configuration;
use slate_module::Stage;

use crate::survey::writers::writers;
use crate::survey::{LinkSource, ResolvedLink, Survey};

/// Sets which of the links are delayed, once all of them are resolved.
pub(super) fn set_delays(configuration: &Configuration, survey: &Survey<'_>, links: &mut [ResolvedLink<'_>]) {
    let delays: Vec<_> = links.iter().map(|link| is_delayed(configuration, survey, links, link)).collect();
    for (link, delayed) in links.iter_mut().zip(delays) {
        link.delayed = delayed;
    }
}

/// Returns whether a link reads last cycle's value of an earlier write.
fn is_delayed(
    configuration: &Configuration,
    survey: &Survey<'_>,
    links: &[ResolvedLink<'_>],
    link: &ResolvedLink<'_>,
) -> bool {
    let own = &survey.modules[link.port.0];
    match link.target {
        // Replayed properties are written at their module's slot, possibly earlier in the cycle.
        LinkSource::Played(played) => {
            link.previous && survey.played[played].later_modules.contains(&own.module.name.value)
        }
        target => {
            let place = place(configuration, own.stage);
            let is_earlier = |writer: usize| self::place(configuration, survey.modules[writer].stage) < place;
            link.previous
                && writers(configuration, &survey.modules, links, target).into_iter().any(is_earlier)
        }
    }
}

/// Returns the place of a stage in a cycle; `None` for a stage that is not in it.
fn place(configuration: &Configuration, stage: Stage) -> Option<(usize, Option<usize>)> {
    let stages = configuration.schedule().stages();
    let at = stages.iter().position(|own| own.members.contains(&stage))?;
    Some((at, stages[at].members.iter().position(|member| *member == stage)))
}
