//! Frame of a tick for another process, in memory that both map.
//! Its addresses are that process's.

use std::cell::Cell;
use std::sync::Arc;

use slate_blackboard::Shape;
use slate_module::{Direction, Entry, Flags, Frame, PortDescription, PortSlot, Random};

use super::arena::{Arena, Block};

/// Lack of memory in the arena of a module.
#[derive(Clone, Copy, Debug)]
pub(super) struct OutOfMemory;

/// Arena, with its address in the other process.
#[derive(Debug)]
pub(super) struct MappedArena {
    pub arena: Arc<Arena>,
    pub address: usize,
}

/// Shared copy of a module's frame.
/// It is filled from the host's frame before a tick, and the results of the tick are checked and copied back: the host
/// follows no pointer that the other process could have changed.
#[derive(Debug)]
pub(super) struct Mirror {
    /// Arenas: first the one for writing, then those for reading.
    arenas: Vec<MappedArena>,
    frame: Block,
    slots: Block,
    random: Block,
    params: Block,
    ports: Vec<PortMirror>,
}

#[derive(Debug)]
struct PortMirror {
    direction: Direction,
    /// Shape of a value; its capacity does not count.
    shape: Shape,
    entries: GrowingBlock,
    /// Values that are not in shared memory, or messages.
    values: Vec<GrowingBlock>,
}

/// Memory that grows on demand, up to the size of the largest value so far.
#[derive(Debug, Default)]
struct GrowingBlock(Option<Block>);

impl GrowingBlock {
    fn ensure(&mut self, arena: &Arc<Arena>, bytes: usize) -> Result<*mut u8, OutOfMemory> {
        if self.0.as_ref().is_none_or(|block| block.size() < bytes) {
            // Too small blocks are freed first, so that their memory can be reused.
            self.0 = None;
            self.0 =
                Some(arena.block(bytes.checked_next_power_of_two().ok_or(OutOfMemory)?).ok_or(OutOfMemory)?);
        }
        Ok(self.0.as_ref().ok_or(OutOfMemory)?.as_ptr())
    }
}

impl Mirror {
    pub fn new(
        arenas: Vec<MappedArena>,
        ports: &[PortDescription],
        params_size: usize,
    ) -> Result<Self, OutOfMemory> {
        let own = &arenas.first().ok_or(OutOfMemory)?.arena;
        let block = |bytes: usize| own.block(bytes).ok_or(OutOfMemory);
        let port = |port: &PortDescription| PortMirror {
            direction: port.direction,
            shape: port.descriptor.shape(0),
            entries: GrowingBlock::default(),
            values: Vec::new(),
        };
        Ok(Self {
            frame: block(size_of::<Frame>())?,
            slots: block(size_of::<PortSlot>() * ports.len())?,
            random: block(size_of::<Random>())?,
            params: block(params_size)?,
            ports: ports.iter().map(port).collect(),
            arenas,
        })
    }

    /// Returns the address of the frame in the other process.
    pub fn frame_address(&self) -> usize {
        self.remote_address(self.frame.as_ptr()).unwrap_or_default()
    }

    /// Converts an address to that of the other process; `None` if not mapped.
    fn remote_address(&self, data: *const u8) -> Option<usize> {
        self.arenas.iter().find_map(|mapped| Some(mapped.address + mapped.arena.offset(data)?))
    }

    /// Converts an address in the own arena to that of the other process.
    fn remote_pointer<T>(&self, pointer: *mut T) -> *mut T {
        self.remote_address(pointer.cast()).unwrap_or_default() as *mut T
    }

