//! Interface to the player of a recording.
//! It sets the time, and writes properties in place of modules.

mod control;
mod excerpt;
mod service_stub;

use std::time::Duration;

use slate_blackboard::interface::{Descriptor, Interface, Value};
use slate_module::{Description, Plugin};
use slate_safety::GateState;
use slate_sorted::SortedMap;

pub use control::{LoopSection, Order, PlaybackControl, PlaybackStatus};
pub use excerpt::{Excerpt, excerpt};
pub use slate_composition::Played;
use slate_configuration::{Configuration, Module};
pub use slate_engine::Playback;
use slate_engine::log::{LogCounts, LogLine};
use slate_engine::main_loop::LoopState;
use slate_engine::runner::{ModuleState, ModuleTiming, OwnSetup, describe};
use slate_engine::timing::TimingHistogram;

/// Returns all interfaces that are known here, by their schemas.
/// These are those of the agent itself, and those of the plugins' modules, as a configuration sets them up if there is
/// one.
pub fn interfaces(
    plugins: &[Plugin],
    configuration: Option<&Configuration>,
) -> SortedMap<u64, &'static Descriptor> {
    let own = [
        ModuleState::DESCRIPTOR,
        ModuleTiming::DESCRIPTOR,
        TimingHistogram::DESCRIPTOR,
        LoopState::DESCRIPTOR,
        LogLine::DESCRIPTOR,
        LogCounts::DESCRIPTOR,
        slate_composition::parameters::enabled_descriptor(),
        GateState::DESCRIPTOR,
    ];
    let mut known: SortedMap<_, _> =
        own.into_iter().map(|descriptor| (descriptor.hash, descriptor)).collect();
    let mut learn = |description: &Description| {
        let ports = description.ports.iter().map(|port| port.descriptor);
        known.extend(ports.chain([description.params]).map(|descriptor| (descriptor.hash, descriptor)));
    };
    if let Some(configuration) = configuration {
        descriptions(plugins, configuration).values().for_each(&mut learn);
    }
    for kind in plugins.iter().flat_map(Plugin::kinds) {
        let setup = OwnSetup { name: kind.name().into(), seed: 0, period: 0, section: None, params: None };
        // One that can't do without its section is known by its configuration or not at all.
        if let Ok(description) = describe(kind, &setup, DESCRIPTION) {
            learn(&description);
        }
    }
    known
}

/// Returns the descriptions of a configuration's modules.
/// Modules of unknown plugins are left out.
fn descriptions(plugins: &[Plugin], configuration: &Configuration) -> SortedMap<String, Description> {
    let described = |module: &Module| {
        let kinds = plugins.iter().flat_map(Plugin::kinds);
        let kind = kinds.into_iter().find(|kind| kind.name() == module.kind.value)?;
        let section = Some(kind.section()).filter(|section| !section.is_empty());
        let setup = OwnSetup {
            name: module.name.value.as_str().into(),
            seed: configuration.seed().value,
            period: configuration.period().value,
            section: section.and_then(|name| configuration.table(name)).map(Value::from),
            params: None,
        };
        Some((module.name.value.clone(), describe(kind, &setup, DESCRIPTION).ok()?))
    };
    configuration.modules().iter().filter_map(described).collect()
}

/// Time limit of describing a module.
const DESCRIPTION: Duration = Duration::from_secs(5);
