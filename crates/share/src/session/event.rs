use super::Options;
use super::delivery::DeliveryStatus;
use super::wire::{Sample, Seen};

/// What a property that was subscribed to is.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Offer {
    /// Path of the property. What was asked for may be another name of it.
    pub path: String,
    /// Its interface, as [`slate_module::encode_interface`] writes it.
    pub interface: Vec<u8>,
    /// What it is for.
    pub doc: String,
    /// Part of the architecture that writes it, such as `monitor`; empty for none.
    pub part: String,
    /// Room in the tail.
    pub capacity: u64,
    /// How many values are kept.
    pub depth: u32,
    /// Values with greater numbers than this one follow.
    pub after: u64,
}

/// What happens in a session.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Event {
    /// The other agent is there.
    Connected {
        /// Its name.
        agent: String,
        /// Another one after each restart.
        instance: u64,
    },
    /// The other agent is gone; everything that was under way ended.
    Disconnected {
        /// In words.
        reason: String,
    },
    /// This agent was refused, or refuses the other one.
    Refused {
        /// In words.
        reason: String,
    },
    /// A subscription of this agent is served from now on.
    Accepted {
        /// The subscription.
        id: u32,
        /// What it brings.
        offer: Offer,
    },
    /// A subscription of this agent waits for the property.
    Waiting {
        /// The subscription.
        id: u32,
        /// In words, with the nearest names there are.
        reason: String,
    },
    /// A subscription of this agent is not served.
    Declined {
        /// The subscription.
        id: u32,
        /// In words.
        reason: String,
    },
    /// The property that is subscribed to has no writer any more.
    WriterLeft {
        /// The subscription.
        id: u32,
        /// Which writer that was.
        generation: u64,
    },
    /// The other agent subscribes: to be accepted, or to wait, or to be refused.
    Subscribed {
        /// The other agent's number of the subscription.
        id: u32,
        /// Path of a property.
        path: String,
        /// How it is to be served.
        options: Options,
        /// What it has seen already.
        seen: Option<Seen>,
    },
    /// The other agent ends a subscription, or is gone.
    Unsubscribed {
        /// The other agent's number of the subscription.
        id: u32,
    },
    /// The other agent sends a message to a mailbox: to be answered.
    Message {
        /// The other agent's number of the message.
        ticket: u64,
        /// Path of the mailbox.
        path: String,
        /// Hash of the message's schema.
        schema: u64,
        /// How many items its tail has.
        items: u64,
        /// The message.
        bytes: Vec<u8>,
    },
    /// A message of this agent was answered.
    Answered {
        /// The message.
        ticket: u64,
        /// How it fares.
        answer: DeliveryStatus,
    },
    /// The other agent asks what there is: to be answered in parts.
    Asked {
        /// The other agent's number of the question.
        request: u32,
        /// Which paths it means.
        pattern: String,
        /// Whether it wants the newest values, too.
        values: bool,
    },
    /// A part of the answer to a question of this agent.
    Part {
        /// The question.
        request: u32,
        /// What the other agent wrote.
        bytes: Vec<u8>,
        /// Whether no other part follows.
        last: bool,
    },
    /// The other agent tells something of the team's knowledge.
    Told {
        /// What it tells.
        bytes: Vec<u8>,
    },
    /// A question of this agent gets no answer.
    Failed {
        /// The question.
        request: u32,
        /// Why, in words.
        reason: String,
    },
}

/// Who uses a session: gives it the values that are served, and takes those that are read; none unless said.
pub trait Application {
    /// Something happened.
    fn event(&mut self, event: Event);

    /// A value came for a subscription: newer than all before, of which `skipped` did not come since the last one.
    fn sample(&mut self, id: u32, sample: &Sample, skipped: u64, content: &[u8]) {
        let _ = (id, sample, skipped, content);
    }

    /// A value came in memory that both agents see, and is not shown: its place can be given back.
    fn discard(&mut self, sample: &Sample, content: &[u8]) {
        let _ = (sample, content);
    }

    /// Whether there is a value for a subscription of the other agent that was not taken.
    fn has_news(&mut self, id: u32) -> bool {
        let _ = id;
        false
    }

    /// Appends the content of the next value for a subscription of the other agent. The session asks when it can be
    /// sent, so the newest value is as new as can be, and of a queue nothing is lost to a slow connection but what the
    /// queue itself no longer keeps.
    fn take(&mut self, id: u32, content: &mut Vec<u8>) -> Option<Sample> {
        let _ = (id, content);
        None
    }
}
