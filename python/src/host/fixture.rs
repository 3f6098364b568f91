//! Test fixture of a module in Python, without an agent and without a process.

use std::cell::{Cell, RefCell};
use std::sync::Arc;

use pyo3::exceptions::{PyKeyError, PyValueError};
use pyo3::prelude::*;
use pyo3::types::{PyBytes, PyDict, PyTuple};
use slate_module::blackboard::interface::{Descriptor, Kind, Value as Untyped, edit};
use slate_module::{
    Description, Direction, Entry, Flags, Frame, Host, ModuleKind, PortDescription, PortSlot, Random, Setup,
    Stamp,
};

use super::kind::{Instance, kind};
use super::memory::{Block, Epoch};
use super::plain;
use super::ports::named;
use super::value::{Place, fill};
use super::wrong;

/// Test fixture: set inputs, tick, read outputs.
#[pyclass(unsendable, module = "slate._slate")]
pub struct Fixture {
    instance: Instance,
    description: Description,
    ports: Vec<PortMemory>,
    params: Vec<u8>,
    params_version: u64,
    now: u64,
    last: u64,
    number: u64,
    random: Cell<Random>,
    log: RefCell<Vec<(u32, String)>>,
}

/// Memory of a port.
struct PortMemory {
    block: Arc<Block>,
    items: usize,
    stamp: Stamp,
    /// Flags of an input.
    flags: u32,
    /// Output: whether the last tick wrote it.
    is_set: bool,
    priority: u32,
    messages: Vec<Message>,
}

/// Value of a queue, an inbox or an outbox.
struct Message {
    block: Arc<Block>,
    items: usize,
    answer: u32,
}

impl PortMemory {
    fn new(port: &PortDescription) -> Self {
        let shape = port.descriptor.shape(port.capacity);
        let stamp = Stamp { sequence: 0, time: 0, generation: 1 };
        let block = Block::new(shape.bytes(shape.capacity));
        Self { block, items: 0, stamp, flags: 0, is_set: false, priority: 0, messages: Vec::new() }
    }
}

fn dict(py: Python<'_>, descriptor: &'static Descriptor, block: &Block, items: usize) -> PyResult<Py<PyAny>> {
    Place { descriptor, data: block.data(), items, writable: false, epoch: Epoch::now() }.dict(py)
}

#[pymethods]
impl Fixture {
    /// Fresh instance of a module with those parameters, at time 0.
    #[new]
    #[pyo3(signature = (module, **parameters))]
    fn new(module: &Bound<'_, PyAny>, parameters: Option<&Bound<'_, PyDict>>) -> PyResult<Self> {
        let kind: ModuleKind = kind(module).map_err(|refusal| wrong(&refusal))?;
        let setup = Setup { name: kind.name(), seed: 0, period: 20_000_000, section: None, params: None };
        let description = kind.describe(&setup).map_err(|refusal| wrong(&refusal))?;
        let mut params = vec![0; description.params.size];
        for parameter in &description.parameters {
            set_parameter(&description, &mut params, &parameter.name, &parameter.default)?;
        }
        if let Some(parameters) = parameters {
            change(&description, &mut params, parameters)?;
        }
        // An exception of `create` is shown as it is.
        let instance = Instance::of(module, &setup, &params)?;
        let ports = description.ports.iter().map(PortMemory::new).collect();
        let random = Cell::new(Random::new(0, setup.name));
        let log = RefCell::default();
        Ok(Self {
            instance,
            description,
            ports,
            params,
            params_version: 1,
            now: 0,
            last: 0,
            number: 0,
            random,
            log,
        })
    }

    /// Sets an input: to a dict, or to the fields by their names.
    #[pyo3(signature = (port, *value, **fields))]
    fn set(
        &mut self,
        port: &str,
        value: &Bound<'_, PyTuple>,
        fields: Option<&Bound<'_, PyDict>>,
    ) -> PyResult<()> {
        let index = self.index(port)?;
        let (declared, now) = (&self.description.ports[index], self.now);
        let memory = &mut self.ports[index];
        let data = memory.block.data();
        let place =
            Place { descriptor: declared.descriptor, data, items: 0, writable: true, epoch: Epoch::now() };
        memory.items = fill(&place, declared.capacity, &named(value, fields)?)?;
        memory.stamp.sequence += 1;
        memory.stamp.time = now;
        memory.flags = Flags::NEW | Flags::ALIVE;
        Ok(())
    }

