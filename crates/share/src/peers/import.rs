//! Imports: mirrors of another agent's properties on this agent's board.

use std::sync::Arc;

use slate_blackboard::channel::{Budget, Writer};
use slate_blackboard::interface::{Descriptor, Kind, Primitive, difference};
use slate_blackboard::{Access, Board, Property, Store};

use super::WantedProperty;
use crate::carrier::SharedMemory;
use crate::encoding::decode;
use crate::schema::interface;
use crate::session::{Encoding, Estimate, Offer, Sample};

/// Subscription of this agent.
#[derive(Debug)]
pub(super) struct Import {
    pub want: WantedProperty,
    /// Path of the mirror.
    pub mirror_path: String,
    pub mirror: Option<Mirror>,
    pub status: Status,
    /// Received values that did not fit.
    pub unfit: u64,
}

/// Status of a subscription of this agent.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Status {
    /// No connection, or no answer yet.
    Unanswered,
    /// The other agent has no such property yet; with the reason.
    Waiting(String),
    /// Active subscription.
    Served,
    /// Refused subscription, with the reason.
    Refused(String),
}

/// Largest depth of mirrors that lend values instead of copying them.
/// A deeper one would occupy as many slots of the other agent for long.
const MAX_LENDING_DEPTH: usize = 4;

/// Mirror: a property of the board that follows the other agent's.
#[derive(Debug)]
pub(super) struct Mirror {
    property: Arc<Property>,
    /// Writer of the mirror.
    /// `None` while the other agent, or the property's writer there, is gone.
    writer: Option<Writer>,
    /// Use of values in the other agent's memory, without a copy.
    adopts: bool,
    /// Generation of the values at their origin.
    generation: u64,
    /// Generation of the last writer that left.
    left_generation: u64,
    /// Lost values since the last shown one.
    missed: u64,
    /// Time of the last value by this agent's clock, ns.
    time: u64,
}

impl Import {
    pub fn new(agent: &str, want: WantedProperty) -> Self {
        let mirror_path = format!("agents/{agent}/{}", want.path);
        Self { want, mirror_path, mirror: None, status: Status::Unanswered, unfit: 0 }
    }

    /// Creates the mirror before the other agent is present, if its interface is known.
    pub fn prepare(&mut self, board: &Board) -> Result<(), String> {
        match self.want.expected {
            Some(descriptor) if self.mirror.is_none() => {
                let (capacity, depth) = (self.want.capacity, self.want.depth);
                self.make(board, "A property of another agent.", descriptor, capacity, depth)
            }
            _ => Ok(()),
        }
    }

    fn make(
        &mut self,
        board: &Board,
        doc: &str,
        descriptor: &'static Descriptor,
        capacity: usize,
        depth: usize,
    ) -> Result<(), String> {
        let depth = depth.clamp(1, 4096);
        let window = u16::try_from(depth / 2).unwrap_or(u16::MAX).max(64);
        let store = Store { capacity, depth, budget: Budget { latest: 16, queues: 8, window } };
        let property = board
            .add_channel(&self.mirror_path, doc, descriptor, store, Access::Output)
            .map_err(|error| error.to_string())?;
        let adopts = depth <= MAX_LENDING_DEPTH && is_numbers(descriptor);
        self.mirror = Some(Mirror {
            property,
            writer: None,
            adopts,
            generation: 0,
            left_generation: 0,
            missed: 0,
            time: 0,
        });
        Ok(())
    }

    /// Accepts an offer; checks that the property is the expected one.
    pub fn accept(&mut self, board: &Board, offer: &Offer, largest: usize) -> Result<(), String> {
        let descriptor = interface(&offer.interface).map_err(|refusal| refusal.to_string())?;
        let expected = self.mirror.as_ref().map(|mirror| mirror.property.descriptor());
        if let Some(expected) = expected.or(self.want.expected)
            && let Some(difference) = difference(expected, descriptor, ("here", "there"))
        {
            return Err(format!("/{} differs from the expected interface: {difference}", self.want.path));
        }
        let capacity = usize::try_from(offer.capacity).unwrap_or(usize::MAX);
        let room = self.mirror.as_ref().and_then(|mirror| Some(mirror.property.channel()?.shape().capacity));
        if let Some(room) = room.filter(|room| *room < capacity && self.want.expected.is_none()) {
            // The reader subscribes again with more capacity.
            return Err(format!("/{} has room for {capacity} items now, and not for {room}", self.want.path));
        }
        if self.mirror.is_none() {
            let bytes = descriptor.shape(capacity).bytes(capacity);
            if bytes > largest {
                return Err(format!(
                    "/{} may take {bytes} bytes, more than the {largest} of a shared value",
                    self.want.path
                ));
            }
            let depth = self.want.depth.max(offer.depth as usize);
            // As many as fit into what a few of the largest would take.
            let depth = depth.min((4 * largest / bytes.max(1)).max(1));
            self.make(board, &offer.doc, descriptor, capacity, depth)?;
        }
        if let Some(mirror) = &mut self.mirror {
            mirror.property.set_part(&offer.part);
            // Whether there is a writer at the origin shows even if it has written nothing new.
            mirror.left_generation = 0;
            mirror.time = 0;
            mirror.take_writer();
        }
        self.status = Status::Served;
        Ok(())
    }

    /// Marks the origin as unreachable.
    pub fn mark_unreachable(&mut self) {
        self.remove_writer(0);
    }

