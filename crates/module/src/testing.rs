//! Ticks a module without an agent and without a thread.

mod services;
mod tick_result;

use std::cell::Cell;
use std::collections::BTreeMap;
use std::rc::Rc;

use slate_blackboard::Stamp;
use slate_blackboard::interface::{Interface, View};

use crate::instance::ModuleInstance;
use crate::{
    Delivery, Description, Direction, Entry, Flags, Frame, Host, Instance, Module, PortCursor, PortSlot,
    Random, Refusal, Setup, Tick,
};
use services::{Provided, Provision};
pub use tick_result::TickResult;

/// Test fixture of a module with its ports: set inputs, tick, read outputs.
pub struct Fixture<M: Module> {
    instance: ModuleInstance<M>,
    description: Description,
    memory: Vec<FixtureMemory>,
    params: M::Params,
    now: u64,
    last: u64,
    number: u64,
    random: Cell<Random>,
}

/// Memory of a port, aligned for every interface.
struct FixtureMemory {
    words: Vec<u128>,
    items: usize,
    sequence: u64,
    time: u64,
    new: bool,
    stale: bool,
    set: bool,
    priority: u32,
    messages: Vec<Vec<u128>>,
    /// Aspect: whether the test has provided it.
    is_provided: bool,
    /// Aspect: the service of another fixture that it uses.
    provided: Option<Rc<Provided>>,
    /// Provider: its provided service.
    provider: Option<Box<Provision>>,
    /// Outbox: how messages fared, by their numbers.
    deliveries: BTreeMap<u64, Delivery>,
}

impl<M: Module> Default for Fixture<M> {
    fn default() -> Self {
        Self::new()
    }
}

impl<M: Module> Fixture<M> {
    /// Returns a fresh instance with default parameters, seed 0, at time 0.
    ///
    /// # Panics
    /// When the module refuses its setup.
    pub fn new() -> Self {
        Self::with(M::Params::default()).unwrap_or_else(|refusal| refused(&refusal))
    }

    /// Returns a fresh instance with those parameters.
    ///
    /// # Errors
    /// The module's refusal.
    pub fn with(mut params: M::Params) -> Result<Self, Refusal> {
        let setup = Setup { name: M::NAME, seed: 0, period: 20_000_000, section: None, params: None };
        let description = ModuleInstance::<M>::describe(&setup)?;
        let memory = description
            .ports
            .iter()
            .map(|port| {
                let shape = port.descriptor.shape(port.capacity);
                FixtureMemory {
                    words: vec![0; shape.bytes(shape.capacity).div_ceil(16).max(1)],
                    items: 0,
                    sequence: 0,
                    time: 0,
                    new: false,
                    stale: false,
                    set: false,
                    priority: 0,
                    messages: Vec::new(),
                    is_provided: false,
                    provided: None,
                    provider: (port.direction == Direction::Provider).then(Provision::new),
                    deliveries: BTreeMap::new(),
                }
            })
            .collect();
        let random = Cell::new(Random::new(0, setup.name));
        let instance = ModuleInstance::<M>::create(&setup, View::of(&mut params).bytes())?;
        Ok(Self { instance, description, memory, params, now: 0, last: 0, number: 0, random })
    }

    fn index(&self, port: &str) -> usize {
        let names =
            || self.description.ports.iter().map(|port| port.name.as_str()).collect::<Vec<_>>().join(", ");
        let found = self.description.ports.iter().position(|description| description.name == port);
        found.unwrap_or_else(|| missing(port, &names()))
    }

    fn typed_index<T: Interface + ?Sized>(&self, port: &str) -> usize {
        let index = self.index(port);
        let expected = self.description.ports[index].descriptor;
        assert_eq!(
            T::DESCRIPTOR.hash,
            expected.hash,
            "port `{port}` carries {}, not {}",
            expected.name,
            T::DESCRIPTOR.name
        );
        index
    }

    /// Sets an input.
    ///
    /// # Panics
    /// When the module has no such port or it carries another interface.
    pub fn set<T: Interface + Copy>(&mut self, port: &str, value: T) {
        let index = self.typed_index::<T>(port);
        let now = self.now;
        let memory = &mut self.memory[index];
        // SAFETY: the memory was made for this interface.
        unsafe { memory.words.as_mut_ptr().cast::<T>().write(value) };
        memory.sequence += 1;
        memory.time = now;
        memory.new = true;
        memory.stale = false;
    }

