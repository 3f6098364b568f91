//! No code leaves while a thread of its module runs it.

use super::{Composer, PluginError};
use crate::agent::composition::Composition;
use crate::aspects::Closed;

impl Composer {
    /// Ends the threads of modules whose code leaves. Until the result is dropped, none begins.
    pub(super) fn end_threads(
        &self,
        composition: &Composition,
        modules: &[String],
    ) -> Result<Closed, PluginError> {
        let closed = composition.ground.means.threads.close(modules);
        closed.map_err(|lingering| PluginError::Thread {
            module: lingering.module.to_string(),
            thread: lingering.thread.to_string(),
            limit: lingering.limit,
        })
    }
}
