//! Modules that the main loop calls.
//! These are the one that may take the loop over, and the time source.

use std::sync::Arc;

use slate_module::aspect::{MainLoop, Service, TimeSource};
use slate_sorted::SortedMap;

use super::module::LoadedModule;
use crate::aspects::{PlaceTime, ServiceContext};
use slate_composition::needs;
use slate_engine::main_loop::SharedLoop;

/// Modules that the main loop calls, by name.
#[derive(Default)]
pub(super) struct LoopOwners {
    /// Module that has the main loop, or may take it.
    taker: Option<String>,
    /// Module that is the time source.
    time: Option<String>,
}

impl LoopOwners {
    /// Connects the loop with the module that may take it over and the time source.
    pub fn connect(
        &mut self,
        modules: &SortedMap<String, LoadedModule>,
        service_context: &ServiceContext,
        shared: &Arc<SharedLoop>,
    ) {
        let of = |schema: u64| modules.iter().find(|(_, loaded)| needs(&loaded.description, schema));
        let (taker, time) = (of(MainLoop::DESCRIPTOR.hash), of(TimeSource::DESCRIPTOR.hash));
        let name = |owner: Option<(&String, &LoadedModule)>| owner.map(|(name, _)| name.clone());
        if name(taker) != self.taker {
            let place = taker.and_then(|(name, loaded)| {
                Some((service_context.takeovers.get(name)?, Arc::clone(&loaded.cell)))
            });
            shared.set_takeover(place);
        }
        if name(time) != self.time {
            match time {
                Some((_, loaded)) => {
                    let code = PlaceTime(Arc::clone(&service_context.time));
                    let cell = (!loaded.own_thread).then(|| Arc::clone(&loaded.cell));
                    shared.set_time_source(Some(Box::new(code)), cell);
                }
                None => shared.set_time_source(None, None),
            }
        }
        (self.taker, self.time) = (name(taker), name(time));
    }
}
