//! How orders come to who plays, and how it stands comes back.

use std::sync::mpsc::{Receiver, RecvTimeoutError, Sender, channel};
use std::sync::{Mutex, PoisonError};
use std::time::Duration;

use slate_runtime::playback::{Order, PlaybackControl, PlaybackStatus};

/// What came of an order; what is wrong with it and what helps.
pub(super) type Answer = Result<PlaybackStatus, (String, String)>;

/// An order, and where its answer goes.
type Letter = (Order, Sender<Answer>);

/// How long an order may take: less than tools wait.
const PATIENCE: Duration = Duration::from_secs(50);

/// Where orders are given.
pub(super) struct Counter(Mutex<Sender<Letter>>);

/// Where they are taken.
pub(super) struct Orders(Receiver<Letter>);

pub(super) fn orders() -> (Counter, Orders) {
    let (sender, receiver) = channel();
    (Counter(Mutex::new(sender)), Orders(receiver))
}

impl Orders {
    /// The next order, if there is one within that time.
    pub fn next(&self, within: Duration) -> Option<Letter> {
        match self.0.recv_timeout(within) {
            Ok(letter) => Some(letter),
            Err(RecvTimeoutError::Timeout) => None,
            Err(RecvTimeoutError::Disconnected) => {
                std::thread::sleep(within);
                None
            }
        }
    }
}

impl PlaybackControl for Counter {
    fn order(&self, order: Order) -> Answer {
        let lost = |message: &str| (message.to_owned(), "start it again: slate replay FILE".to_owned());
        let (sender, answer) = channel();
        let counter = self.0.lock().unwrap_or_else(PoisonError::into_inner).clone();
        counter.send((order, sender)).map_err(|_| lost("the playback has ended"))?;
        match answer.recv_timeout(PATIENCE) {
            Ok(answer) => answer,
            Err(RecvTimeoutError::Disconnected) => Err(lost("the playback has ended")),
            Err(RecvTimeoutError::Timeout) => Err((
                format!("the playback has not done it within {} s", PATIENCE.as_secs()),
                "see the log for the module that it waits for".into(),
            )),
        }
    }
}
