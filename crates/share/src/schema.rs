//! Interfaces of other agents, within memory limits.

use std::sync::{Mutex, PoisonError};

use slate_blackboard::interface::Descriptor;
use slate_module::{Refusal, decode_interface};
use slate_sorted::SortedSet;

/// Memory limit for interfaces from other agents, bytes.
/// Descriptors stay for as long as the process, as values and readers refer to them.
const MAX_MEMORY: usize = 8 << 20;

/// Largest encoded interface, bytes.
const MAX_INTERFACE_SIZE: usize = 256 << 10;

/// Received interfaces, each counted once, and their total size, bytes.
static KNOWN_INTERFACES: Mutex<(SortedSet<Vec<u8>>, usize)> = Mutex::new((SortedSet::new(), 0));

/// Decodes an interface that another agent has described.
///
/// # Errors
/// When it can't be read, or other agents have brought too many.
pub fn interface(bytes: &[u8]) -> Result<&'static Descriptor, Refusal> {
    if bytes.len() > MAX_INTERFACE_SIZE {
        return Err(Refusal(format!(
            "its interface takes {} bytes, more than {MAX_INTERFACE_SIZE}",
            bytes.len()
        )));
    }
    {
        let mut known = KNOWN_INTERFACES.lock().unwrap_or_else(PoisonError::into_inner);
        let (all, taken) = &mut *known;
        if !all.contains(bytes) {
            if *taken + bytes.len() > MAX_MEMORY {
                return Err(Refusal(format!(
                    "other agents have brought more than {MAX_MEMORY} bytes of interfaces; restart this agent to forget \
                     them"
                )));
            }
            *taken += bytes.len();
            all.insert(bytes.to_vec());
        }
    }
    decode_interface(bytes)
}