    /// Notes that the property's writer of that generation has left.
    pub fn remove_writer(&mut self, generation: u64) {
        if let Some(mirror) = &mut self.mirror {
            mirror.writer = None;
            mirror.left_generation = generation;
        }
    }

    /// Writes a value to the mirror; returns whether it fits.
    /// `skipped` values before it were lost.
    pub fn show(
        &mut self,
        sample: &Sample,
        skipped: u64,
        content: &[u8],
        memory: Option<&dyn SharedMemory>,
        clock: (Option<Estimate>, i64),
    ) -> bool {
        let length = sample.length as usize;
        if let Some(mirror) = &mut self.mirror {
            mirror.missed = mirror.missed.saturating_add(skipped);
        }
        let fits = self.mirror.as_mut().is_some_and(|mirror| match sample.encoding {
            Encoding::Placed => memory.is_some_and(|memory| mirror.place(sample, content, memory, clock)),
            encoding => decode(mirror.property.descriptor(), encoding, content, length)
                .is_some_and(|bytes| mirror.write(sample, &bytes, clock)),
        });
        if !fits {
            self.unfit += 1;
            if let Some(mirror) = &mut self.mirror {
                mirror.missed = mirror.missed.saturating_add(1);
            }
        }
        fits
    }
}

impl Mirror {
    fn take_writer(&mut self) {
        if self.writer.is_none() {
            self.writer = self.property.channel().and_then(|channel| channel.writer().ok());
        }
    }

    /// Publishes a value of shared memory, in place or as a copy.
    fn place(
        &mut self,
        sample: &Sample,
        reference: &[u8],
        memory: &dyn SharedMemory,
        clock: (Option<Estimate>, i64),
    ) -> bool {
        let length = sample.length as usize;
        if self.adopts
            && let Some(lent) = memory.lend(reference, length)
        {
            let adopt = |writer: &mut Writer, items, time| writer.adopt(lent, items, time).is_ok();
            return self.publish(sample, length, clock, adopt);
        }
        let mut fits = false;
        let mut take = |bytes: &[u8]| fits = self.write(sample, bytes, clock);
        memory.read(reference, length, &mut take) && fits
    }

    fn write(&mut self, sample: &Sample, bytes: &[u8], clock: (Option<Estimate>, i64)) -> bool {
        let write = |writer: &mut Writer, items, time| {
            let written = writer.write(bytes, items, time).is_ok();
            // The other agent may have found no place because all are lent.
            writer.give_back();
            written
        };
        self.publish(sample, bytes.len(), clock, write)
    }

    /// Publishes a value of `length` bytes if it fits.
    fn publish(
        &mut self,
        sample: &Sample,
        length: usize,
        clock: (Option<Estimate>, i64),
        publish: impl FnOnce(&mut Writer, usize, u64) -> bool,
    ) -> bool {
        let descriptor = self.property.descriptor();
        let Some(channel) = self.property.channel() else { return false };
        let items = sample.items as usize;
        let item = descriptor.tail().map_or(0, Kind::size);
        let expected = item.checked_mul(items).and_then(|tail| tail.checked_add(descriptor.size));
        if items > channel.shape().capacity || expected != Some(length) {
            return false;
        }
        if self.generation != sample.stamp.generation {
            // Readers see that it is another writer.
            self.writer = None;
            self.generation = sample.stamp.generation;
        }
        self.take_writer();
        let Some(writer) = &mut self.writer else { return false };
        // As its own reader at the origin, a reader here sees that it has missed them.
        writer.skip(std::mem::take(&mut self.missed));
        let (estimate, clock_offset) = clock;
        // Nothing is subscribed to before there is an estimate.
        let time = estimate.map_or(sample.stamp.time, |clock| clock.here(sample.stamp.time));
        let time = time.saturating_add_signed(clock_offset);
        // A better estimate of the clocks must not turn back the time.
        self.time = self.time.max(time);
        let written = publish(writer, items, self.time);
        if sample.stamp.generation <= self.left_generation {
            // It is the last value of a writer that was told to be gone.
            self.writer = None;
        }
        written
    }
}

/// Returns whether the interface consists only of numbers.
/// Fields of an interface are valid for any bits. But readers of a text, a length or a flag rely on two reads being the
/// same, so the other agent must not be able to change it meanwhile, and it is copied.
fn is_numbers(descriptor: &Descriptor) -> bool {
    descriptor.fields.iter().all(|field| is_number(&field.kind))
}

fn is_number(kind: &Kind) -> bool {
    match kind {
        Kind::Primitive(Primitive::U8)
        | Kind::Primitive(Primitive::U16)
        | Kind::Primitive(Primitive::U32)
        | Kind::Primitive(Primitive::U64) => true,
        Kind::Primitive(Primitive::I8)
        | Kind::Primitive(Primitive::I16)
        | Kind::Primitive(Primitive::I32)
        | Kind::Primitive(Primitive::I64) => true,
        Kind::Primitive(Primitive::F32) | Kind::Primitive(Primitive::F64) => true,
        Kind::Array(item, _) | Kind::Tail(item) => is_number(item),
        Kind::Nested(descriptor) => is_numbers(descriptor),
        Kind::Primitive(Primitive::Bool)
        | Kind::Enumeration(_)
        | Kind::Text(_)
        | Kind::Optional(_)
        | Kind::Sequence(..) => false,
    }
}
