//! Values of the network as messages to inboxes.

use std::collections::VecDeque;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex};
use std::time::Duration;

use serde_json::Value as Json;
use slate_blackboard::wake::Wake;
use slate_control::{Caller, ControlSurface, Dispatcher};

use crate::refusal::QueryRefusal;
use crate::requests::caller;
use crate::shared::locked;

/// Messages that wait, at most; the oldest go first.
const MAX_MESSAGES: usize = 256;

/// Sleep time of the thread while no messages arrive.
const IDLE_PERIOD: Duration = Duration::from_millis(100);

/// Sender of messages to an inbox, in sequence, in a thread of its own.
/// Each message waits until the module has taken it.
pub struct InboxMessages {
    dispatcher: Dispatcher,
    caller: Caller,
    inbox: String,
    queue: Mutex<VecDeque<Json>>,
    wake: Wake,
    ended: AtomicBool,
}

impl InboxMessages {
    pub fn new(surface: &Arc<ControlSurface>, inbox: &str) -> Self {
        Self {
            dispatcher: Dispatcher::new(Arc::clone(surface), 1, false),
            caller: caller(),
            inbox: inbox.into(),
            queue: Mutex::default(),
            wake: Wake::new(),
            ended: AtomicBool::new(false),
        }
    }

    /// Puts a message behind the others; false when the oldest one went for it.
    pub fn push(&self, message: Json) -> bool {
        let mut queue = locked(&self.queue);
        let is_full = queue.len() >= MAX_MESSAGES;
        if is_full {
            queue.pop_front();
        }
        queue.push_back(message);
        drop(queue);
        self.wake.notify(1);
        !is_full
    }

    /// Sends messages until the end, and reports the outcome of each.
    pub fn run(&self, report: impl Fn(Result<(), String>)) {
        while !self.ended.load(Ordering::Acquire) {
            let next = locked(&self.queue).pop_front();
            let Some(message) = next else {
                self.wake.wait_timeout(IDLE_PERIOD);
                continue;
            };
            let sent = self.dispatcher.carry_out(&self.caller, "send", &[("path", &self.inbox)], message);
            report(sent.map(drop).map_err(|problem| QueryRefusal::from(problem).into_reason()));
        }
    }

    pub fn end(&self) {
        self.ended.store(true, Ordering::Release);
        self.wake.notify(1);
    }
}
