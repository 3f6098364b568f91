//! Handover of the loop between the program's stages and policy and a module's.

use std::sync::Arc;

use slate_module::Level;

use super::callback::Callback;
use super::{Core, LoopLog, Takeover};

/// Course of the loop: its own plan, or that of a takeover.
#[derive(Default)]
pub(super) struct PlanSelection {
    /// Number of the active takeover; 0 for the program's policy.
    pub number: u64,
    /// Number of the takeover for whose stages there is a plan beside the program's.
    planned: u64,
    /// True while the loop runs that plan.
    is_module_plan: bool,
    /// Module that has the loop.
    module: Option<Arc<str>>,
}

impl PlanSelection {
    /// Registers new plans: the program's is active, `planned` names the one beside it.
    pub fn replan(&mut self, planned: u64) {
        (self.planned, self.is_module_plan) = (planned, false);
    }
}

impl Core {
    /// Releases a callback for dropping; `None` if a thread has not returned from it.
    pub(super) fn release_callback(
        &mut self,
        callback: Callback<Arc<Takeover>>,
    ) -> Option<Callback<Arc<Takeover>>> {
        if callback.is_late() {
            self.late_callbacks.push(callback.into_late());
            return None;
        }
        Some(callback)
    }

    /// Prepares a cycle: selects the active policy and plan.
    pub(super) fn select_plan(&mut self, log: &LoopLog) {
        let Self { takeover, selection, plan, inactive_plan, .. } = self;
        let number = takeover.as_ref().map_or(0, |callback| {
            if selection.number != 0
                && let Some(cell) = callback.cell.as_ref().filter(|cell| cell.is_idle())
            {
                // Its policy may give it no turn, in which it would see that it was switched off.
                // SAFETY: the cell is idle, and belongs to the holder of the token.
                unsafe { cell.runner() }.is_enabled(log.clock.now());
            }
            callback.code.select_active(selection.planned)
        });
        let has_stages = number != 0 && number == selection.planned;
        if has_stages != selection.is_module_plan {
            std::mem::swap(plan, inactive_plan);
            selection.is_module_plan = has_stages;
        }
        if number == std::mem::replace(&mut selection.number, number) {
            return;
        }
        let module =
            takeover.as_ref().filter(|_| number != 0).map(|callback| Arc::clone(&callback.code.module));
        let before = std::mem::replace(&mut selection.module, module);
        let text = match (&selection.module, before) {
            (Some(module), _) if has_stages => {
                format!("{module} has the main loop, with the stages {}", plan.names.join(", "))
            }
            (Some(module), _) => format!("{module} has the main loop, and selects the next stage"),
            (None, Some(module)) => {
                let names = plan.names.join(", ");
                format!("{module} has the main loop no more; from now on its stages are {names}")
            }
            (None, None) => return,
        };
        log.write(Level::Info, &text);
    }

    /// Ends a module's takeover of the loop because its policy failed.
    pub(super) fn end_failed_takeover(&self, log: &LoopLog, reason: &str) {
        let Some(callback) = &self.takeover else { return };
        callback.code.end(self.selection.number);
        let text = format!("the policy of {} {reason}; it is not called any more", callback.code.module);
        log.write(Level::Error, &text);
    }
}
