//! Ports of a module in Python, bound to the slots of a frame during a tick.

use std::ptr::null_mut;
use std::sync::Arc;
use std::sync::atomic::{AtomicPtr, AtomicUsize, Ordering};

use pyo3::exceptions::{PyAttributeError, PyRuntimeError, PyTypeError, PyValueError};
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyString, PyTuple};
use slate_module::blackboard::interface::Descriptor;
use slate_module::{Delivery, Direction, Entry, Flags, PortSlot};

use super::memory::{Epoch, thread};
use super::value::{Place, Value, fill};

/// Port with its slot; the slot is null outside of a tick.
pub struct Port {
    pub name: String,
    pub descriptor: &'static Descriptor,
    pub direction: Direction,
    slot: AtomicPtr<PortSlot>,
    /// Number of the thread that ticks.
    thread: AtomicUsize,
}

impl Port {
    pub fn new(name: String, descriptor: &'static Descriptor, direction: Direction) -> Arc<Self> {
        let (slot, thread) = (AtomicPtr::new(null_mut()), AtomicUsize::new(0));
        Arc::new(Self { name, descriptor, direction, slot, thread })
    }

    /// Binds the port for a tick, or ends its use.
    pub fn bind(&self, slot: *const PortSlot) {
        self.thread.store(thread(), Ordering::Relaxed);
        self.slot.store(slot.cast_mut(), Ordering::Relaxed);
    }

    fn slot(&self) -> PyResult<&PortSlot> {
        // SAFETY: the slot lives during the tick, and is null outside of it.
        let slot = unsafe { self.slot.load(Ordering::Relaxed).as_ref() }.ok_or_else(|| {
            PyRuntimeError::new_err(format!("the port `{}` is used outside of a tick", self.name))
        })?;
        // What other threads do at which time differs between runs.
        if self.thread.load(Ordering::Relaxed) != thread() {
            let name = &self.name;
            let message =
                format!("the port `{name}` is used by another thread: only `tick` may; pass copies");
            return Err(PyRuntimeError::new_err(message));
        }
        Ok(slot)
    }

    fn place(&self, data: *mut u8, items: usize, writable: bool) -> Place {
        Place { descriptor: self.descriptor, data, items, writable, epoch: Epoch::now() }
    }

    /// Makes the object that Python sees.
    pub fn object(self: &Arc<Self>, py: Python<'_>, required: bool) -> PyResult<Py<PyAny>> {
        let port = Arc::clone(self);
        Ok(match self.direction {
            Direction::Input if required => {
                let input = PyClassInitializer::from(InputPort(port));
                Py::new(py, input.add_subclass(RequiredPort))?.into_any()
            }
            Direction::Input => Py::new(py, InputPort(port))?.into_any(),
            Direction::Queue => Py::new(py, QueuePort(port))?.into_any(),
            Direction::Output => Py::new(py, OutputPort(port))?.into_any(),
            Direction::Debug => Py::new(py, DebugPort(port))?.into_any(),
            Direction::Command => Py::new(py, CommandPort(port))?.into_any(),
            Direction::Inbox => Py::new(py, InboxPort(port))?.into_any(),
            Direction::Outbox => Py::new(py, OutboxPort(port))?.into_any(),
            Direction::Aspect | Direction::Provider => {
                let message = format!("the port `{}`: a module in Python has no services", self.name);
                return Err(PyTypeError::new_err(message));
            }
        })
    }

    /// Writes an output as a whole.
    fn put(&self, value: &Bound<'_, PyAny>) -> PyResult<&PortSlot> {
        let slot = self.slot()?;
        // What is half written is not published.
        slot.flags.set(slot.flags.get() & !Flags::SET);
        let items = fill(&self.place(slot.data, 0, true), slot.capacity, value)
            .map_err(|error| self.with_port_name(error, value.py()))?;
        slot.items.set(items);
        slot.flags.set(slot.flags.get() | Flags::SET);
        Ok(slot)
    }

