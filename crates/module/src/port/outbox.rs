//! Sent messages of a module, and their delivery.

use slate_blackboard::interface::Interface;

use super::Outbox;

/// Delivery state of a sent message.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Delivery {
    /// Waiting for an answer.
    Waiting,
    /// Done: accepted by its receiver.
    Done,
    /// Refused by its receiver, for a reason that the interface defines.
    Refused(u16),
    /// Lost: no answer will come.
    /// The outbox is not linked, the receiver is gone or does not keep up, or the message is too long ago.
    Lost,
}

impl Delivery {
    /// Returns the answer word of this state, in the outbox of a frame.
    pub fn code(self) -> u32 {
        match self {
            Self::Waiting => 0,
            Self::Done => 1,
            Self::Lost => 2,
            Self::Refused(reason) => 1 << 16 | u32::from(reason),
        }
    }

    /// Converts an answer word of an outbox.
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

    /// Acts as [`send`](Outbox::send), and returns the number of the message.
    /// The number is for [`delivery`](Outbox::delivery). `None` when no more fit in this tick.
    pub fn send_tracked(&self, value: T) -> Option<u64> {
        let number = self.slot().stamp.sequence + self.slot().count.get() as u64 + 1;
        self.send(value).then_some(number)
    }

    /// Returns the delivery state of a message posted in this tick or an earlier one.
    /// As many are remembered as fit into one tick.
    pub fn delivery(&self, number: u64) -> Delivery {
        let slot = self.slot();
        let sent = slot.stamp.sequence;
        if number > sent && number <= sent + slot.count.get() as u64 {
            return Delivery::Waiting;
        }
        if number == 0 || slot.entries.is_null() || slot.capacity == 0 {
            return Delivery::Lost;
        }
        let index = (number - 1) as usize % slot.capacity;
        // SAFETY: the host lends `capacity` entries to this tick.
        let entry = unsafe { &*slot.entries.add(index) };
        if entry.stamp.sequence == number { Delivery::from_code(entry.answer.get()) } else { Delivery::Lost }
    }
}
