use crate::table::DONE;

/// It is not done yet.
pub const PENDING: i32 = 5;

/// What came of a request to the host.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum RequestAnswer {
    /// Not done yet.
    Pending,
    /// Done; the text says what happened.
    Done(String),
    /// Nothing was changed, for that reason.
    Refused(String),
    /// There was no such request: it was one of a tick that failed, of an earlier instance of the module, or one of so
    /// long ago that its answer was given up.
    Unknown,
}

impl RequestAnswer {
    /// From the code that a service returned, and the text with it.
    pub(super) fn from_code(code: i32, text: String) -> Self {
        match code {
            DONE => Self::Done(text),
            PENDING => Self::Pending,
            super::ABSENT => Self::Unknown,
            _ => Self::Refused(text),
        }
    }
}
