//! Outputs with too few values for a queue that is linked later.

use slate_blackboard::channel::Writer;
use slate_module::Direction;
use slate_sorted::SortedMap;

use super::{BuildMoment, HostResources, ModuleBuilder};
use slate_composition::{BuildPlan, LinkEnd, Survey};
use slate_configuration::Configuration;

/// Writers of deeper channels for present modules' outputs, by module and path.
pub(in crate::agent) type Deeper = SortedMap<String, SortedMap<String, Writer>>;

/// Makes deeper channels for outputs with too few values for their queues.
/// A failure is reported when the queue is linked.
pub(in crate::agent) fn deepening(
    configuration: &Configuration,
    survey: &Survey<'_>,
    resources: &mut HostResources,
) -> Deeper {
    let plan = BuildPlan { configuration, survey };
    let builder = ModuleBuilder::new(plan, resources, BuildMoment::OnTrial);
    let mut deeper = Deeper::new();
    for resolved in &survey.links {
        let (Some(window), Some(owner)) = (window(plan, resolved.port), plan.writing(resolved.target)) else {
            continue;
        };
        let path = plan.target_path(resolved.target);
        let Some(property) = builder.property(&path) else { continue };
        let Some(channel) = property.channel() else { continue };
        let of_owner = deeper.entry(plan.name(owner).to_owned()).or_default();
        let window = resolved.link.window.as_ref().map_or(window, |window| window.value.into());
        if !channel.keeps_enough(window) && !of_owner.contains_key(&path) {
            let (depth, budget) = plan.demand(resolved.target, &path);
            if let Ok(writer) = channel.deeper(depth, budget) {
                of_owner.insert(path, writer);
            }
        }
    }
    deeper.retain(|_, outputs| !outputs.is_empty());
    deeper
}

/// Returns the window of a queue input, in values; `None` for other ports.
/// It holds if the link sets no other window.
fn window(plan: BuildPlan<'_, '_>, (module, link_end): (usize, LinkEnd)) -> Option<usize> {
    let LinkEnd::Port(port) = link_end else { return None };
    let port = plan.port(module, port);
    (port.direction == Direction::Queue).then_some(port.window)
}
