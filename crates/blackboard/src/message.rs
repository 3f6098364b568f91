//! Messages to the owner of a property.
//! Many senders, one receiver, bounded, in the order of sending.
//!
//! A sender writes into a slot of its own and hands it over with one exchange of the list's head, so a sender that is
//! preempted half-way blocks no other thread; the receiver takes the whole list at once and reverses it.

mod tap;

use std::ops::DerefMut;
use std::sync::{Arc, PoisonError};

use serde::{Deserialize, Serialize};

use crate::Shape;
use crate::bytes;
use crate::sync::{AtomicU32, AtomicU64, GuardedCell, Mutex, Ordering, ReadGuard, order};

pub use tap::Tap;
pub(crate) use tap::TapCell;

/// States of a slot.
/// The receiver changes it from being sent to an answer, the sender back to being sent.
const FREE: u32 = 0;
const SENT: u32 = 1;
const DONE: u32 = 2;
const REFUSED: u32 = 3;
const STATE_MASK: u32 = 3;
/// The message is answered, but the receiver still looks at it.
const HELD_FLAG: u32 = 4;
const CODE_SHIFT: u32 = 3;

/// Refusal code of messages whose receiver went away without an answer.
pub const ABANDONED: u16 = u16::MAX;

/// A bounded queue of messages.
#[derive(Debug)]
pub struct Mailbox {
    shape: Shape,
    slots_per_sender: usize,
    slots: Box<[Slot]>,
    /// 1 + the index of the message sent last; 0 for none.
    head: AtomicU64,
    handles: Mutex<MailboxHandles>,
    tap: TapCell,
}

#[derive(Debug)]
struct MailboxHandles {
    senders: Vec<bool>,
    /// Names of the present or last sender of each place.
    names: Vec<String>,
    receiver: bool,
    /// Number of collected messages, left by the last receiver.
    sequence: u64,
}

#[derive(Debug)]
struct Slot {
    /// `code << CODE_SHIFT | held | state`.
    status: AtomicU32,
    /// 1 + the index of the message sent before; 0 for none.
    previous: AtomicU64,
    content: GuardedCell<Content>,
}

#[derive(Debug)]
struct Content {
    data: Box<[u128]>,
    items: usize,
    time: u64,
}

/// Waiting message in a snapshot.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct WaitingMessage {
    /// Index of the sender.
    pub sender: u32,
    /// The message.
    #[serde(with = "bytes")]
    pub bytes: Vec<u8>,
    /// Number of items in the tail.
    pub items: usize,
    /// The host's time of sending, nanoseconds.
    pub time: u64,
}

/// Error: all handles of senders, or of receivers, are taken.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error("all {limit} handles of the mailbox are taken")]
pub struct HandlesSpent {
    /// Maximum number of handles.
    pub limit: usize,
}

/// Error: all slots of the sender hold messages without an answer.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error("the receiver has not answered the last {0} messages of this sender")]
pub struct Full(pub usize);

/// Identifies a message to its sender.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Ticket {
    slot: usize,
    number: u64,
}

/// State of a message.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Status {
    /// The message waits for its answer.
    Accepted,
    /// The receiver has dealt with it.
    Done,
    /// The receiver refused it, for a reason that the interface defines.
    Refused(u16),
    /// The message is too old: its slot holds another one.
    Unknown,
}

/// Answer of a receiver.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Answer {
    /// Dealt with.
    Done,
    /// Refused, for a reason that the interface defines.
    Refused(u16),
}

impl Mailbox {
    /// Creates a mailbox for `senders`, each with `slots_per_sender` waiting messages.
    pub fn new(shape: Shape, senders: u16, slots_per_sender: u16) -> Arc<Self> {
        let slots_per_sender = usize::from(slots_per_sender.max(1));
        let words = shape.bytes(shape.capacity).div_ceil(16).max(1);
        let slot = || Slot {
            status: AtomicU32::new(FREE),
            previous: AtomicU64::new(0),
            content: GuardedCell::new(Content { data: vec![0; words].into_boxed_slice(), items: 0, time: 0 }),
        };
        let count = usize::from(senders);
        let (senders, names) = (vec![false; count], vec![String::new(); count]);
        let handles = MailboxHandles { senders, names, receiver: false, sequence: 0 };
        Arc::new(Self {
            shape,
            slots_per_sender,
            slots: (0..count * slots_per_sender).map(|_| slot()).collect(),
            head: AtomicU64::new(0),
            handles: Mutex::new(handles),
            tap: TapCell::default(),
        })
    }