    /// Puts a message into an inbox, or a value into a queue.
    #[pyo3(signature = (port, *value, **fields))]
    fn push(
        &mut self,
        port: &str,
        value: &Bound<'_, PyTuple>,
        fields: Option<&Bound<'_, PyDict>>,
    ) -> PyResult<()> {
        let index = self.index(port)?;
        let descriptor = self.description.ports[index].descriptor;
        let value = named(value, fields)?;
        let room = tail_items(descriptor, &value);
        let block = Block::new(descriptor.shape(room).bytes(room));
        let data = block.data();
        let place = Place { descriptor, data, items: 0, writable: true, epoch: Epoch::now() };
        let items = fill(&place, room, &value)?;
        self.ports[index].messages.push(Message { block, items, answer: 0 });
        Ok(())
    }

    /// Makes an input stale, as when its writer stopped.
    fn expire(&mut self, port: &str) -> PyResult<()> {
        let index = self.index(port)?;
        self.ports[index].flags |= Flags::STALE;
        Ok(())
    }

    /// Changes parameters, by their names.
    #[pyo3(signature = (**parameters))]
    fn params(&mut self, parameters: Option<&Bound<'_, PyDict>>) -> PyResult<()> {
        self.params_version += 1;
        parameters.map_or(Ok(()), |parameters| change(&self.description, &mut self.params, parameters))
    }

    /// Advances the time, s; a fixture in Rust has it in ns.
    fn advance(&mut self, seconds: f64) {
        self.now += (seconds * 1e9) as u64;
    }

    /// Name of a required input without a value; None if the module can tick.
    fn waiting_for(&self) -> Option<&str> {
        let mut ports = self.description.ports.iter().zip(&self.ports);
        let missing = ports.find(|(port, memory)| port.required && memory.stamp.sequence == 0);
        missing.map(|(port, _)| port.name.as_str())
    }

    /// Makes one step and returns the number of its outcome.
    /// An exception of the step is raised.
    fn tick(&mut self, py: Python<'_>) -> PyResult<i32> {
        if let Some(port) = self.waiting_for() {
            return Err(PyValueError::new_err(format!("the module waits for its required input `{port}`")));
        }
        self.number += 1;
        let entries: Vec<Vec<Entry>> = self
            .description
            .ports
            .iter()
            .zip(&mut self.ports)
            .map(|(port, memory)| entries(port, memory))
            .collect();
        let slots: Vec<PortSlot> = (self.description.ports.iter().zip(&mut self.ports).zip(&entries))
            .map(|((port, memory), entries)| slot(port, memory, entries))
            .collect();
        let host = Host { context: (&raw const self.log).cast(), log };
        let frame = Frame {
            ports: slots.as_ptr(),
            port_count: slots.len(),
            params: self.params.as_ptr(),
            params_size: self.params.len(),
            params_version: self.params_version,
            now: self.now,
            elapsed: if self.number == 1 { 0 } else { self.now - self.last },
            number: self.number,
            random: &raw const self.random,
            host: &raw const host,
        };
        // SAFETY: the frame, its slots and the parameters live during the call.
        let outcome = unsafe { self.instance.raising_tick(py, &frame) };
        self.last = self.now;
        for ((port, memory), slot) in self.description.ports.iter().zip(&mut self.ports).zip(&slots) {
            memory.finish(port, slot);
        }
        outcome
    }

    /// Value that the last tick wrote; None if it wrote none.
    fn output(&self, py: Python<'_>, port: &str) -> PyResult<Option<Py<PyAny>>> {
        let index = self.index(port)?;
        let memory = &self.ports[index];
        let descriptor = self.description.ports[index].descriptor;
        memory.is_set.then(|| dict(py, descriptor, &memory.block, memory.items)).transpose()
    }

    /// Priority with which the last tick sent a command; None if it sent none.
    fn priority(&self, port: &str) -> PyResult<Option<u32>> {
        let memory = &self.ports[self.index(port)?];
        Ok(memory.is_set.then_some(memory.priority))
    }

    /// Messages that the last tick sent.
    fn sent(&self, py: Python<'_>, port: &str) -> PyResult<Vec<Py<PyAny>>> {
        let index = self.index(port)?;
        let descriptor = self.description.ports[index].descriptor;
        self.ports[index].messages.iter().map(|message| dict(py, descriptor, &message.block, 0)).collect()
    }

    /// Lines of the log so far, each with its level.
    /// The level is 0 for an error, 1 for a warning, 2 for information.
    fn log(&self) -> Vec<(u32, String)> {
        self.log.borrow().clone()
    }

    /// State as in a snapshot.
    fn save(&self, py: Python<'_>) -> PyResult<Py<PyBytes>> {
        let state = self.instance.object().bind(py).call_method0("_save")?;
        Ok(PyBytes::new(py, &plain::encode(&state)?).unbind())
    }

