use super::Options;
use super::delivery::DeliveryStatus;
use super::wire::{Sample, Seen};

/// Description of a subscribed property.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Offer {
    /// Path of the property; the requested path may be another name of it.
    pub path: String,
    /// Interface in the encoding of [`slate_module::encode_interface`].
    pub interface: Vec<u8>,
    /// Documentation of the property.
    pub doc: String,
    /// Part of the architecture that writes it, such as `monitor`; empty for none.
    pub part: String,
    /// Capacity of the tail.
    pub capacity: u64,
    /// Number of kept values.
    pub depth: u32,
    /// Number of the value before the first one that follows.
    pub after: u64,
}

/// Event of a session.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Event {
    /// Connection of the other agent.
    Connected {
        /// Name of the other agent.
        agent: String,
        /// Number unique to each start of the agent.
        instance: u64,
    },
    /// Loss of the connection, with everything in transfer.
    Disconnected {
        /// Reason in words.
        reason: String,
    },
    /// Refusal between this agent and the other one.
    Refused {
        /// Reason in words.
        reason: String,
    },
    /// Acceptance of a subscription of this agent.
    Accepted {
        /// The subscription.
        id: u32,
        /// The offer.
        offer: Offer,
    },
    /// Delay of a subscription of this agent, which waits for the property.
    Waiting {
        /// The subscription.
        id: u32,
        /// Reason in words, with the nearest existing names.
        reason: String,
    },
    /// Refusal of a subscription of this agent.
    Declined {
        /// The subscription.
        id: u32,
        /// Reason in words.
        reason: String,
    },
    /// Loss of the subscribed property's writer.
    WriterLeft {
        /// The subscription.
        id: u32,
        /// Generation of that writer.
        generation: u64,
    },
    /// Subscription of the other agent, to be accepted, delayed or refused.
    Subscribed {
        /// The other agent's number of the subscription.
        id: u32,
        /// Path of a property.
        path: String,
        /// Delivery options.
        options: Options,
        /// Newest value that the subscriber already has.
        seen: Option<Seen>,
    },
    /// End of a subscription of the other agent, or its absence.
    Unsubscribed {
        /// The other agent's number of the subscription.
        id: u32,
    },
    /// Message of the other agent to a mailbox, to be answered.
    Message {
        /// The other agent's number of the message.
        ticket: u64,
        /// Path of the mailbox.
        path: String,
        /// Hash of the message's schema.
        schema: u64,
        /// Number of tail items.
        items: u64,
        /// The message.
        bytes: Vec<u8>,
    },
    /// Answer to a message of this agent.
    Answered {
        /// The message.
        ticket: u64,
        /// Delivery status.
        answer: DeliveryStatus,
    },
    /// Question of the other agent about properties, to be answered in parts.
    Asked {
        /// The other agent's number of the question.
        request: u32,
        /// Pattern of paths.
        pattern: String,
        /// Request for the newest values, too.
        values: bool,
    },
    /// Part of the answer to a question of this agent.
    Part {
        /// The question.
        request: u32,
        /// Content from the other agent.
        bytes: Vec<u8>,
        /// Mark of the last part.
        last: bool,
    },
    /// Message of the team's knowledge from the other agent.
    Knowledge {
        /// Message.
        bytes: Vec<u8>,
    },
    /// Question of this agent that gets no answer.
    Failed {
        /// The question.
        request: u32,
        /// Reason in words.
        reason: String,
    },
}

/// User of a session, which provides served values and takes received ones.
/// By default it does neither.
pub trait Application {
    /// Handles an event.
    fn event(&mut self, event: Event);

    /// Takes a new value of a subscription, newer than all before.
    /// `skipped` values before it were lost.
    fn sample(&mut self, id: u32, sample: &Sample, skipped: u64, content: &[u8]) {
        let _ = (id, sample, skipped, content);
    }

    /// Discards a value in shared memory, so its slot can be freed.
    /// The value is not shown.
    fn discard(&mut self, sample: &Sample, content: &[u8]) {
        let _ = (sample, content);
    }

    /// Returns whether a value for a subscription of the other agent is ready.
    fn has_update(&mut self, id: u32) -> bool {
        let _ = id;
        false
    }

    /// Appends the content of the next value for a subscription of the other agent.
    /// The session calls this when it can send. So the newest value is as recent as possible, and a slow connection
    /// loses only those values of a queue that the queue itself no longer keeps.
    fn take(&mut self, id: u32, content: &mut Vec<u8>) -> Option<Sample> {
        let _ = (id, content);
        None
    }
}