    fn handles(&self) -> impl DerefMut<Target = MailboxHandles> {
        self.handles.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Returns the memory of a message.
    pub fn shape(&self) -> Shape {
        self.shape
    }

    /// Shows `tap` the messages that the receiver takes from now on.
    /// Only the first call has an effect.
    pub fn set_tap(&self, tap: Arc<dyn Tap>) {
        self.tap.set(tap);
    }

    /// Creates a sender.
    ///
    /// # Errors
    /// When all are taken.
    pub fn sender(self: &Arc<Self>) -> Result<Sender, HandlesSpent> {
        self.sender_of("")
    }

    /// Creates a sender of that name, at the place that it had before.
    /// As long as there are other places, no other name gets that one.
    ///
    /// # Errors
    /// When all are taken.
    pub fn sender_of(self: &Arc<Self>, name: &str) -> Result<Sender, HandlesSpent> {
        let mut handles = self.handles();
        let free = |is_meant: &dyn Fn(&str) -> bool| {
            let mut places = handles.senders.iter().zip(&handles.names);
            places.position(|(taken, own)| !taken && is_meant(own))
        };
        let index = free(&|own| own == name).or_else(|| free(&str::is_empty)).or_else(|| free(&|_| true));
        let index = index.ok_or(HandlesSpent { limit: handles.senders.len() })?;
        handles.senders[index] = true;
        handles.names[index] = name.to_owned();
        let numbers = vec![0; self.slots_per_sender];
        Ok(Sender { mailbox: Arc::clone(self), index, numbers, sent: 0, hint: 0 })
    }

    /// Returns the name of the present or last sender at that place.
    /// Empty for one without a name.
    pub fn sender_name(&self, sender: u32) -> String {
        self.handles().names.get(sender as usize).cloned().unwrap_or_default()
    }

    /// Returns the names of the present senders.
    /// Empty for one without a name.
    pub fn sender_names(&self) -> Vec<String> {
        let handles = self.handles();
        let taken = handles.senders.iter().zip(&handles.names).filter(|(taken, _)| **taken);
        taken.map(|(_, name)| name.clone()).collect()
    }

    /// Creates the receiver; messages sent before it came wait for it.
    ///
    /// # Errors
    /// When there is one.
    pub fn receiver(self: &Arc<Self>) -> Result<Receiver, HandlesSpent> {
        let mut handles = self.handles();
        if std::mem::replace(&mut handles.receiver, true) {
            return Err(HandlesSpent { limit: 1 });
        }
        let order = Vec::with_capacity(self.slots.len());
        Ok(Receiver { mailbox: Arc::clone(self), order, sequence: handles.sequence })
    }
}

// SAFETY: a slot's content is written by its sender before it is sent and read by the receiver until it is answered.
unsafe impl Send for Mailbox {}
// SAFETY: as above.
unsafe impl Sync for Mailbox {}

/// One of the senders of a mailbox.
#[derive(Debug)]
pub struct Sender {
    mailbox: Arc<Mailbox>,
    index: usize,
    /// Number of the message in each slot.
    numbers: Vec<u64>,
    sent: u64,
    hint: usize,
}

impl Sender {
    /// Returns the index of the sender.
    pub fn id(&self) -> u32 {
        self.index as u32
    }

    /// Returns true if it sends to that mailbox.
    pub fn is_of(&self, mailbox: &Arc<Mailbox>) -> bool {
        Arc::ptr_eq(&self.mailbox, mailbox)
    }

