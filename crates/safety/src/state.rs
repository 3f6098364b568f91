use slate_interfaces::RefusalReason;

use crate::Reason;

impl From<Reason> for RefusalReason {
    fn from(reason: Reason) -> Self {
        match reason {
            Reason::NotFinite => Self::NOT_FINITE,
            Reason::WrongSize => Self::WRONG_SIZE,
            Reason::Leased { .. } => Self::LEASED,
            Reason::Stopped => Self::STOPPED,
            Reason::Disarmed => Self::DISARMED,
        }
    }
}
