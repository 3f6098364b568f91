//! Unloading of modules' code.
//! Each module may veto it, and no code leaves while a thread of its module runs it.

use std::sync::Arc;

use super::PluginError;
use crate::agent::composition::Composition;
use crate::aspects::Closed;
use slate_engine::main_loop::SharedLoop;

/// Departure of modules whose code is unloaded.
pub(super) struct ModuleRemoval<'c> {
    shared: &'c Arc<SharedLoop>,
    modules: &'c [String],
}

impl<'c> ModuleRemoval<'c> {
    pub fn new(shared: &'c Arc<SharedLoop>, modules: &'c [String]) -> Self {
        Self { shared, modules }
    }

    /// Checks that the modules may be unloaded now.
    pub fn check_vetoes(&self, composition: &Composition) -> Result<(), PluginError> {
        if let Some(source) = composition.configuration.time_source()
            && self.modules.contains(&source.value)
        {
            return Err(PluginError::TimeSource { module: source.value.clone() });
        }
        for module in self.modules {
            let loaded = &composition.assembly.modules[module];
            let (own, cell) = (loaded.own_thread, Arc::clone(&loaded.cell));
            let veto = self.shared.with_cells(&[Arc::clone(&cell)], own, move || {
                let (kind, instance) = {
                    // SAFETY: between two steps the runner is not in use; the reference ends before the call.
                    let runner = unsafe { cell.runner() };
                    runner.code.parts()
                };
                if instance.is_null() {
                    // It has failed for good, so it can't veto.
                    return Some(Ok(()));
                }
                // SAFETY: the instance is of that kind, and between two ticks it belongs to this call.
                cell.call(own, || unsafe { kind.may_unload(instance) })
            });
            match veto {
                Some(Ok(())) => {}
                Some(Err(refusal)) => {
                    return Err(PluginError::Veto { module: module.clone(), reason: refusal.0 });
                }
                None => return Err(PluginError::Late { module: module.clone() }),
            }
        }
        Ok(())
    }

    /// Ends the threads of the modules; none begins until the result is dropped.
    pub fn end_threads(&self, composition: &Composition) -> Result<Closed, PluginError> {
        let closed = composition.assembly.resources.service_context.threads.close(self.modules);
        closed.map_err(|lingering| PluginError::Thread {
            module: lingering.module.to_string(),
            thread: lingering.thread.to_string(),
            limit: lingering.limit,
        })
    }
}
