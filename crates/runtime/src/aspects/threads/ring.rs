//! Lock-free ring of bytes for values between a tick and a thread.
//! Neither side waits.

use rtrb::{Consumer, Producer, RingBuffer};

/// Size of the header of each value: schema and size, bytes.
const HEADER: usize = 12;

/// Makes a ring of a size in bytes.
pub(super) fn ring(bytes: usize) -> (RingInlet, RingOutlet) {
    let (producer, consumer) = RingBuffer::new(bytes);
    (RingInlet { producer, held: Vec::with_capacity(bytes), bytes }, RingOutlet { consumer, visible: 0 })
}

/// Sending end of the ring.
pub(super) struct RingInlet {
    producer: Producer<u8>,
    /// Values that are not sent yet.
    held: Vec<u8>,
    bytes: usize,
}

impl RingInlet {
    /// Holds a value to be sent; false if the ring is full.
    ///
    /// # Errors
    /// When the value is larger than the ring.
    pub fn add(&mut self, schema: u64, value: &[u8]) -> Result<bool, String> {
        let size = HEADER + value.len();
        if size > self.bytes {
            return Err(format!(
                "a value of {} bytes needs {size} in the ring, which has {}; begin the thread with more room",
                value.len(),
                self.bytes
            ));
        }
        if self.held.len() + size > self.producer.slots() {
            return Ok(false);
        }
        self.held.extend_from_slice(&schema.to_le_bytes());
        self.held.extend_from_slice(&(value.len() as u32).to_le_bytes());
        self.held.extend_from_slice(value);
        Ok(true)
    }

    /// Sends the held values; true if there were any.
    pub fn send(&mut self) -> bool {
        if self.held.is_empty() {
            return false;
        }
        // It had room when it was held, and no other thread fills it. The other side sees all of it or nothing.
        let sent = self.producer.push_entire_slice(&self.held).is_ok();
        self.held.clear();
        sent
    }

    /// Discards the held values.
    pub fn forget(&mut self) {
        self.held.clear();
    }
}

/// Receiving end of the ring.
pub(super) struct RingOutlet {
    consumer: Consumer<u8>,
    /// Bytes of the available values; always whole values.
    visible: usize,
}

impl RingOutlet {
    /// Makes all values sent until now available.
    pub fn collect(&mut self) {
        self.visible = self.consumer.slots();
    }

    /// Takes the next value; false without one.
    ///
    /// # Errors
    /// When the value has another type than expected; it is lost then.
    pub fn take(&mut self, schema: u64, value: &mut [u8]) -> Result<bool, String> {
        if self.visible == 0 {
            return Ok(false);
        }
        let (mut found, mut size) = ([0; 8], [0; 4]);
        // Values are sent as a whole, so what follows is there.
        let _ = self.consumer.pop_entire_slice(&mut found);
        let _ = self.consumer.pop_entire_slice(&mut size);
        let (found, size) = (u64::from_le_bytes(found), u32::from_le_bytes(size) as usize);
        self.visible -= HEADER + size;
        if found == schema && size == value.len() {
            let _ = self.consumer.pop_entire_slice(value);
            return Ok(true);
        }
        if let Ok(rest) = self.consumer.read_chunk(size) {
            rest.commit_all();
        }
        Err(format!("the next value is of another interface: {found:016x}, not {schema:016x}; it is dropped"))
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "a test that fails panics")]

    use std::collections::VecDeque;

    use proptest::prelude::*;

    use super::*;

    #[derive(Clone, Debug)]
    enum Step {
        Add(u64, Vec<u8>),
        Send,
        Forget,
        Look,
        Take(u64, usize),
    }

    fn step() -> impl Strategy<Value = Step> {
        prop_oneof![
            (0..3_u64, prop::collection::vec(any::<u8>(), 0..24)).prop_map(|(s, v)| Step::Add(s, v)),
            Just(Step::Send),
            Just(Step::Forget),
            Just(Step::Look),
            (0..3_u64, 0..24_usize).prop_map(|(schema, size)| Step::Take(schema, size)),
        ]
    }

    proptest! {
        #[test]
        fn does_as_a_queue_of_values(steps in prop::collection::vec(step(), 0..200), bytes in 0..100_usize) {
            let (mut inlet, mut outlet) = ring(bytes);
            let (mut held, mut sent) = (Vec::new(), VecDeque::new());
            let mut visible = 0;
            for step in steps {
                match step {
                    Step::Add(schema, value) => {
                        let size = |(_, value): &(u64, Vec<u8>)| value.len() + HEADER;
                        let used: usize = held.iter().chain(&sent).map(size).sum();
                        let added = inlet.add(schema, &value);
                        if value.len() + HEADER > bytes {
                            prop_assert!(added.is_err());
                        } else {
                            let room = used + value.len() + HEADER <= bytes;
                            prop_assert_eq!(added, Ok(room));
                            if room {
                                held.push((schema, value));
                            }
                        }
                    }
                    Step::Send => {
                        prop_assert_eq!(inlet.send(), !held.is_empty());
                        sent.extend(held.drain(..));
                    }
                    Step::Forget => {
                        inlet.forget();
                        held.clear();
                    }
                    Step::Look => {
                        outlet.collect();
                        visible = sent.len();
                    }
                    Step::Take(schema, size) => {
                        let mut value = vec![0; size];
                        let taken = outlet.take(schema, &mut value);
                        if visible == 0 {
                            prop_assert_eq!(taken, Ok(false));
                            continue;
                        }
                        visible -= 1;
                        let (is, expected) = sent.pop_front().unwrap();
                        if is == schema && expected.len() == size {
                            prop_assert_eq!(taken, Ok(true));
                            prop_assert_eq!(value, expected);
                        } else {
                            prop_assert!(taken.is_err());
                        }
                    }
                }
            }
        }
    }
}
