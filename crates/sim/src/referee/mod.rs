//! The judges of a mission: they see the truth, and no robot sees them.

mod conduct;
mod course;
mod pursuit;

pub use course::{Metrics, Referee, Stay};
pub use pursuit::{Pursuit, PursuitReferee};
use slate_interfaces::{MissionState, Verdict};
use slate_module::Text;

fn verdict(state: MissionState, reason: &str) -> Verdict {
    Verdict { state, reason: Text::new(reason) }
}
