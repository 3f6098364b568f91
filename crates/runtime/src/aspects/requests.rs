//! Requests of a module that the host carries out later, and their answers.

use std::sync::mpsc::{Receiver, Sender, channel};

use slate_module::aspect::{ABSENT, PENDING};
use slate_module::table::{DONE, REFUSED, Sink};
use slate_sorted::SortedMap;

use super::calls::say;

/// Most requests of a module that are kept.
const KNOWN: usize = 64;

/// Answer to a request: the result in words, or the reason of a refusal.
pub(crate) type RequestAnswer = Result<String, String>;

/// Requests of one module, by number.
pub(super) struct RequestBook<R> {
    /// Requests of this tick.
    pending: Vec<(u64, R)>,
    /// Answers to earlier requests; `None` while a request is pending.
    known: SortedMap<u64, Option<RequestAnswer>>,
    last: u64,
    sender: Sender<(u64, RequestAnswer)>,
    answers: Receiver<(u64, RequestAnswer)>,
}

/// Destination of the answer to one request.
pub(super) struct AnswerSlot {
    number: u64,
    sender: Sender<(u64, RequestAnswer)>,
}

impl AnswerSlot {
    pub fn give(self, answer: RequestAnswer) {
        // The module may be gone.
        let _ = self.sender.send((self.number, answer));
    }
}

impl<R> RequestBook<R> {
    pub fn new() -> Self {
        let (sender, answers) = channel();
        Self { pending: Vec::new(), known: SortedMap::new(), last: 0, sender, answers }
    }

    /// Notes a request of this tick; returns its number.
    pub fn push(&mut self, request: R) -> u64 {
        self.last += 1;
        self.pending.push((self.last, request));
        self.last
    }

    /// Receives the answers since the last tick.
    pub fn receive(&mut self) {
        while let Ok((number, answer)) = self.answers.try_recv() {
            self.known.entry(number).and_modify(|known| *known = Some(answer));
        }
    }

    /// Sends the requests of the tick.
    pub fn commit(&mut self, mut send: impl FnMut(R, AnswerSlot)) {
        for (number, request) in self.pending.drain(..) {
            self.known.insert(number, None);
            if self.known.len() > KNOWN {
                self.known.pop_first();
            }
            send(request, AnswerSlot { number, sender: self.sender.clone() });
        }
    }

    /// Discards the requests of a failed tick.
    pub fn abandon(&mut self) {
        self.pending.clear();
    }

    /// Returns the answer to a request.
    ///
    /// # Safety
    /// The sink is as the module made it, and lives during the call.
    pub unsafe fn answer(&self, number: u64, sink: *const Sink) -> i32 {
        let (text, result) = match self.known.get(&number) {
            Some(Some(Ok(text))) => (text, DONE),
            Some(Some(Err(reason))) => (reason, REFUSED),
            Some(None) => return PENDING,
            None if self.pending.iter().any(|(pending, _)| *pending == number) => return PENDING,
            None => return ABSENT,
        };
        // SAFETY: passed on to the caller.
        unsafe { say(sink, text) };
        result
    }
}
