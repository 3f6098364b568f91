//! Queue of orders to the player, and of its answers.

use std::sync::mpsc::{Receiver, RecvTimeoutError, Sender, channel};
use std::sync::{Mutex, PoisonError};
use std::time::Duration;

use slate_blackboard::Stamp;
use slate_blackboard::channel::StampedValue;
use slate_runtime::playback::{Order, PlaybackControl, PlaybackStatus};
use slate_runtime::recording::{History, HistoryRequest, Left, TakeValue};

use super::playback_reader::SharedPlaybackReader;
use super::timeline::RecordedValue;
use super::track::PropertyTrack;
use slate_bag::Error;

/// Outcome of an order; an error has a message and a help.
pub(super) type OrderOutcome = Result<PlaybackStatus, (String, String)>;

/// Order, and the channel of its answer.
type PendingOrder = (Order, Sender<OrderOutcome>);

/// Timeout of an order; shorter than that of tools.
const ORDER_TIMEOUT: Duration = Duration::from_secs(50);

/// Sending end of the orders, with access to the recorded data.
pub(super) struct OrderSender {
    orders: Mutex<Sender<PendingOrder>>,
    playback: SharedPlaybackReader,
}

/// Receiving end of the orders.
pub(super) struct OrderReceiver(Receiver<PendingOrder>);

pub(super) fn orders(playback: &SharedPlaybackReader) -> (OrderSender, OrderReceiver) {
    let (sender, receiver) = channel();
    (OrderSender { orders: Mutex::new(sender), playback: playback.clone() }, OrderReceiver(receiver))
}

impl OrderReceiver {
    /// Returns the next order, if there is one within that time.
    pub fn next(&self, within: Duration) -> Option<PendingOrder> {
        match self.0.recv_timeout(within) {
            Ok(entry) => Some(entry),
            Err(RecvTimeoutError::Timeout) => None,
            Err(RecvTimeoutError::Disconnected) => {
                std::thread::sleep(within);
                None
            }
        }
    }
}

impl PlaybackControl for OrderSender {
    fn order(&self, order: Order) -> OrderOutcome {
        let lost = |message: &str| (message.to_owned(), "start it again: slate replay FILE".to_owned());
        let (sender, answer) = channel();
        let order_sender = self.orders.lock().unwrap_or_else(PoisonError::into_inner).clone();
        order_sender.send((order, sender)).map_err(|_| lost("the playback has ended"))?;
        match answer.recv_timeout(ORDER_TIMEOUT) {
            Ok(answer) => answer,
            Err(RecvTimeoutError::Disconnected) => Err(lost("the playback has ended")),
            Err(RecvTimeoutError::Timeout) => Err((
                format!("the playback has not done it within {} s", ORDER_TIMEOUT.as_secs()),
                "see the log for the module that it waits for".into(),
            )),
        }
    }

    fn history(
        &self,
        request: &HistoryRequest,
        take: &mut TakeValue<'_>,
    ) -> Result<History, (String, String)> {
        let is_meant = |track: &PropertyTrack| track.path == request.path;
        let unknown = || {
            let help =
                "GET /api/v1/properties lists the properties; those of the playback itself are not recorded";
            (format!("no value of /{} is recorded", request.path), help.to_owned())
        };
        let anew = |error: Error| (error.to_string(), "play the file anew".to_owned());
        let (track, descriptor, numbers, (from, to)) = {
            let mut playback = self.playback.get();
            let timeline = &mut playback.timeline;
            let track = timeline.tracks.iter().position(is_meant).ok_or_else(unknown)?;
            let first = timeline.number_from(track, request.from, request.sequence).map_err(anew)?;
            let numbers = first..timeline.number_after(track, Some(request.to)).max(first);
            (track, timeline.tracks[track].form.descriptor, numbers, timeline.span().unwrap_or_default())
        };
        let (mut left, count) = (None, request.most.min(numbers.len()));
        for (number, index) in request.places(numbers.len()).enumerate() {
            // Value by value, so that the playback continues meanwhile; those that it needs stay in memory.
            let mut playback = self.playback.get();
            let timeline = &mut playback.timeline;
            let index = timeline.index(track, numbers.start + index);
            let value = index.map(|index| timeline.value_alone(index)).transpose();
            let value = value.map_err(anew)?;
            drop(playback);
            let Some(RecordedValue { bytes, items, sequence, time }) = value else { continue };
            let stamp = Stamp { sequence, time, generation: 0 };
            if !take(descriptor, StampedValue { bytes, items, stamp }) {
                left = Some(Left { count: count - number, time, sequence });
                break;
            }
        }
        Ok(History { left, count: numbers.len(), from, to })
    }
}
