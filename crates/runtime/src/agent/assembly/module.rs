//! Loaded module, from its cell to its end.

use std::sync::Arc;
use std::time::Duration;

use slate_module::{Description, Level, ModuleKind};
use slate_sorted::SortedMap;

use crate::agent::build::HostResources;
use slate_composition::{LinkEnd, LinkSignature};
use slate_engine::isolation::Isolation;
use slate_engine::main_loop::{RunnerCell, SharedLoop};
use slate_engine::runner::ModuleCondition;

/// Longest wait for others, such as the watchdog, to release a module.
const LETTING_GO: Duration = Duration::from_secs(1);

/// The links of a module, by its ports.
pub(in crate::agent) type LinksByPort = SortedMap<LinkEnd, Vec<LinkSignature>>;

/// Loaded module.
pub(in crate::agent) struct LoadedModule {
    pub cell: Arc<RunnerCell>,
    pub kind: ModuleKind,
    /// Description, shared with the lists that are read during a change.
    pub description: Arc<Description>,
    pub own_thread: bool,
    /// Isolation in a process of its own, if any.
    pub isolation: Option<Arc<Isolation>>,
    /// Links, by port.
    pub links_by_port: LinksByPort,
}

impl LoadedModule {
    /// Returns code as this module runs it: in this process or isolated.
    pub fn placed(&self, kind: &ModuleKind) -> ModuleKind {
        self.isolation.as_ref().map_or_else(|| kind.clone(), |isolation| isolation.kind(kind))
    }

    /// Ends the module after the loop has ceased to run it.
    /// Returns its state if `keep` is true.
    pub fn dispose(
        self,
        name: &str,
        resources: &mut HostResources,
        shared: &SharedLoop,
        keep: bool,
    ) -> Result<Vec<u8>, String> {
        let Self { cell, own_thread, .. } = self;
        if own_thread {
            cell.retire();
            shared.threads().join_one(&cell, resources.hang, shared.clock.now());
        }
        if cell.is_late() {
            let text = format!("{name} has not returned from its last call; its library stays open");
            shared.logger.log(shared.clock.now(), Level::Error, &text);
            // Its thread still refers to it, and so does the library to which that may return.
            std::mem::forget(cell);
            return Err("its tick has not returned".into());
        }
        let Some(mut runner) = cell.into_runner(LETTING_GO) else {
            return Err("it is still in use".into());
        };
        let now = shared.clock.now();
        runner.set_condition(ModuleCondition::UNLOADED, now);
        runner.publish_safe(now);
        resources.signals(name).health.set(ModuleCondition::UNLOADED);
        let retired = runner.retire();
        // Its ports are free for others, also when its last calls don't return.
        drop(runner);
        if keep { retired.save() } else { Ok(Vec::new()) }
    }
}
