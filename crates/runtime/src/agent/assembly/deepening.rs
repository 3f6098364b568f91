//! Deeper channels for outputs that keep too few values for a new queue link.
//! The channel is exchanged between two steps of the module that writes it.

use std::sync::Arc;

use super::Assembly;
use crate::agent::build::deepening;
use slate_composition::Survey;
use slate_configuration::Configuration;
use slate_engine::main_loop::SharedLoop;

impl Assembly {
    /// Deepens outputs for the queues that a survey links to them.
    /// Done before the queues get their readers. Present readers are not affected, so the depth may stay if the links
    /// are not made after all. Fails with the name of a module that has not returned.
    pub fn deepen(
        &mut self,
        configuration: &Configuration,
        survey: &Survey<'_>,
        shared: &SharedLoop,
    ) -> Result<(), String> {
        for (name, outputs) in deepening(configuration, survey, &mut self.resources) {
            // A module that is not there yet finds it when it comes.
            let Some(loaded) = self.modules.get(&name) else { continue };
            let cell = Arc::clone(&loaded.cell);
            let work = move || {
                // SAFETY: the cell is idle and belongs to the loop, or it is claimed.
                let runner = unsafe { cell.runner() };
                for (path, writer) in outputs {
                    if let Some(output) =
                        runner.outputs.ports.iter_mut().find(|output| output.property.path() == path)
                    {
                        output.writer.deepen(writer);
                    }
                }
                Some(())
            };
            let cells = [Arc::clone(&loaded.cell)];
            shared.with_cells(&cells, loaded.own_thread, work).ok_or(name)?;
        }
        Ok(())
    }
}
