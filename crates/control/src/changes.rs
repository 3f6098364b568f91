//! Turns of changes of an agent.

use std::sync::{Arc, Mutex, PoisonError};
use std::time::Duration;

use hyper::StatusCode;
use tokio::sync::{Mutex as AsyncMutex, OwnedMutexGuard};

use crate::problem::Problem;

/// Time that a change waits for the previous one.
/// It is less than callers wait for an answer.
const TURN_TIMEOUT: Duration = Duration::from_secs(50);

/// Lock that serializes changes, which may run modules' code, over all protocols.
#[derive(Default)]
pub(crate) struct ChangeTurns {
    turn: Arc<AsyncMutex<()>>,
    /// Name of the change in progress.
    name: Mutex<&'static str>,
}

impl ChangeTurns {
    /// Waits for the change before this one to end.
    ///
    /// # Errors
    /// When it does not end in time.
    pub async fn next(&self, operation: &'static str) -> Result<OwnedMutexGuard<()>, Problem> {
        let waited = tokio::time::timeout(TURN_TIMEOUT, Arc::clone(&self.turn).lock_owned()).await;
        let turn = waited.map_err(|_| {
            let other = *self.name.lock().unwrap_or_else(PoisonError::into_inner);
            let message =
                format!("another tool's `{other}` has not ended within {} s", TURN_TIMEOUT.as_secs());
            let help = "see the log for the module that it waits for";
            Problem::new(StatusCode::SERVICE_UNAVAILABLE, message, help)
        })?;
        *self.name.lock().unwrap_or_else(PoisonError::into_inner) = operation;
        Ok(turn)
    }
}