    /// Fills the copy for a tick.
    ///
    /// # Safety
    /// The frame is ready for a tick of a module with these ports.
    pub unsafe fn fill(&mut self, frame: &Frame) -> Result<(), OutOfMemory> {
        let mut ports = std::mem::take(&mut self.ports);
        let slots = self.slots.as_ptr().cast::<PortSlot>();
        let filled = ports.iter_mut().enumerate().take(frame.port_count).try_for_each(|(i, port)| {
            // SAFETY: the caller says that there are so many slots; the block has room for all of them.
            unsafe { slots.add(i).write(self.slot(port, &*frame.ports.add(i))?) };
            Ok(())
        });
        self.ports = ports;
        filled?;
        let size = frame.params_size.min(self.params.size());
        // SAFETY: the frame is as the caller says; the blocks have room for what is written.
        unsafe {
            self.params.as_ptr().copy_from_nonoverlapping(frame.params, size);
            self.random.as_ptr().cast::<Random>().write((*frame.random).get());
            self.frame.as_ptr().cast::<Frame>().write(Frame {
                ports: self.remote_pointer(slots),
                port_count: frame.port_count,
                params: self.remote_pointer(self.params.as_ptr()),
                params_size: size,
                params_version: frame.params_version,
                now: frame.now,
                elapsed: frame.elapsed,
                number: frame.number,
                random: self.remote_pointer(self.random.as_ptr()).cast(),
                host: std::ptr::null(),
            });
        }
        Ok(())
    }

    /// # Safety
    /// As for [`fill`](Mirror::fill).
    unsafe fn slot(&self, port: &mut PortMirror, slot: &PortSlot) -> Result<PortSlot, OutOfMemory> {
        let mut copy = PortSlot {
            schema: slot.schema,
            data: std::ptr::null_mut(),
            items: slot.items.clone(),
            capacity: slot.capacity,
            stamp: slot.stamp,
            flags: slot.flags.clone(),
            direction: slot.direction,
            priority: slot.priority.clone(),
            entries: std::ptr::null(),
            count: slot.count.clone(),
            missed: slot.missed,
        };
        // SAFETY: the slot is as the caller says: a value for an input, room for an output, and so many entries.
        unsafe {
            match port.direction {
                Direction::Input => copy.data = self.lend(port, 0, slot.data, slot.items.get())?,
                Direction::Output | Direction::Debug | Direction::Command if !slot.data.is_null() => {
                    let capacity = port.shape.bytes(slot.capacity);
                    copy.data = self.write_address(port, 0, slot.data, capacity)?;
                }
                Direction::Output | Direction::Debug | Direction::Command => {}
                Direction::Queue | Direction::Inbox => {
                    copy.entries = self.entries(port, slot, slot.count.get(), true)?;
                }
                Direction::Outbox => copy.entries = self.entries(port, slot, slot.capacity, false)?,
                // The survey refuses services of isolated modules.
                Direction::Aspect | Direction::Provider => {}
            }
        }
        Ok(copy)
    }

    /// # Safety
    /// The slot has so many entries, with a value if they are `filled`.
    unsafe fn entries(
        &self,
        port: &mut PortMirror,
        slot: &PortSlot,
        count: usize,
        filled: bool,
    ) -> Result<*const Entry, OutOfMemory> {
        let own = &self.arenas.first().ok_or(OutOfMemory)?.arena;
        let entries = port.entries.ensure(own, size_of::<Entry>() * count.max(1))?.cast::<Entry>();
        for i in 0..count {
            // SAFETY: the slot is as the caller says; the room is for so many entries.
            unsafe {
                let entry = &*slot.entries.add(i);
                let items = entry.items.get();
                let data = if filled {
                    self.lend(port, i, entry.data, items)?
                } else {
                    self.write_address(port, i, entry.data, port.shape.bytes(0))?
                };
                entries.add(i).write(Entry {
                    data,
                    items: Cell::new(items),
                    stamp: entry.stamp,
                    answer: Cell::new(if filled { 0 } else { entry.answer.get() }),
                    sender: entry.sender,
                });
            }
        }
        Ok(self.remote_pointer(entries))
    }

