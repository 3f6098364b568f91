use serde::{Deserialize, Serialize};
use slate_module::{Delivery, Interface, Outbox, Tick};

use super::Step;

/// Message to another robot, as a part of an action.
/// It is done when the other robot has taken it, and has failed when that refused it, is absent, or does not answer in
/// time.
///
/// The outbox is one of the body's ports; which robot it leads to is the configuration's matter, as is whether that is another
/// agent: `"slate://r2/planner/orders" = "execute/go"`.
///
/// ```
/// use serde::{Deserialize, Serialize};
/// use slate_interfaces::Point2;
/// use slate_mapek::{Acting, Action, ActionKind, Step, Transmission};
/// use slate_module::{Outbox, ports};
///
/// #[ports]
/// struct Body {
///     /// Where another robot is to go.
///     go: Outbox<Point2>,
/// }
///
/// /// Sends another robot somewhere.
/// #[derive(Clone, Debug, Serialize, Deserialize)]
/// struct SendThere {
///     place: [f64; 2],
///     transmission: Transmission,
/// }
///
/// impl ActionKind for SendThere {
///     const KIND: &'static str = "SendThere";
///     /// To the east and to the north, meters.
///     type Arguments = [f64; 2];
///
///     fn start(place: [f64; 2]) -> Self {
///         Self { place, transmission: Transmission::within(2.0) }
///     }
/// }
///
/// impl Action<Body> for SendThere {
///     fn act(&mut self, acting: &Acting<'_, Body>) -> Step {
///         let [x, y] = self.place;
///         self.transmission.send(&acting.body.go, Point2 { x, y }, acting.now)
///     }
/// }
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Transmission {
    /// Timeout of the answer, nanoseconds.
    #[serde(alias = "patience")]
    timeout: u64,
    /// Time of the first attempt.
    since: Option<u64>,
    /// The message, once it is sent.
    sent: Option<u64>,
}

impl Transmission {
    /// Creates a message with a timeout of `seconds`, for room and answer.
    pub fn within(seconds: f64) -> Self {
        // The cast cuts off what is below a nanosecond, and takes the nearest number for what is out of range.
        Self { timeout: (seconds * 1e9) as u64, since: None, sent: None }
    }

    /// Performs a step: sends the message once there is room, then polls its answer.
    pub fn send<T: Interface>(&mut self, outbox: &Outbox<T>, message: T, now: &Tick) -> Step {
        let since = *self.since.get_or_insert(now.now());
        let is_over = now.now().saturating_sub(since) > self.timeout;
        let delivery = match self.sent {
            Some(number) => outbox.delivery(number),
            None if is_over => Delivery::Lost,
            None => {
                // A full outbox has room in the next cycle.
                self.sent = outbox.send_tracked(message);
                return Step::Running;
            }
        };
        match delivery {
            Delivery::Done => Step::Done,
            Delivery::Waiting if !is_over => Step::Running,
            Delivery::Refused(_) | Delivery::Lost | Delivery::Waiting => Step::Failed,
        }
    }
}
