use crate::table::DONE;

/// Code of a request that is not done yet.
pub const PENDING: i32 = 5;

/// Answer of the host to a request.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum RequestAnswer {
    /// Pending request.
    Pending,
    /// Done; the text describes the result.
    Done(String),
    /// Refused for that reason; nothing was changed.
    Refused(String),
    /// Unknown request.
    /// It was one of a tick that failed, of an earlier instance of the module, or so long ago that its answer was
    /// dropped.
    Unknown,
}

impl RequestAnswer {
    /// Converts the code and the text of a service.
    pub(super) fn from_code(code: i32, text: String) -> Self {
        match code {
            DONE => Self::Done(text),
            PENDING => Self::Pending,
            super::ABSENT => Self::Unknown,
            _ => Self::Refused(text),
        }
    }
}