    /// Begins a value that is written in place; it begins all zero.
    fn write(&self, items: usize) -> PyResult<Value> {
        let slot = self.slot()?;
        let items = if self.descriptor.tail().is_some() { items } else { 0 };
        if items > slot.capacity {
            return Err(PyValueError::new_err(format!(
                "`{}` with {items} items has room for {}: raise its `capacity`",
                self.name, slot.capacity
            )));
        }
        let bytes = self.descriptor.shape(items).bytes(items);
        // SAFETY: the working slot has room for so many items, and this tick alone uses it.
        unsafe { slot.data.write_bytes(0, bytes) };
        slot.items.set(items);
        slot.flags.set(slot.flags.get() | Flags::SET);
        Ok(Value(self.place(slot.data, items, true)))
    }

    /// Adds the name of the port to an error about a value.
    fn with_port_name(&self, error: PyErr, py: Python<'_>) -> PyErr {
        let text = format!("port `{}`: {}", self.name, error.value(py));
        let named = PyErr::from_type(error.get_type(py), (text,));
        named.set_cause(py, error.cause(py));
        named
    }

    fn entries(&self) -> PyResult<&[Entry]> {
        let slot = self.slot()?;
        if slot.entries.is_null() {
            return Ok(&[]);
        }
        // SAFETY: the host lends so many entries during the tick.
        Ok(unsafe { std::slice::from_raw_parts(slot.entries, slot.count.get()) })
    }

    fn received(&self, py: Python<'_>) -> PyResult<Vec<Py<Received>>> {
        let received = |entry: &Entry| {
            let place = self.place(entry.data, entry.items.get(), false);
            Py::new(py, Received { place, entry: AtomicPtr::new(std::ptr::from_ref(entry).cast_mut()) })
        };
        self.entries()?.iter().map(received).collect()
    }
}

/// Returns the value that a call names: one object, or fields by their names.
pub fn named<'py>(
    values: &Bound<'py, PyTuple>,
    fields: Option<&Bound<'py, PyDict>>,
) -> PyResult<Bound<'py, PyAny>> {
    match (values.len(), fields) {
        (1, None) => values.get_item(0),
        (0, Some(fields)) => Ok(fields.clone().into_any()),
        (0, None) => Ok(PyDict::new(values.py()).into_any()),
        _ => Err(PyTypeError::new_err("expected one value, or the fields of one by their names")),
    }
}

/// Time and number of a value.
#[pyclass(frozen, get_all, eq, module = "slate")]
#[derive(PartialEq)]
pub struct Stamp {
    /// Agent time of writing, ns.
    time: u64,
    /// Number of the value, from 1; 0 before the first write.
    sequence: u64,
}

#[pymethods]
impl Stamp {
    fn __repr__(&self) -> String {
        format!("Stamp(time={}, sequence={})", self.time, self.sequence)
    }
}

impl From<slate_module::Stamp> for Stamp {
    fn from(stamp: slate_module::Stamp) -> Self {
        Self { time: stamp.time, sequence: stamp.sequence }
    }
}

/// Newest value of the linked property, which may be missing.
#[pyclass(frozen, subclass, module = "slate")]
pub struct InputPort(Arc<Port>);

impl InputPort {
    fn has(&self, flag: u32) -> PyResult<bool> {
        Ok(self.0.slot()?.flags.get() & flag != 0)
    }

    fn value_if(&self, condition: bool) -> PyResult<Option<Value>> {
        let slot = self.0.slot()?;
        let is_there = condition && slot.stamp.sequence > 0;
        Ok(is_there.then(|| Value(self.0.place(slot.data, slot.items.get(), false))))
    }
}

#[pymethods]
impl InputPort {
    /// Newest value of any age; None before the first write.
    fn get(&self) -> PyResult<Option<Value>> {
        self.value_if(true)
    }

    /// Newest value unless it is stale.
    fn fresh(&self) -> PyResult<Option<Value>> {
        self.value_if(!self.is_stale()?)
    }

    /// Newest value if it was written since this module's last tick.
    fn updated(&self) -> PyResult<Option<Value>> {
        self.value_if(self.is_new()?)
    }

    /// Returns true if the value was written since this module's last tick.
    fn is_new(&self) -> PyResult<bool> {
        self.has(Flags::NEW)
    }