    /// Returns the other process's address of a value: its own, or that of a copy.
    ///
    /// # Safety
    /// It is a value of the port's interface with so many items.
    unsafe fn lend(
        &self,
        port: &mut PortMirror,
        index: usize,
        data: *mut u8,
        items: usize,
    ) -> Result<*mut u8, OutOfMemory> {
        if let Some(address) = self.remote_address(data) {
            return Ok(address as *mut u8);
        }
        let bytes = port.shape.bytes(items);
        let copy = self.ensure_block(port, index, bytes)?;
        // SAFETY: the room has that many bytes, and so has the value.
        unsafe { copy.copy_from_nonoverlapping(data, bytes) };
        Ok(self.remote_pointer(copy))
    }

    /// Returns the address at which the other process writes the value for `data`.
    fn write_address(
        &self,
        port: &mut PortMirror,
        index: usize,
        data: *mut u8,
        bytes: usize,
    ) -> Result<*mut u8, OutOfMemory> {
        match self.arenas.first().and_then(|own| Some(own.address + own.arena.offset(data)?)) {
            Some(address) => Ok(address as *mut u8),
            None => Ok(self.remote_pointer(self.ensure_block(port, index, bytes)?)),
        }
    }

    fn ensure_block(
        &self,
        port: &mut PortMirror,
        index: usize,
        bytes: usize,
    ) -> Result<*mut u8, OutOfMemory> {
        if port.values.len() <= index {
            port.values.resize_with(index + 1, GrowingBlock::default);
        }
        port.values[index].ensure(&self.arenas.first().ok_or(OutOfMemory)?.arena, bytes)
    }

    /// Copies the results of a tick to the host's frame.
    ///
    /// # Safety
    /// The frame is the one that this was filled from.
    pub unsafe fn copy_results(&self, frame: &Frame) {
        let slots = self.slots.as_ptr().cast::<PortSlot>();
        for (i, port) in self.ports.iter().enumerate().take(frame.port_count) {
            // SAFETY: the frame is as the caller says. What the other process can write is read once and checked.
            unsafe {
                let (slot, remote) = (&*frame.ports.add(i), slots.add(i));
                let count = |cell: *const Cell<usize>| cell.cast::<usize>().read_volatile();
                match port.direction {
                    Direction::Input | Direction::Queue | Direction::Aspect | Direction::Provider => {}
                    Direction::Output | Direction::Debug | Direction::Command => {
                        let flags = (&raw const (*remote).flags).cast::<u32>().read_volatile();
                        let items = count(&raw const (*remote).items).min(slot.capacity);
                        slot.items.set(items);
                        slot.flags.set(flags & Flags::SET);
                        slot.priority.set((&raw const (*remote).priority).cast::<u32>().read_volatile());
                        if let Some(GrowingBlock(Some(block))) = port.values.first()
                            && flags & Flags::SET != 0
                            && !slot.data.is_null()
                            && self.arenas.first().is_none_or(|own| own.arena.offset(slot.data).is_none())
                        {
                            let bytes = port.shape.bytes(items).min(block.size());
                            slot.data.copy_from_nonoverlapping(block.as_ptr(), bytes);
                        }
                    }
                    Direction::Inbox => {
                        let GrowingBlock(Some(block)) = &port.entries else { continue };
                        let entries = block.as_ptr().cast::<Entry>();
                        for i in 0..slot.count.get() {
                            let answer = (&raw const (*entries.add(i)).answer).cast::<u32>();
                            (*slot.entries.add(i)).answer.set(answer.read_volatile());
                        }
                    }
                    Direction::Outbox => {
                        let sent = count(&raw const (*remote).count).min(slot.capacity);
                        slot.count.set(sent);
                        for (i, value) in port.values.iter().enumerate().take(sent) {
                            let GrowingBlock(Some(block)) = value else { continue };
                            let data = (*slot.entries.add(i)).data;
                            data.copy_from_nonoverlapping(block.as_ptr(), port.shape.bytes(0));
                        }
                    }
                }
            }
        }
        // SAFETY: as above; any bits are a stream's state.
        unsafe { (*frame.random).set(self.random.as_ptr().cast::<Random>().read_volatile()) };
    }
}

const _: () = assert!(
    align_of::<Frame>() <= super::spans::GRANULARITY && align_of::<Entry>() <= super::spans::GRANULARITY
);
