//! Operations of the control surface, on behalf of nodes.

use std::sync::Arc;

use serde_json::Value as Json;
use slate_control::operations::by_name;
use slate_control::{Caller, Connections, ControlSurface, Dispatcher, OperationAnswer, Problem, Role};
use tokio::runtime::{Builder, Runtime};

/// Operations at work at a time.
const MAX_OPERATIONS: usize = 4;

/// Carries out operations as tools do, with the same checks and in the same turn.
pub struct AgentOperations {
    dispatcher: Dispatcher,
    caller: Caller,
    /// Taken at the end.
    runtime: Option<Runtime>,
}

impl AgentOperations {
    /// Operations on behalf of a bridge, which the log calls by its scheme.
    ///
    /// # Errors
    /// When the system has no resources for waiting.
    pub fn new(surface: &Arc<ControlSurface>, scheme: &str) -> std::io::Result<Self> {
        let caller = Caller {
            // Which of them are offered is up to the table of the bridge.
            role: Role::Developer,
            who: scheme.into(),
            local: None,
            is_told: false,
            connection: Arc::new(Arc::new(Connections::default()).admit()),
        };
        let dispatcher = Dispatcher::new(Arc::clone(surface), MAX_OPERATIONS, true);
        let runtime = Builder::new_current_thread().enable_time().build()?;
        Ok(Self { dispatcher, caller, runtime: Some(runtime) })
    }

    /// Carries out an operation with the parts of its path; returns its answer.
    ///
    /// # Errors
    /// Why it is refused, in words.
    pub fn carry_out(&self, name: &str, parts: &[(&str, &str)], body: Json) -> Result<Json, String> {
        let reason = |problem: Problem| problem.detail().to_owned();
        let operation = by_name(name).ok_or_else(|| format!("no operation is called `{name}`"))?;
        let runtime = self.runtime.as_ref().ok_or("the bridge has ended")?;
        let _turn = runtime.block_on(self.dispatcher.turn(operation)).map_err(reason)?;
        match self.dispatcher.carry_out(&self.caller, name, parts, body).map_err(reason)? {
            OperationAnswer::Json(_, body, _) => Ok(body),
            _ => Ok(Json::Null),
        }
    }
}

/// Shutdown of the runtime in the background.
/// A bridge that does not open drops it within a task, where a runtime must not wait for its own.
impl Drop for AgentOperations {
    fn drop(&mut self) {
        if let Some(runtime) = self.runtime.take() {
            runtime.shutdown_background();
        }
    }
}