    /// Sends a message at the host's `time` in nanoseconds.
    /// It has `bytes` with `items` tail items; excess bytes are cut, and missing ones are zero.
    ///
    /// # Errors
    /// When all slots of this sender wait for their answers.
    pub fn send(&mut self, bytes: &[u8], items: usize, time: u64) -> Result<Ticket, Full> {
        let count = self.numbers.len();
        let first = self.index * count;
        let free = (0..count).map(|i| (self.hint + i) % count).find(|i| {
            let status = self.mailbox.slots[first + i].status.load(order::ACQUIRE);
            status & STATE_MASK != SENT && status & HELD_FLAG == 0 || cfg!(feature = "mutant-mailbox")
        });
        let own = free.ok_or(Full(count))?;
        self.hint = own + 1;
        self.sent += 1;
        self.numbers[own] = self.sent;
        let index = first + own;
        let slot = &self.mailbox.slots[index];
        let shape = self.mailbox.shape;
        let items = items.min(shape.capacity);
        let size = shape.bytes(items);
        let length = bytes.len().min(size);
        slot.content.write(|content| {
            // SAFETY: the slot is not sent, so it is not shared, and it has room for that many items.
            unsafe {
                let data: *mut u8 = (*content).data.as_mut_ptr().cast();
                data.copy_from_nonoverlapping(bytes.as_ptr(), length);
                data.add(length).write_bytes(0, size - length);
                (*content).items = items;
                (*content).time = time;
            }
        });
        slot.status.store(SENT, Ordering::Relaxed);
        // The receiver has mostly taken all.
        let mut head = 0;
        loop {
            slot.previous.store(head, Ordering::Relaxed);
            let sent = self.mailbox.head.compare_exchange_weak(
                head,
                index as u64 + 1,
                order::RELEASE,
                Ordering::Relaxed,
            );
            match sent {
                Ok(_) => return Ok(Ticket { slot: own, number: self.sent }),
                Err(other) => head = other,
            }
        }
    }

    /// Returns the state of a message.
    pub fn status(&self, ticket: Ticket) -> Status {
        if self.numbers.get(ticket.slot) != Some(&ticket.number) {
            return Status::Unknown;
        }
        let status =
            self.mailbox.slots[self.index * self.numbers.len() + ticket.slot].status.load(order::ACQUIRE);
        match status & STATE_MASK {
            DONE => Status::Done,
            REFUSED => Status::Refused((status >> CODE_SHIFT) as u16),
            _ => Status::Accepted,
        }
    }
}

impl Drop for Sender {
    fn drop(&mut self) {
        self.mailbox.handles().senders[self.index] = false;
    }
}

/// The receiver of a mailbox.
#[derive(Debug)]
pub struct Receiver {
    mailbox: Arc<Mailbox>,
    /// The slots of the messages collected last.
    order: Vec<usize>,
    sequence: u64,
}

impl Receiver {
    /// Returns the maximum number of waiting messages.
    pub fn capacity(&self) -> usize {
        self.mailbox.slots.len()
    }

    /// Returns true if a message waits.
    #[inline]
    pub fn has_messages(&self) -> bool {
        self.mailbox.head.load(Ordering::Relaxed) != 0
    }

    /// Copies the messages that wait, oldest first, and leaves them there.
    pub fn waiting(&self) -> Vec<WaitingMessage> {
        let mut waiting = Vec::new();
        let mut next = self.mailbox.head.load(order::ACQUIRE);
        while next != 0 {
            let index = (next - 1) as usize;
            let slot = &self.mailbox.slots[index];
            let message = Message {
                slot: index,
                mailbox: &self.mailbox,
                sequence: 0,
                // Only the receiver takes it, so it does not change.
                content: slot.content.read(),
            };
            waiting.push(WaitingMessage {
                sender: message.sender(),
                bytes: message.bytes().to_vec(),
                items: message.items(),
                time: message.time(),
            });
            next = slot.previous.load(Ordering::Relaxed);
        }
        waiting.reverse();
        waiting
    }

    /// Returns the number of collected messages.
    pub fn sequence(&self) -> u64 {
        self.sequence
    }