    /// Returns true if the value is too old, or its writer gone or late.
    fn is_stale(&self) -> PyResult<bool> {
        self.has(Flags::STALE)
    }

    /// Returns true if a link writes the property now.
    fn has_writer(&self) -> PyResult<bool> {
        self.has(Flags::ALIVE)
    }

    /// Time and number of the value.
    fn stamp(&self) -> PyResult<Stamp> {
        Ok(self.0.slot()?.stamp.into())
    }

    /// Number of values that this module never saw.
    fn missed(&self) -> PyResult<u64> {
        Ok(self.0.slot()?.missed)
    }
}

/// Input without whose first value the module does not run.
/// Its fields are attributes.
#[pyclass(frozen, extends = InputPort, module = "slate")]
pub struct RequiredPort;

#[pymethods]
impl RequiredPort {
    fn __getattr__(slf: &Bound<'_, Self>, name: &str) -> PyResult<Py<PyAny>> {
        match slf.as_super().get().value_if(true)? {
            Some(value) => value.0.get(slf.py(), name),
            None => Err(PyAttributeError::new_err(name.to_owned())),
        }
    }

    fn __getitem__(slf: &Bound<'_, Self>, name: &str) -> PyResult<Py<PyAny>> {
        Self::__getattr__(slf, name)
    }
}

/// Every value of the linked property, in order.
#[pyclass(frozen, module = "slate")]
pub struct QueuePort(Arc<Port>);

#[pymethods]
impl QueuePort {
    fn __len__(&self) -> PyResult<usize> {
        Ok(self.0.entries()?.len())
    }

    fn __iter__<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        self.0.received(py)?.into_pyobject(py)?.try_iter().map(Bound::into_any)
    }

    /// Number of values that this reader lost because it lagged.
    fn missed(&self) -> PyResult<u64> {
        Ok(self.0.slot()?.missed)
    }
}

/// Received messages, in the order of each sender.
#[pyclass(frozen, module = "slate")]
pub struct InboxPort(Arc<Port>);

#[pymethods]
impl InboxPort {
    fn __len__(&self) -> PyResult<usize> {
        Ok(self.0.entries()?.len())
    }

    fn __iter__<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        self.0.received(py)?.into_pyobject(py)?.try_iter().map(Bound::into_any)
    }
}

/// Received value or message; its fields are attributes.
#[pyclass(frozen, module = "slate")]
pub struct Received {
    place: Place,
    entry: AtomicPtr<Entry>,
}

impl Received {
    fn entry(&self) -> PyResult<&Entry> {
        self.place.check()?;
        // SAFETY: the entry lives during the tick, which lasts.
        Ok(unsafe { &*self.entry.load(Ordering::Relaxed) })
    }
}

#[pymethods]
impl Received {
    fn __getattr__(&self, py: Python<'_>, name: &str) -> PyResult<Py<PyAny>> {
        self.place.get(py, name)
    }

    fn __getitem__(&self, py: Python<'_>, name: &str) -> PyResult<Py<PyAny>> {
        self.place.get(py, name)
    }

    /// The value without its stamp.
    fn value(&self) -> Value {
        Value(self.place)
    }

    /// Copy of all fields, with lists for arrays.
    fn to_dict(&self, py: Python<'_>) -> PyResult<Py<PyAny>> {
        self.place.check()?;
        self.place.dict(py)
    }

    /// Time and number of the value.
    fn stamp(&self) -> PyResult<Stamp> {
        Ok(self.entry()?.stamp.into())
    }

    /// Number of the message's sender.
    fn sender(&self) -> PyResult<u32> {
        Ok(self.entry()?.sender)
    }

    /// Refuses the message, with a reason that the interface defines (not 0).
    fn refuse(&self, reason: u16) -> PyResult<()> {
        self.entry()?.answer.set(reason.max(1).into());
        Ok(())
    }
}

/// Property of which this module is the only writer.
#[pyclass(frozen, module = "slate")]
pub struct OutputPort(Arc<Port>);

#[pymethods]
impl OutputPort {
    /// Writes the property: a value, a dict, or the fields by their names.
    #[pyo3(signature = (*value, **fields))]
    fn set(&self, value: &Bound<'_, PyTuple>, fields: Option<&Bound<'_, PyDict>>) -> PyResult<()> {
        self.0.put(&named(value, fields)?).map(drop)
    }

