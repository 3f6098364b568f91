//! Turns of changes of an agent.

use std::sync::{Arc, Mutex, PoisonError};
use std::time::Duration;

use hyper::StatusCode;
use tokio::sync::{Mutex as AsyncMutex, OwnedMutexGuard};

use crate::problem::Problem;

/// How long a change waits for the one before it; less than callers wait for an answer.
const TURN: Duration = Duration::from_secs(50);

/// Turns of changes, which may run modules' code: one at a time, whichever way they come.
#[derive(Default)]
pub(crate) struct ChangeTurns {
    turn: Arc<AsyncMutex<()>>,
    /// The change that is under way.
    name: Mutex<&'static str>,
}

impl ChangeTurns {
    /// Waits for the change before this one to end.
    ///
    /// # Errors
    /// When it does not end in time.
    pub async fn next(&self, operation: &'static str) -> Result<OwnedMutexGuard<()>, Problem> {
        let waited = tokio::time::timeout(TURN, Arc::clone(&self.turn).lock_owned()).await;
        let turn = waited.map_err(|_| {
            let other = *self.name.lock().unwrap_or_else(PoisonError::into_inner);
            let message = format!("another tool's `{other}` has not ended within {} s", TURN.as_secs());
            let help = "see the log for the module that it waits for";
            Problem::new(StatusCode::SERVICE_UNAVAILABLE, message, help)
        })?;
        *self.name.lock().unwrap_or_else(PoisonError::into_inner) = operation;
        Ok(turn)
    }
}
