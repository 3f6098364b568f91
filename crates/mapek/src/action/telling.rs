use serde::{Deserialize, Serialize};
use slate_module::{Delivery, Interface, Outbox, Tick};

use super::Step;

/// A message to another robot, as a part of an action: it is done when the other robot has taken it, and has failed when that
/// refused it, is not there, or does not answer in time.
///
/// The outbox is one of the body's ports; which robot it leads to is the configuration's matter, as is whether that is another
/// agent: `"execute/orders" = "slate://r2/planner/orders"`.
///
/// ```
/// use serde::{Deserialize, Serialize};
/// use slate_interfaces::Point2;
/// use slate_mapek::{Acting, Action, ActionKind, Step, Telling};
/// use slate_module::{Outbox, ports};
///
/// #[ports]
/// struct Body {
///     /// Where another robot is to go.
///     go: Outbox<Point2>,
/// }
///
/// /// Tells another robot to go somewhere.
/// #[derive(Clone, Debug, Serialize, Deserialize)]
/// struct SendThere {
///     place: [f64; 2],
///     telling: Telling,
/// }
///
/// impl ActionKind for SendThere {
///     const KIND: &'static str = "SendThere";
///     /// To the east and to the north, metres.
///     type Arguments = [f64; 2];
///
///     fn start(place: [f64; 2]) -> Self {
///         Self { place, telling: Telling::within(2.0) }
///     }
/// }
///
/// impl Action<Body> for SendThere {
///     fn act(&mut self, acting: &Acting<'_, Body>) -> Step {
///         let [x, y] = self.place;
///         self.telling.tell(&acting.body.go, Point2 { x, y }, acting.now)
///     }
/// }
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Telling {
    /// How long the answer is waited for, nanoseconds.
    patience: u64,
    /// The message and when it was sent, once it is.
    sent: Option<(u64, u64)>,
}

impl Telling {
    /// A message whose answer is waited for so many seconds.
    pub fn within(seconds: f64) -> Self {
        // A float converts to the nearest integer in range.
        Self { patience: (seconds * 1e9) as u64, sent: None }
    }

    /// One step: sends the message in the first one, and looks for its answer in the others.
    pub fn tell<T: Interface>(&mut self, outbox: &Outbox<T>, message: T, now: &Tick) -> Step {
        let Some((number, since)) = self.sent else {
            self.sent = outbox.post(message).map(|number| (number, now.now()));
            // A full outbox has room in the next cycle.
            return Step::Running;
        };
        match outbox.delivery(number) {
            Delivery::Done => Step::Done,
            Delivery::Refused(_) | Delivery::Lost => Step::Failed,
            Delivery::Waiting if now.now().saturating_sub(since) > self.patience => Step::Failed,
            Delivery::Waiting => Step::Running,
        }
    }
}