    /// Sets an input whose value has a tail of `items` items.
    ///
    /// # Panics
    /// As [`set`](Fixture::set).
    pub fn write<T: Interface + ?Sized>(&mut self, port: &str, items: usize, write: impl FnOnce(&mut T)) {
        let index = self.typed_index::<T>(port);
        let now = self.now;
        let memory = &mut self.memory[index];
        let bytes = T::DESCRIPTOR.shape(items).bytes(items);
        memory.words.resize(bytes.div_ceil(16).max(1), 0);
        // SAFETY: the memory has room for that many items.
        write(unsafe { T::from_raw_mut(memory.words.as_mut_ptr().cast(), items) });
        memory.items = items;
        memory.sequence += 1;
        memory.time = now;
        memory.new = true;
        memory.stale = false;
    }

    /// Puts a message into an inbox, or a value into a queue.
    ///
    /// # Panics
    /// As [`set`](Fixture::set).
    pub fn push<T: Interface + Copy>(&mut self, port: &str, value: T) {
        let index = self.typed_index::<T>(port);
        let mut words = vec![0_u128; size_of::<T>().div_ceil(16).max(1)];
        // SAFETY: the memory was made for this interface.
        unsafe { words.as_mut_ptr().cast::<T>().write(value) };
        self.memory[index].messages.push(words);
    }

    /// Sets the delivery of a posted message.
    /// `number` counts the messages of the port from 1.
    ///
    /// # Panics
    /// When the module has no such port.
    pub fn deliver(&mut self, port: &str, number: u64, delivery: Delivery) {
        let index = self.index(port);
        self.memory[index].deliveries.insert(number, delivery);
    }

    /// Makes an input stale, as when its writer stopped.
    pub fn expire(&mut self, port: &str) {
        let index = self.index(port);
        self.memory[index].stale = true;
    }

    /// Changes the parameters.
    pub fn params(&mut self) -> &mut M::Params {
        &mut self.params
    }

    /// Saves the module's state.
    ///
    /// # Errors
    /// A state that can't be saved.
    pub fn save(&self) -> Result<Vec<u8>, Refusal> {
        self.instance.save()
    }

    /// Takes over a saved state.
    ///
    /// # Errors
    /// A state that doesn't fit.
    pub fn restore(&mut self, state: &[u8]) -> Result<(), Refusal> {
        self.instance.restore(state)
    }

    /// Advances the time, ns.
    pub fn advance(&mut self, nanoseconds: u64) {
        self.now += nanoseconds;
    }

    /// Makes one step, or returns the required input that has no value.
    /// An agent acts the same.
    ///
    /// # Panics
    /// When a service that the module needs was not [provided](Fixture::provide).
    pub fn tick(&mut self) -> TickResult {
        self.check_services();
        self.memory.iter_mut().for_each(|memory| memory.set = false);
        let ports = self.description.ports.iter().zip(&self.memory);
        let mut missing = ports.filter(|(port, memory)| port.required && memory.sequence == 0);
        if let Some((port, _)) = missing.next() {
            return TickResult::Waiting(port.name.clone());
        }
        self.number += 1;
        let mut entries: Vec<Vec<Entry>> = Vec::new();
        for (port, memory) in self.description.ports.iter().zip(&mut self.memory) {
            if port.direction == Direction::Outbox {
                let words = port.descriptor.size.div_ceil(16).max(1);
                memory.messages = vec![vec![0; words]; port.window];
            }
            let mut lent: Vec<Entry> =
                memory.messages.iter_mut().enumerate().map(|(i, words)| entry(words, i)).collect();
            if port.direction == Direction::Outbox {
                let (count, sent) = (lent.len() as u64, memory.sequence);
                for number in sent.saturating_sub(count) + 1..=sent {
                    let entry = &mut lent[((number - 1) % count) as usize];
                    entry.stamp.sequence = number;
                    let delivery = memory.deliveries.get(&number).copied();
                    entry.answer.set(delivery.unwrap_or(Delivery::Waiting).code());
                }
            }
            entries.push(lent);
        }
        let slots: Vec<PortSlot> = self
            .description
            .ports
            .iter()
            .zip(&mut self.memory)
            .zip(&entries)
            .map(|((port, memory), entries)| slot(port, memory, entries))
            .collect();
        let host = Host { context: std::ptr::null(), log: print };
        let frame = Frame {
            ports: slots.as_ptr(),
            port_count: slots.len(),
            params: std::ptr::from_ref(&self.params).cast(),
            params_size: size_of::<M::Params>(),
            params_version: 1,
            now: self.now,
            elapsed: if self.number == 1 { 0 } else { self.now - self.last },
            number: self.number,
            random: &raw const self.random,
            host: &raw const host,
        };
        // SAFETY: the frame, its slots and the parameters live during the call.
        let outcome = unsafe {
            let params = std::slice::from_raw_parts(frame.params, frame.params_size);
            self.instance.tick(&mut PortCursor::new(&frame), params, &Tick::new(&frame))
        };
        self.last = self.now;
        let results: Vec<_> = slots
            .iter()
            .map(|slot| (slot.items.get(), slot.flags.get(), slot.priority.get(), slot.count.get()))
            .collect();
        for ((port, memory), (items, flags, priority, count)) in
            self.description.ports.iter().zip(&mut self.memory).zip(results)
        {
            memory.new = false;
            memory.items = items;
            memory.priority = priority;
            memory.set = flags & Flags::SET != 0;
            match port.direction {
                Direction::Outbox => {
                    memory.messages.truncate(count);
                    memory.sequence += count as u64;
                }
                _ => memory.messages.clear(),
            }
        }
        TickResult::Ran(outcome)
    }