    /// Continues as a receiver that has collected `sequence` messages.
    /// Waiting messages are returned to their senders as [`ABANDONED`].
    pub fn resume(&mut self, sequence: u64) {
        self.collect();
        self.give_back(u32::from(ABANDONED) << CODE_SHIFT | REFUSED);
        self.sequence = sequence;
    }

    /// Shows the messages collected last to the mailbox's tap.
    /// They are processed from the host's time `now` on, nanoseconds.
    pub fn show(&self, now: u64) {
        if let Some(tap) = self.mailbox.tap.get() {
            self.messages().for_each(|message| tap.took(&message, now));
        }
    }

    /// Releases the last messages, and takes all sent since; returns their number.
    pub fn collect(&mut self) -> usize {
        self.release();
        if !self.has_messages() {
            return 0;
        }
        let mut next = self.mailbox.head.swap(0, order::ACQUIRE);
        while next != 0 {
            let index = (next - 1) as usize;
            self.order.push(index);
            next = self.mailbox.slots[index].previous.load(Ordering::Relaxed);
        }
        self.order.reverse();
        self.sequence += self.order.len() as u64;
        self.order.len()
    }

    /// Returns the messages collected last to their senders.
    /// Those without an answer count as done.
    pub fn release(&mut self) {
        self.give_back(DONE);
    }

    fn give_back(&mut self, unanswered: u32) {
        for index in self.order.drain(..) {
            let status = &self.mailbox.slots[index].status;
            // Only the receiver changes it from being sent until it is given back.
            let answer = status.load(Ordering::Relaxed) & !HELD_FLAG;
            status.store(if answer == SENT { unanswered } else { answer }, order::RELEASE);
        }
    }

    /// Returns the messages collected, oldest first.
    pub fn messages(&self) -> impl ExactSizeIterator<Item = Message<'_>> {
        let first = self.sequence + 1 - self.order.len() as u64;
        self.order.iter().enumerate().map(move |(i, index)| Message {
            slot: *index,
            mailbox: &self.mailbox,
            sequence: first + i as u64,
            content: self.mailbox.slots[*index].content.read(),
        })
    }

    /// Answers one of the collected messages; its sender sees the answer at once.
    /// Without an answer, a message counts as done when it is released.
    pub fn answer(&mut self, message: usize, answer: Answer) {
        let Some(index) = self.order.get(message) else { return };
        let status = match answer {
            Answer::Done => DONE,
            Answer::Refused(code) => u32::from(code) << CODE_SHIFT | REFUSED,
        };
        self.mailbox.slots[*index].status.store(status | HELD_FLAG, order::RELEASE);
    }
}

impl Drop for Receiver {
    fn drop(&mut self) {
        self.give_back(u32::from(ABANDONED) << CODE_SHIFT | REFUSED);
        let mut handles = self.mailbox.handles();
        handles.receiver = false;
        handles.sequence = self.sequence;
    }
}

/// A message that was received.
#[derive(Debug)]
pub struct Message<'a> {
    slot: usize,
    mailbox: &'a Mailbox,
    sequence: u64,
    content: ReadGuard<Content>,
}

impl<'a> Message<'a> {
    fn content(&self) -> &Content {
        // SAFETY: it was sent and not answered, so its sender leaves it alone.
        unsafe { self.content.get() }
    }

    /// Returns the bytes of the message.
    pub fn bytes(&self) -> &'a [u8] {
        let content = self.content();
        // SAFETY: as above; the memory has room for every message of the shape.
        unsafe {
            std::slice::from_raw_parts(content.data.as_ptr().cast(), self.mailbox.shape.bytes(content.items))
        }
    }

    /// Returns the number of items in the tail.
    pub fn items(&self) -> usize {
        self.content().items
    }

    /// Returns the host's time of sending, nanoseconds.
    pub fn time(&self) -> u64 {
        self.content().time
    }

    /// Returns the index of the sender.
    pub fn sender(&self) -> u32 {
        (self.slot / self.mailbox.slots_per_sender) as u32
    }

    /// Counts the messages of the mailbox from 1.
    pub fn sequence(&self) -> u64 {
        self.sequence
    }
}