    /// Takes over a saved state.
    fn restore(&self, py: Python<'_>, state: &[u8]) -> PyResult<()> {
        let state = plain::decode(py, state).map_err(|refusal| wrong(&refusal))?;
        self.instance.object().bind(py).call_method1("_restore", (state,)).map(drop)
    }

    /// The instance, whose state can be read.
    #[getter]
    fn module(&self, py: Python<'_>) -> Py<PyAny> {
        self.instance.object().clone_ref(py)
    }
}

impl Fixture {
    fn index(&self, port: &str) -> PyResult<usize> {
        let ports = &self.description.ports;
        ports.iter().position(|declared| declared.name == port).ok_or_else(|| {
            let names: Vec<_> = ports.iter().map(|port| port.name.as_str()).collect();
            PyKeyError::new_err(format!("no port `{port}`; it has {}", names.join(", ")))
        })
    }
}

impl PortMemory {
    /// Takes the results of a tick over.
    fn finish(&mut self, port: &PortDescription, slot: &PortSlot) {
        self.flags &= !Flags::NEW;
        self.items = slot.items.get();
        self.priority = slot.priority.get();
        self.is_set = slot.flags.get() & Flags::SET != 0;
        if port.direction == Direction::Outbox {
            self.messages.truncate(slot.count.get());
            self.stamp.sequence += slot.count.get() as u64;
        } else {
            self.messages.clear();
        }
    }
}

/// Returns the number of tail items that a value has; 0 if it has no tail.
/// A value that does not fit is refused when it is written.
fn tail_items(descriptor: &Descriptor, value: &Bound<'_, PyAny>) -> usize {
    let tail = descriptor.fields.iter().find(|field| matches!(field.kind, Kind::Tail(_)));
    let items = tail.and_then(|tail| value.get_item(tail.name).ok()).and_then(|items| items.len().ok());
    items.unwrap_or(0)
}

fn entries(port: &PortDescription, memory: &mut PortMemory) -> Vec<Entry> {
    if port.direction == Direction::Outbox {
        let message = || Message { block: Block::new(port.descriptor.size), items: 0, answer: 0 };
        memory.messages = std::iter::repeat_with(message).take(port.window).collect();
    }
    let entry = |(i, message): (usize, &mut Message)| Entry {
        data: message.block.data(),
        items: Cell::new(message.items),
        stamp: Stamp { sequence: i as u64 + 1, time: 0, generation: 1 },
        answer: Cell::new(message.answer),
        sender: 0,
    };
    memory.messages.iter_mut().enumerate().map(entry).collect()
}

fn slot(port: &PortDescription, memory: &mut PortMemory, entries: &[Entry]) -> PortSlot {
    let is_outbox = port.direction == Direction::Outbox;
    PortSlot {
        schema: port.descriptor.hash,
        direction: port.direction as u32,
        data: memory.block.data(),
        items: Cell::new(memory.items),
        capacity: if is_outbox { entries.len() } else { port.capacity },
        stamp: memory.stamp,
        flags: Cell::new(if port.direction == Direction::Input { memory.flags } else { 0 }),
        priority: Cell::new(0),
        entries: entries.as_ptr(),
        count: Cell::new(if is_outbox { 0 } else { entries.len() }),
        missed: 0,
    }
}

fn set_parameter(description: &Description, params: &mut [u8], name: &str, value: &Untyped) -> PyResult<()> {
    let edited = edit(description.params, params, 0, name, value);
    edited.map(drop).map_err(|error| PyValueError::new_err(error.to_string()))
}

/// Changes parameters within their ranges.
fn change(description: &Description, params: &mut [u8], values: &Bound<'_, PyDict>) -> PyResult<()> {
    for (name, value) in values {
        let name: String = name.extract()?;
        let value: Untyped =
            slate_module::decode(&plain::encode(&value)?).map_err(|refusal| wrong(&refusal))?;
        let declared = description.parameters.iter().find(|parameter| parameter.name == name);
        let range = declared.and_then(|parameter| parameter.range);
        if let (Some((low, high)), Some(number)) = (range, value.as_f64())
            && !(low..=high).contains(&number)
        {
            return Err(PyValueError::new_err(format!("{name}: expected {low} to {high}, found {number}")));
        }
        set_parameter(description, params, &name, &value)?;
    }
    Ok(())
}

unsafe extern "C" fn log(context: *const (), level: u32, text: *const u8, length: usize) {
    // SAFETY: the context is the log of the fixture that ticks; the text lives during the call.
    let (log, text) = unsafe {
        (&*context.cast::<RefCell<Vec<(u32, String)>>>(), std::slice::from_raw_parts(text, length))
    };
    log.borrow_mut().push((level, String::from_utf8_lossy(text).into_owned()));
}
