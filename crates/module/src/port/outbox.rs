//! Messages that a module sends, and what becomes of them.

use slate_blackboard::interface::Interface;

use super::Outbox;

/// How a message fares that was sent.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Delivery {
    /// It was not answered yet.
    Waiting,
    /// Its receiver has taken it, and did not refuse it.
    Done,
    /// Its receiver refused it, for a reason that the interface defines.
    Refused(u16),
    /// Nobody will answer: the outbox is not linked, the receiver is gone or does not keep up, or the message is too long ago.
    Lost,
}

impl Delivery {
    /// The answer word of this entry, as the outbox of a frame has it.
    pub fn code(self) -> u32 {
        match self {
            Self::Waiting => 0,
            Self::Done => 1,
            Self::Lost => 2,
            Self::Refused(reason) => 1 << 16 | u32::from(reason),
        }
    }

    /// What such a code means.
    pub fn from_code(code: u32) -> Self {
        match code {
            0 => Self::Waiting,
            1 => Self::Done,
            code if code >> 16 == 1 => Self::Refused(code as u16),
            _ => Self::Lost,
        }
    }
}

impl<T: Interface> Outbox<T> {
    /// Sends a message when the tick ends; false when no more fit in this tick.
    pub fn send(&self, value: T) -> bool {
        let slot = self.slot();
        let count = slot.count.get();
        if count >= slot.capacity {
            return false;
        }
        // SAFETY: the host lends `capacity` entries to this tick alone, each with room for the interface.
        unsafe { (*slot.entries.add(count)).data.cast::<T>().write(value) };
        slot.count.set(count + 1);
        true
    }

    /// As [`send`](Outbox::send); the number that is returned tells [how the message fares](Outbox::delivery).
    pub fn post(&self, value: T) -> Option<u64> {
        let number = self.slot().stamp.sequence + self.slot().count.get() as u64 + 1;
        self.send(value).then_some(number)
    }

    /// How a message fares that was posted in this tick or an earlier one. As many are remembered as fit into one tick.
    pub fn delivery(&self, number: u64) -> Delivery {
        let slot = self.slot();
        let sent = slot.stamp.sequence;
        if number > sent && number <= sent + slot.count.get() as u64 {
            return Delivery::Waiting;
        }
        if number == 0 || slot.entries.is_null() || slot.capacity == 0 {
            return Delivery::Lost;
        }
        let place = (number - 1) as usize % slot.capacity;
        // SAFETY: the host lends `capacity` entries to this tick.
        let entry = unsafe { &*slot.entries.add(place) };
        if entry.stamp.sequence == number { Delivery::from_code(entry.answer.get()) } else { Delivery::Lost }
    }
}