    /// Returns the value of an output in the last tick; `None` if not written.
    ///
    /// # Panics
    /// As [`set`](Fixture::set).
    pub fn output<T: Interface + Copy>(&self, port: &str) -> Option<T> {
        let memory = &self.memory[self.typed_index::<T>(port)];
        // SAFETY: the memory holds a value of this interface.
        memory.set.then(|| unsafe { memory.words.as_ptr().cast::<T>().read() })
    }

    /// Passes the value of an output in the last tick to `read`; `None` if not written.
    /// For an output whose value has a tail.
    ///
    /// # Panics
    /// As [`set`](Fixture::set).
    pub fn read<T: Interface + ?Sized, R>(&self, port: &str, read: impl FnOnce(&T) -> R) -> Option<R> {
        let memory = &self.memory[self.typed_index::<T>(port)];
        // SAFETY: the memory holds a value of this interface, with that many items.
        memory.set.then(|| read(unsafe { T::from_raw(memory.words.as_ptr().cast(), memory.items) }))
    }

    /// Returns true if the last tick wrote an output.
    ///
    /// # Panics
    /// When the module has no such port.
    pub fn wrote(&self, port: &str) -> bool {
        self.memory[self.index(port)].set
    }

    /// Returns the priority with which the last tick sent a command.
    pub fn priority(&self, port: &str) -> Option<u32> {
        let memory = &self.memory[self.index(port)];
        memory.set.then_some(memory.priority)
    }

    /// Returns the messages that the last tick sent.
    ///
    /// # Panics
    /// As [`set`](Fixture::set).
    pub fn sent<T: Interface + Copy>(&self, port: &str) -> Vec<T> {
        let memory = &self.memory[self.typed_index::<T>(port)];
        // SAFETY: each holds a value of this interface.
        memory.messages.iter().map(|words| unsafe { words.as_ptr().cast::<T>().read() }).collect()
    }
}

fn slot(port: &crate::PortDescription, memory: &mut FixtureMemory, entries: &[Entry]) -> PortSlot {
    // No value, no writer.
    let mut flags = if memory.sequence > 0 { Flags::ALIVE } else { 0 };
    if memory.new {
        flags |= Flags::NEW;
    }
    if memory.stale {
        flags |= Flags::STALE;
    }
    let data = memory.provider.as_deref_mut().map(Provision::table);
    let given = match port.direction {
        Direction::Input => flags,
        Direction::Provider if memory.provider.as_ref().is_some_and(|provider| provider.is_provided()) => {
            Flags::SET
        }
        _ => 0,
    };
    PortSlot {
        schema: port.descriptor.hash,
        direction: port.direction as u32,
        data: data.unwrap_or_else(|| memory.words.as_mut_ptr().cast()),
        items: Cell::new(memory.items),
        capacity: if port.direction == Direction::Outbox { entries.len() } else { port.capacity },
        stamp: Stamp { sequence: memory.sequence, time: memory.time, generation: 1 },
        flags: Cell::new(given),
        priority: Cell::new(0),
        entries: entries.as_ptr(),
        count: Cell::new(if port.direction == Direction::Outbox { 0 } else { entries.len() }),
        missed: 0,
    }
}

fn entry(words: &mut [u128], index: usize) -> Entry {
    Entry {
        data: words.as_mut_ptr().cast(),
        items: Cell::new(0),
        stamp: Stamp { sequence: index as u64 + 1, time: 0, generation: 1 },
        answer: Cell::new(0),
        sender: 0,
    }
}

unsafe extern "C" fn print(_: *const (), level: u32, text: *const u8, length: usize) {
    // SAFETY: a tick passes text that lives during the call.
    let text = unsafe { std::slice::from_raw_parts(text, length) };
    eprintln!("[{level}] {}", String::from_utf8_lossy(text));
}

#[allow(clippy::panic, reason = "a test's error ends the test")]
fn refused(refusal: &Refusal) -> ! {
    panic!("the module refuses its setup: {refusal}")
}

#[allow(clippy::panic, reason = "a test's error ends the test")]
fn missing(port: &str, names: &str) -> ! {
    panic!("no port `{port}`; there are {names}")
}
