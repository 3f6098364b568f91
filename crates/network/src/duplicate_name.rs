//! Check for another agent of the same name.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

use slate_module::Level;
use zenoh::Wait;
use zenoh::query::Reply;
use zenoh::sample::Locality;

use crate::key::alive_key;
use crate::shared::NetworkShared;

/// Period of the check.
const CHECK_PERIOD: Duration = Duration::from_secs(5);

/// Periodic check for another agent of the same name.
/// Readers take two agents of a name for one.
pub struct DuplicateNameCheck {
    shared: Arc<NetworkShared>,
    /// Time of the next check, ns.
    next: u64,
    is_found: Arc<AtomicBool>,
}

impl DuplicateNameCheck {
    pub fn new(shared: Arc<NetworkShared>) -> Self {
        Self { shared, next: 0, is_found: Arc::default() }
    }

    /// Queries periodically until one is found, and logs it once.
    pub fn check(&mut self) {
        let now = self.shared.surface.agent.composer().steady_now();
        if now < self.next || self.is_found.load(Ordering::Relaxed) {
            return;
        }
        self.next = now + CHECK_PERIOD.as_nanos() as u64;
        let (shared, is_found) = (Arc::clone(&self.shared), Arc::clone(&self.is_found));
        let found = move |_: Reply| {
            if !is_found.swap(true, Ordering::Relaxed) {
                let text = format!(
                    "another agent is called `{}` on this network: readers can't tell the two apart; give each a name: \
                     agent.name",
                    shared.board().agent()
                );
                shared.log(Level::Warn, &text);
            }
        };
        let get = self.shared.session.get(alive_key(self.shared.board().agent()));
        // A query that fails is repeated at the next check.
        let _ = get.allowed_destination(Locality::Remote).timeout(CHECK_PERIOD).callback(found).wait();
    }
}
