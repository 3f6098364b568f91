//! Where another agent is dialled.

/// Where another agent is dialled, and for how long.
#[derive(Debug, Default)]
pub(super) struct Dialling {
    /// Whenever it is not there; nothing while only it dials.
    pub always: Option<String>,
    /// Until then, for a question.
    until: Option<(String, u64)>,
}

impl Dialling {
    /// Dials until then.
    pub fn visit(&mut self, endpoint: &str, until: u64) {
        self.until = Some((endpoint.into(), until));
    }

    /// Where it is to be dialled now.
    pub fn endpoint(&mut self, now: u64) -> Option<String> {
        if self.until.as_ref().is_some_and(|(_, until)| now > *until) {
            self.until = None;
        }
        self.always.clone().or_else(|| self.until.as_ref().map(|(endpoint, _)| endpoint.clone()))
    }
}
