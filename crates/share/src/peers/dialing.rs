//! Endpoint at which another agent is dialed.

/// Endpoint at which another agent is dialed, and the duration of dialing.
#[derive(Debug, Default)]
pub(super) struct Dialing {
    /// Endpoint dialed whenever the agent is absent; `None` if only it dials.
    pub always: Option<String>,
    /// Endpoint dialed for a query, and the end of that, ns.
    until: Option<(String, u64)>,
}

impl Dialing {
    /// Dials an endpoint until that time.
    pub fn dial_until(&mut self, endpoint: &str, until: u64) {
        self.until = Some((endpoint.into(), until));
    }

    /// Returns the endpoint to dial at time `now`.
    pub fn endpoint(&mut self, now: u64) -> Option<String> {
        if self.until.as_ref().is_some_and(|(_, until)| now > *until) {
            self.until = None;
        }
        self.always.clone().or_else(|| self.until.as_ref().map(|(endpoint, _)| endpoint.clone()))
    }
}