    /// Begins a value with `items` tail items, whose fields are then set.
    /// It begins all zero.
    #[pyo3(signature = (items=0))]
    fn write(&self, items: usize) -> PyResult<Value> {
        self.0.write(items)
    }

    /// Number of tail items that fit.
    #[getter]
    fn capacity(&self) -> PyResult<usize> {
        Ok(self.0.slot()?.capacity)
    }
}

/// Property that is written only while somebody reads it.
#[pyclass(frozen, module = "slate")]
pub struct DebugPort(Arc<Port>);

#[pymethods]
impl DebugPort {
    /// Computes and writes the value if somebody reads it.
    fn set(&self, compute: &Bound<'_, PyAny>) -> PyResult<()> {
        if !self.0.slot()?.data.is_null() {
            self.0.put(&compute.call0()?)?;
        }
        Ok(())
    }

    /// Begins a value as that of an output; None if nobody reads it.
    #[pyo3(signature = (items=0))]
    fn write(&self, items: usize) -> PyResult<Option<Value>> {
        if self.0.slot()?.data.is_null() { Ok(None) } else { self.0.write(items).map(Some) }
    }
}

/// Commands of an actuator, which pass the gate.
#[pyclass(frozen, module = "slate")]
pub struct CommandPort(Arc<Port>);

#[pymethods]
impl CommandPort {
    /// Commands the actuator until the command's time to live ends.
    #[pyo3(signature = (*value, priority=1, **fields))]
    fn send(
        &self,
        value: &Bound<'_, PyTuple>,
        priority: u32,
        fields: Option<&Bound<'_, PyDict>>,
    ) -> PyResult<()> {
        if !(1..=3).contains(&priority) {
            return Err(PyValueError::new_err(format!("expected a Priority, found {priority}")));
        }
        self.0.put(&named(value, fields)?)?.priority.set(priority);
        Ok(())
    }
}

/// Messages to the inbox that it is linked to.
#[pyclass(frozen, module = "slate")]
pub struct OutboxPort(Arc<Port>);

#[pymethods]
impl OutboxPort {
    /// Sends a message when the tick ends; returns its number.
    /// None when no more fit in this tick.
    #[pyo3(signature = (*value, **fields))]
    fn send(&self, value: &Bound<'_, PyTuple>, fields: Option<&Bound<'_, PyDict>>) -> PyResult<Option<u64>> {
        let slot = self.0.slot()?;
        let count = slot.count.get();
        if count >= slot.capacity {
            return Ok(None);
        }
        let value = named(value, fields)?;
        // SAFETY: the host lends so many entries to this tick alone, each with room for the interface.
        let data = unsafe { (*slot.entries.add(count)).data };
        fill(&self.0.place(data, 0, true), 0, &value)
            .map_err(|error| self.0.with_port_name(error, value.py()))?;
        slot.count.set(count + 1);
        Ok(Some(slot.stamp.sequence + count as u64 + 1))
    }

    /// Delivery of a message: "waiting", "done", "lost", or the reason of a refusal.
    fn delivery(&self, py: Python<'_>, number: u64) -> PyResult<Py<PyAny>> {
        let text = |text| Ok(PyString::new(py, text).into_any().unbind());
        let slot = self.0.slot()?;
        let sent = slot.stamp.sequence;
        if number > sent && number <= sent + slot.count.get() as u64 {
            return text("waiting");
        }
        if number == 0 || slot.entries.is_null() || slot.capacity == 0 {
            return text("lost");
        }
        // SAFETY: the host lends so many entries to this tick.
        let entry = unsafe { &*slot.entries.add((number - 1) as usize % slot.capacity) };
        if entry.stamp.sequence != number {
            return text("lost");
        }
        match Delivery::from_code(entry.answer.get()) {
            Delivery::Waiting => text("waiting"),
            Delivery::Done => text("done"),
            Delivery::Lost => text("lost"),
            Delivery::Refused(reason) => Ok(reason.into_pyobject(py)?.into_any().unbind()),
        }
    }
}
