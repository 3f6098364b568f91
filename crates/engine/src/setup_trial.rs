//! Trial of a module's setup, as `slate check` needs it.

use std::sync::Arc;
use std::time::Duration;

use slate_composition::SetupTrial;
use slate_module::Refusal;

use crate::isolation::{Arena, Isolation};
use crate::runner::within_create_timeout;

/// Makes an instance of a module and ends it.
/// The code of a library runs in a thread, with the timeout of its creation, as it may not return; an isolated module
/// has a process of its own, which its faults end. A kind that is linked in is the program's own code: it runs in the
/// calling thread, and has no timeout.
///
/// Returns the result of the restoration of its state.
///
/// # Errors
/// The module's refusal, or that the call does not return.
pub fn set_up(trial: SetupTrial, hang: Duration) -> Result<Result<(), Refusal>, Refusal> {
    match trial.memory {
        Some(memory) => set_up_isolated(trial, memory, hang),
        None if trial.kind.library().is_none() => slate_composition::set_up(trial, hang),
        None => {
            let name = Arc::clone(&trial.setup.name);
            within_create_timeout(&name, hang, move || slate_composition::set_up(trial, hang))
        }
    }
}

fn set_up_isolated(trial: SetupTrial, memory: u64, hang: Duration) -> Result<Result<(), Refusal>, Refusal> {
    let arena = || Arena::new().map_err(|error| Refusal(format!("it can't get shared memory: {error}")));
    let isolation = Isolation {
        name: Arc::clone(&trial.setup.name),
        program: None,
        memory,
        tick_timeout: hang,
        call_timeout: hang,
        own: arena()?,
        readable: vec![arena()?],
        ports: trial.ports.clone(),
        params_size: trial.params.len(),
        process_record: Default::default(),
    };
    let kind = Arc::new(isolation).kind(&trial.kind);
    slate_composition::set_up(SetupTrial { kind, ..trial }, hang)
}
